"""A linkage with its ghosts and its path, in symbols."""

from __future__ import annotations

import numpy as np

from ..kinematics.linkage import PR, RP, RR
from ..kinematics.types import Complexes
from .scene import Scene
from .symbols import BLOCK, COUPLER, CRANK, GREY, INK, PATH, ROD, Pen

#: Ways in which a bracket may point, the usual one first.
DOWN = (-1j, 1j, 1 + 0j, -1 + 0j)


def drawn(pen: Pen, shown: Scene) -> None:
    """Draw the scene: the linkage in mid-stroke with its names, ghosts at the ends of the stroke, and the path."""
    for i in (0, 1):
        if shown.kinds[i] == RR:
            pen.line(
                shown.moving[:, i],
                f"sweep-{i + 1}",
                color=CRANK,
                alpha=0.45,
                linewidth=0.8,
                linestyle=(0, (1, 2)),
                zorder=2,
            )
    for pose in (0, -1):
        _linkage(pen, shown, pose, "start-" if pose == 0 else "end-")
    _linkage(pen, shown, shown.middle, "")
    for i in (0, 1):
        _frame(pen, shown, i)
    _path(pen, shown)
    _names(pen, shown)


def _linkage(pen: Pen, shown: Scene, pose: int, prefix: str) -> None:
    """Draw the moving parts."""
    ghost = bool(prefix)
    back = 1.0 if ghost else 4.0
    corners = shown.coupler[pose]
    pen.link(corners, prefix + "coupler", COUPLER, ghost=ghost, zorder=back)
    for i, kind in enumerate(shown.kinds):
        number = f"{i + 1}"
        fixed, moving = shown.fixed[i], shown.moving[pose, i]
        if kind == RR:
            pen.link(np.array([fixed, moving]), f"{prefix}crank-{number}", CRANK, ghost=ghost, zorder=back + 1)
        elif kind == PR:
            pen.block(moving, f"{prefix}slider-{number}", 1j * fixed, CRANK, ghost=ghost, zorder=back + 0.5)
        else:
            pen.link(
                _rod(pen, shown, i, pose), f"{prefix}line-{number}", COUPLER, ghost=ghost, width=ROD, zorder=back + 0.2
            )
            if not ghost:
                pen.block(fixed, f"slide-{number}", 1j * moving, CRANK, zorder=back + 1.5)
        if kind != RP:
            pen.pivot(moving, f"{prefix}moving-pivot-{number}", ghost=ghost, zorder=back + 5)
    pen.dot(corners[-1], f"{prefix}guided", PATH, ghost=ghost, zorder=8 if ghost else 10)


def _rod(pen: Pen, shown: Scene, i: int, pose: int) -> Complexes:
    """Return the ends of a coupler line, with a little to spare at those that run through the block."""
    ends = shown.rods[i][pose]
    along = 1j * shown.moving[pose, i]
    spare = (BLOCK[0] + 8) * pen.point * np.array([-1, 1])
    at_foot = np.abs(ends - shown.coupler[pose, i]) < 1e-9 * np.abs(ends[1] - ends[0])
    return np.asarray(ends + np.where(at_foot, 0, spare) * along)


def _frame(pen: Pen, shown: Scene, i: int) -> None:
    """Draw what holds the dyad: a bracket, or the line of a slider."""
    fixed, number = shown.fixed[i], f"{i + 1}"
    if shown.kinds[i] == PR:
        along, track = 1j * fixed, shown.moving[:, i]
        run = ((track - track[0]) * along.conjugate()).real
        spare = (BLOCK[0] + 7) * pen.point
        # under the block, where the rest of the linkage is not
        others = np.concatenate([shown.fixed[shown.kinds != PR], shown.coupler[shown.middle]])
        side = -1.0 if ((others - track[0]) * fixed.conjugate()).real.mean() > 0 else 1.0
        foot = track[0] + side * BLOCK[1] * pen.point * fixed
        ends = foot + np.array([run.min() - spare, run.max() + spare]) * along
        pen.hatched(ends[0], ends[1], side * fixed, f"guide-{number}")
        return
    pen.ground(fixed, f"ground-{number}", _down(pen, shown, i))
    pen.pivot(fixed, f"fixed-pivot-{number}")


def _down(pen: Pen, shown: Scene, i: int) -> complex:
    """Return the first way for a bracket to point in which neither the link nor the other bracket lies."""
    fixed, moving, other = shown.fixed[i], shown.moving[shown.middle, i], shown.fixed[1 - i]
    arms = [moving - fixed] if shown.kinds[i] == RR else [1j * moving, -1j * moving]
    near = shown.kinds[1 - i] != PR and abs(other - fixed) < 32 * pen.point

    def hidden(down: complex) -> float:
        among = [(arm / abs(arm) * down.conjugate()).real for arm in arms]
        if near:
            among.append(((other - fixed) / abs(other - fixed) * down.conjugate()).real + 0.4)
        return max(0.6, *map(float, among))

    return min(DOWN, key=hidden)


def _path(pen: Pen, shown: Scene) -> None:
    for z, gid in ((shown.before, "path-before"), (shown.after, "path-after")):
        if len(z) > 1:
            pen.line(z, gid, color=PATH, linewidth=0.9, zorder=6)
    pen.line(shown.path, "path", color=PATH, linewidth=2.4, zorder=7)


def _names(pen: Pen, shown: Scene) -> None:
    """Name the finite pivots as in the candidate: A1, A1*, A2, A2*."""
    for i in (0, 1):
        if shown.kinds[i] != PR:
            pen.name(shown.fixed[i], f"$A_{i + 1}$", f"name-fixed-{i + 1}", GREY)
        if shown.kinds[i] != RP:
            pen.name(shown.moving[shown.middle, i], f"$A_{i + 1}^{{*}}$", f"name-moving-{i + 1}", INK)
