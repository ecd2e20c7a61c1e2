"""How an answer came about."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np


@dataclass
class Trail:
    """How an answer came about: seconds per step, and how many candidates each constraint removed after tracing; where
    pivots are given, how many linkages the series gave, how many were completed numerically, and the least
    deviation that was reached.

    `certain`: nothing that was not traced promises to be among the answers.
    """

    seconds: dict[str, float] = field(default_factory=dict)
    traced: int = 0
    removed: dict[str, int] = field(default_factory=dict)
    solved: int = 0
    completed: int = 0
    least: float = np.nan
    certain: bool = False

    def timed(self, step: str) -> Callable[[], None]:
        """Start a step; call what is returned when it ends."""
        start = time.perf_counter()

        def stop() -> None:
            self.seconds[step] = self.seconds.get(step, 0.0) + time.perf_counter() - start

        return stop
