"""Figures of one placed guide, on a fine grid of its finite motion: nothing of it comes from `catalogue`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from independent import (
    BAR,
    SLIDE,
    SLIDER,
    Array,
    Guides,
    angle_of_turn,
    arc,
    dot,
    least_angle,
    posed,
    sines,
    strip,
    turning,
)
from independent_scatter import DRAWS, allowance

#: Stations along the path.
FINE = 2001
#: A transmission angle below which a linkage is at a dead point [deg].
DEAD = 0.01
#: Best and worst value of each part of the score: lengths in strokes, degrees, deviations.
DESIRES = {
    "size": (1.0, 6.0), "transmission": (60.0, 15.0), "allowance": (2.0, 0.0),
    "min_link": (0.25, 0.05), "ground": (0.25, 0.05), "travel": (0.5, 1.0),
}  # fmt: skip
#: Figures bounded from above and from below, by the name of the bound, and what they are measured in: a length, 90
#: degrees, or 1.
BOUNDS = {
    "max_size": "size", "max_link": "max_link", "min_link": "min_link", "max_ground": "ground", "min_ground": "ground",
    "max_arm": "max_arm", "max_travel": "travel", "min_allowance": "allowance", "min_transmission": "transmission",
    "min_transmission_turn": "transmission_turn", "max_rotation": "rotation", "max_drive_angle": "drive_angle",
    "min_drive_angle": "drive_angle", "min_uniformity": "uniformity", "min_advantage": "advantage",
}  # fmt: skip
ANGLES = ("transmission", "transmission_turn", "rotation", "drive_angle")
RATIOS = ("uniformity", "advantage")


@dataclass(frozen=True)
class Figures:
    """What one placed guide is worth, in the unit of its pivots.

    Attributes
    ----------
    deviation : float
        Half the width of the narrowest strip or annulus, or the largest distance from the best-placed arc of a radius.
    radius : float or None
        Of that arc, negative if it bulges to -y; None for a line.
    size : float
        Diameter of the finite pivots, rails, slots and the path.
    max_link, min_link, ground, max_arm, travel : float or None
        Longest and shortest of the cranks and the coupler; distance of the fixed pivots; distance of the guided point
        from the nearer moving pivot; longest way of a slide along its line.
    transmission : float
        Least over the stroke, the better crank driving, or that which turns fully [deg].
    transmission_turn : float
        The same over its whole turn; 0: it does not turn fully; NaN: not known.
    turning : float
        By how much the crank turns fully that does so best [length]; negative: none does; NaN: not known.
    rotation, drive_angle : float
        Ranges of the angles of the coupler and of the driving crank [deg].
    uniformity, advantage : float
        Least over largest speed of the guided point, the driver turning steadily; least speed of the driving crank pin
        over that of the guided point.
    fixed, moving : complex ndarray
        Finite pivots in mid-stroke with the ends of rails (fixed) and slots (moving).
    segments : complex ndarray, shape (m, k, 2)
        Ends of the k segments of all links, rails and slots at the stations.
    off : float
        Largest distance of the ends of the path from (0, 0) and (stroke, 0), and of the guided point from x = stroke/2.
    allowance : float
        Scatter of the pivots that the path forgives; NaN: not looked at, or not known.
    """

    deviation: float
    radius: float | None
    size: float
    max_link: float | None
    min_link: float | None
    ground: float | None
    max_arm: float | None
    travel: float | None
    transmission: float
    transmission_turn: float
    turning: float
    rotation: float
    drive_angle: float
    uniformity: float
    advantage: float
    fixed: Array
    moving: Array
    segments: Array
    off: float
    allowance: float = np.nan


@dataclass(frozen=True)
class Course:
    """A guide followed from x = 0 to x = 1: path, unit vector of the coupler and angle of what turns it, (m,) each;
    least transmission angle [deg]."""

    path: Array
    turn: Array
    angle: Array
    transmission: float


Pivots = Any
#: Guided point, unit vector of the coupler and sine of the transmission angle, at angles.
Moves = Callable[[Array], tuple[Array, Array, Array]]


def measured(
    pivots: Pivots, guided: Any, stroke: float, *, circle: bool, radius: float | None = None, turns: bool = False,
    stations: int = FINE, tolerance: float | None = None, draws: int = DRAWS,
) -> Figures | None:  # fmt: skip
    """Measure one placed linkage; None where its path cannot be followed from x = 0 to x = stroke.

    It is by turning a crank, or the coupler if no crank gets beyond a dead point; at a change point in mid-stroke along
    the branch with the least deviation.

    Parameters
    ----------
    pivots : (2, 2, 3) numbers
        Dyad, (fixed, moving), (x, y, w); w = 0 at infinity: of a fixed pivot the normal of the slider's line, of a
        moving one the normal of a line of the coupler.
    guided : (x, y)
        Guided point in mid-stroke.
    radius : float, optional
        That an arc must have.
    turns : bool
        Whether what drives is a crank that turns fully, where there is one.
    tolerance : float, optional
        Deviation for which the allowance is measured.
    draws : int
        Machines that are drawn for it.
    """
    place, finite, point = _places(pivots, guided, stroke)
    best, driver, mark = None, 0, (False, -1.0)
    for first in (0, 1):
        if finite[first].all() or not finite.all(axis=1).any():
            order = [first, 1 - first]
            found = _followed(_moves(place[order], finite[order], point), stations)
            guide = _guide(place[order], finite[order], point)
            own = turns and guide is not None and bool(turning(guide)[0, 0] >= 0)
            if found is not None and (own, found.transmission) > mark:
                best, driver, mark = found, first, (own, found.transmission)
    if best is None or best.transmission < DEAD:
        order = [0, 1] if finite[0].all() else [1, 0]
        ways = [] if best is None else [best]
        if finite[order[0]].all() and finite[:, 1].all():
            for turn in (
                _turned(place[order], finite[order], point, side, flip) for side in (1, -1) for flip in (0, 1)
            ):
                found = _followed(turn, stations)
                if found is not None:
                    ways.append(found)
        if not ways:
            return None
        best = min(ways, key=lambda way: arc(_up(way.path))[0] if circle else strip(way.path)[0])
        best = Course(best.path, best.turn, best.angle, 0.0)
    order = [driver, 1 - driver]
    return _summed(place[order], finite[order], point, best, stroke, circle, radius, tolerance, draws)


def guide_of(pivots: Pivots, guided: Any, stroke: float) -> Guides:
    """Return a linkage of one of the families as a guide in strokes; its first dyad is a crank."""
    z, finite, point = _places(pivots, guided, stroke)
    order = [0, 1] if finite[0].all() else [1, 0]
    guide = _guide(z[order], finite[order], point)
    if guide is None:
        raise ValueError("no four-bar, slider-crank or inverted slider-crank")
    return guide


def _places(pivots: Pivots, guided: Any, stroke: float) -> tuple[Array, Array, complex]:
    """Return pivots and unit normals, which pivots are finite, (2, 2) each, and the guided point, in strokes."""
    z = np.asarray(pivots, float)
    place, finite = z[..., 0] + 1j * z[..., 1], z[..., 2] != 0
    place = np.where(finite, place / np.where(finite, z[..., 2], 1) / stroke, place / np.abs(place))
    return place, finite, complex(*guided) / stroke


def _guide(z: Array, finite: Array, point: complex) -> Guides | None:
    """Return a guide of a family whose crank is the first dyad, None of others."""
    if not finite[0].all() or not finite[1].any():
        return None
    (a, b), (c, d) = z.tolist()
    fixed, pin, other, end, guided = (np.array([v]) for v in (a, b, c, d, point))
    family = BAR if finite[1].all() else SLIDER if finite[1, 1] else SLIDE
    return Guides(fixed, pin, other, end, guided, family)


def _moves(z: Array, finite: Array, point: complex) -> Moves:
    """Return the motion by angles of the first dyad's crank, or of the coupler if that is none, in strokes."""
    guide = _guide(z, finite, point)

    def slides(angle: Array) -> tuple[Array, Array, Array]:
        """No crank: two lines for the guided point at each turn of the coupler."""
        turn = np.exp(1j * angle)
        normals, offsets = [], []
        for (fixed, moving), (stays, _) in zip(z.tolist(), finite.tolist(), strict=True):
            if not stays:  # a pivot of the coupler on a fixed line
                normals.append(fixed + 0 * turn)
                offsets.append(dot(fixed, moving) - dot(fixed, turn * (moving - point)))
            else:  # a line of the coupler through a fixed point
                normals.append(turn * moving)
                offsets.append(dot(turn * moving, fixed) - dot(moving, fixed - point))
        (n, m), (e, f) = normals, offsets
        path = 1j * (n * f - m * e) / (n.conj() * m).imag
        (_, b), (_, d) = z.tolist()
        at = [path + turn * (w - point) for w in (b, d)]
        hold = [at[i] if finite[i, 1] else z[i, 0] + 0 * turn for i in (0, 1)]
        arm = turn * b if not finite[0, 1] else hold[1] - at[0]
        return path, turn, sine_between(arm, normals[1])

    def cranks(angle: Array) -> tuple[Array, Array, Array]:
        assert guide is not None
        poses = posed(guide, angle)
        return poses.p, poses.turn, sines(guide, poses)[0]

    return cranks if guide is not None else slides


