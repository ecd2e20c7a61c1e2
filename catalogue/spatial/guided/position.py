"""Solve for positions at driver values, with residuals, condition numbers and reasons."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import InvalidRequest
from ...given import array, instance
from ...kinematics.types import Array
from ..continuation.elimination import condition, solve
from ..geometry.kinds import Kind
from ..geometry.rotation import fitted, matrix
from .equations import System
from .formulation import lost_at
from .mechanism import Mechanisms
from .newton import newton
from .unknowns import Equations

OK = ""
NO_ASSEMBLY = "no assembly near the start"
DEAD_POINT = "past a dead point"
SINGULAR = "singular position"
EDGE = "off the edge of a guide"
APEX = "at the apex of a guide"
CHART = "driven coordinate is singular"
NOT_FINITE = "driver is not finite"
#: Largest distance from a guide of an assembled body [largest lengths of the mechanism].
MAX_DISTANCE = 1e-12
#: Largest distance that rounding explains; positions of a motion beyond it are corrected.
ROUNDING_DISTANCE = 2e-14
#: Condition number above which a position is singular.
SINGULAR_CONDITION = 1e12
#: Condition number above which a dead point explains that Newton's method finds no root.
DEAD_POINT_CONDITION = 100.0
#: Cosine between the residual and its possible changes below which no motion reduces it.
STATIONARY_COSINE = 0.05
#: Distance from the apex of a guide, in units, below which its tangent plane is undetermined.
APEX_DISTANCE = 1e-8


@dataclass(frozen=True, eq=False)
class Positions:
    """Positions of n mechanisms; lengths and coordinates in the given units.

    Attributes
    ----------
    drivers : ndarray, shape (n, k)
    quaternion, translation : ndarray, shape (n, 4), (n, 3)
        World = translation + rotation (body).
    points : ndarray, shape (n, p, 3)
    coordinates : ndarray, shape (n, p, 2)
        u, w on each guide; w is NaN on a curve.  Angles of undriven points are between -pi and pi.
    success : ndarray, shape (n,)
    residual : ndarray, shape (n,)
        Largest distance of a point from its guide, in diameters of the body.
    condition : ndarray, shape (n,)
        Condition number (Frobenius) of the Jacobian in radians and diameters: rotations and arcs
        against distances.
    reason : ndarray of str, shape (n,)
        Empty on success.
    evaluations : ndarray, shape (n,)
    """

    drivers: Array
    quaternion: Array
    translation: Array
    points: Array
    coordinates: Array
    success: Array
    residual: Array
    condition: Array
    reason: Array
    evaluations: Array
    state: Array

    def __getitem__(self, index: Any) -> Positions:
        index = np.atleast_1d(np.arange(len(self.success))[index])
        values = {k: v[index] for k, v in vars(self).items() if k != "state"}
        return Positions(**values, state=self.state[:, index])

    def put(self, index: Any, other: Positions) -> None:
        """Overwrite some positions, but keep their numbers of evaluations."""
        for name, value in vars(self).items():
            if name not in ("state", "evaluations"):
                value[index] = getattr(other, name)
        self.state[:, index] = other.state


def solve_positions(mechanisms: Mechanisms, drivers: Any, start: Any) -> Positions:
    """Assemble the mechanisms at given values of the drivers, near a start.

    From known positions the assembly is kept: the drivers change linearly to their values.  A value
    beyond a dead point or a branch point is refused with that reason, even where Newton's method
    would find another assembly.

    Parameters
    ----------
    mechanisms : Mechanisms
    drivers : array-like, shape (n, k) or (k,)
        Values of the driven coordinates [rad, length].
    start : Positions, or array-like of shape (n, p, 2) or (p, 2)
        Known positions, or rough u, w of every point (NaN for w on curves).

    Raises
    ------
    InvalidRequest
        If a shape is wrong, or a rough coordinate is off its guide.
    """
    system = System.of(instance("mechanisms", mechanisms, Mechanisms))
    values = driver_values(mechanisms, drivers)
    q = values.T / driver_units(mechanisms)
    if not isinstance(start, Positions):
        state = rough(mechanisms, system, start)
    else:
        check_positions("start", start, mechanisms)
        state = start.state
    finite = np.isfinite(q).all(0)
    there = np.where(finite, q, 0)
    root = newton(system, state, there)
    found = reported(mechanisms, system, root.state, values, root.found & finite, root.evaluations)
    if mechanisms.formulation != "pose":
        lost = lost_at(mechanisms, found)
        found.reason[finite] = np.where(lost == OK, found.reason, lost)[finite]
        found.success[lost != OK] = False
    if isinstance(start, Positions) and not np.array_equal(start.drivers, values):
        return _kept(mechanisms, found, start)
    return found


def _kept(mechanisms: Mechanisms, found: Positions, start: Positions) -> Positions:
    """Return positions reached from a start by linear changes of drivers; reasons for others."""
    from .follow import follow
    from .walk import TURNING

    some = np.flatnonzero(np.isfinite(start.drivers).all(1) & np.isfinite(found.drivers).all(1))
    if not len(some):
        return found
    motion = follow(mechanisms[some], np.stack([start.drivers[some], found.drivers[some]], axis=1), start[some])
    led = motion.reached == 2
    found.put(some[led], motion.node(1)[led])
    reason = np.where(motion.reason == TURNING, DEAD_POINT, motion.reason)
    astray = ~led & found.success[some]
    found.reason[some[astray]], found.success[some[astray]] = reason[astray], False
    return found


def reported(
    mechanisms: Mechanisms, system: System, state: Array, values: Array, found: Array, evaluations: Array
) -> Positions:
    """Return the measured positions of states (of `equations`); `found` is Newton's success."""
    q = values.T / driver_units(mechanisms)
    finite = np.isfinite(q).all(0)
    now = system.evaluate(state, np.where(finite, q, 0))
    ratio = system.unit / mechanisms.diameter
    kappa, _ = conditioning(now, ratio)
    world = system.world(state, q)
    local = system.local(world)
    residual = now.distance * ratio
    coordinates = _locate(mechanisms, system, state, values, local * system.unit)
    reason = np.full(len(system), OK, dtype="U90")
    with np.errstate(invalid="ignore"):
        assembled = found & (now.distance <= MAX_DISTANCE * system.reach)
        reason[kappa > SINGULAR_CONDITION] = SINGULAR
        reason[~assembled] = NO_ASSEMBLY
        reason[~assembled & (_is_stationary(now) | (kappa > DEAD_POINT_CONDITION))] = DEAD_POINT
    uncharted = ~np.isfinite(coordinates[..., 0]).all(1)
    reason[assembled & uncharted] = EDGE
    reason[_apex_distance(mechanisms, local, system) < APEX_DISTANCE] = APEX
    reason[(now.metric < APEX_DISTANCE).any(0)] = CHART
    reason[~is_on_chart(mechanisms, values)] = EDGE
    reason[~finite] = NOT_FINITE
    points = np.moveaxis(world * system.unit + system.centre[:, None], (0, 1), (2, 1))
    rotation = matrix(state[:4])
    base = system.driven[0].slot.point
    translation = points[:, base] - np.einsum("ijn,nj->ni", rotation, mechanisms.body[:, base])
    return Positions(
        values,
        state[:4].T.copy(),
        translation,
        points,
        coordinates,
        reason == OK,
        residual,
        kappa,
        reason,
        evaluations,
        state,
    )


