"""Draw a scene in three dimensions, with equal scales and nearer parts over farther ones."""

from __future__ import annotations

from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...kinematics.types import Array
from ...paper import CRANK, FAINT, GREY, INK, PAPER, PATH, blank, kind_of, literal, write
from .lettering import Letters
from .scene import Body, Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Width and height [inch].
FIGURE_SIZE = (9.0, 7.0)
#: Fraction of the height for the title.
TITLE_HEIGHT = 0.1
#: Elevations of the views that are tried [deg].
ELEVATIONS = (16, 24, 32)
#: Azimuths of the views that are tried [deg].
AZIMUTHS = range(-175, 180, 10)
#: Colours of bodies, distinct for colour-blind readers (Okabe and Ito).
BODY_COLOURS = ("#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
#: Colours of paths.
PATH_COLOURS = (PATH, "#b5342b", "#8a6fb0")
#: Colour of guides and springs.
GUIDE_COLOUR = "#5b9aa0"
#: Opacity of ghosts.
GHOST_OPACITY = 0.22


def draw(scene: Scene, file: str | PathLike[str] | None = None, labels: bool = True) -> Figure:
    """Draw a scene; write it to a PNG, SVG or PDF file if one is given."""
    kind = kind_of(file) if file is not None else ""
    figure = blank(*FIGURE_SIZE)
    sheet = Sheet(figure, scene)
    for pose in reversed(range(len(scene.balls))):
        sheet.pose(pose)
    sheet.paths()
    sheet.triad()
    if labels:
        sheet.names()
    figure.text(0.04, 0.955, scene.title, fontsize=13, color=INK)
    figure.text(0.04, 0.922, scene.note, fontsize=9.5, color=GREY)
    literal(figure)
    if file is not None:
        write(figure, Path(file), kind)
    return figure


class Sheet:
    """Axes in three dimensions; symbols are drawn in order of depth."""

    def __init__(self, figure: Figure, scene: Scene) -> None:
        from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]  # it ships no types

        self.scene, self.figure = scene, figure
        add: Any = figure.add_axes
        self.ax = add((0.0, 0.0, 1.0, 1 - TITLE_HEIGHT), projection=Axes3D.name, computed_zorder=False)
        self.colours = {b.name: BODY_COLOURS[i % len(BODY_COLOURS)] for i, b in enumerate(scene.bodies)}
        low, high = scene.places.min(0), scene.places.max(0)
        room = np.maximum(high - low, 0.25 * scene.size) * 1.02
        for name, middle, half in zip("xyz", (low + high) / 2, room / 2, strict=True):
            getattr(self.ax, f"set_{name}lim")(middle - half, middle + half)
        elevation, azimuth = view(scene)
        self.ax.view_init(elev=elevation, azim=azimuth)
        self.ax.set_proj_type("ortho")
        self.ax.set_axis_off()
        self.ax.set_facecolor(PAPER)
        self.middle = (low + high) / 2
        self._fill_paper(room)
        self.toward = toward(elevation, azimuth)
        self.range = float(np.abs(room @ np.abs(self.toward))) or 1.0

    def _fill_paper(self, room: Array) -> None:
        """Set the scale so that the scene fills the paper."""
        self.ax.set_box_aspect(tuple(room), zoom=1.0)
        self.figure.draw_without_rendering()
        flat = self.flat(self.scene.places)
        box = self.ax.get_window_extent()
        taken = max(np.ptp(flat[:, 0]) / (0.86 * box.width), np.ptp(flat[:, 1]) / (0.84 * box.height))
        self.ax.set_box_aspect(tuple(room), zoom=1.0 / taken)
        self.figure.draw_without_rendering()
        flat, h = self.flat(self.scene.places), 0.1 * self.scene.size
        by = (self.flat(self.middle + h * np.eye(3)) - self.flat(self.middle)) / h
        off = (flat.min(0) + flat.max(0)) / 2 - [(box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2]
        for name, middle, half in zip("xyz", self.middle + np.linalg.pinv(by.T) @ off, room / 2, strict=True):
            getattr(self.ax, f"set_{name}lim")(middle - half, middle + half)
        self.figure.draw_without_rendering()

    def flat(self, x: Array) -> Array:
        """Return the positions (n, 2) of points (n, 3) on the paper [pixel]."""
        from mpl_toolkits.mplot3d import proj3d

        a, b, _ = proj3d.proj_transform(*np.reshape(x, (-1, 3)).T, self.ax.get_proj())
        return np.asarray(self.ax.transData.transform(np.stack([a, b], axis=1)))

    def depth(self, x: Array, above: float = 0.0) -> float:
        """Return the drawing order of a symbol at points (n, 3): 10 to 20, nearer ones higher."""
        return float(15 + 9 * ((np.reshape(x, (-1, 3)).mean(0) - self.middle) @ self.toward) / self.range + above)

    # -- symbols ---------------------------------------------------------------------------------
    def bar(self, ends: Array, width: float, colour: str, alpha: float = 1.0) -> None:
        """Draw a bar with a border, in pieces with their own depths."""
        pieces = 8 if alpha == 1 else 1
        x = ends[0] + np.linspace(0, 1, pieces + 1)[:, None] * (ends[1] - ends[0])
        for a, b in pairwise(x):
            z = self.depth(np.stack([a, b])) if alpha == 1 else 5.0
            if alpha == 1:
                self.ax.plot(*np.stack([a, b]).T, color=PAPER, lw=width + 2.2, zorder=z - 0.01, solid_capstyle="butt")
            cap = "round" if pieces == 1 else "projecting"
            self.ax.plot(*np.stack([a, b]).T, color=colour, lw=width, zorder=z, solid_capstyle=cap, alpha=alpha)

    def dots(self, x: Array, size: float, face: str, edge: str, marker: str = "o", above: float = 2.5) -> None:
        for p in np.reshape(x, (-1, 3)):
            self.ax.plot(
                *p[:, None], marker, ms=size, mfc=face, mec=edge, mew=1.1, zorder=self.depth(p, above), ls="none"
            )

    def pose(self, k: int) -> None:
        """Draw all parts in pose k; poses other than the first are ghosts."""
        scene, alpha = self.scene, 1.0 if k == 0 else GHOST_OPACITY
        for _, patch in scene.patches:
            if k == 0:
                grid = np.moveaxis(patch[0], -1, 0)
                self.ax.plot_surface(*grid, color=GUIDE_COLOUR, alpha=0.22, lw=0, shade=False, zorder=2)
                self.ax.plot_wireframe(*grid, color=GUIDE_COLOUR, alpha=0.35, lw=0.5, rcount=7, ccount=7, zorder=3)
        for _, curve in scene.curves:
            self.ax.plot(*curve[k].T, color=GUIDE_COLOUR, lw=2.0, alpha=alpha, zorder=4 if k == 0 else 3)
        for ring in scene.rings:
            z = self.depth(ring[k], -2) if k == 0 else 3
            self.ax.plot(
                *ring[k].T, color=GREY, lw=1.4 if k == 0 else 1.0, alpha=0.9 if k == 0 else GHOST_OPACITY, zorder=z
            )
        for body in scene.bodies:
            self.body(body, k)
        for link in scene.links:
            self.bar(link.ends[k], 3.2 if k == 0 else 1.6, CRANK, alpha=alpha)
        if k:
            return
        for axis in scene.axes:
            self.axis(axis.ends(scene.size)[0], axis.turns, axis.slides)
        self.dots(scene.fixed, 9.5, FAINT, GREY, "s", 2.4)
        self.dots(scene.balls[0], 6.0, PAPER, INK)

    def axis(self, ends: Array, turns: bool, slides: bool) -> None:
        """Draw a hinge as a sleeve, a slider as a block on a rail."""
        middle, half = ends.mean(0), (ends[1] - ends[0]) / 2
        self.ax.plot(
            *(middle + np.outer([-1.9, 1.9], half)).T,
            color=INK,
            lw=0.8,
            ls=(0, (9, 3, 2, 3)),
            zorder=self.depth(ends, 0.02),
        )
        symbol = (
            ((1.0, 2.2, INK), (0.45, 9.0, INK), (0.38, 6.6, GREY if turns else PAPER))
            if slides
            else ((1.0, 7.0, INK), (0.93, 4.8, PAPER))
        )
        for k, (share, width, colour) in enumerate(symbol):
            x = middle + np.outer([-share, share], half)
            self.ax.plot(*x.T, color=colour, lw=width, zorder=self.depth(ends, 0.5 + 0.01 * k), solid_capstyle="butt")

    def body(self, body: Body, k: int) -> None:
        """Draw a body as the edges of the hull of its points, faces translucent."""
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]  # it ships no types

        colour, x = self.colours[body.name], body.points[k]
        edges, faces = hull(x)
        if k == 0 and len(faces):
            self.ax.add_collection3d(
                Poly3DCollection(x[faces], facecolor=colour, alpha=0.16, lw=0, zorder=self.depth(x, -1))
            )
        for i, j in edges:
            if len(x) > 3 and k == 0:  # three-dimensional body
                self.ax.plot(*x[[i, j]].T, color=colour, lw=1.3, zorder=self.depth(x[[i, j]], -0.5))
            else:
                self.bar(x[[i, j]], 2.6 if k == 0 else 1.0, colour, alpha=1.0 if k == 0 else GHOST_OPACITY)
        for rod in body.rods[k]:
            self.bar(rod, 4.4 if k == 0 else 2.0, colour, alpha=1.0 if k == 0 else GHOST_OPACITY)

    def paths(self) -> None:
        for colour, (_, x) in zip(PATH_COLOURS * len(self.scene.paths), self.scene.paths.items(), strict=False):
            good = x[np.isfinite(x).all(1)]
            if len(good):
                self.ax.plot(*good.T, color=colour, lw=2.2, zorder=24)
                self.dots(good[[0, -1]], 3.2, colour, colour, above=12)

    def triad(self) -> None:
        """Draw the coordinate axes beside the mechanism, with their length as a scale."""
        scene = self.scene
        length = nice(0.16 * scene.size)
        flat = self.flat(np.eye(3) * length) - self.flat(np.zeros((1, 3)))
        box = self.ax.get_window_extent()
        shown, low = self.flat(scene.places), np.array([box.x0 + 0.04 * box.width, box.y0 + 0.055 * box.height])
        far = np.array([box.x1 - 0.04 * box.width - flat[:, 0].max(), low[1] - min(flat[:, 1].min(), 0)])
        near = low - np.minimum(flat.min(0), 0)
        room = [float(np.hypot(*(shown - c - flat.mean(0)).T).min()) for c in (near, far)]
        corner = near if room[0] >= min(room[1], 1.2 * float(np.hypot(*flat.T).max())) else far
        paper = self.figure.transFigure.inverted().transform
        for name, tip in zip("xyz", flat, strict=True):
            a, b = paper(corner), paper(corner + tip)
            from matplotlib.lines import Line2D

            self.figure.add_artist(Line2D([a[0], b[0]], [a[1], b[1]], color=INK, lw=1.2))
            end = paper(corner + tip + 9 * tip / max(float(np.hypot(*tip)), 1e-9) * self.figure.dpi / 72)
            self.figure.text(end[0], end[1], name, fontsize=9, color=INK, ha="center", va="center")
        self.figure.text(0.04, 0.02, f"axes {length:g} {scene.unit}", fontsize=8.5, color=GREY)

    def names(self) -> None:
        """Write names of links and bodies, and lengths of links, in free places."""
        scene = self.scene
        letters = Letters(self.figure)
        for x in (
            *(v.ends[0] for v in scene.links),
            *(v.points[0][list(e)] for v in scene.bodies for e in hull(v.points[0])[0]),
        ):
            letters.keep_off(self.flat(x[0] + np.linspace(0, 1, 25)[:, None] * (x[1] - x[0])))
        for rod in (r for v in scene.bodies for r in v.rods[0]):
            letters.keep_off(self.flat(rod[0] + np.linspace(0, 1, 25)[:, None] * (rod[1] - rod[0])), 3.0)
        for axis in scene.axes:
            ends = axis.ends(scene.size)[0]
            letters.keep_off(self.flat(ends[0] + np.linspace(-0.3, 1.3, 12)[:, None] * (ends[1] - ends[0])), 5.0)
        for _, curve in scene.curves:
            letters.keep_off(self.flat(curve[0]))
        for path in scene.paths.values():
            letters.keep_off(self.flat(path[np.isfinite(path).all(1)]))
        letters.keep_off(self.flat(scene.balls[0]), 6.0)
        for link in scene.links:
            length = float(np.sqrt(((link.ends[0, 1] - link.ends[0, 0]) ** 2).sum()))
            text = f"{link.name}  {length:.4g}".strip()
            letters.write(text, self.flat(link.ends[0]), CRANK)
        for body in scene.bodies:
            tips = body.rods[0].reshape(-1, 3)
            letters.write(
                body.name, self.flat(tips if len(tips) else body.points[0]), self.colours[body.name], bold=True
            )
        for name, guide in (*scene.curves, *scene.patches):
            letters.write(name, self.flat(guide[0].reshape(-1, 3)[[0, -1]]), GUIDE_COLOUR, at_ends=True)
        for colour, (name, x) in zip(PATH_COLOURS * len(scene.paths), scene.paths.items(), strict=False):
            good = x[np.isfinite(x).all(1)]
            if name and len(good):
                letters.write(name, self.flat(good[[0, -1]]), colour, at_ends=True)


