"""Rank of the conditions of a mechanism, and an independent set of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kinematics.types import Array
from .curve import Curve, pivots
from .system import System

#: Ratio to the largest below which a singular value is zero: rounded hard points cause larger ones.
RANK_TOLERANCE = 1e-8
#: Distance of a second pose, for comparison, from the design pose [rad, units].
SECOND_POSE_DISTANCE = 0.03
#: Ratio below which a singular value is zero in the second pose, which is corrected to 1e-10.
SECOND_RANK_TOLERANCE = 1e-6
#: Part of that distance below which the second pose has returned: the design pose is isolated.
RETURN_RATIO = 0.05
#: Largest residual of the second pose [units]; if it is larger, the mechanism does not move there.
MAX_RESIDUAL = 1e-8
#: Ratio to the largest below which a singular value could be zero if hard points were exact.
NEAR_RANK_TOLERANCE = 1e-3


#: Largest residual next to the design pose that rounded hard points explain [units].
ROUNDED_RESIDUAL = 1e-3
#: Message: no motion from a singular design pose.
SINGULAR = "the design pose is singular: more freedoms than beside it, or no pose beside it; give another design pose"


#: Message: a mechanism of a batch violates conditions that are redundant in the first one.
UNMET_CONDITIONS = "conditions that others imply in the first mechanism of the batch are not met in this one"


class Rank(NamedTuple):
    """Independent conditions of a mechanism.

    Attributes
    ----------
    use : ndarray of int, shape (r,)
        Numbers of a largest set of independent conditions, in all poses.
    singular : bool
        Whether the design pose has more freedoms than its neighbours, or is isolated.
    """

    use: Array
    singular: bool


def rank_of(system: System) -> Rank:
    """Compute the rank of the conditions in the design pose and next to it."""
    system = system.take(np.array([0])) if len(system.points) > 1 else system
    y = system.design[None]
    j = system.evaluate(y)[2][0, : system.rows]
    s = np.linalg.svd(j, compute_uv=False) if j.size else np.zeros(0)
    rank = int((s > RANK_TOLERANCE * s.max(initial=0)).sum())
    if rank == system.rows:
        return Rank(np.arange(system.rows), False)
    free = np.linalg.svd(j)[2][rank:]
    if not len(free):
        return Rank(pivots(j[None], rank)[0], False)
    there = _step_aside(system, y, free, SECOND_RANK_TOLERANCE)
    f, _, jacobian = system.evaluate(there)
    gone = np.sqrt((system.weight * (there - y) ** 2).sum())
    if (
        not np.abs(f).max() <= MAX_RESIDUAL or gone < RETURN_RATIO * SECOND_POSE_DISTANCE
    ):  # the freedom is infinitesimal only
        return Rank(pivots(j[None], rank)[0], True)
    aside = jacobian[0, : system.rows]
    s = np.linalg.svd(aside, compute_uv=False)
    beside = int((s > SECOND_RANK_TOLERANCE * s.max()).sum())
    return Rank(pivots(aside[None], beside)[0], beside > rank)


def _step_aside(system: System, y: Array, free: Array, least: float) -> Array:
    """Step along rates (f, m) to a second pose, and correct it by truncated singular values."""
    direction = free.T @ np.random.default_rng(1).normal(size=len(free))
    y = system.moved(y, SECOND_POSE_DISTANCE * direction[None] / np.sqrt(direction @ direction))
    for _ in range(30):
        f, _, jacobian = system.evaluate(y)
        step = -np.linalg.lstsq(jacobian[0, : system.rows], f[0], rcond=least)[0]
        y = system.moved(y, step[None])
        if np.abs(step).max() < 1e-10:
            break
    return y


def most_violated(system: System) -> tuple[str, float] | None:
    """Find the condition with the largest residual next to the design pose [units].

    None if no condition is nearly redundant, or the residual is too large for rounded hard points.
    """
    system = system.take(np.array([0])) if len(system.points) > 1 else system
    y = system.design[None]
    _, s, v = np.linalg.svd(system.evaluate(y)[2][0, : system.rows])
    if not s[-1] < NEAR_RANK_TOLERANCE * s[0]:
        return None
    off = np.abs(system.evaluate(_step_aside(system, y, v[-1:], NEAR_RANK_TOLERANCE))[0][0])
    return (system.names[int(off.argmax())], float(off.max())) if off.max() <= ROUNDED_RESIDUAL else None


def drop_violating(curve: Curve, states: Array) -> list[int]:
    """Set states (n, s, numbers) that violate a redundant condition to NaN; return their
    mechanisms.
    """
    out: list[int] = []
    for i in range(len(states)) if curve.system.redundant else ():
        some = np.flatnonzero(np.isfinite(states[i]).all(-1))
        part = curve.take(np.full(len(some), i)).system
        if len(some) and not np.abs(part.evaluate(states[i, some])[0]).max() <= MAX_RESIDUAL:
            states[i] = np.nan
            out.append(i)
    return out
