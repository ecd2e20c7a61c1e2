"""Move a batch along a path of drivers, each mechanism with its own steps.

A motion ends at a turning point of the path's parameter, a branch point, an apex or the edge of a
guide.  It never continues in another branch unreported.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...given import array, instance, whole
from ...kinematics.types import Array
from . import compiled
from .equations import System
from .filling import corners
from .formulation import SINGULAR, first_lost
from .mechanism import Mechanisms
from .newton import newton
from .position import ROUNDING_DISTANCE, Positions, driver_units, reported, solve_positions
from .walk import Walk

BEYOND = "beyond the end of the motion"
#: Mechanisms moved together: their arrays fit in the second-level cache.
BLOCK = 1024
#: Positions measured together.
MEASURED_BLOCK = 4096
#: Newton steps that reduce the residual of a position after the last step of its motion.
CLOSING_STEPS = 3


@dataclass(frozen=True, eq=False)
class Motion:
    """Positions of n mechanisms at the nodes of a path; NaN beyond the last node reached.

    Attributes
    ----------
    positions : Positions
        n times s positions, mechanism by mechanism; `node` returns those of one node.
    reached : ndarray, shape (n,)
        Number of nodes reached.
    reason : ndarray of str, shape (n,)
        Reason for the end; empty if all nodes were reached.
    end : ndarray, shape (n,)
        End of the motion, in nodes from the first: at a turning point to rounding, elsewhere to the
        last step.
    end_drivers : ndarray, shape (n, k)
        Values of the drivers at the end.
    steps : ndarray, shape (n,)
        Number of attempted steps.
    """

    positions: Positions
    reached: Array
    reason: Array
    end: Array
    end_drivers: Array
    steps: Array

    def node(self, i: int) -> Positions:
        """Return the positions at node i."""
        n = len(self.reached)
        s = len(self.positions.success) // n
        return self.positions[np.arange(n) * s + range(s)[whole("i", i, -s, s - 1)]]


def follow(mechanisms: Mechanisms, path: Any, start: Any) -> Motion:
    """Move the mechanisms along a path of the drivers.

    Parameters
    ----------
    mechanisms : Mechanisms
    path : array-like, shape (n, s, k) or (s, k)
        Values of the drivers at s nodes; linear between them.
    start : Positions, or array-like of shape (n, p, 2) or (p, 2)
        As for `solve_positions`, at or near the first node.

    Raises
    ------
    InvalidRequest
        If the path has a wrong shape or is not finite.
    """
    n, k = len(instance("mechanisms", mechanisms, Mechanisms)), mechanisms.freedom
    nodes = array("path", path, (None, k), (1, None, k), (n, None, k), finite=True)
    nodes = np.broadcast_to(nodes, (n, *nodes.shape[-2:]))
    first = solve_positions(mechanisms, nodes[:, 0], start)
    fast = compiled.fast(mechanisms) if nodes.shape[1] > 2 and nodes[..., 0].size >= compiled.MIN_POSITIONS else None
    if fast:
        states, reached, reason, end, steps = compiled.led(fast, nodes, corners(nodes), first.state.T, first.success)
        reason = np.where(first.success, reason, first.reason)
    else:
        reached, reason, end, steps = np.zeros(n, int), first.reason.copy(), np.zeros(n), np.zeros(n, int)
        states = np.full((*nodes.shape[:2], len(first.state)), np.nan)
        begun = np.flatnonzero(first.success)
        for low in range(0, len(begun), BLOCK):
            index = begun[low : low + BLOCK]
            walk = Walk(mechanisms[index], nodes[index], first.state[:, index], corners(nodes[index]))
            walk.run()
            states[index], reached[index], reason[index] = walk.states, walk.reached, walk.reason
            end[index], steps[index] = walk.end, walk.steps
    positions = _measure_states(mechanisms, fast, nodes, states, reached)
    if mechanisms.formulation != "pose":
        lost = (at := first_lost(mechanisms, positions)) < end
        end, reason = np.where(lost, at, end), np.where(lost, SINGULAR[mechanisms.formulation], reason)
        reached = np.where(lost, end.astype(int) + 1, reached)
        states[np.arange(nodes.shape[1]) >= reached[:, None]] = np.nan
        positions = _measure_states(mechanisms, fast, nodes, states, reached) if lost.any() else positions
    return Motion(positions, reached, reason, end, _interpolate_drivers(nodes, end), steps)


def _interpolate_drivers(nodes: Array, end: Array) -> Array:
    """Interpolate the drivers (n, k) at the ends of motions, `end` (n,) [nodes]."""
    every, one = np.arange(len(nodes)), np.minimum(end.astype(int), max(nodes.shape[1] - 2, 0))
    after = np.minimum(one + 1, nodes.shape[1] - 1)
    return np.asarray(nodes[every, one] + (end - one)[:, None] * (nodes[every, after] - nodes[every, one]))


def _measure_states(
    mechanisms: Mechanisms, fast: compiled.Fast | None, nodes: Array, states: Array, reached: Array
) -> Positions:
    """Return positions of stored states (n, s, 4 + f), mechanism by mechanism.

    The kernel measures them; numpy does without kernel, and where a position needs a remark.
    """
    s, many = nodes.shape[1], nodes[..., 0].size
    there, good, reason = (np.arange(s) < reached[:, None]).ravel(), np.zeros(many, bool), np.zeros(many, "U90")
    reason[~there] = BEYOND
    body, p = mechanisms.body.shape[1:], len(mechanisms.curves)
    blank = [np.full((many, *shape), np.nan) for shape in ((4,), (3,), body, (p, 2), (), ())]
    if fast:
        compiled.measured(fast, nodes, states, reached, [*blank, good])
    flat, (quaternion, shift, points, coordinates, residual, condition) = states.reshape(many, -1).T, blank
    found = Positions(
        nodes.reshape(many, -1).copy(),
        quaternion,
        shift,
        points,
        coordinates,
        good,
        residual,
        condition,
        reason,
        there.astype(int),
        flat,
    )
    left = np.flatnonzero(there & ~good)
    for low in range(0, len(left), MEASURED_BLOCK):
        index = left[low : low + MEASURED_BLOCK]
        i, j = np.divmod(index, s)
        some, system = mechanisms[i], System.of(mechanisms).take(i)
        found.put(index, _close_and_report(some, system, found.state[:, index], nodes[i, j]))
    return found


def _close_and_report(mechanisms: Mechanisms, system: System, state: Array, values: Array) -> Positions:
    """Return the positions in the states after steps.

    Newton's method corrects states with a residual, which strongly curved guides cause.
    """
    every = np.ones(len(system), bool)
    at = reported(mechanisms, system, state, values, every, every.astype(int))
    off = np.flatnonzero(
        ~at.success | (at.residual * mechanisms.diameter > ROUNDING_DISTANCE * system.reach * system.unit)
    )
    if len(off):
        some, sub = mechanisms[off], system.take(off)
        root = newton(sub, state[:, off], values[off].T / driver_units(some), CLOSING_STEPS)
        closed = reported(some, sub, root.state, values[off], root.found, at.evaluations[off])
        at.put(off[root.found], closed[root.found])
    return at
