"""Sweep several drives along a path or over a grid, with scalars held at given values.

A grid is swept drive by drive: each sweep starts from all poses of the one before.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...errors import CannotDrive, NotMovable
from ...kinematics.types import Array
from .curve import Curve, tangents
from .elements import Scalar, title
from .motion import Motion
from .paths import Course, corrected, follow
from .rank import RANK_TOLERANCE, SINGULAR, UNMET_CONDITIONS, drop_violating
from .request import Drives
from .sweeping import swept

if TYPE_CHECKING:
    from .mechanism import Mechanism
    from .system import System

#: Largest slope of a stationary drive, per arc length.
STATIONARY_SLOPE = 1e-7
#: Reason for the end of a path: its values have no pose in this assembly.
DEAD_POINT = "dead point"


class Poses(NamedTuple):
    """States (N, numbers), their scalars (N, f), and their mechanisms (N,)."""

    states: Array
    values: Array
    owner: Array


def sweep(mechanism: Mechanism, drives: Drives, grid: bool) -> Motion:
    """Sweep a mechanism by several drives, or with scalars held at values.

    Parameters
    ----------
    mechanism : Mechanism
    drives : Drives
    grid : bool
        Whether every value of a drive is combined with every one of the others; else all drives
        follow one path.

    Returns
    -------
    Motion
    """
    coupled = mechanism.couplings
    drives = replace(drives, held=(*coupled, *drives.held), at=(*[np.nan] * len(coupled), *drives.at))
    order = (*drives.held, *drives.scalars)
    system = mechanism.system(*order)
    n, units = len(system.points), np.array([s.unit for s in system.scalars])
    y = np.repeat(system.design[None], n, axis=0)
    design = system.evaluate(y)[1]
    mechanism.movable(system)
    _check_drives(system, y, design, drives.scalars, len(coupled))
    path = drives.grid() if grid else drives.path()
    asked = np.concatenate([np.tile(drives.at, (len(path), 1)), path], axis=1) / units
    points = np.where(np.isnan(asked)[:, None], design, asked[:, None])
    stops: list[list[str]] = [[] for _ in range(n)]
    swept_by_legs = grid or len(drives.scalars) == 1
    first = np.where(np.arange(len(order)) < len(drives.held), points[0], design) if swept_by_legs else points[0]
    start = _moved(system, y, np.stack([design, first]), order, stops)[-1] if (first != design).any() else y
    if swept_by_legs:
        states = _sweep_grid(mechanism, drives, Poses(start, first, np.arange(n)), points, stops)
    else:
        states = np.moveaxis(_moved(system, start, points, order, stops), 0, 1)
    for i in drop_violating(Curve(system, design[:, :-1]), states):
        stops[i].append(UNMET_CONDITIONS)
    held = np.moveaxis(points, 0, 1)[:, :, :-1]
    ends = ((None, None),) * n
    return Motion(
        mechanism,
        Curve(system, held[:, 0]),
        drives.scalars[-1],
        drives.held,
        path[:, -1],
        states,
        ends,
        others=drives.scalars[:-1],
        other_values=path[:, :-1],
        held_values=held,
        stops=tuple(map(tuple, stops)),
    )


def _check_drives(system: System, y: Array, values: Array, drives: tuple[Scalar, ...], coupled: int) -> None:
    """Raise an error if the drives cannot move the mechanism in the design pose."""
    freedoms, given = system.unknowns - len(system.use) - coupled, len(system.scalars) - coupled
    if freedoms != given:
        raise CannotDrive(
            f"there are {freedoms} freedoms: {len(drives)} drive, {freedoms - len(drives)} must be held, "
            f"not {given - len(drives)}"
        )
    _, conditions, _, by = Curve(system, values[:, :-1]).selected(y)(y)
    own = conditions[:, : len(system.use)]
    s = np.linalg.svd(own, compute_uv=False) if own.shape[1] else np.ones((len(own), 1))
    if (s[:, -1] < RANK_TOLERANCE * s[:, 0]).any():
        raise NotMovable(SINGULAR)
    s = np.linalg.svd(np.concatenate([conditions, by[:, None]], axis=1), compute_uv=False)
    if (s[:, -1] < STATIONARY_SLOPE * s[:, 0]).any():
        names = ", ".join(title(d) for d in drives)
        raise CannotDrive(f"{names} cannot drive together: the mechanism moves while all scalars keep their values")


def _moved(system: System, y: Array, points: Array, order: tuple[Scalar, ...], stops: list[list[str]]) -> Array:
    """Follow a path from states (n, numbers) to its points (p, n, f)."""
    states, reached = follow(system, y, points)
    for i in np.flatnonzero(reached < len(points) - 1):
        at = Course.through(points).take(np.array([i]))(reached[[i]])[0][0]
        where = ", ".join(
            _shown_value(s, v, f.unit, f.angular) for s, v, f in zip(order, at, system.scalars, strict=True)
        )
        stops[i].append(f"the path ends at {where}: {DEAD_POINT}")
    return corrected(system, states, points)


def _shown_value(scalar: Scalar, value: float, unit: float, angular: bool) -> str:
    return f"{title(scalar)} = {np.degrees(value) if angular else value * unit:.6g}"


def _sweep_grid(mechanism: Mechanism, drives: Drives, start: Poses, points: Array, stops: list[list[str]]) -> Array:
    """Return states (n, p, numbers) over a grid of points (p, n, f), drive after drive."""
    order, first = (*drives.held, *drives.scalars), len(drives.held)
    here = start
    for k, values in enumerate(drives.values, first):
        others = [i for i in range(len(order)) if i != k]
        system = mechanism.system(*(order[i] for i in others), order[k])
        goal = values / system.scalars[-1].unit
        states = _sweep_one_drive(Curve(system.take(here.owner), here.values[:, others]), here, goal, order[k], stops)
        size = len(goal)
        there = np.repeat(here.values, size, axis=0)
        there[:, k] = np.tile(goal, len(here.states))
        here = Poses(states.reshape(-1, states.shape[2]), there, np.repeat(here.owner, size))
    return here.states.reshape(len(start.states), len(points), -1)


def _sweep_one_drive(curve: Curve, here: Poses, goal: Array, drive: Scalar, stops: list[list[str]]) -> Array:
    """Sweep one drive over values (s,) from many poses: states (N, s, numbers)."""
    states = np.full((len(here.states), len(goal), here.states.shape[1]), np.nan)
    some = np.flatnonzero(np.isfinite(here.states).all(1))
    y = here.states[some]
    at = curve.take(some).selected(y)(y)
    tangent, slope, regular = tangents(at[1], at[3])
    good = (slope >= STATIONARY_SLOPE) & (regular >= RANK_TOLERANCE)
    some = some[good]
    if not len(some):
        return states
    begin = tuple(v[good] for v in at)
    states[some], end, reason = swept(curve.take(some), y[good], begin, tangent[good], goal)
    scalar = curve.system.scalars[-1]
    for side, sign, far in ((0, -1, goal.min()), (1, 1, goal.max())):
        short = sign * (far - end[:, side]) > 0
        for i in np.unique(here.owner[some[short]]):
            rows = np.flatnonzero(short & (here.owner[some] == i))
            least = rows[(sign * end[rows, side]).argmin()]
            where = _shown_value(drive, end[least, side], scalar.unit, scalar.angular)
            stops[i].append(f"a sweep ends at {where}: {reason[least, side]}")
    return states
