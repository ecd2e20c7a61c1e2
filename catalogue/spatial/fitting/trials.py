"""Sweep, read and differentiate mechanisms with moved hard points, many at once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import InvalidLinkage, InvalidRequest
from ...kinematics.types import Array
from ..jointed.curve import Curve
from ..jointed.hard_points import numbers
from ..jointed.mechanism import Mechanism
from ..jointed.motion import Motion, taken
from ..jointed.newton import solved
from ..jointed.sensitivity import STEP
from ..jointed.system import System
from .boxes import Variables
from .targets import Bound, Sweep, Target

#: Reasons for the refusal of a trial.
OTHER_ASSEMBLY = "its design pose is another assembly"


@dataclass(frozen=True, eq=False)
class Stacked(Motion):
    """Motions of many mechanisms as one, pose after pose."""

    def flat(self) -> tuple[Curve, Array]:
        return self.curve, self.states[0]

    def each(self, value: Any, what: str) -> Array:
        found = numbers(value, what)
        if len(found) not in (1, self.states.shape[1]):
            raise InvalidRequest(f"{what} must be one for all")
        return found


@dataclass(frozen=True, eq=False)
class Trial:
    """A mechanism at variables u (k,): motions, and readings (s, c) of targets and bounds."""

    u: Array
    motions: tuple[Motion, ...]
    read: tuple[Array, ...]


class Trials:
    """Make trials, and count refused ones by reason.

    Attributes
    ----------
    refused : Counter
        Number of trials that did not complete all sweeps, by reason.
    made : int
        Number of all trials.
    """

    def __init__(self, variables: Variables, curves: Sequence[Target | Bound]) -> None:
        self.variables, self.curves = variables, tuple(curves)
        self.sweeps: list[Sweep] = list({id(c.over): c.over for c in curves}.values())
        self.over = [self.sweeps.index(c.over) for c in curves]
        self.pointwise: dict[int, bool] = {}
        self.refused: Counter[str] = Counter()
        self.made = 0
        self.side = [_jacobian_signs(variables.mechanism, sweep) for sweep in self.sweeps]

    # -- whole sweeps ----------------------------------------------------------------------------
    def at(self, u: Array) -> Trial | None:
        """Return the trial at variables (k,); None, and counted, if refused."""
        return self.batch(u[None])[0]

    def batch(self, u: Array) -> list[Trial | None]:
        """Return trials at variables (n, k); None where refused."""
        motions, reasons = self._motions(u)
        self.made += len(u)
        self.refused.update(r for r in reasons if r)
        out: list[Trial | None] = []
        for i, reason in enumerate(reasons):
            own = tuple(motions[i]) if not reason else ()
            out.append(None if reason else Trial(u[i], own, tuple(self._read(c, own[k]) for c, k in self._pairs())))
        return out

    def _pairs(self) -> list[tuple[Target | Bound, int]]:
        return list(zip(self.curves, self.over, strict=True))

    def _motions(self, u: Array) -> tuple[list[list[Motion]], list[str]]:
        """Return motions of each mechanism over every sweep, and reasons of refusals."""
        try:
            mechanism = self.variables.moved(u)
            swept = [mechanism.sweep(s.drive, s.values, s.hold) for s in self.sweeps]
            sides = [_jacobian_signs(mechanism, s) for s in self.sweeps]
        except (InvalidLinkage, InvalidRequest) as error:
            if len(u) == 1:
                return [[]], [str(error)]
            each = [self._motions(one[None]) for one in u]  # one of them makes the batch fail
            return [m for found, _ in each for m in found], [r for _, reasons in each for r in reasons]
        reasons = [""] * len(u)
        for motion, side, home in zip(swept, sides, self.side, strict=True):
            for i in range(len(u)):
                if not np.isfinite(motion.states[i]).all():
                    reasons[i] = reasons[i] or next((end[1] for end in motion.ends[i] if end), "a pose was not found")
                elif side[i] != home[0]:
                    reasons[i] = reasons[i] or OTHER_ASSEMBLY
        motions: list[list[Motion]] = []
        for i in range(len(u)):
            one = self.variables.moved(u[i : i + 1]) if len(u) > 1 and not reasons[i] else mechanism
            motions.append([_motion_of_one(one, motion, i) for motion in swept] if not reasons[i] else [])
        return motions, reasons

    @staticmethod
    def _read(curve: Target | Bound, motion: Motion) -> Array:
        """Return the reading (s, c) of a target or bound from the motion of one mechanism."""
        found = taken(motion, curve.reading, f"{curve.name}: reading")
        if found.ndim not in (1, 2) or len(found) != motion.states.shape[1]:
            raise InvalidRequest(
                f"{curve.name}: its reading gives shape {found.shape}, not a number or a vector for each pose"
            )
        return found.reshape(len(found), -1)

    # -- derivatives -----------------------------------------------------------------------------
    def gradient(self, trial: Trial) -> list[Array]:
        """Return the derivatives (s, c, k) of the readings by the variables.

        Central differences of exact solutions; all displaced mechanisms are solved at once, from
        the poses of the trial.
        """
        k = len(self.variables.half)
        step = STEP * trial.motions[0].curve.system.unit / self.variables.half
        u = np.concatenate([trial.u + np.diag(step), trial.u - np.diag(step)])
        stacks = [self._displaced(trial, motion, u) for motion in trial.motions]
        out = []
        for index, (curve, which) in enumerate(self._pairs()):
            stack, base = stacks[which], trial.read[index]
            read = self._read_all(index, curve, stack, u).reshape(2 * k, *base.shape)
            out.append(np.moveaxis((read[:k] - read[k:]) / (2 * step[:, None, None]), 0, -1))
        return out

    def _displaced(self, trial: Trial, motion: Motion, u: Array) -> Stacked:
        """Return the motions of mechanisms at variables u (n, k) next to a trial, stacked."""
        system, (n, s) = motion.curve.system, (len(u), motion.states.shape[1])
        shift = self.variables.in_system(system, self.variables.displacement(u - trial.u))
        moved = system.with_points(system.points + shift)
        design = np.repeat(moved.design[None], n, axis=0)
        held = moved.evaluate(design)[1][:, :-1] if motion.held else np.zeros((n, 0))
        curve = Curve(moved, held).take(np.repeat(np.arange(n), s))
        drive = np.tile(motion.drive, n)
        states, good = solved(curve, np.tile(motion.states[0], (n, 1)), drive / system.scalars[-1].unit)
        states[~good] = np.nan
        mechanism = Mechanism(self.variables.elements(u, repeat=s), motion.mechanism.unit)
        return Stacked(mechanism, curve, motion.driven, motion.held, drive, states[None], ((None, None),))

    def _read_all(self, index: int, curve: Target | Bound, stack: Stacked, u: Array) -> Array:
        """Return readings of all stacked poses, in one call if the reading is pointwise."""
        if index not in self.pointwise:
            self.pointwise[index] = self._is_pointwise(curve, stack, u)
        if self.pointwise[index]:
            return self._read(curve, stack)
        return np.concatenate([self._read(curve, self._single_motion(stack, u, i)) for i in range(len(u))])

    def _is_pointwise(self, curve: Target | Bound, stack: Stacked, u: Array) -> bool:
        """Return whether first and last mechanism of a stack have equal readings if read
        separately.
        """
        try:
            read = self._read(curve, stack)
        except Exception:  # a user's reading may fail on poses of many mechanisms
            return False
        parts = read.reshape(len(u), -1, read.shape[1])
        ends = [self._read(curve, self._single_motion(stack, u, i)) for i in (0, len(u) - 1)]
        return all(
            one.shape == there.shape and np.allclose(there, one, 1e-9, 1e-12, equal_nan=True)
            for one, there in zip(ends, (parts[0], parts[-1]), strict=True)
        )

    def _single_motion(self, stack: Stacked, u: Array, i: int) -> Motion:
        """Return the motion of one mechanism of a stack."""
        s = stack.states.shape[1] // len(u)
        here = slice(i * s, (i + 1) * s)
        return Motion(
            self.variables.moved(u[i : i + 1]),
            stack.curve.take(np.array([i * s])),
            stack.driven,
            stack.held,
            stack.drive[here],
            stack.states[:, here],
            ((None, None),),
        )


def _motion_of_one(mechanism: Mechanism, motion: Motion, i: int) -> Motion:
    """Return the motion of one mechanism of a batch."""
    if len(motion.states) == 1:
        return motion
    return Motion(
        mechanism,
        motion.curve.take(np.array([i])),
        motion.driven,
        motion.held,
        motion.drive,
        motion.states[i : i + 1],
        motion.ends[i : i + 1],
    )


def _jacobian_signs(mechanism: Mechanism, sweep: Sweep) -> list[tuple[float, int]]:
    """Return sign of the determinant and size of the Jacobian in each design pose.

    The sign changes at singular poses.
    """
    system: System = mechanism.system(*mechanism.couplings, *sweep.hold, sweep.drive)
    design = np.repeat(system.design[None], len(system.points), axis=0)
    jacobian = system.evaluate(design)[2]
    rows = np.concatenate([system.use, np.arange(system.rows, jacobian.shape[1])])
    square = jacobian[:, rows]
    if square.shape[1] != square.shape[2]:
        return [(0.0, 0)] * len(square)
    return [(float(sign), len(rows)) for sign in np.linalg.slogdet(square)[0]]
