"""Ranking of answers: criteria, their costs, and desirabilities joined to one score.

The cost is a smooth function of the criteria; the refinement minimises it and the selection sorts
by it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..errors import InvalidRequest, quoted
from ..given import doubles, names, number, positive, whole
from ..kinematics.types import Floats, Indices
from ..quantities import DESIRED, RANKED
from ..units import decimal
from .criteria import ANSWERS, CRITERIA
from .path import PathRequest, digits

#: Desirability below which its negative logarithm is continued linearly: even a desirability of
#: zero then has a finite cost and a gradient.
WORTHLESS = 0.02


@dataclass(frozen=True)
class Desire:
    """Desirability of a value: 1 beyond `best`, 0 beyond `worst`, linear in between.

    Derringer and Suich (1980), one-sided desirability with exponent 1.
    """

    best: float
    worst: float
    weight: float = 1.0

    @classmethod
    def of(cls, name: str, given: object, unit: float) -> Desire:
        """Parse a desirability (best, worst) or (best, worst, weight) in the user's unit."""
        if name not in DESIRES:
            raise InvalidRequest(f"no desirability is made of {quoted(name)}; there are {', '.join(DESIRES)}")
        try:
            values = doubles(given)
        except ValueError:
            values = np.empty(0)
        if values.shape not in ((2,), (3,)):
            raise InvalidRequest(f"the desire for {name} must be BEST, WORST or BEST, WORST, WEIGHT")
        best, worst, weight = (*values.tolist(), 1.0)[:3]
        downward = name not in RISING
        if not np.isfinite([best, worst]).all() or best == worst or (best < worst) != downward:
            side = "below" if downward else "above"
            raise InvalidRequest(f"the best {name} must lie {side} the worst, not {best:g} and {worst:g}")
        return cls(digits(best / unit), digits(worst / unit), positive(f"the weight of {name}", weight))

    def of_value(self, value: Floats) -> Floats:
        """Return the desirability, 0 to 1."""
        return np.clip((value - self.worst) / (self.best - self.worst), 0.0, 1.0)

    def cost(self, value: Floats) -> Floats:
        """Compute the negative logarithm of the desirability, linear below `WORTHLESS`."""
        share = np.minimum((value - self.worst) / (self.best - self.worst), 1.0)
        short = np.maximum(WORTHLESS - share, 0.0) / WORTHLESS
        return np.asarray(short - np.log(np.maximum(share, WORTHLESS)))


#: Default desirabilities: lengths in strokes, transmission in right angles, allowance over
#: tolerance.
DESIRES: Mapping[str, Desire] = {row.criterion: Desire(*row.desire) for row in DESIRED if row.desire is not None}
#: Measures to maximise.
RISING = frozenset(row.criterion for row in RANKED if not row.is_upper)
#: Measures with an upper limit of 1.
TO_ONE = frozenset(row.criterion for row in RANKED if row.limit is not None and not row.is_upper)
#: Costs below which hardly any guide falls: that of a score of 95, else a hundredth above the least
#: possible cost of a measure; a size, for example, is never below the stroke.
GOOD = {"score": 0.05, "balance": 0.05} | {
    row.criterion: (row.limit if row.is_upper else 0.0) + 0.01 for row in RANKED if row.limit is not None
}


def weights(rank_by: str | Mapping[str, float] | Sequence[str]) -> dict[str, float]:
    """Parse criteria with weights: ``"size"``, ``"size=1,transmission=0.5"`` or a mapping.

    Weights are normalised to the sum 1 and criteria sorted, so neither scale nor order affects a
    search.
    """
    if isinstance(rank_by, str):
        parts = [part.partition("=") for part in rank_by.split(",")]
        given: Mapping[str, Any] = {name.strip(): _number(value) if equal else 1.0 for name, equal, value in parts}
    elif isinstance(rank_by, Mapping):
        given = rank_by
    else:
        raise InvalidRequest(f"cannot rank by {quoted(rank_by)}; choose from {', '.join(CRITERIA)}")
    unknown = [str(name) for name in given if name not in CRITERIA]
    if unknown or not given:
        wrong = unknown[0] if unknown else "nothing"
        raise InvalidRequest(f"cannot rank by {wrong}; choose from {', '.join(CRITERIA)}")
    read = {name: positive(f"the weight of {name}", given[name]) for name in CRITERIA if name in given}
    total = sum(read.values())
    return {name: digits(weight / total) for name, weight in read.items()}


def _number(text: str) -> float | str:
    """Convert a text to a number; return any other text unchanged, to be rejected later."""
    found = decimal(text)
    return text if found is None else found


Values = Mapping[str, Floats]


