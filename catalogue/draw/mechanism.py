"""A linkage with its ghosts and its path, in symbols."""

from __future__ import annotations

import numpy as np

from ..kinematics.linkage import PR, RP, RR
from ..kinematics.types import Complexes
from ..paper import COUPLER, CRANK, DRIVER, GREY, INK, PATH
from .drive_marks import drive_marks
from .scene import Scene
from .symbols import BLOCK, SOLID, SYMBOL, Pen

#: Direction in which a bearing points.
DOWN = -1j


def drawn(pen: Pen, shown: Scene) -> None:
    """Draw the scene: linkage at mid-stroke with names, ghosts at the ends, path."""
    dotted = {"color": CRANK, "alpha": 0.45, "linewidth": 0.8, "linestyle": (0, (1, 2)), "zorder": 2}
    for i in (0, 1):
        if shown.kinds[i] == RR:
            pen.line(shown.moving[:, i], f"sweep-{i + 1}", **dotted)
    _drive(pen, shown)
    for pose, prefix in zip(shown.ghosts, ("start-", "end-"), strict=False):
        links(pen, shown, pose, prefix, ghost=True)
    links(pen, shown, shown.middle)
    ground(pen, shown)
    for i in (0, 1):  # the finite pivots as in the candidate: A1, A1*, A2, A2*
        if shown.kinds[i] != PR:
            pen.name(shown.fixed[i], f"$A_{i + 1}$", f"name-fixed-{i + 1}", GREY)
        if shown.kinds[i] != RP:
            pen.name(shown.moving[shown.middle, i], f"$A_{i + 1}^{{*}}$", f"name-moving-{i + 1}", INK)


def links(pen: Pen, shown: Scene, pose: int, prefix: str = "", *, ghost: bool = False) -> None:
    """Draw the moving parts in one pose."""
    corners = shown.coupler[pose]
    if shown.joint is not None:
        for ends, gid in (((shown.pivot, shown.joint[pose]), "rocker"), ((corners[-1], shown.joint[pose]), "rod")):
            pen.link(np.array(ends), prefix + gid, CRANK, ghost=ghost, zorder=3.5)
        pen.pivot(shown.joint[pose], prefix + "joint", ghost=ghost)
    pen.link(corners, prefix + "coupler", COUPLER, ghost=ghost, zorder=1 if ghost else 4)
    for i, kind in enumerate(shown.kinds):
        rod = _rod(pen, shown, i, pose) if kind == RP else None
        colour = DRIVER if shown.driver == i + 1 else CRANK
        dyad(pen, kind, shown.fixed[i], shown.moving[pose, i], rod, f"{prefix}%s-{i + 1}", colour, ghost=ghost)
    pen.dot(corners[-1], prefix + "guided", PATH, ghost=ghost, zorder=8 if ghost else 10)


def ground(pen: Pen, shown: Scene) -> None:
    """Draw the fixed parts: bearings, rails, the path."""
    for i in (0, 1):
        _frame(pen, shown, i)
    if shown.joint is not None:
        pen.ground(shown.pivot, "ground-output", DOWN)
        pen.pivot(shown.pivot, "fixed-pivot-output")
    if len(shown.turn):
        pen.line(shown.turn, "path-turn", color=PATH, alpha=0.6, linewidth=0.8, linestyle=(0, (4, 3)), zorder=2)
    for z, gid in ((shown.before, "path-before"), (shown.after, "path-after")):
        if len(z) > 1:
            pen.line(z, gid, color=PATH, linewidth=0.9, zorder=6)
    pen.line(shown.path, "path", color=PATH, linewidth=2.4, zorder=7)


def _drive(pen: Pen, shown: Scene) -> None:
    """Draw the arc with arrow heads at the driving crank."""
    if not shown.driver:
        return
    i = shown.driver - 1
    angle = np.unwrap(np.angle(shown.moving[:, i] - shown.fixed[i]))
    for number, mark in enumerate(drive_marks(angle)):
        z = shown.fixed[i] + pen.point * mark
        pen.line(z, f"drive-{number}", color=DRIVER, linewidth=1.2, zorder=SOLID)


def dyad(
    pen: Pen,
    kind: int,
    fixed: complex,
    moving: complex,
    rod: Complexes | None,
    gid: str,
    colour: str = CRANK,
    *,
    ghost: bool = False,
) -> None:
    """Draw the moving parts of a dyad of kind `RR`, `PR` or `RP`, without coupler.

    A pivot at infinity is given by its unit normal; `rod` are the ends of the coupler line of a
    slide, shape (2,); `gid` names the elements, with %s for the part; `colour` is that of a crank.
    """
    back = 1.0 if ghost else 4.0
    if kind == RR:
        pen.link(np.array([fixed, moving]), gid % "crank", colour, ghost=ghost, zorder=back + 1)
    elif kind == PR:
        pen.block(moving, gid % "slider", 1j * fixed, CRANK, ghost=ghost, zorder=back + 0.5)
    elif rod is not None:
        pen.link(rod, gid % "line", COUPLER, ghost=ghost, width=SYMBOL.rod, zorder=back + 0.2)
        if not ghost:
            pen.block(fixed, gid % "slide", 1j * moving, CRANK, zorder=back + 1.5)
    if kind != RP:
        pen.pivot(moving, gid % "moving-pivot", ghost=ghost, zorder=back + 5)


def _rod(pen: Pen, shown: Scene, i: int, pose: int) -> Complexes:
    """Return the ends of a coupler line, extended where they would lie inside the block."""
    ends = shown.rods[i][pose]
    along = 1j * shown.moving[pose, i]
    spare = (BLOCK[0] + 8) * pen.point * np.array([-1, 1])
    at_foot = np.abs(ends - shown.coupler[pose, i]) < 1e-9 * np.abs(ends[1] - ends[0])
    return np.asarray(ends + np.where(at_foot, 0, spare) * along)


def _frame(pen: Pen, shown: Scene, i: int) -> None:
    """Draw the support of the dyad: a bracket, or the rail of a slider."""
    fixed, number = shown.fixed[i], f"{i + 1}"
    if shown.kinds[i] == PR:
        track = shown.moving[:, i]
        run = ((track - track[0]) * (1j * fixed).conjugate()).real
        spare = (BLOCK[0] + 7) * pen.point
        others = np.concatenate([shown.fixed[shown.kinds != PR], shown.coupler[shown.middle]])
        pen.track(track[0], fixed, (run.min() - spare, run.max() + spare), others, f"guide-{number}")
        return
    pen.ground(fixed, f"ground-{number}", DOWN)
    pen.pivot(fixed, f"fixed-pivot-{number}")
