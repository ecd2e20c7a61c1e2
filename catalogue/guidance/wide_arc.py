"""Arcs near a half circle and beyond: guides on their circuits, over windows of an angle.

Along such an arc a point runs to and fro in the direction of its chord, and a small error rotates
the chord by a large angle. So a window is defined by angles instead: it ends where the point, as
seen from the centre of the mean circle, has moved half the angle from the middle of the path,
either way. The mean circle has the given radius and the least mean square distance from the path.
The deviation is measured from the best-placed circle. That circle cannot define the window, as its
centre is not unique where the ends of a path are opposite each other. The motion passes dead
points, and full turns of a crank, so its parameter is the phase of the circuit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..kinematics.batch import Columns
from ..kinematics.circuits import OPEN, Circuits, circuits
from ..kinematics.linkage import Linkage
from ..kinematics.types import Complexes, Floats
from .best_circle import best_placed, by_length, mean_centre
from .circuit_curve import MIDDLE, CircuitCurve, CircuitMotion
from .coupler_curve import false_position
from .minimum_zone import Fit, Grid, grid, resolved
from .trace import MAX_GRID_ERROR, Traced


class WideArc(NamedTuple):
    """Options of windows along wide arcs."""

    #: Number of steps either way that bracket the ends of a window: none turns a path by more than
    #: a fifth of a turn.
    steps: int = 64
    #: Total length of these steps either way [periods]: an arc of 350 degrees may take most of a
    #: period on one side.
    farthest: float = 0.8
    nodes: int = 32  #: intervals between the Chebyshev points of a window in a search
    finer: int = 128  #: largest number of these intervals, which is doubled where they do not resolve the deviation
    shown: int = 128  #: number of intervals at which the deviation of an answer is measured
    most: int = 512  #: largest number of intervals for an answer
    #: Largest number of corrections of a window, each to the mean circle of the path between its
    #: last ends.
    rounds: int = 10
    reached: float = 1e-12  #: displacement of an end by a correction below which the iteration stops [rad]
    missed: float = 1e-9  #: accepted error of a window where `reached` is not met [rad]
    difference: float = 1e-6  #: step of difference quotients [rad]


WIDE_ARC = WideArc()


@dataclass(frozen=True)
class WideArcs(Columns):
    """n windows of circuits along arcs; arrays of shape (n,).

    Attributes
    ----------
    middle, start, end : ndarray
        Phases of the middle of the path, its start and its end; the end lies before the start where
        the point runs along the arc against the phase [rad].
    fit : Fit
        The nominal is the best-placed arc of the radius, which bulges to the left of its direction;
        the deviation is NaN where the point does not run forward along the whole arc.
    """

    middle: Floats
    start: Floats
    end: Floats
    fit: Fit

    @property
    def centre(self) -> Complexes:
        """Centres of the nominals, shape (n,)."""
        return self.fit.centre


def wide_arcs(
    some: Circuits,
    point: Complexes,
    middle: Floats,
    centre: Complexes,
    radius: Floats,
    angle: float,
    *,
    nodes: int = WIDE_ARC.nodes,
    most: int = WIDE_ARC.finer,
) -> WideArcs:
    """Trace coupler points (n,) of circuits over arcs whose middles they pass at phases (n,).

    Parameters
    ----------
    centre : complex ndarray, shape (n,)
        Approximate centres of the arcs.
    radius : ndarray, shape (n,)
        Radii of the arcs [length].
    angle : float
        Angle of the arcs [deg].
    nodes, most : int
        First and largest number of intervals between Chebyshev points.
    """
    half = 0.5 * np.radians(angle)
    with np.errstate(all="ignore"):
        ends, way = _bracket_ends(some, point, middle, centre, half)
        points = grid(nodes)
        for _ in range(WIDE_ARC.rounds):
            z = _path(some, point, ends, points)
            centre = mean_centre(z, radius, centre, by_length(z))
            ends, off = _correct_ends(some, point, middle, centre, half * way, ends)
            if not (off > WIDE_ARC.reached).any():
                break
        found = _measure(some, point, middle, ends, way, centre, radius, angle, points)
        rough = np.flatnonzero(np.isfinite(found.fit.deviation) & ~resolved(found.fit))
        if len(rough) and nodes < most:
            finer = wide_arcs(
                some[rough],
                point[rough],
                middle[rough],
                centre[rough],
                radius[rough],
                angle,
                nodes=2 * nodes,
                most=most,
            )
            return found.replaced(rough, finer)
        sure = resolved(found.fit, *MAX_GRID_ERROR)
    return replace(found, fit=replace(found.fit, deviation=np.where(sure, found.fit.deviation, np.nan)))


def _path(some: Circuits, point: Complexes, ends: Floats, points: Grid) -> Complexes:
    """Return coupler points (m, n) at the nodes between phases (2, n)."""
    low, high = ends
    return np.asarray(some.pose(0.5 * (high + low) + 0.5 * (high - low) * points.nodes[:, None]).point(point))


def _bracket_ends(
    some: Circuits, point: Complexes, middle: Floats, centre: Complexes, half: float
) -> tuple[Floats, Floats]:
    """Solve for the ends of windows about given centres.

    Returns
    -------
    ndarray, shape (2, n)
        Phases before and after the middle at which points have passed `half` an arc, NaN if never
        [rad].
    ndarray, shape (n,)
        1 where points run counterclockwise with increasing phase, else -1.
    """
    share = np.linspace(-WIDE_ARC.farthest, WIDE_ARC.farthest, 2 * WIDE_ARC.steps + 1)[:, None]
    s = middle + share * some.period
    s = np.where(some.kind == OPEN, np.clip(s, 0.0, 2 * np.pi), s)
    z = some.pose(s).point(point)
    seen = (z - centre) / (z[WIDE_ARC.steps] - centre)
    turned = np.unwrap(np.angle(seen), axis=0)
    turned -= turned[WIDE_ARC.steps]
    way = np.where(turned[WIDE_ARC.steps + 1] < turned[WIDE_ARC.steps - 1], -1.0, 1.0)
    turned *= way
    column, ends = np.arange(len(middle)), []
    for side in (-1, 1):
        gone = side * turned[WIDE_ARC.steps :] if side > 0 else side * turned[WIDE_ARC.steps :: -1]
        phases = s[WIDE_ARC.steps :] if side > 0 else s[WIDE_ARC.steps :: -1]
        beyond = gone >= half
        k = np.maximum(beyond.argmax(0), 1)
        ray = np.exp(1j * side * way * half) * (z[WIDE_ARC.steps] - centre)

        def missing(t: Floats, ray: Complexes = ray, side: int = side) -> Floats:
            there = some.pose(t[None]).point(point)[0]
            return np.asarray(side * way * np.angle((there - centre) / ray))

        t, _ = false_position(
            missing,
            phases[k - 1, column],
            phases[k, column],
            gone[k - 1, column] - half,
            gone[k, column] - half,
            np.full(len(middle), WIDE_ARC.reached),
            steps=12,
        )
        ends.append(np.where(beyond.any(0), t, np.nan))
    return np.stack(ends), way


def _correct_ends(
    some: Circuits, point: Complexes, middle: Floats, centre: Complexes, half: Floats, ends: Floats
) -> tuple[Floats, Floats]:
    """Take a Newton step of the ends of windows, whose centres have moved.

    Returns
    -------
    ndarray, shape (2, n)
        Phases of the ends [rad].
    ndarray, shape (n,)
        Angular error of the ends before the step [rad].
    """
    step = WIDE_ARC.difference
    side = np.array([[-1.0], [1.0]])
    z = some.pose(np.concatenate([middle[None], ends, ends + step])).point(point)
    ray = (z[0] - centre) * np.exp(1j * side * half)
    off, after = np.angle((z[1:3] - centre) / ray), np.angle((z[3:] - centre) / ray)
    moved = ends - off * step / np.angle(np.exp(1j * (after - off)))
    bounded = np.where(some.kind == OPEN, np.clip(moved, 0.0, 2 * np.pi), moved)
    return bounded, np.abs(off).max(0)


def _measure(
    some: Circuits,
    point: Complexes,
    middle: Floats,
    ends: Floats,
    way: Floats,
    centre: Complexes,
    radius: Floats,
    angle: float,
    points: Grid,
) -> WideArcs:
    """Return windows with their nominals and deviations."""
    z, half, n = _path(some, point, ends, points), 0.5 * np.radians(angle), len(middle)
    spoke = z - centre
    turned = np.angle(spoke[1:] / spoke[:-1])
    forward = (way * turned * radius > MIDDLE.turning * np.abs(np.diff(z, axis=0))).all(0)
    whole = np.abs(np.abs(turned.sum(0)) - 2 * half) < WIDE_ARC.missed
    top = some.pose(middle[None]).point(point)[0] - centre
    top = top / np.abs(top)
    circles = best_placed(z, radius, centre, points)
    centre, deviation = circles.centre, np.where(forward & whole, circles.deviation, np.nan)
    fit = Fit(
        deviation,
        2 * radius * np.sin(half),
        centre + radius * top * np.exp(1j * half),
        -1j * top,
        -1 / radius,
        radius * (1 - np.cos(half)) * np.ones(n),
        circles.unresolved,
    )
    start, end = np.where(way < 0, ends, ends[::-1])
    return WideArcs(middle, start, end, fit)


def along_circuits(linkage: Linkage, point: Complexes) -> CircuitCurve:
    """Return coupler curves (n,) along circuits, for guides in mid-stroke."""
    every = circuits(linkage)
    here = every[np.flatnonzero(np.diff(every.of, prepend=-1) != 0)]  # the circuit of the given position comes first
    n = len(linkage)
    return CircuitCurve(CircuitMotion(here, here.phase, np.ones(n, complex), np.zeros(n, complex)), point)


def on_wide_arcs(some: Circuits, point: Complexes, found: WideArcs) -> tuple[CircuitCurve, Traced]:
    """Move coupler points of circuits from the positions given with the linkages to mid-arc."""
    n = len(found.middle)
    moving = CircuitMotion(some, found.middle, np.ones(n, complex), np.zeros(n, complex))
    guided = some.pose(found.middle[None]).point(point)[0]
    low, high = found.start - found.middle, found.end - found.middle
    return CircuitCurve(moving, guided), Traced(found.fit, 0 * guided, low, high)


def traced_about(
    curve: CircuitCurve,
    centre: Complexes,
    radius: Floats,
    angle: float,
    nodes: int = WIDE_ARC.nodes,
    most: int = WIDE_ARC.finer,
) -> Traced:
    """Trace guides given in the middles of their arcs; for parameters see `wide_arcs`."""
    moving = curve.motion
    found = wide_arcs(
        moving.circuits, curve.point, moving.middle, centre, radius, angle, nodes=nodes, most=max(nodes, most)
    )
    return Traced(found.fit, 0 * curve.point, found.start - moving.middle, found.end - moving.middle)
