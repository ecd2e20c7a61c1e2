"""Symbols of links, pivots and sliders: sizes in points of paper, positions in the drawing."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..kinematics.types import Array, Complexes
from ..paper import GREY, INK, PAPER

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class SymbolSizes(NamedTuple):
    """Sizes of the symbols of a linkage [pt]."""

    link: float = 5.2  #: half the width of a link
    rod: float = 2.4  #: half the width of a coupler line
    pivot: float = 3.1  #: radius of a pivot


SYMBOL = SymbolSizes()

#: Drawing layer from which on a symbol is solid, so that no name may cover it.
SOLID = 3.0
#: Half the length and half the width of a block [point].
BLOCK = (13.0, 7.5)


@dataclass(frozen=True)
class Pen:
    """Draws symbols in axes of equal aspect."""

    axes: Axes
    point: float  #: length in the drawing of a point on paper
    taken: list[Complexes] = field(default_factory=list)  #: places of symbols that a name must not cover

    def line(self, z: Array, gid: str, **style: Any) -> None:
        """Draw a line through the points z."""
        from matplotlib.lines import Line2D

        style = {"solid_capstyle": "round", "solid_joinstyle": "round", "clip_on": False, **style}
        self._reserve(z, style["zorder"])
        self.axes.add_line(Line2D(z.real, z.imag, gid=gid, **style))

    def _plate(
        self, z: Complexes, radius: float, gid: str, face: object, edge: object, width: float, zorder: float
    ) -> None:
        """Fill the outline at a radius [point] about the convex hull of z, with a border."""
        from matplotlib.patches import Polygon

        z = rounded(z, radius * self.point)
        self._reserve(np.append(z, z[0]), zorder)
        self.axes.add_patch(
            Polygon(
                np.stack([z.real, z.imag], 1),
                closed=True,
                gid=gid,
                clip_on=False,
                joinstyle="round",
                facecolor=face,
                edgecolor=edge,
                linewidth=width,
                zorder=zorder,
            )
        )

    def _reserve(self, z: Array, zorder: float) -> None:
        if zorder >= SOLID:
            z = z[np.isfinite(z)]
            run = np.append(0, np.cumsum(np.abs(np.diff(z))))
            at = np.linspace(0, run[-1], 2 + int(run[-1] / (2 * self.point)))
            self.taken.append(np.interp(at, run, z.real) + 1j * np.interp(at, run, z.imag))

    def name(self, z: complex, text: str, gid: str, colour: str) -> None:
        """Write a name beside the point z where there is room."""
        taken = np.concatenate(self.taken)
        ways = np.exp(1j * np.pi * np.arange(24) / 12)
        extent = np.array([-5, 0, 5]) * self.point

        def room(at: complex) -> float:
            clear = float(np.abs(at + extent[:, None] - taken).min()) / self.point
            return min(clear, 7.5) - 0.12 * abs(at - z) / self.point

        at = max((z + far * self.point * way for far in (14, 18, 22, 27, 33) for way in ways), key=room)
        self.axes.text(
            at.real,
            at.imag,
            text,
            gid=gid,
            size=11,
            math_fontfamily="stix",
            color=colour,
            ha="center",
            va="center",
            zorder=12,
        )
        self.taken.append(at + extent)

    def link(
        self, z: Complexes, gid: str, colour: str, *, ghost: bool = False, width: float = SYMBOL.link, zorder: float
    ) -> None:
        """Draw the link whose corners are z: a plate with round ends about them."""
        face, edge = (0.05, 0.28) if ghost else (0.17, 1.0)
        self._plate(z, width, gid, (colour, face), (colour, edge), 0.7 if ghost else 1.3, zorder)

    def pivot(self, z: complex, gid: str, colour: str = INK, *, ghost: bool = False, zorder: float = 9) -> None:
        """Draw a turning joint."""
        radius, edge, width = (0.7 * SYMBOL.pivot, (colour, 0.35), 0.7) if ghost else (SYMBOL.pivot, colour, 1.4)
        self._plate(np.array([z]), radius, gid, PAPER, edge, width, zorder)

    def dot(self, z: complex, gid: str, colour: str, *, ghost: bool = False, zorder: float = 10) -> None:
        """Draw a guided point."""
        radius, face, edge = (2.2, PAPER, colour) if ghost else (3.4, colour, PAPER)
        self._plate(np.array([z]), radius, gid, face, edge, 1.0, zorder)

    def ground(self, z: complex, gid: str, down: complex) -> None:
        """Draw the bracket that holds a fixed pivot, its foot in the unit direction `down`."""
        p, across = self.point * down, 1j * self.point * down
        foot = z + 15 * p
        corner = np.array([z - 2 * across, z + 2 * across, foot + 8 * across, foot - 8 * across])
        self._plate(corner, 2.2, gid, PAPER, GREY, 1.1, 3)
        foot = foot + 2.2 * p
        self.hatched(foot - 14 * across, foot + 14 * across, down, gid + "-hatching")

    def hatched(self, a: complex, b: complex, towards: complex, gid: str) -> None:
        """Draw the fixed line from a to b with hatching on the side `towards`."""
        along = (b - a) / abs(b - a)
        count = max(2, round(abs(b - a) / (5 * self.point)))
        start = a + (np.arange(count) + 0.75) / count * (b - a)
        strokes = np.stack([start, start + 5 * self.point * (towards - along), np.full(count, np.nan)], 1)
        self.line(strokes.ravel(), gid, color=GREY, linewidth=0.7, zorder=3)
        self.line(np.array([a, b]), gid + "-line", color=GREY, linewidth=1.3, zorder=3)

    def track(self, at: complex, normal: complex, run: tuple[float, float], others: Complexes, gid: str) -> None:
        """Draw the rail of a slider over its `run`, on the side away from the `others`."""
        side = -1.0 if ((others - at) * normal.conjugate()).real.sum() > 0 else 1.0
        foot, along = at + side * BLOCK[1] * self.point * normal, 1j * normal
        self.hatched(foot + run[0] * along, foot + run[1] * along, side * normal, gid)

    def block(self, z: complex, gid: str, along: complex, colour: str, *, ghost: bool = False, zorder: float) -> None:
        """Draw a sliding block about z."""
        length, width = ((b - 1.5) * self.point * d for b, d in zip(BLOCK, (along, 1j * along), strict=True))
        corner = z + np.array([length + width, width - length, -length - width, length - width])
        face, edge, width = ("none", 0.28, 0.7) if ghost else (PAPER, 1, 1.3)
        self._plate(corner, 1.5, gid, face, (colour, edge), width, zorder)


def rounded(z: Complexes, radius: float) -> Complexes:
    """Return the outline at a distance `radius` about the convex hull of z."""
    corner = [z[0]]
    for c in z[1:]:
        if min(abs(c - other) for other in corner) > 1e-6 * radius:
            corner.append(c)
    z = np.array(corner)
    if len(z) == 1:
        return np.asarray(z[0] + radius * np.exp(2j * np.pi * np.arange(48) / 48))
    if (z.conj() * np.roll(z, -1)).imag.sum() < 0:
        z = z[::-1]
    out = np.roll(z, -1) - z
    normal = -1j * out / np.abs(out)
    turn = np.angle(normal / np.roll(normal, 1)) % (2 * np.pi)
    turn = np.where(turn > 1.5 * np.pi, 0, turn)  # corners on one line: no arc between their sides
    arcs = np.roll(normal, 1)[:, None] * np.exp(1j * turn[:, None] * np.linspace(0, 1, 24))
    return np.asarray((z[:, None] + radius * arcs).ravel())
