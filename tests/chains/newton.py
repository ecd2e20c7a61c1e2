"""Chains closed by Newton's method on the equations of their joints, in real numbers; shares no formula with the core.

The unknowns are x, y and angle of each bar but the frame.  All arithmetic works for complex numbers too, so that a
Jacobian, and a derivative by a coordinate of the reference pose, is a complex step.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from catalogue.chains.chain import Chain
from catalogue.chains.poses import Poses

STEP = 1e-30


@dataclass
class Loops:
    """Equations of n chains; x, y (j, n) and angles (s, n) of the reference pose may be complex."""

    chain: Chain
    x: Any
    y: Any
    angle: Any

    @classmethod
    def of(cls, chain: Chain) -> Loops:
        return cls(chain, chain.z.real, chain.z.imag, np.angle(chain.u))

    @property
    def moving(self) -> list[int]:
        structure = self.chain.structure
        return [i for i in range(len(structure.bars)) if i != structure.frame]

    def unknowns(self, poses: Poses) -> Any:
        """Return the unknowns (m, n, 3 b) of poses."""
        found = []
        for bar in self.moving:
            shift = poses.at[bar] - poses.turn[bar] * poses.origin[bar]
            angle = np.angle(poses.turn[bar])
            found += [shift.real, shift.imag, angle]
        return np.stack(found, -1)

    def _bar(self, q: Any, bar: int) -> tuple[Any, Any, Any]:
        if bar == self.chain.structure.frame:
            zero = np.zeros_like(q[..., 0])
            return zero, zero, zero
        k = 3 * self.moving.index(bar)
        return q[..., k], q[..., k + 1], q[..., k + 2]

    def place(self, q: Any, bar: int, x: Any, y: Any) -> tuple[Any, Any]:
        """Return where a point of a bar is."""
        px, py, t = self._bar(q, bar)
        return px + np.cos(t) * x - np.sin(t) * y, py + np.sin(t) * x + np.cos(t) * y

    def closing(self, q: Any) -> Any:
        """Return what is off in the joints (m, n, r): lengths over the size, and angles."""
        structure, size, found = self.chain.structure, self.chain.size, []
        for joint, bars in enumerate(structure.on):
            first, *others = sorted(bars)
            x, y = self.place(q, first, self.x[joint], self.y[joint])
            for other in others:
                x2, y2 = self.place(q, other, self.x[joint], self.y[joint])
                found += [(x - x2) / size, (y - y2) / size]
        for slide, one in enumerate(structure.slides):
            rail, slider = structure.number(one.first), structure.number(one.second)
            t, t2 = self._bar(q, rail)[2], self._bar(q, slider)[2]
            near = self.x[0], self.y[0]
            (x, y), (x2, y2) = self.place(q, rail, *near), self.place(q, slider, *near)
            along = self.angle[slide] + t
            found += [np.sin(t2 - t), ((x2 - x) * np.sin(along) - (y2 - y) * np.cos(along)) / size]
        for gear in structure.gears:
            t, t2, c = (self._bar(q, structure.number(name))[2] for name in (gear.first, gear.second, gear.carrier))
            # angles are known up to whole turns, which a whole multiple of the ratio forgives
            teeth = Fraction(gear.ratio).limit_denominator(360)
            found.append(np.sin(teeth.denominator * (t2 - c) - teeth.numerator * (t - c)))
        return np.stack(found, -1)

    def driven(self, q: Any, drive: Any) -> Any:
        """Return how far the drive is from where it should be (m, n)."""
        bar, link = self.chain.structure.driver
        if not link.is_slide:
            return np.sin(self._bar(q, bar)[2] - drive)
        (x, y), angle = self.place(q, bar, self.x[0], self.y[0]), self.angle[link.joint]
        way = (x - self.x[0]) * np.cos(angle) + (y - self.y[0]) * np.sin(angle)
        return (way - drive) / self.chain.size

    def jacobian(self, function: Any, q: Any) -> Any:
        """Return the Jacobian (..., r, 3 b) by complex steps, one unknown after the other."""
        columns = []
        for k in range(q.shape[-1]):
            step = q.astype(complex)
            step[..., k] += 1j * STEP
            columns.append(function(step).imag / STEP)
        return np.stack(columns, -1)

    def scale(self, count: int) -> Any:
        """Return the unit of each unknown (n, 3 b): lengths by the size, angles by 1."""
        size = self.chain.size[:, None]
        return np.tile(np.concatenate([size, size, np.ones_like(size)], 1), count // 3)

    def corrected(self, q: Any, rounds: int = 3) -> Any:
        """Return the nearest unknowns that close, to second order."""
        unit = self.scale(q.shape[-1])
        for _ in range(rounds):
            jacobian = self.jacobian(self.closing, q) * unit[..., None, :]
            step = np.linalg.pinv(jacobian, rcond=1e-11) @ self.closing(q)[..., None]
            q = q - unit * step[..., 0]
        return q

    def solved(self, q: Any, drive: Any, rounds: int = 3) -> Any:
        """Return the unknowns at positions of the drive, from those near them."""

        def function(q: Any) -> Any:
            return np.concatenate([self.closing(q), self.driven(q, drive)[..., None]], -1)

        for _ in range(rounds):
            q = q - np.linalg.solve(self.jacobian(function, q), function(q)[..., None])[..., 0]
        return q

    def continued(self, q: Any, towards: Any, rounds: int = 5) -> Any:
        """Return the unknowns at which the motion from `q` meets the plane across it through `towards`."""
        unit = self.scale(q.shape[-1])
        tangent = np.linalg.svd(self.jacobian(self.closing, q) * unit[..., None, :])[2][..., -1, :]
        goal = ((towards - q) / unit * tangent).sum(-1)
        start, q = q, q + unit * tangent * goal[..., None]
        for _ in range(rounds):
            along = ((q - start) / unit * tangent).sum(-1) - goal
            rows = np.concatenate([self.jacobian(self.closing, q) * unit[..., None, :], tangent[..., None, :]], -2)
            off = np.concatenate([self.closing(q), along[..., None]], -1)[..., None]
            q = q - unit * np.linalg.solve(rows, off)[..., 0]
        return q
