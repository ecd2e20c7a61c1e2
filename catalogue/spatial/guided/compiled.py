"""Follow motions by the compiled `kernel`, where numba is installed.

It knows the guides of `geometry.guides.KINDS`; numpy follows bodies on other kinds.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from ...kinematics.types import Array
from ..continuation.tracing import BRANCH, STUCK
from ..geometry.guides import KINDS
from ..geometry.kinds import Kind
from ..native.loading import call, load, plain
from .equations import System, slot_of
from .mechanism import Mechanisms
from .position import APEX_DISTANCE, EDGE, OK, ROUNDING_DISTANCE, SINGULAR_CONDITION, driver_units
from .walk import ACCURACY, LIMITS, TURNING

#: Least number of positions for which numba is imported; the import costs some thousand by numpy.
MIN_POSITIONS = 100
#: Nodes of a curve in memory; longer curves continue from the last one.
MAX_NODES = 128
#: Reasons for the end of a path, in the order of `native.curve`.
REASONS = np.array([OK, TURNING, BRANCH, STUCK, STUCK, STUCK, EDGE, STUCK], dtype="U90")


class Fast(NamedTuple):
    """Mechanisms in the form of the kernel, and work arrays of one pose."""

    kernel: Any
    plan: Any
    bodies: Any
    scales: Any
    work: Any
    units: Array


@cache
def kernel() -> ModuleType | None:
    """Return the compiled functions; None if numba is not installed or disabled."""
    return load(f"{__package__}.kernel")


def fast(mechanisms: Mechanisms) -> Fast | None:
    """Return mechanisms in the form of the kernel; None if not supported."""
    made: dict[str, Any] = mechanisms.__dict__
    if "fast" not in made:
        made["fast"] = _made(mechanisms)
    found: Fast | None = made["fast"]
    return found


def _made(mechanisms: Mechanisms) -> Fast | None:
    known = all(type(kind) is type(KINDS.get(kind.name)) for g in mechanisms.guides for kind in g.kinds)
    k = kernel() if known else None
    if k is None:
        return None
    system, number = System.of(mechanisms), {name: i for i, name in enumerate(KINDS)}

    def numbers(kinds: tuple[Kind, ...], which: Array) -> Array:
        return np.array([number[kind.name] for kind in kinds])[which]

    n, p = mechanisms.body.shape[:2]
    shapes, units, smooth = np.zeros((n, p, 2)), np.ones((n, p, 2)), np.zeros((n, len(system.driven)), bool)
    for i, guides in enumerate(mechanisms.guides):
        shape = slot_of(i, mechanisms).parameters[:2].T
        shapes[:, i, : shape.shape[1]] = shape
        for kind, where, _ in guides.each():
            for axis in (0, 1):
                units[where, i, axis] = kind.coordinate_unit(axis, mechanisms.unit[where])
    for j, d in enumerate(system.driven):
        for kind, where, _ in mechanisms.guides[d.slot.point].each():
            smooth[where, j] = kind.smooth is not None and d.driver[1] is None
    driven = [
        (d.slot.point, -1 if d.column is None else d.column, *(-1 if k is None else k for k in d.driver))
        for d in system.driven
    ]
    bodies = k.Bodies(
        _writable_copy(system.arms.T),
        _writable_copy(system.frames.transpose(3, 2, 0, 1)),
        _writable_copy(system.origins.T),
        np.stack([numbers(g.kinds, g.which) for g in mechanisms.guides], axis=1),
        np.stack([numbers(d.slot.kinds, d.slot.which) for d in system.driven], axis=1),
        shapes,
        _writable_copy(system.quadrics.T),
        _writable_copy(system.reach),
    )
    base = system.driven[0].slot.point
    scales = k.Scales(
        _writable_copy(system.unit),
        _writable_copy(system.centre.T),
        _writable_copy(system.unit / mechanisms.diameter),
        _writable_copy(mechanisms.body[:, base]),
        units,
        smooth,
    )
    plan = k.plan(system.points, driven, system.free)
    return Fast(k, plan, bodies, scales, k.work(plan, p, mechanisms.freedom), driver_units(mechanisms))


def _writable_copy(v: Array) -> Array:
    """Return a contiguous, writable copy of doubles: the array type of the kernel."""
    return np.array(v, float, order="C")


def led(fast: Fast, nodes: Array, corners: Array, begin: Array, begun: Array) -> tuple[Array, ...]:
    """Move mechanisms along paths (n, s, k) from states (n, 4 + f).

    Return states at the nodes (n, s, 4 + f), the number of reached nodes, reasons and positions of
    the ends, and the number of steps.
    """
    k, (n, s, _), rows = fast.kernel, nodes.shape, begin.shape[1]
    path = plain(nodes / fast.units.T[:, None])
    states = np.full((n, s, rows), np.nan)
    states[begun, 0] = begin[begun]
    counts = (np.zeros(n, kind) for kind in (np.int64, float, np.int64))
    ways = k.Ways(path, corners.copy(), states, begun.astype(np.int64), *counts)
    unknowns = len(fast.plan.keep) + 1
    room = k.nodes(unknowns, MAX_NODES, unknowns + 1)
    call(k.led, fast.plan, fast.bodies, ways, room, LIMITS, ACCURACY, np.zeros(0), fast.work)
    return states, ways.reached, REASONS[ways.why], ways.end, ways.steps


def measured(fast: Fast, nodes: Array, states: Array, reached: Array, found: Sequence[Array]) -> None:
    """Fill the arrays of `kernel.Measured` at the reached nodes.

    `good` marks positions without a remark.
    """
    path, tests = plain(nodes / fast.units.T[:, None]), (ROUNDING_DISTANCE, SINGULAR_CONDITION, APEX_DISTANCE)
    given = fast.plan, fast.bodies, fast.scales, path, _writable_copy(nodes), states, reached, tests
    call(fast.kernel.measured, *given, fast.kernel.Measured(*found), fast.work)
