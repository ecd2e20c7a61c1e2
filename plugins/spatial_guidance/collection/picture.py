"""Draw a guided body in space.

Guides are translucent. The body is drawn in mid-stroke and, as ghosts, at the ends, with the path
of its point.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from catalogue.plugin import PAPER, Array, blank, kind_of, write
from catalogue.spatial import KINDS, Kind, follow, matrix

from .measures import fitted, run
from .minimum_zone import Fit, unit
from .plain_data import Strokes, strokes

if TYPE_CHECKING:
    from catalogue.plugin import CollectionCandidate


class View(NamedTuple):
    """Extent and resolution of a drawing."""

    nodes: int = 41  #: number of nodes of the motion
    mesh: int = 25  #: number of points of a patch along each coordinate
    beyond: float = 0.35  #: angle of a patch beyond the path of its point [rad]
    further: float = 0.12  #: length of a patch beyond the path of its point [sizes of the drawing]
    longer: float = 0.15  #: length of the nominal beyond either end of the path [paths]


VIEW = View()

#: Height of the point of view [deg].
ELEVATION = 24
#: Trial directions of view [deg].
AZIMUTHS = range(-100, 101, 5)
INK = "#222222"
BODY = "#2f5d8a"
PATH = "#b5342b"
CURVE = "#3d7a4e"
SURFACES = ("#c9a227", "#8a6fb0", "#5b9aa0", "#c07a4a", "#7d9b5a")


def picture(piece: CollectionCandidate, file: Path | None) -> Any:
    """Draw a mechanism in three dimensions, in its own frame: the stroke from the origin along x.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    MissingExtra
        Without matplotlib.
    InvalidRequest
        If the file cannot be written.
    """
    kind = kind_of(file) if file is not None else ""
    figure = blank(8.5, 7.5)
    from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]  # it ships no types

    ax: Any = figure.add_axes((0.0, 0.0, 1.0, 0.92), projection=Axes3D.name, computed_zorder=False)
    given = strokes([piece.parameters])
    share = np.linspace(0, 1, VIEW.nodes)[:, None]
    path = given.path[0, 0] + share * (given.path[0, 1] - given.path[0, 0])
    moved = follow(given.mechanisms, path[None], given.start).positions
    turn = np.moveaxis(matrix(moved.quaternion.T), 2, 0)
    guided = moved.translation + np.einsum("sij,j->si", turn, given.point[0])
    cloud = np.concatenate([moved.points.reshape(-1, 3), guided])
    low, high = cloud.min(0), cloud.max(0)
    size = float(np.sqrt(((high - low) ** 2).sum()))
    _guides(ax, given, moved.coordinates, size)
    middle = VIEW.nodes // 2
    for node, alpha in ((0, 0.25), (VIEW.nodes - 1, 0.25), (middle, 1.0)):
        _body(ax, moved.points[node], guided[node], alpha)
    motion = run(given)
    fit = fitted(motion, "line") if piece.radius is None else fitted(motion, "circle", np.array([piece.radius]))
    _nominal(ax, fit, motion.path[0])
    ax.plot(*guided.T, color=PATH, lw=2.4, zorder=8)
    ax.scatter(*guided[[middle]].T, color=PATH, s=34, zorder=9, depthshade=False)
    _frame(ax, low, high, size)
    ax.view_init(elev=ELEVATION, azim=_azimuth(given, moved.coordinates[middle]))
    radius = "" if piece.radius is None else f", radius {piece.radius:.4g}"
    special = f" ({', '.join(piece.special)})" if piece.special else ""
    head = f"class {piece.family}, series {piece.series}: {piece.configuration}{special}"
    foot = (
        f"stroke {piece.stroke:.4g}{radius}, deviation {piece.deviation:.3g}, rotation {piece.metrics['rotation']:.3g}°"
    )
    figure.text(0.5, 0.955, head, ha="center", fontsize=12, color=INK)
    figure.text(0.5, 0.925, foot, ha="center", fontsize=10, color=INK)
    if file is not None:
        write(figure, file, kind)
    return figure


def _guides(ax: Any, given: Strokes, coordinates: Array, size: float) -> None:
    colours = iter(SURFACES)
    for i, g in enumerate(given.mechanisms.guides):
        kind, p = g.kinds[0], g.parameters[0]
        frame, origin = matrix(g.quaternion[:1].T)[:, :, 0], g.origin[0]
        passed = coordinates[:, i]
        if kind.conditions == 2:
            ends = _reach(np.unwrap(passed[:, 0]) if "u" not in kind.lengths else passed[:, 0], kind, 0, size)
            points = _points(kind, np.linspace(*ends, 120), np.zeros(120), p)
            ax.plot(*(origin[:, None] + frame @ points), color=CURVE, lw=1.6, zorder=3)
        else:
            sides = [_reach(_unwrap_angles(passed[:, axis], kind, axis), kind, axis, size) for axis in (0, 1)]
            if kind.name == "plane":  # the chart of a plane has a pole: a rectangle looks better than a sector
                sides, kind = _rectangle(passed, size)
            u, w = (v.ravel() for v in np.meshgrid(*(np.linspace(*e, VIEW.mesh) for e in sides)))
            x = (origin[:, None] + frame @ _points(kind, u, w, p)).reshape(3, VIEW.mesh, VIEW.mesh)
            ax.plot_surface(*x, color=next(colours), alpha=0.28, lw=0, shade=True, zorder=1)
            ax.plot_wireframe(*x, color=INK, alpha=0.12, lw=0.4, rcount=9, ccount=9, zorder=2)


def _azimuth(given: Strokes, coordinates: Array) -> float:
    """Return a direction of view in which neither the stroke nor any surface is seen edge-on."""
    edges = [np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])]  # perpendicular to the stroke
    for g, (u, w) in zip(given.mechanisms.guides, coordinates, strict=True):
        kind, p = g.kinds[0], g.parameters[:1].T
        if kind.conditions == 1:
            _, (one, other) = kind.tangents(np.array([u]), np.array([w]), p[: len(kind.parameters)])
            normal = np.cross(one[:, 0], other[:, 0])
            edges.append(matrix(g.quaternion[:1].T)[:, :, 0] @ normal / np.sqrt((normal**2).sum()))
    turns, tip = np.radians(AZIMUTHS), np.radians(ELEVATION)
    view = np.stack([np.cos(tip) * np.cos(turns), np.cos(tip) * np.sin(turns), np.full(len(turns), np.sin(tip))])
    seen = np.abs(np.array(edges) @ view)
    stroke = np.sqrt(seen[0] ** 2 + seen[1] ** 2)
    return float(AZIMUTHS[int(np.concatenate([stroke[None] - 0.4, seen[2:]]).min(0).argmax())])


def _points(kind: Kind, u: Array, w: Array, p: Array) -> Array:
    shape = np.repeat(p[: len(kind.parameters), None], len(u), axis=1)
    return np.stack(np.broadcast_arrays(*kind.point(u, w, shape), u)[:3])


def _unwrap_angles(values: Array, kind: Kind, axis: int) -> Array:
    angle = "uw"[axis] not in kind.lengths and kind.spans[axis] == np.pi
    return np.unwrap(values) if angle else values


def _reach(values: Array, kind: Kind, axis: int, size: float) -> tuple[float, float]:
    more = VIEW.further * size if "uw"[axis] in kind.lengths else VIEW.beyond
    return float(values.min() - more), float(values.max() + more)


def _rectangle(passed: Array, size: float) -> tuple[list[tuple[float, float]], Kind]:
    chart = KINDS["plane:cartesian"]
    x, y = passed[:, 1] * np.cos(passed[:, 0]), passed[:, 1] * np.sin(passed[:, 0])
    return [_reach(v, chart, axis, size) for axis, v in enumerate((x, y))], chart


def _body(ax: Any, points: Array, guided: Array, alpha: float) -> None:
    """Draw the body as all edges between its points and to the guided point."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]  # it ships no types

    n = len(points)
    edges = [(points[i], points[j]) for i in range(n) for j in range(i)]
    ax.add_collection3d(Line3DCollection(edges, colors=BODY, lw=1.8 * alpha + 0.5, alpha=alpha, zorder=6))
    arms = [(p, guided) for p in points]
    ax.add_collection3d(Line3DCollection(arms, colors=BODY, lw=0.8, alpha=0.6 * alpha, linestyles=":", zorder=5))
    if alpha == 1:
        ax.scatter(*points.T, color="white", edgecolor=INK, s=30, zorder=7, depthshade=False)
        apart = np.sqrt(((points[:, None] - points) ** 2).sum(2))
        for i, point in enumerate(points):
            here = np.flatnonzero(apart[i] < 1e-9 * apart.max())
            if here[0] == i:
                ax.text(*point, "  " + " = ".join(f"A{j + 1}" for j in here), fontsize=9, color=INK, zorder=10)


