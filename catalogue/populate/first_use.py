"""The build on first use: one process builds, others wait for it."""

from __future__ import annotations

import time
from contextlib import nullcontext
from typing import TYPE_CHECKING, NamedTuple

from ..errors import DatabaseBusy
from ..progress import busy, shown

if TYPE_CHECKING:
    from ..api import Catalogue


class FirstUse(NamedTuple):
    """Limits of waiting for another process that fills the file [s]."""

    pause: float = 0.5  #: pause between two checks of the file
    #: Time without a write after which the other process counts as dead: blocks take less than two.
    still: float = 20.0


FIRST_USE = FirstUse()


def build_once(catalogue: Catalogue, *, quiet: bool) -> None:
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


def _wait(catalogue: Catalogue) -> None:
    """Wait until a catalogue is complete, or no process writes to its file any more."""
    before: tuple[int, ...] = ()
    last = time.monotonic()
    while not catalogue.complete and time.monotonic() - last < FIRST_USE.still:
        if (now := catalogue.database.stamp()) != before:
            before, last = now, time.monotonic()
        time.sleep(FIRST_USE.pause)