def _is_stationary(now: Equations) -> Array:
    """Return a mask of states in which no small motion reduces the residual to first order."""
    slope = np.sqrt(((now.jacobian * now.residual[:, None]).sum(0) ** 2).sum(0))
    norms = np.sqrt((now.jacobian**2).sum((0, 1)) * (now.residual**2).sum(0))
    return np.asarray(slope < STATIONARY_COSINE * norms)


def conditioning(now: Equations, unit: Array) -> tuple[Array, Array]:
    """Return condition numbers (n,) and inverses (m, m, n); the diameter is 1 / `unit`."""
    m, n = now.residual.shape
    inverse, _ = solve(now.jacobian, np.broadcast_to(np.eye(m)[:, :, None], (m, m, n)))
    weight = np.ones((m, n))
    weight[: m - len(now.metric)] = unit
    with np.errstate(all="ignore"):
        kappa = condition(now.jacobian * weight, inverse / weight[:, None])
    return np.where(np.isfinite(kappa), kappa, np.inf), inverse


def check_positions(name: str, positions: Positions, mechanisms: Mechanisms) -> None:
    """Raise `InvalidRequest` unless positions match the mechanisms in number and class."""
    drivers = (len(mechanisms), mechanisms.freedom)
    if positions.points.shape != mechanisms.body.shape or positions.drivers.shape != drivers:
        raise InvalidRequest(f"{name} must be positions of these mechanisms: they are of others")


def driver_values(mechanisms: Mechanisms, drivers: Any) -> Array:
    """Return driver values as an array (n, k)."""
    values = array("driver values", drivers)
    wanted = (len(mechanisms), mechanisms.freedom)
    if values.shape not in (wanted, wanted[1:], (1, wanted[1])):
        raise InvalidRequest(f"driver values must be of shape {wanted}, not {values.shape}")
    return np.array(np.broadcast_to(values, wanted))


