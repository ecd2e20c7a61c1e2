"""What is told of a search: how many starts and points it took, how long, and all that was
found."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from ..candidates.batch import CandidateBatch


@dataclass
class SearchReport:
    """Statistics of a search."""

    seconds: dict[str, float] = field(default_factory=dict)  #: wall time of each step, which do not overlap
    eligible: int = 0  #: stored reaches that are of a family, series, configuration and order asked for
    measured: int = 0  #: starts that were laid along the path and measured
    raced: int = 0  #: rounds of single starts in races
    refined: int = 0  #: programmes that the refinement solved, each for a trial point that it measured
    solved: int = 0  #: where pivots are prescribed: linkages that the series have in closed form
    completed: int = 0  #: there: others, completed along the path
    #: all that was found, whether it meets the constraints or not
    nearest: CandidateBatch | None = field(default=None, repr=False)

    @contextmanager
    def timed(self, step: str) -> Iterator[None]:
        """Add the wall time of a block to a step."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[step] = self.seconds.get(step, 0.0) + time.perf_counter() - start