def _turned(z: Array, finite: Array, point: complex, side: int, flip: int) -> Moves:
    """Return the motion by angles of the coupler; `flip` changes the side on which the circles meet when the coupler
    comes through mid-stroke, as it does at a change point."""
    (a, b), (c, d) = z.tolist()

    def moves(angle: Array) -> tuple[Array, Array, Array]:
        turn = np.exp(1j * angle)
        at, r = side * (np.where(angle < 0, -1, 1) if flip else 1), abs(b - a)
        if finite[1, 0]:
            apart = c - turn * (d - b) - a
            along = 0.5 * (np.abs(apart) + (r**2 - abs(d - c) ** 2) / np.abs(apart))
            way = apart / np.abs(apart)
        else:
            way, along = c + 0 * turn, dot(c, d - turn * (d - b) - a)
        square = r**2 - along**2
        first = a + way * (along + 1j * at * np.sqrt(np.where(square > -1e-13 * r**2, np.maximum(square, 0), square)))
        path = first + turn * (point - b)
        start = abs(a - b + way.ravel()[0] * (along + 1j * at * np.sqrt(np.maximum(square, 0))).ravel()[0])
        # the first angle asked for is 0: not the reference position if the circles meet on the other side
        good = angle.ravel()[0] != 0 or start < 1e-6 * r
        return (path if good else np.nan * path), turn, np.ones(angle.shape)

    return moves