def driver_units(mechanisms: Mechanisms) -> Array:
    """Return the unit of each driver: the unit of length, or 1 for an angle, shape (k, n)."""
    units = np.ones((mechanisms.freedom, len(mechanisms)))
    for k, (i, name) in enumerate(mechanisms.drivers):
        for kind, where, _ in mechanisms.guides[i].each():
            units[k, where] = kind.coordinate_unit("uw".index(name), mechanisms.unit[where])
    return units


def is_on_chart(mechanisms: Mechanisms, values: Array) -> Array:
    """Return whether the driven values (n, k) are on their guides, shape (n,)."""
    good = np.ones(len(values), bool)
    for k, (i, name) in enumerate(mechanisms.drivers):
        for kind, where, p in mechanisms.guides[i].each():
            here = values[where, k]
            far = np.full(len(where), np.finfo(float).max)
            good[where] &= kind.reaches(here, far, p) if name == "u" else kind.reaches(np.zeros(len(where)), here, p)
    return good


def rough(mechanisms: Mechanisms, system: System, coordinates: Any) -> Array:
    """Return the state that best fits rough coordinates."""
    given = array("rough coordinates", coordinates)
    n, p = mechanisms.body.shape[:2]
    if given.shape[-2:] != (p, 2) or given.ndim > 3 or (given.ndim == 3 and len(given) not in (1, n)):
        raise InvalidRequest(f"rough coordinates must be of shape {(n, p, 2)}, not {given.shape}")
    given = np.broadcast_to(given, (n, p, 2))
    world = np.empty((p, 3, n))
    frames = np.moveaxis(system.frames, 2, 0)
    free = np.zeros((system.free, n))
    columns = {d.slot.point: (d, d.column - 3) for d in system.driven if d.column is not None}
    for i, guides in enumerate(mechanisms.guides):
        for kind, where, shape in guides.each():
            u, w = given[where, i].T
            w = np.zeros_like(w) if mechanisms.curves[i] else w
            bad = ~kind.reaches(u, w, shape)
            if bad.any():
                raise InvalidRequest(
                    f"the start of point {i} of mechanism {where[bad.argmax()]} is off its {kind.name}"
                )
            x = np.stack(np.broadcast_arrays(*kind.point(u, w, shape)))
            world[i][:, where] = guides.origin[where].T + (frames[i][..., where] * x).sum(1)
            if i in columns:
                d, row = columns[i]
                axis = d.driver.index(None)
                smooth = axis == 1 and kind.smooth
                value = smooth.locate(x, shape)[1] if smooth else (u, w)[axis]
                unit = np.ones_like(u) if smooth else kind.coordinate_unit(axis, mechanisms.unit[where])
                free[row, where] = value / unit
    return np.concatenate([fitted(np.moveaxis(mechanisms.body, 0, -1), world), free])


def _locate(mechanisms: Mechanisms, system: System, state: Array, values: Array, local: Array) -> Array:
    """Return u, w of all points from local points (3, p, n); keep driven and free coordinates."""
    n, p = mechanisms.body.shape[:2]
    out = np.empty((n, p, 2))
    for i, guides in enumerate(mechanisms.guides):
        for kind, where, shape in guides.each():
            u, w = kind.locate(local[:, i, where], shape)
            out[where, i, 0], out[where, i, 1] = u, np.nan if mechanisms.curves[i] else w
    for d in system.driven:
        for axis, k in enumerate(d.driver):
            for kind, where, _ in mechanisms.guides[d.slot.point].each():
                if k is not None:
                    lost = np.isnan(out[where, d.slot.point, 0])
                    out[where, d.slot.point, axis] = np.where(lost, np.nan, values[where, k])
                elif d.column is not None and not (axis == 1 and kind.smooth):
                    unit = kind.coordinate_unit(axis, mechanisms.unit[where])
                    out[where, d.slot.point, axis] = state[d.column + 1, where] * unit
    return out


def off_edge(mechanisms: Mechanisms, system: System, local: Array) -> Array:
    """Return a mask (n,) of points (3, p, n) beyond the chart of their guide."""
    out = np.zeros(len(system), bool)
    for i, guides in enumerate(mechanisms.guides):
        for kind, where, p in guides.each():
            if kind.bounded:
                out[where] |= np.isnan(kind.locate(local[:, i, where], kind.scaled(p, system.unit[where]))[0])
    return out


def _apex_distance(mechanisms: Mechanisms, local: Array, system: System) -> Array:
    """Return distances (n,) to the nearest apex of an undriven point's guide, in units."""
    out = np.full(len(system), np.inf)
    for i in set(system.points):
        for kind, where, p in mechanisms.guides[i].each():
            if type(kind).apex is not Kind.apex:
                near = kind.apex(local[:, i, where], kind.scaled(p, system.unit[where]))
                out[where] = np.minimum(out[where], near)
    return out
