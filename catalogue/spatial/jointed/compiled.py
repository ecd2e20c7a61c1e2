"""Sweep by the compiled `kernel`: ten times faster.

It needs numba, and mechanisms without surfaces and curves as guides.

The first sweep imports numba.
"""

from __future__ import annotations

from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from ...kinematics.types import Array
from ..continuation.newton import Accuracy
from ..native.loading import call, load, plain
from .scalars import AngleFunction, CoordinateFunction, LengthFunction, ScalarFunction, SumFunction, TravelFunction

if TYPE_CHECKING:
    from ..continuation.tracing import March
    from .system import System

#: The kernel, a plan, a geometry and work arrays of one pose.
Fast = tuple[Any, Any, Any, Any]


@cache
def kernel() -> ModuleType | None:
    """Return the compiled equations; None if numba is not installed or disabled."""
    return load(f"{__package__}.kernel")


def plan(system: System) -> Any:
    """Return the plan of a system for the kernel, without geometry; None if not supported."""
    k = kernel()
    if k is None or system.guides or any(p.guide for p in system.placed):
        return None
    joints = [
        (p.joint_kind, *one)
        for p in system.placed
        for one in zip(p.bodies, p.on, p.unknown, p.number, p.point, p.direction, strict=True)
    ]
    lead = [v for p in system.placed for v in p.lead or (0.0,) * len(p.bodies)]
    scalars, moves, weights, stated = _scalar_rows(system)
    held = system.rows + stated[:-1]
    whole = (system.ends, system.vectors, system.distances, system.offsets, system.angles, system.idle)
    return k.Plan(
        np.array(joints, np.int64),
        np.array(lead),
        *(np.ascontiguousarray(v, np.int64) for v in whole),
        np.concatenate([system.moves[: system.rows], moves]),
        scalars,
        np.array(weights),
        np.concatenate([system.use, held]).astype(np.int64),
        system.redundant,
        system.rows + stated,
        system.weight,
    )


def fast(system: System) -> Fast | None:
    """Return the compiled evaluation of a system.

    None without numba, or if a guide is a surface or a curve.
    """
    plan = system.plan
    if plan is None:
        return None
    k = kernel()
    assert k is not None  # the kernel made the plan
    given = (system.points, system.directions, system.lengths, *system.constants)
    return k, plan, k.Geometry(*map(plain, given)), k.work(plan, system.numbers)


def _scalar_rows(system: System) -> tuple[Array, Array, list[float], Array]:
    """Return scalars in the form of `kernel.read`, (k, 5) integers, sums after their parts.

    Besides: the mask (k, m) of the unknowns that move each, the weights of all sums, and the rows
    of the system's scalars.
    """
    rows: list[tuple[int, ...]] = []
    moves, weights, stated = [np.zeros((0, system.unknowns))], list[float](), []
    for scalar, moved in zip(system.scalars, system.moves[system.rows :], strict=True):
        if isinstance(scalar, SumFunction):
            total = (4, len(rows), len(scalar.parts), len(weights), int(scalar.periodic))
            rows += [*map(_scalar_row, scalar.parts), total]
            moves.append(scalar.moves)
            weights += scalar.weights
        else:
            rows.append(_scalar_row(scalar))
        moves.append(moved[None])
        stated.append(len(rows) - 1)
    return np.array(rows, np.int64).reshape(-1, 5), np.concatenate(moves), weights, np.array(stated, np.int64)


def _scalar_row(s: ScalarFunction) -> tuple[int, ...]:
    """Return the kind of a scalar, its integer parameters, and whether it is periodic."""
    if isinstance(s, CoordinateFunction):
        return 0, s.number, s.unknown, 0, 0
    if isinstance(s, TravelFunction):
        return 1, s.end, s.design, s.along, 0
    if isinstance(s, LengthFunction):
        return 2, s.first, s.second, 0, 0
    assert isinstance(s, AngleFunction)  # there is no other kind
    return 3, s.vector, s.first, s.second, 1


