"""Measures of a guide: size, link lengths, transmission angles, rotation of the cranks.

Over the stroke they are measured on the finite motion.  One crank drives: the one with the larger
minimum transmission angle; where a crank must turn fully, only cranks that turn fully are compared.
All measures that depend on the drive refer to this crank: `Measures.min_transmission` and
`drive_angle` here, and all of `catalogue.guidance.drive`.

Over the whole turn transmission angles and margins of rotation have a closed form.  With a the
crank, g the frame, b the coupler, c the other crank, e the distance of the crank's fixed pivot from
the line of the slider's pivot, and h the distance of the crank's moving pivot from the coupler line
of a slide:

=============  ====================================  =====================================
linkage        margin                                cosine of extreme transmission angles
=============  ====================================  =====================================
four-bar       min(b + c - g - a,                    (b^2 + c^2 - (g -+ a)^2) / (2 b c)
               |g - a| - |b - c|)
slider-crank   b - a - |e|                           (a + |e|) / b
inverted       |g - a| - h                           h / |g - a|
slider-crank
=============  ====================================  =====================================

A crank turns fully exactly if its margin is not negative.  At a margin of 0 the linkage has a
*change point*: in one position of the crank all pivots lie on one line.  The crank passes it, into
either of two motions, and so counts as turning fully (Grashof's condition with its equality, as in
textbooks).  The least transmission angle over the turn is then 0: another link must lead it across.
A margin within `CHANGE_POINT` is 0: above the rounding of the pivots and far below any workshop's
tolerance.  The transmission angle is extreme where crank and frame are in line, with a slider where
the crank is normal to its line.

Source: Grashof, Theoretische Maschinenlehre 2, 1883, for the four-bar; Alt, Der
Uebertragungswinkel, 1932.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from ..kinematics.batch import Rows, put
from ..kinematics.linkage import PR, RP, RR, Linkage
from ..kinematics.motion import Motion, Pose
from ..kinematics.types import Complexes, Floats, Indices, Integers, Mask, Scalar
from .coupler_curve import CouplerCurve, false_position
from .inverse import of_machine
from .minimum_zone import grid, largest, times
from .slides import rails, slide_ends, slide_runs, slots, travels
from .trace import Traced

if TYPE_CHECKING:
    from .circuit_curve import CircuitCurve

#: Margins up to this part of the longest length in their formula count as 0: it is the residual up
#: to which a linkage belongs to a series. Stored members of the series with change points stay
#: below 4e-16.
CHANGE_POINT = 1e-9


def rotation_margin(linkage: Linkage) -> Floats:
    """Compute the margins by which cranks turn fully, shape (n, 2) [length].

    The margin is the least spare length of the links that must reach a position of the turn:
    positive if the crank turns fully, 0 at a change point (within `CHANGE_POINT`), negative if it
    swings; NaN for a dyad that is no crank.
    """
    a, g, b, c, e, h = _lengths(linkage)
    kind = linkage.dyads[:, ::-1]
    four_bar = np.minimum(b + c - g - a, np.abs(g - a) - np.abs(b - c))
    margin = _select_by_kind(kind, four_bar, b - a - e, np.abs(g - a) - h)
    longest = np.maximum(a, _select_by_kind(kind, np.maximum(np.maximum(g, b), c), np.maximum(b, e), g))
    # the rounding of coordinates depends on their distance from the origin
    z = np.where(linkage.finite, np.abs(linkage.points), 0).max((1, 2))
    nothing = CHANGE_POINT * longest + 8 * np.finfo(float).eps * z[:, None]
    margin = np.where(np.abs(margin) <= nothing, 0.0, margin)
    return np.where(linkage.dyads == RR, margin, np.nan)


def rotates(linkage: Linkage) -> Integers:
    """Return which cranks turn fully, shape (n,): bit i for dyad i; at a change point it is set."""
    full = rotation_margin(linkage) >= 0
    return np.asarray(1 * full[:, 0] + 2 * full[:, 1])


def best_turning_cranks(linkage: Linkage) -> Integers:
    """Select the cranks that turn fully, else the crank nearest to it, shape (n,).

    Bit i stands for dyad i. In a refinement with a required full rotation this crank drives before
    it turns fully.
    """
    margin = rotation_margin(linkage)
    nearest = 1 + np.greater(*np.nan_to_num(margin.T[::-1], nan=-np.inf))
    nearest = np.where(np.isnan(margin).all(1), 0, nearest)
    return np.where((margin >= 0).any(1), rotates(linkage), nearest)


def transmission_turn(linkage: Linkage) -> Floats:
    """Compute the minimum transmission angle over the full turn of either crank, (n, 2) [deg].

    The angle is that of `transmissions`, 0 ... 90; 0 at a change point, NaN where the crank does
    not turn fully.
    """
    a, g, b, c, e, h = _lengths(linkage)
    margin = rotation_margin(linkage)
    near, far = np.abs(g - a), g + a
    with np.errstate(all="ignore"):
        # tangents of half an angle and of an angle, from factors that are differences of lengths:
        # no digits are lost where the angle is small
        inner = 2 * np.arctan2(np.sqrt((near - (b - c)) * (near + (b - c))), np.sqrt((b + c - near) * (b + c + near)))
        outer = 2 * np.arctan2(np.sqrt((b + c - far) * (b + c + far)), np.sqrt((far - (b - c)) * (far + (b - c))))
        four_bar = np.fmin(inner, np.pi - inner)
        four_bar = np.minimum(four_bar, np.fmin(outer, np.pi - outer))
        reach = a + e
        slider = np.arctan2(np.sqrt((b - reach) * (b + reach)), reach)
        slide = np.arctan2(np.sqrt((near - h) * (near + h)), h)
        angle = np.degrees(_select_by_kind(linkage.dyads[:, ::-1], four_bar, slider, slide))
        return np.where(margin > 0, angle, np.where(margin == 0, 0.0, np.nan))


def min_transmission_turn(linkage: Linkage, driver: Integers | None = None) -> Floats:
    """Compute the minimum transmission angle over the full turn of the driving crank, (n,) [deg].

    `driver` is its number, as in `Measures.driver`; by default the crank with the larger angle
    drives.  NaN where the driving crank, or without `driver` both, cannot turn fully.
    """
    each = transmission_turn(linkage)
    if driver is None:
        return np.asarray(np.fmax(each[:, 0], each[:, 1]))
    index = np.maximum(np.asarray(driver) - 1, 0)
    return np.where(np.asarray(driver) > 0, each[np.arange(len(each)), index], np.nan)


def _lengths(linkage: Linkage) -> tuple[Floats, ...]:
    """Compute a, g, b, c, e and h of either crank, shape (n, 2) each.

    Lengths that a family does not have are undefined.
    """
    z = linkage.points
    pivot, pin, far_pivot, far_pin = z[:, :, 0], z[:, :, 1], z[:, ::-1, 0], z[:, ::-1, 1]
    return (
        np.abs(pin - pivot),
        np.abs(far_pivot - pivot),
        np.abs(far_pin - pin),
        np.abs(far_pin - far_pivot),
        np.abs(((far_pin - pivot) * far_pivot.conj()).real),
        np.abs(((far_pivot - pin) * far_pin.conj()).real),
    )


def _select_by_kind(
    kind: Integers, four_bar: npt.NDArray[Scalar], slider: npt.NDArray[Scalar], slide: npt.NDArray[Scalar]
) -> npt.NDArray[Scalar]:
    """Select values by the kind of the driven dyad."""
    return np.where(kind == RR, four_bar, np.where(kind == PR, slider, slide))


class MetricsGrid(NamedTuple):
    """Grid of transmission angle and path."""

    poses: int = 17  #: number of positions; it is quadrupled where the error is too large
    most: int = 257  #: largest number of positions
    #: Error above which the grid is refined: in the sine of the angle, and in the path over the
    #: size.
    missed: float = 1e-4


METRICS_GRID = MetricsGrid()

#: Distance of a guided point from a moving pivot, over the stroke, below which the point counts as
#: the pivot, which needs no guide.
LEAST_ARM = 0.05


@dataclass(frozen=True)
class Measures(Rows):
    """Measures of n guides over their strokes, in the length unit of the linkage.

    Arrays of shape (n,) unless said.

    Attributes
    ----------
    size : ndarray
        Diameter of the finite pivots, rails and slots in mid-stroke, together with the guided path,
        which is interpolated between `METRICS_GRID.poses` points.
    max_link, min_link : ndarray
        Longest and shortest of the cranks and the coupler; NaN where there is none.
    max_ground : ndarray
        Distance of the fixed pivots; NaN unless both are finite.
    max_arm : ndarray
        Distance of the guided point from the nearer moving pivot; NaN if both are at infinity.
    min_transmission : ndarray
        Minimum transmission angle over the stroke [deg]: the angle, 0 ... 90, between the ray of
        the driven dyad and the line from the moving pivot of the driving crank to that dyad.
        Without a crank the better dyad drives.
    driver : ndarray of int
        Number of the driving crank, 1 or 2, selected as the head of the module says; 0 where there
        is no crank.
    drive_angle, rotation : ndarray
        Rotation of the driving crank from end to end, NaN without one; range of the coupler's
        angles; both from `METRICS_GRID.poses` positions [deg]. More exact values:
        `catalogue.guidance.drive`.
    rotates : ndarray of int
        Bit i: the crank of dyad i turns fully.
    fixed_box, box : ndarray, shape (n, 4)
        Bounding boxes (x0, y0, x1, y1) of the finite fixed pivots and rails, and of all finite
        pivots, rails and slots in mid-stroke. The origin is the middle of the stroke, the x axis
        runs along it; NaN where there is nothing to bound.
    travel : ndarray
        Longest travel of a slide over the stroke, see `catalogue.guidance.slides`; NaN with cranks
        only.
    slides : complex ndarray, shape (n, 2, 2)
        Ends of the rail or slot of each dyad in mid-stroke, as the guides are traced; NaN for a
        crank.
    """

    size: Floats
    max_link: Floats
    min_link: Floats
    max_ground: Floats
    max_arm: Floats
    min_transmission: Floats
    driver: Integers
    drive_angle: Floats
    rotation: Floats
    rotates: Integers
    fixed_box: Floats
    box: Floats
    travel: Floats
    slides: Complexes

    @property
    def at_pivot(self) -> Mask:
        """Whether the guided point is a moving pivot, shape (n,); lengths are in strokes."""
        return np.asarray(self.max_arm < LEAST_ARM)


def measure(
    guides: CouplerCurve | CircuitCurve,
    traced: Traced,
    poses: int = METRICS_GRID.poses,
    *,
    in_middle: bool = False,
    turning: bool = False,
    inverse: bool = False,
    driver: Integers | None = None,
) -> Measures:
    """Measure traced guides.

    Parameters
    ----------
    in_middle : bool
        Whether the reference position is mid-stroke; else pivots in mid-stroke are interpolated
        between the poses, with an error of a few thousandths of the size.
    turning : bool
        Whether the driver must turn fully; where no crank does, the one with the largest margin
        drives.
    driver : ndarray of int, shape (n,)
        Numbers of the driving cranks; 0: the better one.
    inverse : bool
        Whether the guides are inversions of linkages whose coupler carries a slot over a fixed
        point.  All measures are those of these linkages, over the same motion; `max_arm` is then
        the distance of the middle of the slot from the nearer moving pivot, and the boxes are in
        the frame of the slot in mid-stroke.
    """
    linkage, moving = guides.linkage, guides.motion
    point = guides.point + traced.shift
    share = 0.5 - 0.5 * np.cos(np.pi * np.arange(poses) / (poses - 1))
    t = traced.low + (traced.high - traced.low) * share[:, None]
    with np.errstate(all="ignore"):
        pose = moving.pose(t)
        path = pose.point(point)
        run = slide_runs(linkage, pose)
        middle = _middle(path, traced)
        still = guides.cusp | in_middle  # at a cusp the pivots are taken where the point turns
        slides = _move_to_middle(linkage, pose, slide_ends(linkage, run), middle, still)
        z = linkage.points
        at = [pose.point(z[:, i, 1]) for i in (0, 1)]
        machine, carried = linkage, at
        if inverse:
            machine, pose = of_machine(linkage, pose)
            carried = [pose.point(z[:, i, 0]) for i in (0, 1)]
        turns = rotates(machine)
        # bit values 1 and 2 are the numbers of the cranks
        may_drive = best_turning_cranks(machine) if turning else driver
        angle, drives, missed = transmission(machine, carried, pose.x, may_drive)
        drive_angle, rotation = _drive_angles(machine, carried, pose.x, drives)
        fixed = _finite_pivots(linkage, 0)
        now = np.stack([_at(m, middle) for m in at], axis=-1)
        now = np.where(still[:, None], z[:, :, 1], now)
        now = np.where(linkage.finite[:, :, 1], now, np.nan)
        pivots = np.concatenate([fixed, now], axis=1)
        size = _size(path, pivots, slides)
        wide = np.flatnonzero(traced.fit.is_wide)
        size[wide] = np.maximum(size[wide], _path_diameter(path[:, wide]))
        last = grid(poses - 1).coefficients[-2:]
        unsure = np.abs(times(last, path)).sum(0), *np.abs(times(last, run)).sum(0).T
        missed = np.maximum(missed, np.fmax.reduce(unsure) / size)
        rail, slot = rails(linkage, slides), slots(linkage, slides)
        if inverse:
            rail, slot = slot, rail
            fixed, now, point = now, fixed, np.where(guides.cusp, point, _at(path, middle))
        ends, pins = _finite_pivots(machine, 0), _finite_pivots(machine, 1)
        arm = np.fmin.reduce(np.abs(point[:, None] - pins), axis=1)
        ground = np.abs(np.diff(ends, axis=1)[:, 0])
        links = np.abs(np.stack([*(pins - ends).T, np.diff(pins, axis=1)[:, 0]]))
        centre = traced.fit.start + 0.5 * traced.fit.stroke * traced.fit.along
        fixed = np.concatenate([fixed, *np.moveaxis(rail, 1, 0)], axis=1)
        now = np.concatenate([now, *np.moveaxis(slot, 1, 0)], axis=1)
        fixed, now = ((p - centre[:, None]) * traced.fit.along.conj()[:, None] for p in (fixed, now))
    found = Measures(
        size,
        np.fmax.reduce(links),
        np.fmin.reduce(links),
        ground,
        arm,
        angle,
        drives,
        drive_angle,
        rotation,
        turns,
        _box(fixed),
        _box(np.concatenate([fixed, now], axis=1)),
        travels(slides),
        slides,
    )
    rough = np.flatnonzero(missed > METRICS_GRID.missed)
    if not len(rough) or poses >= METRICS_GRID.most:
        return found
    more = 4 * (poses - 1) + 1
    finer = measure(
        guides[rough],
        traced[rough],
        more,
        in_middle=in_middle,
        turning=turning,
        inverse=inverse,
        driver=None if driver is None else driver[rough],
    )
    return put(found, rough, finer)


def _move_to_middle(
    linkage: Linkage, pose: Pose, ends: Complexes, middle: tuple[Indices, Floats], still: Mask
) -> Complexes:
    """Move the ends of rails and slots (n, 2, 2) to mid-stroke, unless `still`."""
    ends = ends.copy()
    for i in (0, 1):
        some = np.flatnonzero((linkage.dyads[:, i] == RP) & ~still)
        if len(some):
            part = Pose(pose.d[:, some], pose.x[:, some], pose.origin[some])
            here = middle[0][some], middle[1][some]
            for k in (0, 1):
                ends[some, i, k] = _at(part.point(ends[some, i, k]), here)
    return ends


def _size(path: Complexes, pivots: Complexes, slides: Complexes) -> Floats:
    """Compute the diameter of paths, pivots (n, k) and slides, shape (n,)."""
    between = np.fmax.reduce(np.abs(pivots[:, :, None] - pivots[:, None, :]), axis=(1, 2))
    size = np.maximum(between, _reach(path, pivots))
    some = np.flatnonzero(np.isfinite(slides).any(axis=(1, 2)))
    if len(some):
        ends = slides[some].reshape(-1, 4)
        others = np.concatenate([pivots[some], ends], axis=1)
        between = np.fmax.reduce(np.abs(ends[:, :, None] - others[:, None, :]), axis=(1, 2))
        size[some] = np.maximum(size[some], np.maximum(between, _reach(path[:, some], ends)))
    return size


def _path_diameter(path: Complexes) -> Floats:
    """Compute the diameter of paths (m, n), interpolated between points, shape (n,)."""
    fine = times(grid(len(path) - 1).fine, path)
    most = np.zeros(path.shape[1])
    # places closer along the path than a quarter of it are not far apart
    for apart in range(len(fine) // 4, len(fine)):
        most = np.maximum(most, largest(np.abs(fine[apart:] - fine[:-apart])))
    return np.asarray(most)


def _reach(path: Complexes, pivots: Complexes) -> Floats:
    """Compute the largest distance of paths from pivots and from their own ends, (n,).

    Paths are given at Chebyshev points and interpolated; pivots may be NaN.
    """
    fine = times(grid(len(path) - 1).fine, path)
    places = np.concatenate([path[[0, -1]].T, pivots], axis=1)
    return np.asarray(np.fmax.reduce(largest(np.abs(fine[:, :, None] - places)), axis=1))


def transmission(
    linkage: Linkage, at: list[Complexes], x: Complexes, turns: Integers | None = None
) -> tuple[Floats, Integers, Floats]:
    """Compute the minimum transmission angle over the poses, shape (n,) [deg].

    Return also the number of the driving crank, and an estimate of the error of the sine between
    the poses. `turns` selects the cranks that may drive, bit i for dyad i; where none is selected
    both may. The better one drives. For the other parameters see `transmissions`.
    """
    (least, missed), may = transmissions(linkage, at, x), linkage.dyads.T == RR
    if turns is not None:
        full = may & (turns >> np.array([[0], [1]]) & 1).astype(bool)
        may = np.where(full.any(0), full, may)
    second = may[1] & (~may[0] | (least[1] > least[0]))
    angle = np.where(may.any(0), np.where(second, least[1], least[0]), np.maximum(*least))
    driver = np.where(may.any(0), np.where(second, 2, 1), 0)
    missed = np.where(driver > 0, missed[np.maximum(driver - 1, 0), np.arange(len(driver))], missed.max(0))
    return np.where(np.isnan(least[0] + least[1]), np.nan, angle), driver, missed


def transmissions(linkage: Linkage, at: list[Complexes], x: Complexes) -> tuple[Floats, Floats]:
    """Compute the minimum transmission angle over the poses with either dyad driving.

    The sine of the angle is interpolated between the poses, and its minimum by a parabola.

    Parameters
    ----------
    linkage : Linkage
    at : list of complex ndarray, shape (m, n) each
        Moving pivots, or any finite point of a slide, at Chebyshev points of the stroke [length].
    x : complex ndarray, shape (m, n)
        exp(i theta) - 1 of the coupler's angles there.

    Returns
    -------
    ndarray, shape (2, n)
        Angles [deg]; -1 for a dyad that is no crank, if the other is one.
    ndarray
        Error of the interpolated sine, from its last two Chebyshev coefficients.
    """
    kind = linkage.dyads
    points = grid(len(x) - 1)
    least, missed = [], []
    for driver, sine in enumerate(transmission_sines(linkage, at, x)):
        missed.append(np.abs(points.coefficients[-2:] @ sine).sum(axis=0))
        sine = points.fine @ sine
        through = (sine.min(axis=0) < 0) & (sine.max(axis=0) > 0)  # the motion passes a dead point
        smallest = np.clip(-largest(-np.abs(sine)), 0, 1)
        angle = np.where(through, 0.0, np.degrees(np.arcsin(smallest)))
        no_crank = (kind != RR).all(1)
        least.append(np.where((kind[:, driver] == RR) | no_crank, angle, -1.0))
    return np.stack(least), np.stack(missed)


def transmission_sines(linkage: Linkage, at: list[Complexes], x: Complexes) -> Floats:
    """Compute the sines of the transmission angles with either dyad driving, shape (2, m, n)."""
    z, kind = linkage.points, linkage.dyads
    sines = []
    for driver in (0, 1):
        other = 1 - driver
        ray = _select_by_kind(kind[:, other], at[other] - z[:, other, 0], z[:, other, 0], z[:, other, 1] * (1 + x))
        contact = np.where(kind[:, other] == RP, z[:, other, 0], at[other])
        arm = np.where(kind[:, driver] == RP, z[:, driver, 1] * (1 + x), contact - at[driver])
        with np.errstate(all="ignore"):
            sines.append((arm.conj() * ray).imag / (np.abs(arm) * np.abs(ray)))
    return np.stack(sines)


def _finite_pivots(linkage: Linkage, plane: int) -> Complexes:
    """Return the fixed (0) or moving (1) pivots, shape (n, 2); NaN for those at infinity."""
    return np.where(linkage.finite[:, :, plane], linkage.points[:, :, plane], complex(np.nan, np.nan))


def _drive_angles(linkage: Linkage, at: list[Complexes], x: Complexes, driver: Integers) -> tuple[Floats, Floats]:
    """Compute the rotation of the driving crank, and the range of the coupler's angle [deg].

    Rotations are accumulated from pose to pose, so that those beyond 180 degrees are counted.
    """
    second = driver == 2
    spoke = np.where(second, at[1], at[0]) - np.where(second, linkage.points[:, 1, 0], linkage.points[:, 0, 0])
    crank = np.abs(np.angle(spoke[1:] * spoke[:-1].conj()).sum(0))
    coupler = np.angle((1 + x[1:]) * (1 + x[:-1]).conj()).cumsum(0)
    rotation = np.maximum(coupler.max(0), 0.0) - np.minimum(coupler.min(0), 0.0)
    return np.where(driver > 0, np.degrees(crank), np.nan), np.degrees(rotation)


def middle_of_stroke(moving: Motion, point: Complexes, traced: Traced, cusp: Mask) -> Floats:
    """Solve for the parameter of mid-stroke, or of the cusp, shape (n,)."""
    start, end = traced.low, traced.high
    middle = traced.fit.start + 0.5 * traced.fit.stroke * traced.fit.along
    path = moving.point(point, traced.fit.along)
    offset = ((point - middle) * traced.fit.along.conj()).real
    with np.errstate(all="ignore"):
        f0, f1 = path(np.stack([start, end]))[0] + offset
        close = 16 * np.finfo(f1.dtype).eps * (traced.fit.stroke + np.abs(offset))
        t, _ = false_position(lambda t: path(t[None])[0][0] + offset, start, end, f0, f1, close, steps=60)
    return np.where(cusp, 0.0, t)


def _middle(path: Complexes, traced: Traced) -> tuple[Indices, Floats]:
    """Return the index of the pose before mid-stroke, and the fraction of the step to it."""
    run = ((path - traced.fit.start) * traced.fit.along.conj()).real - 0.5 * traced.fit.stroke
    k = np.clip((run < 0).sum(0) - 1, 0, len(run) - 2)
    a, b = (np.take_along_axis(run, (k + j)[None], 0)[0] for j in (0, 1))
    return k, np.where(b != a, -a / np.where(b != a, b - a, 1), 0.0)


def _at(values: Complexes, middle: tuple[Indices, Floats]) -> Complexes:
    k, share = middle
    a, b = (np.take_along_axis(values, (k + j)[None], 0)[0] for j in (0, 1))
    return np.asarray(a + share * (b - a))


def _box(p: Complexes) -> Floats:
    return np.stack(
        [np.fmin.reduce(p.real, 1), np.fmin.reduce(p.imag, 1), np.fmax.reduce(p.real, 1), np.fmax.reduce(p.imag, 1)], 1
    )
