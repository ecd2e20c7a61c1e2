"""Place labels beside points of a small figure, without overlaps."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..kinematics.types import Array, Complexes, Floats
from ..paper import PAPER
from .symbols import Pen

#: Trial distances of a label from its point [point].
STEPS = (7.0, 9.5, 12.5, 16.0, 20.0, 25.0, 31.0)


class LabelCosts(NamedTuple):
    """Costs of placing a label."""

    solid: float = 8.0  #: cost of covering part of a linkage, or another label
    curve: float = 0.35  #: cost of covering part of a curve
    spare: float = 2.0  #: margin of a label [pt]


COST = LabelCosts()


@dataclass
class Labels:
    """Chooses places in a square figure."""

    pen: Pen
    centre: complex
    half: float  #: half the side of the square
    point: float  #: length of a point of paper in the drawing, independent of the scale of symbols
    _places: list[Array] = field(default_factory=list)
    _weights: list[Floats] = field(default_factory=list)

    def avoid(self, z: Complexes, weight: float) -> None:
        """Keep labels off a line through the points z, or off a single point."""
        z = np.atleast_1d(z)
        if len(z) == 1:
            self._add(z, weight)
            return
        shown = np.isfinite(z[:-1]) & np.isfinite(z[1:])
        a, b = z[:-1][shown], z[1:][shown]
        near = np.maximum(self.out(a), self.out(b)) < 2 * self.half
        a, along = a[near], (b - a)[near]
        count = 2 + (np.abs(along) / (2 * self.point)).astype(int)
        each = np.repeat(np.arange(len(a)), count)
        number = np.arange(len(each)) - np.repeat(np.cumsum(count) - count, count)
        self._add(a[each] + along[each] * number / (count[each] - 1), weight)

    def _add(self, z: Array, weight: float) -> None:
        self._places.append(z)
        self._weights.append(np.full(len(z), weight))

    def out(self, z: Complexes) -> Floats:
        """Return the distances of points z from the square, negative inside."""
        off = z - self.centre
        return np.maximum(np.abs(off.real), np.abs(off.imag)) - self.half

    def write(self, z: complex, text: str, gid: str, size: float, width: float, **style: Any) -> None:
        """Write a label, `width` times its size wide, close to the point z."""
        from matplotlib.patheffects import withStroke

        a, b = 0.5 * width * size + COST.spare, 0.45 * size + COST.spare
        taken, weight = np.concatenate(self._places), np.concatenate(self._weights)
        reached = np.abs(taken - z) <= (STEPS[-1] + 2 * np.hypot(a, b)) * self.point
        taken, weight = (taken[reached] - z) / self.point, weight[reached]
        x, y = taken.real, taken.imag
        least, best = np.inf, z
        for far in STEPS:
            for way in np.exp(2j * np.pi * np.arange(32) / 32):
                # the distance is that of the word's edge, not of its middle
                off = way * (far + min(a / max(abs(way.real), 1e-9), b / max(abs(way.imag), 1e-9)) - b)
                at = z + off * self.point
                covered = weight @ ((np.abs(x - off.real) < a) & (np.abs(y - off.imag) < b))
                edge = np.maximum(
                    np.abs((at - self.centre).real) + a * self.point, np.abs((at - self.centre).imag) + b * self.point
                )
                cost = covered + 0.16 * far + (1e6 if edge > self.half else 0)
                if cost < least:
                    least, best = cost, at
        halo = [withStroke(linewidth=2.2, foreground=PAPER)]
        self.pen.axes.text(
            best.real,
            best.imag,
            text,
            gid=gid,
            size=size,
            ha="center",
            va="center",
            zorder=14,
            path_effects=halo,
            **style,
        )
        box = np.linspace(-1, 1, 9)
        self._add((best + self.point * (a * box[:, None] + 1j * b * box)).ravel(), COST.solid)
