"""Goal of a search in a collection: bounds on metrics, ranked metric, regions."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..kinematics.types import Floats

if TYPE_CHECKING:
    from .spec import Places


@dataclass(frozen=True)
class Bound:
    """Bounds of a metric; `scale` converts stored values to the user's unit."""

    name: str
    low: float
    high: float
    scale: float

    def holds(self, value: float) -> bool:
        """Return whether a value in the user's unit is within."""
        return self.low <= value <= self.high

    def __str__(self) -> str:
        parts = [f"{self.name} >= {self.low:g}"] * (self.low > -math.inf)
        return " and ".join(parts + [f"{self.name} <= {self.high:g}"] * (self.high < math.inf))


@dataclass(frozen=True)
class Goal:
    """Requirements on refined mechanisms.

    Attributes
    ----------
    rank_by : str
        ``deviation``, or a metric.
    bounds : sequence of Bound
    outside : callable, optional
        Function from the places of n mechanisms [strokes] to their distances outside the regions,
        (n,), negative inside. The path runs from 0 to 1; mechanisms that keep their scale and place
        have places in the frame of their family.
    """

    rank_by: str = "deviation"
    bounds: Sequence[Bound] = ()
    outside: Callable[[Places], Floats] | None = None
