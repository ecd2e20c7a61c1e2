"""What answers can be ranked by, and what makes them desirable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InvalidRequest
from ..kinematics.types import Array
from .request import digits, positive

#: What candidates can be ranked by; of each less is better as a cost.  The score is that of the desirabilities, the
#: balance the size over the stroke less the transmission angle over 90 degrees.
CRITERIA = (
    "score", "balance", "size", "deviation", "transmission", "allowance", "max_link", "min_link", "max_ground",
    "max_arm",
)  # fmt: skip
#: How far from each other answers are as designs unless asked otherwise: refinement leads neighbours to one.
DISTINCT = 0.02
#: Desirabilities below this are continued in a straight line, so that what is worthless can still be made better.
WORTHLESS = 0.02


@dataclass(frozen=True)
class Desire:
    """How desirable a value is: 1 from `best` on, 0 from `worst` on, in proportion between them.

    Derringer and Suich (1980), one-sided desirability with exponent 1.
    """

    best: float
    worst: float
    weight: float = 1.0

    @classmethod
    def of(cls, name: str, given: Any, unit: float) -> Desire:
        """Return the desire given as (best, worst) or (best, worst, weight), in the user's unit.

        Raises
        ------
        InvalidRequest
            If there is no such desire, or it is none.
        """
        if name not in DESIRES:
            raise InvalidRequest(f"no desirability is made of {name!r}; there are {', '.join(DESIRES)}")
        try:
            best, worst, *more = (float(value) for value in given)
            (weight,) = more or (1.0,)
        except (TypeError, ValueError):
            raise InvalidRequest(f"the desire for {name} must be BEST, WORST or BEST, WORST, WEIGHT") from None
        downward = DESIRES[name].best < DESIRES[name].worst
        if not np.isfinite([best, worst]).all() or best == worst or (best < worst) != downward:
            side = "below" if downward else "above"
            raise InvalidRequest(f"the best {name} must lie {side} the worst, not {best:g} and {worst:g}")
        right = 90.0 if name == "transmission" else unit
        return cls(digits(best / right), digits(worst / right), positive(f"the weight of {name}", weight))

    def of_value(self, value: Array) -> Array:
        """Return the desirability, 0 to 1."""
        return np.clip((value - self.worst) / (self.best - self.worst), 0.0, 1.0)

    def cost(self, value: Array) -> Array:
        """Return minus its logarithm, continued in a straight line where it is `WORTHLESS`."""
        share = np.minimum((value - self.worst) / (self.best - self.worst), 1.0)
        short = np.maximum(WORTHLESS - share, 0.0) / WORTHLESS
        return np.asarray(short - np.log(np.maximum(share, WORTHLESS)))


#: Size and shortest link in strokes, transmission in right angles, allowance in parts of the deviation asked.  A
#: guide is as large as its stroke at least; textbooks ask for 40 to 50 degrees and accept 30; a path that uses none of
#: its tolerance allows about 0.4 of it at the sensitivities of sound guides.
DESIRES: Mapping[str, Desire] = {
    "size": Desire(1.0, 6.0),
    "transmission": Desire(60 / 90, 15 / 90),
    "allowance": Desire(0.25, 0.0),
    "min_link": Desire(0.25, 0.05),
}


def weights(rank_by: str | Mapping[str, float] | Sequence[str]) -> dict[str, float]:
    """Return criteria with weights from ``"size"``, ``"size=1,transmission=0.5"`` or a mapping.

    Raises
    ------
    InvalidRequest
        If a criterion is unknown or a weight is not positive.
    """
    if isinstance(rank_by, str):
        parts = [part.partition("=") for part in rank_by.split(",")]
        given: Mapping[str, Any] = {name.strip(): value if equal else 1.0 for name, equal, value in parts}
    elif isinstance(rank_by, Mapping):
        given = rank_by
    else:
        raise InvalidRequest(f"cannot rank by {rank_by!r}; choose from {', '.join(CRITERIA)}")
    unknown = [name for name in given if name not in CRITERIA]
    if unknown or not given:
        raise InvalidRequest(
            f"cannot rank by {unknown[0] if unknown else 'nothing'}; choose from {', '.join(CRITERIA)}"
        )
    return {name: positive(f"the weight of {name}", weight) for name, weight in given.items()}
