"""Choose positions of a motion for tables, drawings and files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..kinematics.circuits import OPEN, Circuits
from ..kinematics.linkage import PR, RP, RR
from ..kinematics.sampling import POLYLINE, Samples, lowest, resolved
from ..kinematics.splines import SPLINE, place_points
from ..kinematics.types import Complexes, Floats, Integers
from ..problem.path import places
from .guide_motion import GuideMotion
from .kinds import is_dwell

if TYPE_CHECKING:
    from .placed import PlacedGuide


class RunOptions(NamedTuple):
    """Accuracy of paths, and their extent."""

    least: float = 1e-3  #: lower bound of the extent to which errors are relative [size of the linkage]
    near: float = 3.0  #: distance up to which a path to infinity is drawn [size of the linkage]
    part: float = 1e-3  #: error of a spline over the deviation: below the printed digits
    rounded: float = 1e-12  #: smallest error of a spline, by rounding [size of the linkage]


RUN = RunOptions()


@dataclass(frozen=True, eq=False)
class Run:
    """The motion of a guide between two phases.

    Attributes
    ----------
    guide : PlacedGuide
    circuit : Circuits
        Circuit of the given position.
    low, high : float
        Phases of start and end, in either order [rad].
    closed : bool
        Whether start and end coincide.
    points : mapping of str to (x, y)
        Further coupler points by name, in the given position [length].
    """

    guide: PlacedGuide
    circuit: Circuits
    low: float
    high: float
    closed: bool = False
    points: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def whole(cls, guide: PlacedGuide, circuit: Circuits, points: Mapping[str, Any] | None) -> Run:
        """Return the run round a circuit from the given position back to it.

        An open circuit is covered from end to end.
        """
        period, start = float(circuit.period[0]), float(circuit.phase[0])
        told = places("points", points)
        if circuit.kind[0] == OPEN:
            return cls(guide, circuit, min(0.0, start), max(period, start), False, told)
        return cls(guide, circuit, start, start + period, True, told)

    @cached_property
    def samples(self) -> Samples:
        """Positions of the guided, further and sliding points, then directions of the links."""
        extents = 1 + len(self.points) + int((self._kinds != RR).sum()) + self._has_output
        count = self._values(np.array([self.low])).shape[1]
        scale = np.where(np.arange(count) < extents, np.nan, 1.0)
        return resolved(self._values, self.low, self.high, scale, RUN.least * float(self.circuit.linkage.size[0]))

    def rows(self, count: int) -> Floats:
        """Return the phases of `count` rows; see `Samples.rows`."""
        return self.samples.rows(np.linspace(0, 1, count))

    def polyline(self, error: float = POLYLINE.error) -> Floats:
        """Return the phases of polylines along guided and further points.

        See `Samples.polyline`.
        """
        return self.samples.polyline(list(range(1 + len(self.points))), error)

    def spline(self) -> tuple[Floats, Floats]:
        """Place the points of a spline along the guided point; see `splines.place_points`.

        For an answer its error is at most `RUN.part` of the deviation.
        """
        scale, size = float(self.samples.scale[0]), float(self.circuit.linkage.size[0])
        deviation = getattr(self.guide, "deviation", np.inf)
        return place_points(self.samples, 0, min(SPLINE.error, max(RUN.part * deviation, RUN.rounded * size) / scale))

    def path(self, phases: Floats) -> Complexes:
        """Compute positions of the guided point at phases (m,)."""
        return self.places(complex(*self.guide.guided), phases)

    def places(self, point: complex, phases: Floats) -> Complexes:
        """Carry a coupler point from the given position to phases (m,)."""
        return self.circuit.pose(phases[:, None]).point(np.array([point]))[:, 0]

    def motion(self, phases: Floats, driver: int | None = None) -> GuideMotion:
        """Compute the motion at phases (m,)."""
        return GuideMotion.of(self.guide, self.circuit, phases[:, None], self.points, driver)

    def sliding(self, i: int) -> Complexes:
        """Return the pin of slider i, or slide i's fixed pivot in the coupler, (m,)."""
        return self.samples.values[:, self._column(i)]

    def travel(self, i: int, along: complex) -> tuple[float, float]:
        """Compute the range of the coordinate of `sliding` in a direction [length]."""

        def ahead(s: Floats) -> Floats:
            return np.asarray((self._values(s)[:, self._column(i)] * along.conjugate()).real)

        at = self.samples.at
        here = ahead(at)
        return lowest(ahead, at, here), -lowest(lambda s: -ahead(s), at, -here)

    def until(self, tangent: complex, length: float) -> float:
        """Return a phase just after the point has moved a length along a tangent."""
        ahead = ((self.samples.values[:, 0] - self.samples.values[0, 0]) * np.conj(tangent)).real
        ahead = ahead * np.sign(ahead[1])
        beyond = (ahead > length) | (np.diff(ahead, append=-np.inf) <= 0)
        return float(self.samples.at[min(int(beyond.argmax()) + 1, len(ahead) - 1)])

    def near(self) -> Run:
        """Return the part of an open run within `RUN.near` sizes of the given position."""
        if self.circuit.kind[0] != OPEN:
            return self
        home, z = complex(*self.guide.guided), self.samples.values[:, 0]
        away = np.abs(z - home)
        middle = int(np.nanargmin(away))
        far = np.flatnonzero(~(away <= max(RUN.near * float(self.circuit.linkage.size[0]), float(away[middle]))))
        first, last = int(far[far < middle].max(initial=-1)) + 1, int(far[far > middle].min(initial=len(z))) - 1
        return replace(self, low=float(self.samples.at[first]), high=float(self.samples.at[last]))

    def _column(self, i: int) -> int:
        """Return the column of the sliding point of dyad i."""
        return 1 + len(self.points) + int((self._kinds[:i] != RR).sum())

    @cached_property
    def _kinds(self) -> Integers:
        return np.asarray(self.circuit.linkage.dyads[0])

    @property
    def _has_output(self) -> bool:
        return is_dwell(self.guide)

    def _values(self, s: Floats) -> Complexes:
        """Compute positions and directions at phases (m,), shape (m, k)."""
        pose, kinds, z = self.circuit.pose(s[:, None]), self._kinds, self.circuit.linkage.points[0]
        start, turn = complex(*self.guide.guided), 1 + pose.x[:, 0]
        guided = pose.point(np.array([start]))[:, 0]
        there = [guided, *(pose.point(np.array([complex(*at)]))[:, 0] for at in self.points.values())]
        links = [turn]
        for i in (0, 1):
            if kinds[i] == RP:  # the fixed pivot in the coupler's frame
                there.append(start + turn.conj() * (z[i, 0] - guided))
                continue
            pin = pose.point(z[None, i, 1])[:, 0]
            if kinds[i] == PR:
                there.append(pin)
            else:
                links.append((pin - z[i, 0]) / abs(z[i, 1] - z[i, 0]))
        if is_dwell(self.guide):
            joint, pivot = self.guide.joints(guided), complex(*self.guide.pivot)
            there.append(joint)
            links += [(joint - pivot) / np.abs(joint - pivot), (guided - joint) / np.abs(guided - joint)]
        return np.stack([*there, *links], axis=1)