def hull(x: Array) -> tuple[list[tuple[int, int]], Array]:
    """Return edges and faces (f, 3) of the convex hull of points (k, 3).

    For a flat hull the edges are those of its border.
    """
    from scipy.spatial import ConvexHull, QhullError

    if len(x) < 3:
        return [(i, i + 1) for i in range(len(x) - 1)], np.zeros((0, 3), int)
    c = x - x.mean(0)
    _, s, v = np.linalg.svd(c, full_matrices=False)
    rank = int((s > 1e-6 * s[0]).sum()) if s[0] else 0
    if rank < 2:
        order = np.argsort(c @ v[0])
        return [(int(order[0]), int(order[-1]))], np.zeros((0, 3), int)
    try:
        found = ConvexHull(c @ v[:rank].T)
    except QhullError:
        return [(i, j) for i in range(len(x)) for j in range(i)], np.zeros((0, 3), int)
    if rank == 2:
        corners = found.vertices
        return (
            [(int(corners[i - 1]), int(corners[i])) for i in range(len(corners))],
            np.array([(corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1)]),
        )
    return _crease_edges(found), found.simplices


def _crease_edges(found: Any) -> list[tuple[int, int]]:
    """Return edges between faces that are not in one plane."""
    normal: dict[tuple[int, int], list[Array]] = {}
    for face, plane in zip(found.simplices, found.equations, strict=True):
        for a, b in ((0, 1), (1, 2), (0, 2)):
            i, j = sorted((int(face[a]), int(face[b])))
            normal.setdefault((i, j), []).append(plane[:3])
    return [pair for pair, n in normal.items() if len(n) < 2 or n[0] @ n[1] < 1 - 1e-9]


