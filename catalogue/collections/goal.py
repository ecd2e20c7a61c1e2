"""What a search of a collection aims for: bounds on metrics, what is ranked, regions."""

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
    """A metric between two numbers; `scale` is its stored unit in that of the user."""

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
    """What refined mechanisms should be.

    Attributes
    ----------
    rank_by : str
        ``deviation``, or a metric.
    bounds : sequence of Bound
    outside : callable, optional
        Tells how far the places of n mechanisms, in strokes, leave their regions, (n,); negative
        inside. The path runs from 0 to 1; of mechanisms that keep their scale and place, places are
        in the frame of their family.
    """

    rank_by: str = "deviation"
    bounds: Sequence[Bound] = ()
    outside: Callable[[Places], Floats] | None = None
