"""The path of a coupler point about its reference position, and its inverse.

A coupler curve holds, per guide, the motion in the chart that carries the point farthest, and a
table of the point's displacement u along its tangent.  A window of u then gives the window of the
parameter that covers it.

The path of a point at the pole has a cusp: it runs in along a tangent, rests, and runs out along it
again.  There u is counted negative before the reference position.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..curvature_theory.taylor import path_series
from ..kinematics.batch import Columns
from ..kinematics.linkage import Linkage
from ..kinematics.motion import CHARTS, Motion, Path, motion
from ..kinematics.types import Complexes, Floats, Integers, Mask


class CurveOptions(NamedTuple):
    """Options of the table of a coupler curve, and of the solution of its windows."""

    steps: int = 16  #: half the number of intervals of the table
    farthest: float = 8.0  #: largest parameter of a window: a rotation of 166 degrees either way
    tolerance: float = 1e-13  #: relative accuracy of windows [extents]
    few: int = 12  #: number of iterations that find nearly all ends of windows
    many: int = 40  #: number of iterations after which other ends are given up
    #: Factor that prefers charts which cover the required extent, in their score: it exceeds any
    #: ratio of the other factor, the root of the conditioning.
    first: float = 1e3
    #: Number of successive parabolas that locate the turning point of a path: 98 of 100 paths then
    #: end within 1e-4 of their extent.
    turnings: int = 5
    singular: float = 1e-4  #: least conditioning of a chart that is used
    #: Speed below which a point is at rest [sizes of the linkage per unit of the parameter].
    at_rest: float = 1e-9
    #: Largest distance to which a point is followed [sizes of the linkage]: coupler points of
    #: slides and sliders run to infinity.
    far: float = 100.0
    rounding: float = 1e-9  #: relative difference of extents or scores that counts as rounding


CURVE = CurveOptions()

#: Places of the table, as fractions of the angle to the end of the chart. They are dense there,
#: because the path approaches a turning point like a square root.
SHARES = np.sin(0.5 * np.pi * np.arange(CURVE.steps + 1) / CURVE.steps)[:, None]


@dataclass(frozen=True)
class Table(Columns):
    """Displacements of points over the part of their paths on which they increase.

    Attributes
    ----------
    t, u : ndarray, shape (2 steps + 1, n)
        Parameters and displacements along the tangent [length]; u is infinite outside that part.
    """

    t: Floats
    u: Floats

    @property
    def extent(self) -> Floats:
        """Largest u before (without its sign) and after the reference position, shape (2, n)."""
        u = np.where(np.isfinite(self.u), self.u, 0)
        return np.stack([-u.min(0), u.max(0)])


@dataclass(frozen=True)
class CouplerCurve(Columns):
    """n guides ready to be traced.

    Attributes
    ----------
    point : complex ndarray, shape (n,)
        Guided point in the reference position.
    tangent : complex ndarray, shape (n,)
        Unit vector of the point's velocity there, at a cusp of its acceleration; u runs along it
        and increases with the parameter.
    still : ndarray of bool, shape (n,)
        Whether the path has no tangent.
    cusp : ndarray of bool, shape (n,)
        Whether the point is at rest in the reference position.
    """

    motion: Motion
    point: Complexes
    tangent: Complexes
    still: Mask
    cusp: Mask
    pole: Complexes | None = None

    @property
    def linkage(self) -> Linkage:
        return self.motion.linkage

    def __len__(self) -> int:
        return len(self.point)

    def __getitem__(self, index: Any) -> CouplerCurve:
        some = super().__getitem__(index)
        for name in ("_table", "table"):  # cached values that are expensive
            if name in self.__dict__:
                some.__dict__[name] = self.__dict__[name][index]
        return some

    @cached_property
    def path(self) -> Path:
        """Path of the guided point along and across its tangent."""
        return self.motion.point(self.point, self.tangent)

    @cached_property
    def turn(self) -> Path:
        """Re x and Im x of the pose, x = exp(i theta) - 1: factors of a shift of the point."""
        return self.motion.turn()

    @cached_property
    def _table(self) -> Table:
        """Table of displacements, to at most one step before the turning points."""
        moving, cusp = self.motion, self.cusp
        with np.errstate(all="ignore"):
            angle = np.arctan(np.clip(moving.interval, -CURVE.farthest, CURVE.farthest))
            t = np.tan(np.concatenate([angle[:1] * SHARES[:0:-1], angle[1:] * SHARES]))
            u, _ = self.path(t)
            u[: CURVE.steps] *= np.where(cusp, -1, 1)
            u[CURVE.steps] = 0.0
            rising = np.diff(u, axis=0) > 0
            near = np.abs(u) <= CURVE.far * moving.linkage.size
        up = np.logical_and.accumulate(rising[CURVE.steps :] & near[CURVE.steps + 1 :], axis=0)
        down = np.logical_and.accumulate((rising[: CURVE.steps] & near[: CURVE.steps])[::-1], axis=0)[::-1]
        inside = np.concatenate([down, np.ones_like(up[:1]), up]) & ~self.still & (moving.conditioning > CURVE.singular)
        outside = np.concatenate([np.full(CURVE.steps, -np.inf), [0.0], np.full(CURVE.steps, np.inf)])[:, None]
        return Table(t, np.where(inside, u, outside))

    @cached_property
    def table(self) -> Table:
        """Table of displacements, up to the turning points of the path."""
        return _extend_to_turnings(self, self._table)

    @property
    def extent(self) -> Floats:
        """Largest u before (without its sign) and after the reference position, shape (2, n)."""
        return self.table.extent

    def window(self, low: Floats, high: Floats) -> tuple[Floats, Floats]:
        """Solve for the parameters where u is `low` and `high`, (n,) each; NaN beyond the extent.

        Solutions are bracketed in the table, then iterated to `CURVE.tolerance` of the extent: in
        few steps, in more where the path turns nearby.
        """
        wanted = np.stack([low, high])
        t, near = self._solved(self._table, wanted, CURVE.few)
        far = np.flatnonzero(~near)
        if len(far):
            some = self[far]
            t[:, far] = some._solved(some.table, wanted[:, far], CURVE.many)[0]
        return t[0], t[1]

    def _solved(self, table: Table, wanted: Floats, steps: int) -> tuple[Floats, Mask]:
        """Solve for the parameters (2, n) of values u (2, n) in a table; tell which converged."""
        k = np.clip((table.u[:, None] < wanted).sum(0), 1, len(table.u) - 1)
        t0, t1 = (np.take_along_axis(table.t, k + j, 0) for j in (-1, 0))
        extent = table.extent
        close = CURVE.tolerance * extent.sum(0)
        with np.errstate(all="ignore"):
            outside = (wanted < -extent[0] * (1 + CURVE.rounding)) | (wanted > extent[1] * (1 + CURVE.rounding))
            f0, f1 = (np.take_along_axis(table.u, k + j, 0) - wanted for j in (-1, 0))
            t, off = false_position(
                lambda t: np.where(self.cusp & (t < 0), -1, 1) * self.path(t)[0] - wanted, t0, t1, f0, f1, close, steps
            )
        found = ~outside & np.isfinite(t)
        return np.where(found, t, np.nan), np.asarray((found & ~(np.abs(off) > close)).all(0))


def false_position(
    function: Callable[[Floats], Floats], t0: Floats, t1: Floats, f0: Floats, f1: Floats, close: Floats, steps: int
) -> tuple[Floats, Floats]:
    """Solve for zeros of functions in brackets t0, t1 by regula falsi (Illinois).

    Returns the zeros and the values there; stops when all are within `close` of 0.
    """
    for _ in range(steps):
        t = t1 - f1 * (t1 - t0) / np.where(f1 == f0, 1, f1 - f0)
        f = function(t)
        crossed = (f < 0) != (f1 < 0)
        t0, f0 = np.where(crossed, t1, t0), np.where(crossed, f1, 0.5 * f0)
        t1, f1 = t, f
        if not (np.abs(f) > close).any():
            break
    return t1, f1


def coupler_curve(
    linkage: Linkage,
    point: Complexes,
    dtype: Any = float,
    pole: Complexes | None = None,
    chart: Integers | None = None,
    least: float = 0.0,
) -> CouplerCurve:
    """Build the coupler curves of points, each in the chart of the largest extent.

    The score of a chart is the smaller of its two extents times the root of its conditioning;
    charts with an extent of `least` on both sides come first.

    Parameters
    ----------
    point : complex ndarray, shape (n,)
        Guided points in the reference position.
    dtype : dtype
        float or numpy.longdouble.
    pole : complex ndarray, shape (n,), optional
        Selects the branch of linkages at a change point; without it such a linkage has extent 0.
    chart : ndarray of int, shape (n,), optional
        Charts of linkages nearby, used without a comparison.
    least : float
        Required extent [length].
    """
    point = np.asarray(point, dtype=complex)
    if chart is None:
        n = len(linkage)
        each = np.tile(np.arange(n), len(CHARTS))
        poles = None if pole is None else np.asarray(pole)[each]
        every = _curves_in_charts(linkage[each], point[each], np.repeat(CHARTS, n), float, poles)
        conditioning, extent = every.motion.conditioning, every._table.extent.min(0)
        score = extent * np.sqrt(np.minimum(conditioning, 1)) * np.where(extent >= least, CURVE.first, 1.0)
        score = np.where(conditioning > CURVE.singular, score, -1.0).reshape(len(CHARTS), n)
        chosen = np.zeros(n, dtype=int)
        for i in range(1, len(CHARTS)):
            chosen = np.where(score[i] > score[:i].max(0) * (1 + CURVE.rounding), i, chosen)
        if dtype is float:
            return every[chosen * n + np.arange(n)]
        chart = np.array(CHARTS)[chosen]
    return _curves_in_charts(linkage, point, chart, dtype, pole)


def _curves_in_charts(
    linkage: Linkage, point: Complexes, chart: Integers, dtype: Any, pole: Complexes | None
) -> CouplerCurve:
    """Return coupler curves in given charts."""
    moving = motion(linkage, chart, point, dtype, pole)
    velocity = moving.velocity_of(point)
    speed = np.abs(velocity)
    with np.errstate(all="ignore"):
        cusp = ~(speed > CURVE.at_rest * moving.linkage.size) & (moving.conditioning > CURVE.singular)
        if cusp.any():
            velocity = np.array(velocity)
            velocity[cusp] = path_series(moving[cusp].point(point[cusp]))[2]
            speed = np.abs(velocity)
        still = ~(speed > CURVE.at_rest * moving.linkage.size)
        tangent = np.where(still, 1.0, velocity / speed)
    return CouplerCurve(moving, point, tangent, still, cusp, pole)


def _extend_to_turnings(guides: CouplerCurve, table: Table) -> Table:
    """Extend a table to the places where paths turn.

    A path turns between the neighbours of its last place in the table, at most one step beyond it.
    """
    t, u = table.t.copy(), table.u.copy()
    for side in (-1, 1):
        inside = np.isfinite(u[CURVE.steps :] if side > 0 else u[CURVE.steps :: -1]).sum(0) - 1
        k = np.flatnonzero((inside > 0) & (inside < CURVE.steps))
        sign = side * np.where(guides.cusp[k] & (side < 0), -1, 1)
        at = t[CURVE.steps + side * (inside[k] + np.array([[-1], [0], [1]])), k]
        with np.errstate(all="ignore"):
            height = sign * guides.path[k](at)[0]
        turns = height[2] <= height[1]  # otherwise the next place is far away, or beyond the chart
        k, sign, at, height = k[turns], sign[turns], at[:, turns], height[:, turns]
        tip, top = _find_summit(guides.path[k], sign, side, at, height)
        place = CURVE.steps + side * (inside[k] + (side * tip > side * at[1]))
        t[place, k], u[place, k] = tip, side * top
    return Table(t, u)


def _find_summit(path: Path, sign: Integers, side: int, at: Floats, height: Floats) -> tuple[Floats, Floats]:
    """Find the greatest displacement of paths by successive parabolas.

    Parameters
    ----------
    sign : ndarray, shape (n,)
        Factor of the displacement u.
    side : int
        1 if the parameters rise, -1 if they fall.
    at, height : ndarray, shape (3, n)
        Three parameters, the middle one with the greatest displacement, and their displacements.
    """
    every = np.arange(len(sign))
    for _ in range(CURVE.turnings):
        (t0, t1, t2), (u0, u1, u2) = at, height
        with np.errstate(all="ignore"):
            rise, fall = (t2 - t1) * (u1 - u0), (t1 - t0) * (u1 - u2)
            tip = t1 + 0.5 * ((t2 - t1) * rise - (t1 - t0) * fall) / (rise + fall)
            tip = np.where(np.isfinite(tip), tip, t1)
            at = np.stack([t0, t1, tip, t2])
            height = np.stack([u0, u1, sign * path(tip[None])[0][0], u2])
        order = np.argsort(side * at, axis=0, kind="stable")
        top = np.clip(np.argmax(np.take_along_axis(height, order, 0), axis=0), 1, 2)
        places = order[top + np.array([[-1], [0], [1]]), every]
        at, height = (np.take_along_axis(values, places, 0) for values in (at, height))
    return at[1], height[1]