def toward(elevation: float, azimuth: float) -> Array:
    """Return the direction to the eye."""
    e, a = np.radians(elevation), np.radians(azimuth)
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def view(scene: Scene) -> tuple[float, float]:
    """Return elevation and azimuth of the best view [deg].

    Joints are far apart in it, links little foreshortened.
    """
    x = np.concatenate(
        [scene.balls[0], *(v.points[0] for v in scene.bodies), *(v.rods[0].reshape(-1, 3) for v in scene.bodies)]
    )
    x = np.unique(np.round(x / scene.size, 6), axis=0)
    bars = np.array([v.ends[0, 1] - v.ends[0, 0] for v in scene.links]).reshape(-1, 3) / scene.size
    best, found = -np.inf, (24.0, -60.0)
    apart = (x[:, None] - x)[np.triu_indices(len(x), 1)]
    every = np.concatenate([apart, 2 * bars])
    for e in ELEVATIONS:
        for a in AZIMUTHS:
            to = toward(e, a)
            seen = every - (every @ to)[:, None] * to
            far = np.sqrt((seen * seen).sum(1))
            worth = float(np.log(far + 0.02).mean() + 0.5 * np.log(far.min(initial=1.0) + 0.02)) if len(far) else 0.0
            if worth > best + 1e-9:
                best, found = worth, (float(e), float(a))
    return found


def nice(length: float) -> float:
    """Round a length down to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(power * max(k for k in (1, 2, 5) if k * power <= length * (1 + 1e-9)))
