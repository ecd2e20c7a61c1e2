"""The build on first use: one process builds, others wait for it."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any, NamedTuple, Protocol

from ..errors import DatabaseBusy
from ..progress import Progress, busy, shown
from ..store import Database


class Buildable(Protocol):
    """Protocol of an open catalogue, as the build on first use needs it."""

    @property
    def complete(self) -> bool: ...
    @property
    def database(self) -> Database: ...
    def build(self, *, report: Callable[[Progress], None]) -> Any: ...


class FirstUse(NamedTuple):
    """Limits of waiting for another process that fills the file [s]."""

    pause: float = 0.5  #: pause between two checks of the file
    #: Time without a write after which the other process is presumed dead: a block takes less than
    #: two.
    still: float = 20.0


FIRST_USE = FirstUse()


def build_once(catalogue: Buildable, *, quiet: bool) -> None:
    """Build the default catalogue, or wait until another process has built it.

    A build that makes no progress, because its process was killed, is continued.
    """
    while not catalogue.complete:
        try:
            with shown(quiet=quiet, label="building the catalogue") as report:
                catalogue.build(report=report)
            return
        except DatabaseBusy:
            with nullcontext() if quiet else busy("another process builds the catalogue: waiting for it"):
                _wait(catalogue)


def _wait(catalogue: Buildable) -> None:
    """Wait until a catalogue is complete, or no process writes to its file any more."""
    before: tuple[int, ...] = ()
    last = time.monotonic()
    while not catalogue.complete and time.monotonic() - last < FIRST_USE.still:
        if (now := catalogue.database.stamp()) != before:
            before, last = now, time.monotonic()
        time.sleep(FIRST_USE.pause)
