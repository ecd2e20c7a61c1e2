"""How a search went."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from ..candidates.batch import CandidateBatch


@dataclass
class SearchReport:
    """Statistics of a search.

    Attributes
    ----------
    seconds : dict of str to float
        Wall time of each step, which do not overlap.
    eligible : int
        Stored reaches that are of a family, series, configuration and order asked for.
    measured : int
        Starts that were laid along the path and measured.
    refined : int
        Trial points that the refinement measured.
    solved, completed : int
        Where pivots are prescribed: linkages that the series have in closed form, and others completed along the path.
    nearest : CandidateBatch or None
        All that was found, whether it meets the constraints or not.
    """

    seconds: dict[str, float] = field(default_factory=dict)
    eligible: int = 0
    measured: int = 0
    refined: int = 0
    solved: int = 0
    completed: int = 0
    nearest: CandidateBatch | None = None

    @contextmanager
    def timed(self, step: str) -> Iterator[None]:
        """Add the wall time of a block to a step."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[step] = self.seconds.get(step, 0.0) + time.perf_counter() - start
