"""The build on first use: one process builds, others that come meanwhile wait for it."""

from __future__ import annotations

import time
from contextlib import nullcontext
from typing import TYPE_CHECKING

from ..errors import DatabaseBusy
from ..progress import busy, shown

if TYPE_CHECKING:
    from ..api import Catalogue

#: Pause between two looks at a file that another process fills [s].
PAUSE = 0.5
#: Time without a write after which the other process is taken for dead [s]: blocks take less than
#: two.
STILL = 20.0


def build_once(catalogue: Catalogue, *, quiet: bool) -> None:
    """Build the default catalogue, or wait until another process has built it.

    A build that stands still, because its process was killed, is gone on with.
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
    """Wait until a catalogue is complete, or nobody writes to its file any more."""
    before: tuple[int, ...] = ()
    last = time.monotonic()
    while not catalogue.complete and time.monotonic() - last < STILL:
        if (now := catalogue.database.stamp()) != before:
            before, last = now, time.monotonic()
        time.sleep(PAUSE)
