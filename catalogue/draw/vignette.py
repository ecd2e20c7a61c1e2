"""One cell of a plate: axes, circles, cubics, linkage and guided points, clipped to a square."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..curvature_theory.analysis import PARALLEL
from ..kinematics.linkage import PR, RP, RR
from ..kinematics.types import Complexes
from ..paper import COUPLER, CRANK, GREY, INK, PATH, SERIF
from .cells import CELLS, Cell
from .cubics import circle, cubic, hyperbola
from .labels import COST, Labels
from .symbols import BLOCK, SYMBOL, Pen

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Directions of a bearing, the usual one first.
BEARING_DIRECTIONS = (-1j, 1j, 1 + 0j, -1 + 0j)
#: Colour of the fixed plane; that of the moving plane is the colour of the coupler.
FIXED = "#00805e"


class CellLayout(NamedTuple):
    """Layout of a cell of a plate."""

    small: float = 0.62  #: scale of symbols relative to those on a sheet
    border: float = 19.0  #: margin of the figure [pt]
    path: float = 17.0  #: half the length of a guided path [pt]


VIGNETTE = CellLayout()

DASHED = (0, (4, 2.6))


class Vignette:
    """Draws a cell in square axes with a side in points.

    `prefix` begins the names of all elements.
    """

    def __init__(self, axes: Axes, cell: Cell, points: float, prefix: str) -> None:
        self.cell, self.prefix = cell, prefix
        self.parallel = bool(cell.curvature.state[0] == PARALLEL)
        self.kinds = cell.linkage.dyads[0]
        self.z = cell.linkage.points[0]
        self.joint = self._coupler_ends()
        self.centre, half = self._bounding_square()
        self.half = half / (1 - 2 * VIGNETTE.border / points)
        self.point = 2 * self.half / points
        self.pen = Pen(axes, VIGNETTE.small * self.point)
        self.labels = Labels(self.pen, self.centre, self.half, self.point)
        axes.set_xlim(self.centre.real - self.half, self.centre.real + self.half)
        axes.set_ylim(self.centre.imag - self.half, self.centre.imag + self.half)

    def _coupler_ends(self) -> Complexes:
        """Return the ends of the coupler: moving pivots, or feet on the slots."""
        z, kinds = self.z, self.kinds
        ends = z[:, 1].copy()
        if (kinds == RP).all():  # two slides: the point where their lines meet
            (n1, n2), (c1, c2) = z[:, 1], (z[:, 0] * z[:, 1].conj()).real
            return np.full(2, 1j * (n1 * c2 - n2 * c1) / (n1.conjugate() * n2).imag)
        for i in np.flatnonzero(kinds == RP):
            ends[i] = z[1 - i, 1] - ((z[1 - i, 1] - z[i, 0]) * z[i, 1].conjugate()).real * z[i, 1]
        return np.asarray(ends)

    def _bounding_square(self) -> tuple[complex, float]:
        """Return centre and half side of the least square about circles and linkage."""
        guided = np.concatenate([g.pairs[0] for g in self.cell.guided] or [np.zeros((0, 3))])
        guided = (guided[:, 0] + 1j * guided[:, 1])[guided[:, 2] != 0]
        held = [self.z[self.cell.linkage.finite[0]], self.joint, guided[np.abs(guided) <= CELLS.far], np.zeros(1)]
        if not self.parallel:
            held.append(np.array([0.5 + 1j, -0.5 - 1j]))
        z = np.concatenate(held)
        low, high = complex(z.real.min(), z.imag.min()), complex(z.real.max(), z.imag.max())
        return 0.5 * (low + high), 0.5 * max((high - low).real, (high - low).imag)

    def draw(self) -> None:
        """Draw everything, the names last."""
        self._draw_axes()
        self._draw_loci()
        self._draw_rays()
        self._linkage()
        names = [self._draw_guided_pair(number) for number in range(len(self.cell.guided))]
        self.pen.dot(0j, self.prefix + "pole", INK, zorder=11)
        for z in self.pen.taken:
            self.labels.avoid(z, COST.solid)
        style = {"family": SERIF, "math_fontfamily": "stix"}
        for at, text, gid in names:
            width = 0.5 * len(text)
            self.labels.write(
                at, text, gid, 7.8, width, color=PATH, style="normal" if "[" in text else "italic", **style
            )
        end = self.centre + (1 + 1j) * (self.half - 7 * self.point)
        for at, text, gid in ((complex(end.real, 0), "x", "tangent"), (complex(0, end.imag), "y", "normal")):
            self.labels.write(at, text, f"{self.prefix}name-{gid}", 7.5, 0.5, color=GREY, style="italic", **style)
        if not self.parallel:
            self.labels.write(0j, "Q", self.prefix + "name-pole", 7.8, 0.7, color=INK, style="italic", **style)

    def _line(self, z: Complexes, gid: str, colour: str, width: float, zorder: float, dash: object = "-") -> None:
        self.pen.line(z, self.prefix + gid, color=colour, linewidth=width, zorder=zorder, linestyle=dash, clip_on=True)
        self.labels.avoid(z, COST.curve)

    def _draw_axes(self) -> None:
        end, tip = self.centre + (1 + 1j) * self.half, 4.5 * self.point
        start = self.centre - (1 + 1j) * self.half
        for gid, a, b in (
            ("tangent", complex(start.real, 0), complex(end.real, 0)),
            ("normal", complex(0, start.imag), complex(0, end.imag)),
        ):
            along = (b - a) / abs(b - a)
            self._line(np.array([a, b]), gid, GREY, 0.5, 0.5)
            self.pen.line(
                b + tip * np.array([-along + 0.3j * along, 0, -along - 0.3j * along]),
                self.prefix + gid + "-tip",
                color=GREY,
                linewidth=0.6,
                zorder=0.5,
            )

    def _draw_loci(self) -> None:
        """Draw the two circles and the two cubics, those of the fixed plane below."""
        at = self.cell.curvature
        reach = 2 * (abs(self.centre) + 2 * self.half)
        if self.parallel:
            curves = [hyperbola(float(k[0]), reach) for k in (at.k, at.k_star)]
        else:
            unit, s = float(at.rho0[0]), float(at.s[0])
            curves = [cubic(float(k[0]) * unit, s * unit, reach) for k in (at.kappa, at.kappa_star)]
            self._line(circle(-1j), "return-circle", FIXED, 0.8, 1.0, DASHED)
            self._line(circle(1j), "inflection-circle", COUPLER, 0.8, 1.0, DASHED)
        for gid, parts, colour, width, level in (
            ("centring", curves[0], FIXED, 2.0, 1.2),
            ("circling", curves[1], COUPLER, 1.0, 1.4),
        ):
            for i, part in enumerate(parts):
                self._line(part, f"{gid}-{i + 1}", colour, width, level)

    def _draw_rays(self) -> None:
        """Draw the rays through fixed pivot, moving pivot and pole."""
        for i, ray in enumerate(self.cell.linkage.rays[0]):
            pivots = self.z[i][self.cell.linkage.finite[0, i]]
            if not self.parallel:
                ends = np.array([0j, *pivots]) * ray.conjugate()
                z = ray * np.array([ends.real.min(), ends.real.max()])
                self._line(z, f"ray-{i + 1}", GREY, 0.6, 1.6, (0, (1, 2)))

    def _linkage(self) -> None:
        pen = self.pen
        pen.link(self.joint, self.prefix + "coupler", COUPLER, zorder=4)
        for i, kind in enumerate(self.kinds):
            (fixed, moving), name, rod = self.z[i], f"{self.prefix}%s-{i + 1}", None
            if kind == PR:
                others = np.append(self.z[self.cell.linkage.finite[0]], 0)
                half = 2.1 * BLOCK[0] * pen.point
                pen.track(moving, fixed, (-half, half), others, name % "guide")
            else:
                pen.ground(fixed, name % "ground", self._bearing_direction(i))
                pen.pivot(fixed, name % "fixed-pivot")
            if kind == RP:
                along, foot = 1j * moving, self.joint[i]
                ends = np.array([((fixed - foot) * along.conjugate()).real, 0])
                spare = (BLOCK[0] + 10) * pen.point * np.array([-1, 1])
                rod = foot + along * (np.sort(ends) + spare)
            self._draw_dyad(kind, fixed, moving, rod, name)

    def _draw_dyad(self, kind: int, fixed: complex, moving: complex, rod: Complexes | None, name: str) -> None:
        """Draw the moving parts of a dyad, without coupler; `rod` is the line of a slide, (2,)."""
        pen = self.pen
        if kind == RR:
            pen.link(np.array([fixed, moving]), name % "crank", CRANK, zorder=5)
        elif kind == PR:
            pen.block(moving, name % "slider", 1j * fixed, CRANK, zorder=4.5)
        elif rod is not None:
            pen.link(rod, name % "line", COUPLER, width=SYMBOL.rod, zorder=4.2)
            pen.block(fixed, name % "slide", 1j * moving, CRANK, zorder=5.5)
        if kind != RP:
            pen.pivot(moving, name % "moving-pivot")

    def _bearing_direction(self, i: int) -> complex:
        """Return the direction in which a bracket covers least of the linkage."""
        fixed, share = self.z[i, 0], np.linspace(0, 1, 101)
        links = [self.joint, *(self.z[j] for j in (0, 1) if self.kinds[j] == RR)]
        parts = np.concatenate([a + share * (b - a) for a, b in links]) - fixed
        near = (np.abs(parts) > 3 * self.pen.point) & (np.abs(parts) < 26 * self.pen.point)
        ways = parts[near] / np.abs(parts[near])
        if self.kinds[i] == RP:
            ways = np.append(ways, [1j * self.z[i, 1], -1j * self.z[i, 1]])

        def hidden(down: complex) -> float:
            return max(0.6, float((ways * down.conjugate()).real.max(initial=0)))

        return min(BEARING_DIRECTIONS, key=hidden)

    def _draw_guided_pair(self, number: int) -> tuple[complex, str, str]:
        """Draw a guided pair.

        Return the place of its name, the name and the kind of element.
        """
        guided = self.cell.guided[number]
        gid = f"guided-{number + 1}"
        pair, finite = guided.pairs[0, :, 0] + 1j * guided.pairs[0, :, 1], guided.pairs[0, :, 2] != 0
        (fixed, moving), seen = pair, finite & (self.labels.out(pair) < 0)
        # draw the ray up to both points, or to the frame
        ends = [*pair[finite], *([] if self.parallel or not finite.all() else [0j])]
        if len(ends) > 1:
            far = max(ends, key=lambda end: abs(end - ends[-1]))
            way = (far - ends[-1]) / abs(far - ends[-1])
            along = (np.array(ends) * way.conjugate()).real
            z = ends[0] + way * (np.array([along.min(), along.max()]) - along[0])
            self._line(z, gid + "-ray", PATH, 0.6, 1.8, (0, (5, 2)))
        if seen[1]:
            self._path(moving, fixed if finite[0] else None, fixed, gid)
            self.pen.dot(moving, self.prefix + gid + "-moving", PATH, zorder=10.5)
        elif not finite[1]:
            across = 1j * moving * VIGNETTE.path * self.point
            for side in (-1, 1):
                z = fixed + side * 1.7 * self.point * moving + np.array([-across, across])
                self._line(z, f"{gid}-slot-{side + 2}", PATH, 1.0, 7)
        if seen[0]:
            self.pen.pivot(fixed, self.prefix + gid + "-fixed", PATH, zorder=10)
        at = moving if seen[1] else fixed if seen[0] else self._point_on_border(moving if finite[1] else fixed)
        return at, guided.label, self.prefix + gid

    def _path(self, moving: complex, centre: complex | None, normal: complex, gid: str) -> None:
        """Draw the circle or straight line of a guided point, on both sides of it."""
        run = VIGNETTE.path * self.point * np.linspace(-1, 1, 41)
        if centre is None:
            z = moving + 1j * normal * run
        else:
            arm = moving - centre
            z = centre + arm * np.exp(1j * np.clip(run / abs(arm), -1.2, 1.2))
        self.pen.line(z, self.prefix + gid + "-path", color=PATH, linewidth=1.7, zorder=7)

    def _point_on_border(self, z: complex) -> complex:
        """Return the point of the frame towards a point outside it, seen from the pole."""
        off = z - self.centre
        return self.centre + off * 0.93 * self.half / max(abs(off.real), abs(off.imag))