@dataclass(frozen=True)
class Ranking:
    """An order of preference: a weighted sum of criteria, or Pareto fronts.

    Attributes
    ----------
    weights : mapping of str to float
        Weight of each criterion, with the sum 1.  Criteria of `front` have weights too, for a
        single cost.
    front : tuple of str
        Criteria of the Pareto fronts; empty for a weighted sum.
    per_series : int
        Maximum number of answers of one series while others have answers; 0: no limit.
    distinct : float
        Minimum distance between two answers; see `catalogue.candidates.select`.
    desires : mapping of str to Desire
        Desirabilities in the score: lengths in strokes, allowance over tolerance.
    """

    weights: Mapping[str, float] = field(default_factory=lambda: {"score": 1.0})
    front: tuple[str, ...] = ()
    per_series: int = 0
    distinct: float = 0.0
    desires: Mapping[str, Desire] = field(default_factory=lambda: DESIRES)

    @classmethod
    def of(
        cls,
        request: PathRequest,
        rank_by: Any = "score",
        per_series: int | None = None,
        distinct: Any = 0.0,
        limit: int = ANSWERS,
        desires: Mapping[str, Any] | None = None,
    ) -> Ranking:
        """Build a ranking from the arguments of `Catalogue.find`; refuse unknown criteria."""
        front: tuple[str, ...] = ()
        if isinstance(rank_by, Sequence) and not isinstance(rank_by, str):
            front = tuple(dict.fromkeys(names("rank_by", rank_by)))
            if len(front) < 2:
                raise InvalidRequest("a front needs two criteria or more: rank by one with its name")
            rank_by = dict.fromkeys(front, 1.0)
        share = (0 if front else -(-limit // 4)) if per_series is None else whole("per_series", per_series, 0)
        least = number("distinct", distinct, "a number from 0 to below 1")
        if not 0 <= least < 1:
            raise InvalidRequest(f"distinct must be a number from 0 to below 1, not {quoted(distinct)}")
        if desires is not None and not isinstance(desires, Mapping):
            raise InvalidRequest(f"desires must be a mapping of names to BEST, WORST, not {quoted(desires)}")
        units = {"allowance": request.deviation, "transmission": 90.0}  # all others are lengths
        wishes = {
            name: Desire.of(name, given, units.get(name, request.extent)) for name, given in (desires or {}).items()
        }
        return cls(weights(rank_by), front, share, least, {**DESIRES, **wishes})

    def without(self, desire: str) -> Ranking:
        """Remove a desirability from the score."""
        return replace(self, desires={name: wish for name, wish in self.desires.items() if name != desire})

    @property
    def only(self) -> str | None:
        """The only criterion, or None if there are several."""
        return next(iter(self.weights)) if len(self.weights) == 1 else None

    @property
    def good(self) -> float:
        """Cost below which hardly any guide falls; -infinity if unknown."""
        return sum(weight * GOOD.get(name, -np.inf) for name, weight in self.weights.items())

    @property
    def quantities(self) -> frozenset[str]:
        """Measures that the cost depends on."""
        parts = {"balance": ("size", "transmission"), "score": tuple(self.desires)}
        return frozenset(q for name in self.weights for q in parts.get(name, (name,)))

    def cost(self, values: Values) -> Floats:
        """Compute the cost to minimise, shape (n,).

        Parameters
        ----------
        values : mapping of str to ndarray, shape (n,)
            The `quantities`: size, links, ground, arm and travel in strokes; transmission in right
            angles; uniformity; deviation and allowance over tolerance.
        """
        # any monotonic function gives the same order; the logarithm is independent of scale
        if self.only == "deviation":
            with np.errstate(divide="ignore"):
                return np.asarray(np.log(values["deviation"]))
        return np.asarray(sum(w * self.criterion(name, values) for name, w in self.weights.items()))

    def criterion(self, name: str, values: Values) -> Floats:
        """Compute the cost of one criterion, shape (n,)."""
        if name == "balance":
            return np.asarray(values["size"] - values["transmission"])
        if name == "score":
            return self._weighted_mean({q: d.cost(values[q]) for q, d in self.desires.items()})
        if name in RISING:
            return np.asarray((name in TO_ONE) - values[name])
        return np.asarray(np.nan_to_num(values[name]))

    def score(self, values: Values) -> Floats:
        """Compute the joint desirability, 0 to 100, shape (n,): a weighted geometric mean.

        Derringer and Suich, J. Quality Technology 12 (1980) 214-219.
        """
        with np.errstate(divide="ignore"):
            return 100 * np.exp(
                self._weighted_mean({q: np.log(d.of_value(values[q])) for q, d in self.desires.items()})
            )

    def faults(self, values: Values) -> Indices:
        """Count the desirabilities of zero, shape (n,): any one makes the score 0."""
        return np.asarray(sum((d.of_value(values[q]) <= 0).astype(int) for q, d in self.desires.items()))

    def _weighted_mean(self, parts: Values) -> Floats:
        """Return the weighted mean over the desirabilities, shape (n,)."""
        total = sum(d.weight for d in self.desires.values())
        return np.asarray(sum(digits(d.weight / total) * parts[q] for q, d in self.desires.items()))
