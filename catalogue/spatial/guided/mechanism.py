"""A batch of mechanisms: rigid bodies with points on fixed surfaces and curves, with checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import InvalidLinkage, InvalidRequest
from ...given import array, choice, pair, several, text, whole
from ...kinematics.types import Array
from ..geometry.guides import Guides, same

#: Class and degrees of freedom by (curves, surfaces): Mangeron, Oğuztöreli and Plitea 1970, sec. 2
#: to 4.
CLASSES = {
    (0, 5): ("I", 1),
    (1, 3): ("II", 1),
    (2, 1): ("III", 1),
    (0, 4): ("IV", 2),
    (1, 2): ("V", 2),
    (0, 3): ("VI", 3),
}
#: Unknowns of the position: the pose of the body; Euler angles (Nota I); curvilinear distances
#: (sec. 2 to 4).
FORMULATIONS = ("pose", "euler-angles", "distances")
#: Ratio of second extent to diameter below which a body is a line: its spin is undetermined.
COLLINEAR = 1e-12
#: Distance below which points of the body coincide [diameters].
COINCIDENT = 1e-12


@dataclass(frozen=True, eq=False)
class Mechanisms:
    """A batch of n mechanisms of one class with equal choice of drivers.

    Parameters
    ----------
    body : array-like, shape (n, p, 3) or (p, 3)
        Guided points A_1 ... A_p in the body.
    guides : sequence of p Guides
        Kinds may be mixed within a point's guides if all are curves or all are surfaces.
    drivers : sequence of (int, str)
        Prescribed coordinates, one for each degree of freedom: number of the point, from 0, and
        ``"u"`` or ``"w"``.
    formulation : "pose", "euler-angles" or "distances"
        Unknowns that must be regular: positions are refused and motions end where they are
        singular. All computations use the pose.  ``"pose"`` is singular only where the mechanism
        is.  ``"euler-angles"``, precession, nutation and spin of axes through A1, A2 and A3 (first
        note), are singular where A1A2 is along z. ``"distances"`` has curvilinear coordinates as
        unknowns and distances of the points as equations; it is singular for flat bodies of four or
        five points, for coincident points and in singular points of a chart.

    Attributes
    ----------
    name : str
        Class, I to VI.
    unit : ndarray, shape (n,)
        Power of two nearest to the diameter of the body: the unit of length in all computations.

    Raises
    ------
    InvalidLinkage
        If no class has these guides, or a body is a line or not finite.
    InvalidRequest
        If the drivers do not match the class, or the formulation is unknown.
    """

    body: Any
    guides: Sequence[Guides]
    drivers: Sequence[tuple[int, str]]
    formulation: str = "pose"
    curves: tuple[bool, ...] = field(init=False)

    def __post_init__(self) -> None:
        choice("formulation", self.formulation, FORMULATIONS)
        object.__setattr__(self, "guides", several("guides", self.guides, Guides))
        p = len(self.guides)
        body = array("body", self.body, (p, 3), (None, p, 3), wrong=InvalidLinkage)
        n = max([body.shape[0] if body.ndim == 3 else 1, *map(len, self.guides)])
        sets = {len(body)} if body.ndim == 3 else set()
        if (sets | set(map(len, self.guides))) - {1, n}:
            raise InvalidLinkage("body and guides are of different numbers of mechanisms")
        object.__setattr__(self, "body", np.broadcast_to(body, (n, *body.shape[-2:])))
        object.__setattr__(self, "guides", tuple(g if len(g) == n else g[np.zeros(n, int)] for g in self.guides))
        object.__setattr__(
            self, "drivers", tuple(_parse_driver(one) for one in several("drivers", self.drivers, object))
        )
        conditions = [{kind.conditions for kind in g.kinds} for g in self.guides]
        if any(len(c) > 1 for c in conditions):
            raise InvalidLinkage(
                "one point is on a curve in some mechanisms and on a surface in others; split the batch"
            )
        object.__setattr__(self, "curves", tuple(c == {2} for c in conditions))
        if self._counts not in CLASSES:
            raise InvalidLinkage(
                f"{self._counts[0]} curves and {self._counts[1]} surfaces make none of the six classes"
            )
        wrong = ~np.isfinite(self.body).all((1, 2))
        if wrong.any():
            raise InvalidLinkage(f"body {wrong.argmax()} has a coordinate that is not finite")
        extents = np.linalg.svd(self.body - self.body.mean(1, keepdims=True), compute_uv=False)
        line = ~(extents[:, 1] > COLLINEAR * extents[:, 0])
        if line.any():
            raise InvalidLinkage(f"the points of body {line.argmax()} are on one line: its spin is undetermined")
        self._check_drivers()

    def _check_drivers(self) -> None:
        if len(self.drivers) != self.freedom or len(set(self.drivers)) != self.freedom:
            raise InvalidRequest(f"class {self.name} wants {self.freedom} different drivers, not {self.drivers}")
        for i, k in self.drivers:
            if not 0 <= i < len(self.guides) or k not in ("u", "w") or (k == "w" and self.curves[i]):
                raise InvalidRequest(f"there is no coordinate {k} of point {i} to drive")

    @property
    def _counts(self) -> tuple[int, int]:
        return sum(self.curves), len(self.curves) - sum(self.curves)

    @property
    def name(self) -> str:
        return CLASSES[self._counts][0]

    @property
    def freedom(self) -> int:
        """Degrees of freedom."""
        return CLASSES[self._counts][1]

    @cached_property
    def diameter(self) -> Array:
        """Largest distance between two points of the body, shape (n,)."""
        return np.asarray(np.linalg.norm(self.body[:, :, None] - self.body[:, None], axis=-1).max((1, 2)))

    @cached_property
    def unit(self) -> Array:
        return np.asarray(2.0 ** np.round(np.log2(self.diameter)))

    @cached_property
    def series(self) -> Array:
        """Degeneration series: degrees of freedom, and number of surfaces of each distinct point.

        Every class is a special case of five, four or three surfaces with coincident points: a
        curve guides a point on two surfaces, a fixed point is on three.  ``1.11111`` is class I,
        ``1.2111`` II (A5 = A1), ``1.221`` III (A4 = A1, A5 = A2), ``1.311`` a body about a fixed
        point, ``2.1111`` IV, ``2.211`` V (A4 = A1), ``3.111`` VI; a mechanism of class I with A5 =
        A1 in the body is in the series of class II.  Shape (n,) of str.
        """
        p = len(self.curves)
        apart = np.linalg.norm(self.body[:, :, None] - self.body[:, None], axis=-1)
        same = apart <= COINCIDENT * self.diameter[:, None, None]
        first = same.argmax(2)  # the first point that each one coincides with
        weight = np.array([2 if c else 1 for c in self.curves])
        times = np.stack([(weight * (first == i)).sum(1) for i in range(p)], axis=1)
        times = -np.sort(-times, axis=1)
        return np.array([f"{self.freedom}." + "".join(str(t) for t in row if t) for row in times])

    def __len__(self) -> int:
        return len(self.body)

    def __getitem__(self, index: Any) -> Mechanisms:
        every = np.arange(len(self))
        index = np.atleast_1d(every[index])
        if np.array_equal(index, every):
            return self
        selected: Mechanisms = same(self, {"body": self.body[index], "guides": tuple(g[index] for g in self.guides)})
        selected.__dict__["diameter"] = self.diameter[index]  # avoids a second computation
        return selected


def _parse_driver(given: Any) -> tuple[int, str]:
    point, coordinate = pair("a driver", given, 'a point and a coordinate, such as (0, "u")')
    return whole("the point of a driver", point, 0), text("the coordinate of a driver", coordinate)