def _nominal(ax: Any, fit: Fit, path: Array) -> None:
    """Draw the nominal line or circle of a path (f, 3), somewhat beyond its ends."""
    share = np.linspace(-VIEW.longer, 1 + VIEW.longer, 80)[:, None]
    if np.isfinite(fit.radius[0]):
        centre, normal, radius = fit.centre[0], fit.normal[0], fit.radius[0]
        out = path - centre
        first = unit(out[0] - (out[0] @ normal) * normal)
        second = np.cross(normal, first)
        angle = share * np.unwrap(np.arctan2(out @ second, out @ first))[-1]
        nominal = centre + radius * (np.cos(angle) * first + np.sin(angle) * second)
    else:
        nominal = fit.start[0] + share * fit.stroke[0] * fit.axes[0, 0]
    ax.plot(*nominal.T, color=INK, lw=0.8, ls="--", zorder=4)


def _frame(ax: Any, low: Array, high: Array, size: float) -> None:
    """Set equal scales, a plain background and a small cross of axes at the origin."""
    middle, half = 0.5 * (low + high), 0.5 * max((high - low).max(), 0.3 * size) * 1.12
    for name, c in zip("xyz", middle, strict=True):
        getattr(ax, f"set_{name}lim")(c - half, c + half)
    ax.set_box_aspect((1, 1, 1), zoom=1.3)
    ax.set_axis_off()
    ax.set_facecolor(PAPER)
    for axis, name in zip(np.eye(3) * 0.14 * size, "xyz", strict=True):
        ax.plot(*np.stack([np.zeros(3), axis]).T, color=INK, lw=1, zorder=4)
        ax.text(*(1.12 * axis - (0.03 * size * np.eye(3)[2] if name == "x" else 0)), name, fontsize=9, zorder=10)