def evaluate(fast: Fast, y: Array) -> tuple[Array, Array]:
    """Return residuals and scalars (n, c + k), and their Jacobian (n, c + k, unknowns)."""
    k, plan, geometry, work = fast
    value, jacobian = np.empty((len(y), len(plan.moves))), np.empty((len(y), *plan.moves.shape))
    call(k.evaluated, plan, geometry, work, plain(y), value, jacobian)
    if len(plan.weights):
        rows = np.concatenate([np.arange(len(plan.moves) - len(plan.scalars)), plan.stated])
        return value[:, rows], jacobian[:, rows]
    return value, jacobian


def rated(fast: Fast, held: Array, y: Array) -> tuple[Array, Array, Array, Array]:
    """Return rotations (n, b, 3, 3), translations (n, b, 3), rates and twists per freedom.

    Rates of the unknowns are of shape (n, m, f), twists of the bodies (n, b, 6, f).
    """
    k, plan, geometry, work = fast
    n, bodies = len(y), len(plan.joints) + 1
    rotation, shift = np.empty((n, bodies, 3, 3)), np.empty((n, bodies, 3))
    basis, twist = np.empty((n, plan.moves.shape[1], len(plan.stated))), np.empty((n, len(plan.stated), bodies, 6))
    twist[:, :, 0] = 0.0
    call(k.rated, plan, geometry, work, plain(held), plain(y), rotation, shift, basis, twist)
    return rotation, shift, basis, np.moveaxis(twist, 1, 3)


def solved(fast: Fast, held: Array, y: Array, target: Array, accuracy: Accuracy) -> tuple[Array, Array, Array]:
    """Correct states (n, numbers); return them, a mask of success and one of singular matrices."""
    k, plan, geometry, work = fast
    y, found = np.array(y, order="C"), np.empty(len(y), np.int64)
    call(k.solved, plan, geometry, work, plain(held), y, plain(target), found, accuracy)
    return y, found == 1, found < 0


def steps(fast: Fast, held: Array, march: March) -> Any:
    """Try a step of many curves from their last two nodes.

    Return the next step lengths (n,), the new nodes, a mask of accepted steps, and one of steps
    that would have changed the orientation; None if a matrix was singular.
    """
    k, plan, geometry, work = fast
    nodes = k.Nodes(*(np.stack([a, b, b], axis=1) for a, b in zip(march.before, march.last, strict=True)))
    h, good, crossing = march.h.copy(), np.zeros(len(march.h), bool), np.zeros(len(march.h), bool)
    given = (plan, geometry, work, plain(held), h, plain(march.sign), nodes, march.limits)
    if not call(k.steps, *given, good, crossing):
        return None
    return h, tuple(v[:, 2] for v in nodes), good, crossing


def swept(
    fast: Fast, held: Array, start: Any, sign: Array, target: Array, goal: Array, most: int, constants: Any
) -> Any:
    """Sweep a batch from its design poses.

    Return states (n, s, numbers), NaN without pose; ends of the drive (n, 2), their reasons (n, 2)
    as numbers of `kernel`; and a mask of mechanisms with a singular matrix.
    """
    k, plan, geometry, work = fast
    n, s, numbers = len(target), len(goal), start[1].shape[1]
    sweep = k.Sweep(
        k.Nodes(*map(plain, start)),
        plain(sign),
        plain(target),
        goal,
        np.empty((n, s, numbers)),
        np.zeros((n, s), np.int64),
        np.empty((n, 2)),
        np.empty((n, 2), np.int64),
    )
    call(k.swept, plan, geometry, work, plain(held), sweep, k.nodes(plan.moves.shape[1], most + 2, numbers), *constants)
    sweep.states[sweep.found != 1] = np.nan
    return sweep.states, sweep.end, sweep.why, (sweep.found < 0).any(1) | (sweep.why == k.SINGULAR).any(1)
