"""Rank of the conditions of a mechanism, and an independent set of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kinematics.types import Array
from .curve import Curve, pivots
from .system import System

#: Singular values below this part of the largest count as none: rounded hard points make more.
RANK = 1e-8
#: How far from the design pose a second pose is looked at [rad, units].
ASIDE = 0.03
#: The same in that pose, which is corrected to 1e-10 and has been moved far from where values
#: vanish.
RANK_ASIDE = 1e-6
#: Part of that way below which the pose has come back: the design pose is alone.
BACK = 0.05
#: How far conditions may be missed in the second pose [units]: else the mechanism does not move
#: there.
MISSED = 1e-8
#: Singular values below this part of the largest could be none, if hard points were exact.
NEARLY = 1e-3


#: How far conditions may be missed in a pose beside that of rounded hard points [units].
ROUNDED = 1e-3
#: Why a mechanism is not moved.
SINGULAR = "the design pose is singular: more freedoms than beside it, or no pose beside it; give another design pose"


#: Why a mechanism of a batch has no poses.
UNMET = "conditions that others imply in the first mechanism of the batch are not met in this one"


class Rank(NamedTuple):
    """Independent conditions of a mechanism.

    Attributes
    ----------
    use : ndarray of int, shape (r,)
        As many conditions as are independent wherever the mechanism moves.
    singular : bool
        Whether the design pose has more freedoms than poses beside it, or none beside it at all.
    """

    use: Array
    singular: bool


def rank_of(system: System) -> Rank:
    """Compute the rank of the conditions in the design pose and beside it."""
    system = system.take(np.array([0])) if len(system.points) > 1 else system
    y = system.design[None]
    j = system.evaluate(y)[2][0, : system.rows]
    s = np.linalg.svd(j, compute_uv=False) if j.size else np.zeros(0)
    rank = int((s > RANK * s.max(initial=0)).sum())
    if rank == system.rows:
        return Rank(np.arange(system.rows), False)
    free = np.linalg.svd(j)[2][rank:]
    if not len(free):
        return Rank(pivots(j[None], rank)[0], False)
    there = _aside(system, y, free, RANK_ASIDE)
    f, _, jacobian = system.evaluate(there)
    gone = np.sqrt((system.weight * (there - y) ** 2).sum())
    if not np.abs(f).max() <= MISSED or gone < BACK * ASIDE:  # the freedom is one of the first order only
        return Rank(pivots(j[None], rank)[0], True)
    aside = jacobian[0, : system.rows]
    s = np.linalg.svd(aside, compute_uv=False)
    beside = int((s > RANK_ASIDE * s.max()).sum())
    return Rank(pivots(aside[None], beside)[0], beside > rank)


def _aside(system: System, y: Array, free: Array, least: float) -> Array:
    """Step aside along rates (f, m) and correct by truncated singular values."""
    direction = free.T @ np.random.default_rng(1).normal(size=len(free))
    y = system.moved(y, ASIDE * direction[None] / np.sqrt(direction @ direction))
    for _ in range(30):
        f, _, jacobian = system.evaluate(y)
        step = -np.linalg.lstsq(jacobian[0, : system.rows], f[0], rcond=least)[0]
        y = system.moved(y, step[None])
        if np.abs(step).max() < 1e-10:
            break
    return y


def missed_by(system: System) -> tuple[str, float] | None:
    """Find the condition that a structure misses most beside its design pose [units].

    None if it is far from moving: its hard points are not those of a mechanism, rounded.
    """
    system = system.take(np.array([0])) if len(system.points) > 1 else system
    y = system.design[None]
    _, s, v = np.linalg.svd(system.evaluate(y)[2][0, : system.rows])
    if not s[-1] < NEARLY * s[0]:
        return None
    off = np.abs(system.evaluate(_aside(system, y, v[-1:], NEARLY))[0][0])
    return (system.names[int(off.argmax())], float(off.max())) if off.max() <= ROUNDED else None


def without_missed(curve: Curve, states: Array) -> list[int]:
    """Make states (n, s, numbers) NaN that miss conditions taken for implied by others; return
    their mechanisms.
    """
    out: list[int] = []
    for i in range(len(states)) if curve.system.redundant else ():
        some = np.flatnonzero(np.isfinite(states[i]).all(-1))
        part = curve.take(np.full(len(some), i)).system
        if len(some) and not np.abs(part.evaluate(states[i, some])[0]).max() <= MISSED:
            states[i] = np.nan
            out.append(i)
    return out