def _up(path: Array) -> Array:
    """Return a path mirrored, if need be, so that it bulges to +y."""
    return path if path[len(path) // 2].imag > 0.5 * (path[0].imag + path[-1].imag) else path.conj()


def sine_between(a: Array, b: Array) -> Array:
    """Return the sine of the angle from one vector to another."""
    sine: Array = (np.conj(a) * b).imag / (np.abs(a) * np.abs(b))
    return sine


def _followed(moves: Moves, stations: int) -> Course | None:
    """Return the way from x = 0 to x = 1; None if it cannot be followed."""
    steps = np.linspace(0, 2 * np.pi, 6001)[:, None]
    with np.errstate(all="ignore"):
        ends = []
        here = float(moves(steps[:1])[0].real[0, 0])
        for target in (0.0, 1.0):
            found = []
            for sign in (1, -1):
                x = moves(sign * steps)[0].real[:, 0]
                ahead = (x - target) * np.sign(target - here)
                beyond = np.flatnonzero(~(ahead < 0))
                if not beyond.size or not ahead[beyond[0]] >= 0 or not (np.diff(ahead[: beyond[0] + 1]) > 0).all():
                    continue
                low, high = steps[max(beyond[0] - 1, 0), 0], steps[beyond[0], 0]
                for _ in range(60):
                    middle = 0.5 * (low + high)
                    value = (moves(np.array([[sign * middle]]))[0].real[0, 0] - target) * np.sign(target - here)
                    low, high = (middle, high) if value < 0 else (low, middle)
                found.append(sign * high)
            if not found:
                return None
            ends.append(found)
        pair = next(((i, j) for i in ends[0] for j in ends[1] if (i < 0) != (j < 0)), None)
        if pair is None:
            return None
        share = 0.5 - 0.5 * np.cos(np.pi * np.arange(stations) / (stations - 1))[:, None]
        angle = pair[0] + (pair[1] - pair[0]) * share
        path, turn, sine = moves(angle)
    if not np.isfinite(path).all():
        return None
    return Course(path[:, 0], turn[:, 0], angle[:, 0], float(least_angle(sine)[0]))


def _summed(
    z: Array, finite: Array, point: complex, way: Course, stroke: float, circle: bool, radius: float | None,
    tolerance: float | None, draws: int,
) -> Figures:  # fmt: skip
    """Return the figures of a guide, in strokes but for `stroke`, `radius` and `tolerance`."""
    (a, b), (c, d) = z.tolist()
    path, given = way.path, radius
    if circle:
        bulge = np.sign(path[len(path) // 2].imag - 0.5 * (path[0].imag + path[-1].imag)) or 1.0
        deviation, _, fitted = arc(path if bulge > 0 else path.conj(), None if radius is None else radius / stroke)
        flat = strip(path)[0] if radius is None else np.inf  # an arc of radius infinity
        deviation, radius = min(deviation, flat), float(bulge * fitted * stroke)
        if radius is not None and flat < np.inf and deviation == flat:
            radius = float(bulge * np.inf)
    else:
        deviation = strip(path)[0]
        radius = None
    rails, slots, travel = _slides(z, finite, point, way)
    fixed, moving = np.array([*z[:, 0][finite[:, 0]], *rails]), np.array([*z[:, 1][finite[:, 1]], *slots])
    points = np.concatenate([fixed, moving, path[:: max(1, len(path) // 100)], path[-1:]])
    links = [abs(p - q) for p, q, whole in ((a, b, finite[0].all()), (c, d, finite[1].all()),
                                            (b, d, finite[:, 1].all())) if whole]  # fmt: skip
    arms = [abs(point - q) for q, whole in zip((b, d), finite[:, 1], strict=True) if whole]
    turns = whole_turn = allowed = np.nan
    if (guide := _guide(z, finite, point)) is not None:
        turns, whole_turn = float(np.nanmax(turning(guide))), angle_of_turn(guide)
        if tolerance is not None:
            own = 0.0 if not circle else None if given is None else given / stroke
            allowed = allowance(guide, tolerance / stroke, own, draws)
    off = max(abs(path[0]), abs(path[-1] - 1), abs(point.real - 0.5))
    rotation = np.degrees(np.ptp(np.unwrap(np.angle(way.turn))))
    drive, uniform, advantage = np.nan, np.nan, np.nan
    if finite[0].all() and way.transmission >= DEAD:
        speed = np.abs(np.gradient(path, way.angle, edge_order=2))
        drive = float(np.degrees(np.ptp(way.angle)))
        uniform, advantage = float(speed.min() / speed.max()), float(abs(b - a) / speed.max())

    def scaled(values: list[float], pick: Callable[[list[float]], float]) -> float | None:
        return float(pick(values)) * stroke if values else None

    return Figures(
        float(deviation) * stroke, radius, float(np.abs(points[:, None] - points).max()) * stroke, scaled(links, max),
        scaled(links, min), abs(a - c) * stroke if finite[:, 0].all() else None, scaled(arms, min),
        None if travel is None else travel * stroke, way.transmission, whole_turn, turns * stroke, float(rotation),
        drive, uniform, advantage, fixed * stroke, moving * stroke,
        _segments(z, finite, point, way, rails, slots) * stroke, off * stroke, allowed * stroke,
    )  # fmt: skip


def _slides(z: Array, finite: Array, point: complex, way: Course) -> tuple[list[complex], list[complex], float | None]:
    """Return the ends of rails and of slots in mid-stroke, and the longest travel."""
    rails: list[complex] = []
    slots: list[complex] = []
    travels = []
    for (fixed, moving), (stands, carried) in zip(z.tolist(), finite.tolist(), strict=True):
        if stands and carried:
            continue
        if carried:  # a pivot along a line of the frame
            home, along = moving, 1j * fixed
            places = way.path + way.turn * (moving - point)
        else:  # the fixed pivot along a line of the coupler, as that sees it
            home, along = fixed, 1j * moving
            places = point + (fixed - way.path) / way.turn
        run = dot(along, places - home)
        (rails if carried else slots).extend([home + along * run.min(), home + along * run.max()])
        travels.append(float(np.ptp(run)))
    return rails, slots, max(travels, default=None)


def _segments(
    z: Array, finite: Array, point: complex, way: Course, rails: list[complex], slots: list[complex]
) -> Array:
    """Return the ends of all segments, (m, k, 2): cranks, rails, and what joins pivots, guided point and slots of the
    coupler, of a slide its fixed pivot too."""
    still = np.ones(len(way.path))

    def carried(w: complex) -> Array:
        return way.path + way.turn * (w - point)

    pins = [carried(m) if whole else f * still for (f, m), whole in zip(z.tolist(), finite[:, 1], strict=True)]
    plate = [*pins, way.path, *(carried(w) for w in slots)]
    found = [(p, q) for i, p in enumerate(plate) for q in plate[i + 1 :]]
    found += [(z[i, 0] * still, pins[i]) for i in (0, 1) if finite[i].all()]
    found += [(rails[i] * still, rails[i + 1] * still) for i in range(0, len(rails), 2)]
    return np.array(found).transpose(2, 0, 1)


# -- what is asked ----------------------------------------------------------------------------------------------------
def boxed(box: Any) -> tuple[float, float, float, float]:
    """Return x0, x1, y0, y1 of a box given by two corners."""
    (x0, x1), (y0, y1) = sorted(box[::2]), sorted(box[1::2])
    return x0, x1, y0, y1


def outside(box: Any, z: Array) -> Array:
    """Return by how much places are out of a box, negative inside."""
    x0, x1, y0, y1 = boxed(box)
    return np.asarray(np.max([x0 - z.real, z.real - x1, y0 - z.imag, z.imag - y1], axis=0))


def apart(box: Any, p: Array, q: Array) -> Array:
    """Return the gap of segments from a box along the axis that separates them best; negative: they overlap so far."""
    x0, x1, y0, y1 = boxed(box)
    corners = np.array([x0 + 1j * y0, x1 + 1j * y0, x1 + 1j * y1, x0 + 1j * y1])
    gaps = [np.minimum(p.real, q.real) - x1, x0 - np.maximum(p.real, q.real),
            np.minimum(p.imag, q.imag) - y1, y0 - np.maximum(p.imag, q.imag)]  # fmt: skip
    length = np.abs(q - p)
    normal = np.where(length > 0, 1j * (q - p) / np.where(length > 0, length, 1), 1)
    across = [dot(normal, corner - p) for corner in corners]
    gaps += [np.min(across, axis=0), -np.max(across, axis=0)]
    return np.asarray(np.max(gaps, axis=0))


def violations(m: Figures, constraints: Mapping[str, Any], asked: float, stroke: float) -> dict[str, float]:
    """Return by how much a guide breaks each constraint, in strokes (degrees over 90), positive where it does.

    Constraints are named as by `catalogue.Catalogue.find`; families and the like are not looked at.

    Parameters
    ----------
    asked : float
        Largest deviation.
    """
    out = {"deviation": (m.deviation - asked) / stroke}
    for name, figure in BOUNDS.items():
        bound, value = constraints.get(name), getattr(m, figure)
        if bound is None or value is None:
            continue
        unit = 90 if figure in ANGLES else 1 if figure in RATIOS else stroke
        by = (value - bound if name.startswith("max_") else bound - value) / unit
        out[name] = by if np.isfinite(by) else np.inf
    if constraints.get("full_rotation") or constraints.get("min_transmission_turn"):
        out["full_rotation"] = -m.turning / stroke
    for name, places in (("fixed_pivots_in", m.fixed), ("pivots_in", np.concatenate([m.fixed, m.moving])),
                         ("swept_in", m.segments)):  # fmt: skip
        box = constraints.get(name)
        if box is not None:
            out[name] = float(outside(box, places).max(initial=-np.inf)) / stroke
    for box in constraints.get("keep_out", ()):
        gap = float(apart(box, m.segments[..., 0], m.segments[..., 1]).min()) / stroke
        out["keep_out"] = max(out.get("keep_out", -np.inf), -gap)
    return out


def cost(m: Figures, rank_by: str, stroke: float, turns: bool, asked: float) -> float:
    """Return what is ranked by, less is better: lengths in strokes, balance and transmission in their own unit, of a
    score what is missing to 1; where a crank is to turn fully its transmission angle is that over the turn."""
    angle = m.transmission_turn if turns else m.transmission
    if rank_by == "size":
        return m.size / stroke
    if rank_by == "balance":
        return m.size / stroke - angle / 90
    if rank_by == "transmission":
        return 1 - angle / 90
    if rank_by == "deviation":
        return m.deviation / stroke
    if rank_by == "score":
        values = {"size": m.size / stroke, "transmission": angle, "allowance": m.allowance / asked}
        values |= {k: v / stroke for k in ("min_link", "ground", "travel") if (v := getattr(m, k)) is not None}
        parts = [np.clip((values[k] - worst) / (best - worst), 0, 1) if k in values else 1.0
                 for k, (best, worst) in DESIRES.items()]  # fmt: skip
        return float(1 - np.prod(parts) ** (1 / len(parts)))
    raise ValueError(f"no cost is known for {rank_by!r}")
