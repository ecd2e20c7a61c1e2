"""Measures of placed guides as maxima of smooth pieces, with derivatives by the pivots.

A size is the largest of many distances, a minimum transmission angle the least of many angles. Each
of these pieces is smooth, and several of them can determine the measure at once. Signs are such
that more is worse. Lengths are in strokes, angles in right angles; coordinates are those of
`catalogue.guidance.sensitivity`. Derivatives without a closed form are finite differences.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..candidates.batch import CandidateBatch
from ..candidates.feasibility import PIVOT_REGIONS
from ..guidance.metrics import LEAST_ARM, rotation_margin
from ..guidance.sensitivity import COUNT, PoseJacobian
from ..guidance.slides import extremes, slide_runs
from ..kinematics.linkage import PR, RP, RR, Linkage
from ..kinematics.motion import Pose
from ..kinematics.types import Array, Complexes, Floats, Mask
from ..problem.problem import Problem
from ..problem.region import Region

#: Measures with pieces for guided points only, not for slots.
POINTS_ONLY = ("max_arm",)
#: Measures that are largest between the stations, so that their pieces are raised.
BETWEEN_STATIONS = ("travel",)
#: Value of a piece that does not apply to a linkage.
NONE = -1e3


class PieceOptions(NamedTuple):
    """Resolution of pieces, and limits of their derivatives."""

    corners: int = 33  #: number of places on an arc beyond a half circle: the error of its size is 0.5 %
    #: Distance below which ends of slides count as coincident [strokes]: it is never the largest,
    #: and any step changes its direction.
    same: float = 1e-4
    squared_sine: float = 1e-4  #: least squared sine, in derivatives, of an angle near 0 or 180 degrees


PIECE = PieceOptions()


class Pieces(NamedTuple):
    """Pieces of one measure of n guides; larger values are worse."""

    value: Floats  #: values, (n, k)
    slope: Floats  #: derivatives by the coordinates, (n, k, 10)

    @classmethod
    def of(cls, rows: Iterable[tuple[Floats, Floats]], sign: float = 1.0) -> Pieces:
        """Collect pieces with values (n,) and slopes (n, 10); omit infinite ones."""
        value, slope = (np.stack(list(part), axis=1) for part in zip(*rows, strict=True))
        good = np.isfinite(value) & np.isfinite(slope).all(-1)
        return cls(np.where(good, sign * value, NONE), np.where(good[..., None], sign * slope, 0.0))

    def in_basis(self, basis: Floats) -> Pieces:
        """Express the slopes in p other coordinates; drop pieces that no guide has.

        `basis`, (n, 10, p), holds the derivatives of the 10 coordinates by the others.
        """
        some = np.flatnonzero((self.value > NONE).any(axis=0))
        some = some if len(some) else np.zeros(1, int)
        return Pieces(self.value[:, some], self.slope[:, some] @ basis)

    def raised(self, to: Floats) -> Pieces:
        """Shift the pieces of each guide so that their largest is a given value, shape (n,).

        The given value includes the path between the stations, which the pieces do not.
        """
        return self.less(np.nan_to_num(self.value.max(1) - to))

    def less(self, bound: Floats | float) -> Pieces:
        """Subtract a bound, shape () or (n,), from the pieces."""
        return Pieces(self.value - np.reshape(bound, (-1, 1)), self.slope)


Row = tuple[Array, Array]


@dataclass(frozen=True)
class Quantities:
    """Measures of n guides, placed along the path of a problem, as pieces.

    Attributes
    ----------
    linkage : Linkage
    point : complex ndarray, shape (n,)
        Guided points.
    driver : ndarray of int, shape (n,)
        Number of the driving crank, 0 where there is none.
    slides : complex ndarray, shape (n, 2, 2)
        Ends of rails and slots in mid-stroke, see `Measures.slides`.
    pose : Pose
        Poses at m stations, Chebyshev points of the stroke.
    by : PoseJacobian
        Derivatives of the poses.
    least : ndarray, shape (n,), optional
        Least transmission angles, at the stations and between them [deg].
    """

    problem: Problem
    linkage: Linkage
    point: Complexes
    driver: Array
    slides: Complexes
    pose: Pose
    by: PoseJacobian
    least: Floats | None = None

    @classmethod
    def of(
        cls, problem: Problem, found: CandidateBatch, pose: Pose, by: PoseJacobian, least: Floats | None = None
    ) -> Quantities:
        """Return the measures of candidates in poses."""
        m = found.measures
        return cls(problem, found.linkage, found.point, m.driver, m.slides, pose, by, least)

    def __len__(self) -> int:
        return len(self.point)

    @cached_property
    def machine(self) -> Linkage:
        """The linkages as built: those with a guided slot are traced as their inversions."""
        return self.linkage.inverted() if self.problem.constraints.slots else self.linkage

    def __call__(self, name: str) -> Pieces:
        """Return the pieces of a measure or of a region, by its name."""
        if name in PIVOT_REGIONS:
            return self._standing(getattr(self.problem.constraints, name), name)
        made: dict[str, Callable[[], Pieces]] = {
            "size": self._size,
            "max_link": lambda: Pieces.of(self.links()),
            "min_link": lambda: Pieces.of(self.links(), -1.0),
            "max_ground": lambda: Pieces.of([self._length(*self._frame)]),
            "min_ground": lambda: Pieces.of([self._length(*self._frame)], -1.0),
            "max_arm": lambda: Pieces.of([self._nearer_arm()]),
            "travel": self._travel,
            "least_arm": lambda: Pieces.of(self._arms(), -1.0),
            "transmission": self._transmission,
            "min_transmission_turn": lambda: Pieces.of(self._over_the_turn(), -1.0),
            "full_rotation": self._turning,
            "swept_in": self._swept,
            "uniformity": self._uniformity,
        }
        return made[name]()

    def ranked(self, name: str) -> Pieces:
        """Return the pieces of a ranked measure.

        Where a crank must turn fully the ranked transmission angle is that over the turn; a bound
        on it holds over the stroke.
        """
        if name != "transmission" or not self.problem.constraints.full_rotation:
            return self(name)
        both = zip(self(name), self("min_transmission_turn"), strict=True)
        return Pieces(*(np.concatenate(parts, axis=1) for parts in both))

    def collapse(self) -> Pieces:
        """Return pieces that keep links from shrinking to a point.

        A linkage with such a point would turn about it as one body.
        """
        rows = [
            (np.fmin(value, LEAST_ARM) - value, -slope) for value, slope in (*self.links(), self._length(*self._frame))
        ]
        return Pieces.of(rows)

    # -- lengths ---------------------------------------------------------------------------
    def _place(self, j: int) -> Complexes:
        """Return the place of a pivot, 0 to 3, or of the guided point, 4; NaN at infinity."""
        if j == 4:
            return self.point
        finite = self.linkage.finite.reshape(-1, 4)[:, j]
        return np.where(finite, self.linkage.points.reshape(-1, 4)[:, j], np.nan)

    def _length(self, i: int, j: int) -> Row:
        return point_distance(self._place(i), i, self._place(j), j)

    def links(self) -> list[Row]:
        """Return the lengths of the two cranks and of the coupler."""
        return [self._length(0, 1), self._length(2, 3), self._length(*self._coupler)]

    @property
    def ends(self) -> tuple[int, int]:
        """The planes of the fixed and the moving pivot of a dyad.

        They are exchanged for guided slots, which are traced as inversions.
        """
        return (1, 0) if self.problem.constraints.slots else (0, 1)

    @property
    def _frame(self) -> tuple[int, int]:
        return self.ends[0], 2 + self.ends[0]

    @property
    def _coupler(self) -> tuple[int, int]:
        return self.ends[1], 2 + self.ends[1]

    def _arms(self) -> list[Row]:
        return [self._length(4, j) for j in (1, 3)]

    def _nearer_arm(self) -> Row:
        one, two = self._arms()
        return chosen(~(one[0] > two[0]), one, two)

    def _size(self) -> Pieces:
        n = len(self)
        ends = [(np.full(n, end), 5) for end in self._corners]  # the path does not move
        every = [*((self._place(j), j) for j in range(5)), *ends]
        rows = [point_distance(a, i, b, j) for k, (a, i) in enumerate(every[:4]) for b, j in every[k + 1 :]]
        rows += self._reach_of_slides()
        return Pieces.of([*rows, (np.full(n, np.ptp(self._corners.real)), np.zeros((n, COUNT)))])

    @property
    def _corners(self) -> Complexes:
        """Places of the nominal that determine the size: its ends, and others on a wide arc."""
        path = self.problem.path
        if not path.is_wide or path.radius is None or path.angle is None:
            return np.array([0j, path.stroke + 0j])
        turn = np.radians(0.5 * path.angle) * np.linspace(1, -1, PIECE.corners)
        apart = np.cos(np.radians(0.5 * path.angle)) - np.exp(1j * turn)
        return np.asarray(0.5 * path.stroke - 1j * path.radius * apart)

    def _standing(self, region: Region, name: str) -> Pieces:
        planes, kinds = PIVOT_REGIONS[name], self.linkage.dyads
        places = [(self._place(2 * i + j), coordinate_slope(len(self), 2 * i + j)) for i in (0, 1) for j in planes]
        for i, ends in self._slides.items():
            there = (kinds[:, i] == PR) | (1 in planes)
            places += [(np.where(there, z, np.nan), by) for z, by in ends]
        return Pieces.of(row for z, by in places for row in outside(region, z, by))

    # -- slides ----------------------------------------------------------------------------
    @cached_property
    def _slides(self) -> dict[int, list[Row]]:
        """Points in mid-stroke that may end a rail or slot, by the number of its dyad.

        Each is a position (n,) with its derivatives (n, 10), complex; NaN without rail or slot.
        """
        sliding = (self.linkage.dyads != RR).any(0)
        return {i: self._ends_of(i) for i in (0, 1) if sliding[i]}

    def _ends_of(self, i: int) -> list[Row]:
        linkage = self.linkage
        place, by = chosen(linkage.dyads[:, i] == PR, self.at(i, 1), self._relative_to_coupler(i))
        weights = extremes(slide_runs(linkage, self.pose)[..., i])
        slopes = [np.einsum("nm,mnc->nc", w, by) for w in weights]
        lowest, highest = self.slides[:, i].T  # the measured ends, which have been found on a finer grid
        return list(zip((place[0], place[-1], highest, lowest), slopes, strict=True))

    def _relative_to_coupler(self, i: int) -> Row:
        """Return the coupler points at the fixed pivot of dyad i at the stations."""
        pose, turn = self.pose, 1 + self.pose.x
        away = (self.linkage.points[:, i, 0] - pose.origin - pose.d) / turn
        slope = (coordinate_slope(len(self), 2 * i) - self.by.shift) / turn[..., None]
        return pose.origin + away, slope - 1j * away[..., None] * self.by.angle

    def _travel(self) -> Pieces:
        none = np.full(len(self), np.nan), np.zeros((len(self), COUNT))
        return Pieces.of([none, *(distance(*pair) for ends in self._slides.values() for pair in combinations(ends, 2))])

    def _reach_of_slides(self) -> Iterable[Row]:
        """Distances of the ends of slides from each other, from pivots and from the path."""
        n = len(self)
        still = [(np.full(n, end + 0j), np.zeros((n, COUNT), complex)) for end in (0.0, 1.0)]
        others = [*((self._place(j), coordinate_slope(n, j)) for j in range(5)), *still]
        for ends in self._slides.values():
            for end in ends:
                yield from (distance(end, other) for other in others)
                others.append(end)

    # -- angles ----------------------------------------------------------------------------
    def _transmission(self) -> Pieces:
        """Return minus the transmission angles at the stations [right angles].

        The given crank drives.  All angles are shifted so that the least of them is that of the
        whole path, which may be between stations.
        """
        driver = self.driver
        (first, one), (other, two) = (self._sine(dyad) for dyad in (0, 1))
        least = ((np.sign(sine.sum(0)) * sine).min(0) for sine in (other, first))
        better = np.greater(*least)  # without a crank the better dyad drives
        second = np.where(driver == 0, better, driver == 2)
        sine, slope = np.where(second, other, first), np.where(second[:, None], two, one)
        side = np.sign(sine.sum(0))
        sine, slope = side * sine, side[:, None] * slope
        cosine = np.sqrt(np.maximum(1 - sine * sine, PIECE.squared_sine))
        angle, by = np.arcsin(np.clip(sine, -1, 1)), slope / cosine[..., None]
        pieces = Pieces.of(zip(-angle / (np.pi / 2), -by / (np.pi / 2), strict=True))
        return pieces if self.least is None else pieces.raised(-self.least / 90)

    def _over_the_turn(self) -> Iterable[Row]:
        """Yield minus the transmission angles that can be least over the turn of the driving crank.

        They are in right angles, 0 where the crank does not turn fully; see
        `catalogue.guidance.metrics`.
        """
        driver, built = self.driver, self.machine
        kind, margin = built.dyads, rotation_margin(built)
        turns = (driver > 0) & (margin[np.arange(len(driver)), np.maximum(driver - 1, 0)] >= 0)
        four, slider, slide = (turns & of for of in ((kind == RR).all(1), (kind == PR).any(1), (kind == RP).any(1)))
        a, ground, b, c, e, to_fixed = self._driven_by(driver != 2)
        near = chosen(to_fixed[0] > a[0], plus((1, to_fixed), (-1, a)), plus((1, a), (-1, to_fixed)))
        with np.errstate(all="ignore"):
            for ends in (near, plus((1, ground), (1, a))):
                cosine = (b[0] ** 2 + c[0] ** 2 - ends[0] ** 2) / (2 * b[0] * c[0])
                slope = plus((1 / c[0] - cosine / b[0], b), (1 / b[0] - cosine / c[0], c))[1]
                slope -= (ends[0] / (b[0] * c[0]))[:, None] * ends[1]
                for side in (1, -1):
                    yield _angle(four, side * cosine, side * slope)
            yield np.where(turns, np.nan, 0.0), np.zeros_like(a[1])
            for side in (1, -1):
                yield _angle(slider, *ratio(plus((1, a), (side, e)), b))
                yield _angle(slide, *ratio(plus((side, e)), near))

    def _sine(self, driver: int) -> Row:
        """Return the sines of the transmission angle at the stations, one dyad driving.

        Shapes are (m, n) and (m, n, 10). With guided slots the angles are those of the linkage as
        built, whose moving pivots are the fixed ones of the traced inversion.
        """
        other, kind, (fixed, moving) = 1 - driver, self.linkage.dyads, self.ends
        slide = PR if self.problem.constraints.slots else RP
        moving_pivot, fixed_pivot = self.at(other, moving), self.at(other, fixed)
        crank = moving_pivot[0] - fixed_pivot[0], moving_pivot[1] - fixed_pivot[1]
        sliding = kind[:, other] == slide
        ray = chosen(kind[:, other] == RR, crank, chosen(sliding, moving_pivot, fixed_pivot))
        contact, driving = chosen(sliding, fixed_pivot, moving_pivot), self.at(driver, moving)
        arm = contact[0] - driving[0], contact[1] - driving[1]
        arm = chosen(kind[:, driver] == slide, self.at(driver, moving), arm)
        with np.errstate(all="ignore"):
            (p, dp), (q, dq) = ((v / np.abs(v), g / np.abs(v)[..., None]) for v, g in (arm, ray))
            sine = (p.conj() * q).imag
            slope = (dp.conj() * q[..., None] + p.conj()[..., None] * dq).imag
            slope -= sine[..., None] * ((dp.conj() * p[..., None]).real + (dq.conj() * q[..., None]).real)
        return sine, slope

    def at(self, i: int, j: int) -> Row:
        """Return the place of pivot j of dyad i at the stations, with derivatives.

        A pivot at infinity has a direction instead. The guided point is the moving pivot of a third
        dyad.
        """
        if j == 0:
            z, still = self.linkage.points[:, i, 0], np.ones(self.pose.d.shape)
            return still * z, _difference_slope(i, 0, still)
        if i == 2:
            z, finite = self.point, np.ones(len(self), bool)
        else:
            z, finite = self.linkage.points[:, i, 1], self.linkage.finite[:, i, 1]
        pose = self.pose
        arm = pose.direction(np.where(finite, z - pose.origin, z))
        slope = (_difference_slope(2, 0, 1 + pose.x) if i == 2 else _difference_slope(i, 1, 1 + pose.x)) + 1j * arm[
            ..., None
        ] * self.by.angle
        there = np.where(finite, pose.point(z), pose.direction(z))
        return there, slope + np.where(finite[:, None], self.by.shift, 0)

    # -- room ------------------------------------------------------------------------------
    def _swept(self) -> Pieces:
        """Largest distances of pivots and guided point beyond each side of a convex region."""
        wanted, n = self.problem.constraints, np.arange(len(self))
        region = wanted.swept_in
        assert region is not None
        rows: list[Row] = []
        kinds, places = self.linkage.dyads, []
        for i, j in ((0, 0), (0, 1), (1, 0), (1, 1), (2, 1)):
            places.append((*self.at(i, j), self.linkage.finite[:, i, j] if i < 2 else np.ones(len(n), bool)))
        for i, ends in self._slides.items():
            places += [(*self._moved(end, kinds[:, i] == RP), kinds[:, i] != RR) for end in ends]
        for place, slope, finite in places:
            for corner, out in zip(*region.sides, strict=True):
                value = ((place - corner) * out.conj()).real
                most = np.argmax(np.where(np.isnan(value), -np.inf, value), axis=0)
                rows.append((np.where(finite, value[most, n], np.nan), (slope[most, n] * out.conj()).real))
        return Pieces.of(rows)

    def _moved(self, end: Row, slot: Mask) -> Row:
        """Return the places of slides' ends (n,) at the stations.

        The coupler carries slots; rails are fixed.
        """
        place, slope = end
        arm = self.pose.direction(place - self.pose.origin)
        turned = (1 + self.pose.x)[..., None] * slope + 1j * arm[..., None] * self.by.angle + self.by.shift
        there = np.where(slot, self.pose.point(place), place)
        return there, np.where(slot[:, None], turned, slope)

    def _uniformity(self) -> Pieces:
        """Return minus the speeds of the guided point at the stations, over the largest speed."""
        from .driving import Driving

        return Driving(self).uniformity()

    def _turning(self) -> Pieces:
        """Return the shortfall of the best crank for a full turn; see `guidance.metrics`."""
        built = self.machine
        kind, margin = built.dyads, np.nan_to_num(rotation_margin(built), nan=-np.inf)
        a, ground, b, c, e, to_fixed = self._driven_by(margin[:, 0] >= margin[:, 1])
        with np.errstate(all="ignore"):
            side, past = np.sign(ground[0] - a[0]), np.sign(to_fixed[0] - a[0])
        four, slider, slide = (kind == RR).all(1), (kind == PR).any(1), (kind == RP).any(1)
        cases = [
            (four, plus((1, a), (1, ground), (-1, b), (-1, c))),
            (four, plus((1, b), (-1, c), (-side, ground), (side, a))),
            (four, plus((1, c), (-1, b), (-side, ground), (side, a))),
        ]
        for sign in (1, -1):
            cases.append((slider, plus((1, a), (sign, e), (-1, b))))
            cases.append((slide, plus((sign, e), (-past, to_fixed), (past, a))))
        return Pieces.of((np.where(where, value, np.nan), slope) for where, (value, slope) in cases)

    def _driven_by(self, first: Mask) -> tuple[Row, ...]:
        """Return the lengths that decide whether a crank turns fully.

        They are crank, frame, coupler, other crank, offset of the crank from the other slide, and
        distance of the fixed pivots. The crank is the first one where a mask (n,) is True, else the
        second.
        """
        z, links, (fixed, _) = self.linkage.points, self.links(), self.ends
        crank, other = chosen(first, links[0], links[1]), chosen(first, links[1], links[0])
        offset = chosen(first, self._offset(0), self._offset(1))
        away = point_distance(z[:, 0, fixed], fixed, z[:, 1, fixed], 2 + fixed)
        return crank, self._length(*self._frame), links[2], other, offset, away

    def _offset(self, i: int) -> Row:
        """Distance of a pivot of crank i from the slide of the other dyad.

        For a slider it is that of the fixed pivot from the slider's line, for a slide that of the
        moving pivot from the slide's line.
        """
        z, o, (fixed, moving) = self.linkage.points, 1 - i, self.ends
        slider = self.machine.dyads[:, o] == PR
        normal = np.where(slider, z[:, o, fixed], z[:, o, moving])
        gap = np.where(slider, z[:, i, fixed] - z[:, o, moving], z[:, o, fixed] - z[:, i, moving])
        by = np.zeros((len(z), COUNT))
        ends = (
            (slider, (i, fixed), (o, moving), (o, fixed)),
            (~slider, (o, fixed), (i, moving), (o, moving)),
        )
        for where, (a, b), (c, d), (e, f) in ends:
            for k, w, vector in ((4 * a + 2 * b, 1, normal), (4 * c + 2 * d, -1, normal), (4 * e + 2 * f, 1, gap)):
                by[:, k] += np.where(where, w * vector.real, 0)
                by[:, k + 1] += np.where(where, w * vector.imag, 0)
        return (normal.conj() * gap).real, by


def chosen(where: Mask, one: Row, two: Row) -> Row:
    """Select `one` where a mask (n,) is True, else `two`."""
    return np.where(where, one[0], two[0]), np.where(where[:, None], one[1], two[1])


def plus(*terms: tuple[Floats | float, Row]) -> Row:
    """Return the sum of rows times factors, () or (n,)."""
    value = sum(f * v for f, (v, _) in terms)
    return np.asarray(value), np.asarray(sum(np.reshape(f, (-1, 1)) * g for f, (_, g) in terms))


def ratio(one: Row, other: Row) -> Row:
    """Return the quotient of two rows, with its derivatives."""
    value = one[0] / other[0]
    return value, (one[1] - value[:, None] * other[1]) / other[0][:, None]


def _angle(where: Mask, cosine: Floats, slope: Floats) -> Row:
    """Return the angles of cosines [right angles]; NaN outside a mask (n,)."""
    sine = np.sqrt(np.maximum(1 - cosine * cosine, PIECE.squared_sine))
    angle = np.where(where, np.arccos(np.clip(cosine, -1, 1)), np.nan)
    return angle / (np.pi / 2), -slope / sine[:, None] / (np.pi / 2)


def point_distance(one: Complexes, i: int, other: Complexes, j: int) -> Row:
    """Return the distance of two points and its derivatives.

    Points 0 to 3 are pivots, 4 the guided point, 5 a fixed point.
    """
    by = np.zeros((len(one), COUNT + 2))
    between = one - other
    with np.errstate(all="ignore"):
        unit = between / np.abs(between)
    for k, sign in ((i, 1), (j, -1)):
        by[:, 2 * k] += sign * unit.real
        by[:, 2 * k + 1] += sign * unit.imag
    return np.abs(between), by[:, :COUNT]


def distance(one: Row, other: Row) -> Row:
    """Return the distance of places (n,) and its derivatives; NaN if they coincide.

    The places have complex derivatives (n, 10).
    """
    between = one[0] - other[0]
    with np.errstate(all="ignore"):
        unit = np.where(np.abs(between) > PIECE.same, between / np.abs(between), np.nan)
    return np.abs(between), ((one[1] - other[1]) * unit.conj()[:, None]).real


def coordinate_slope(n: int, k: int) -> Complexes:
    """Return the derivatives (n, 10) of a point by all ten coordinates: 1 and i at its own two.

    `k` numbers the pivots, 0 to 3; 4 is the guided point.
    """
    by = np.zeros((n, COUNT), complex)
    by[:, 2 * k], by[:, 2 * k + 1] = 1, 1j
    return by


def outside(region: Region, z: Complexes, slope: Complexes) -> Iterable[Row]:
    """Return the distances of places outside a region, with derivatives.

    A convex region gives one for each side, another region that of the nearest side.
    """
    corner, out = region.sides
    if region.is_convex:
        for c, normal in zip(corner, out, strict=True):
            yield ((z - c) * normal.conj()).real, (slope * normal.conj()).real
        return
    side = np.roll(corner, -1) - corner
    along = np.clip(((z[:, None] - corner) * side.conj()).real / np.abs(side) ** 2, 0, 1)
    away = z[:, None] - corner - along * side
    away = away[np.arange(len(z)), np.argmin(np.where(np.isnan(away), np.inf, np.abs(away)), axis=1)]
    sign = np.where(region.holds(z), -1.0, 1.0)
    with np.errstate(all="ignore"):
        unit = sign * away / np.abs(away)
    yield sign * np.abs(away), (slope * unit.conj()[:, None]).real


def _difference_slope(i: int, j: int, value: Array) -> Complexes:
    """Return the derivatives of a pivot by its own coordinates, times values (m, n)."""
    out = np.zeros((*value.shape, COUNT), dtype=complex)
    out[..., 4 * i + 2 * j], out[..., 4 * i + 2 * j + 1] = value, 1j * value
    return out
