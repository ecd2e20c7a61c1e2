"""The columns of mechanisms, guides and reaches, of blocks and of named designs."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..candidates.batch import Origin, on_path
from ..curvature_theory.instant import Instant
from ..curvature_theory.leading_error import EXACT, leading_error
from ..guidance.coupler_curve import CouplerCurve, coupler_curve
from ..guidance.kinds import STRAIGHT
from ..guidance.metrics import transmission
from ..guidance.reach import LEVELS, about_change_points, reach, scan
from ..guidance.trace import Traced, trace
from ..kinematics.batch import join, take
from ..kinematics.linkage import Linkage
from ..kinematics.types import Floats, Indices, Integers
from ..problem.constraints import Constraints
from ..problem.path import CircularArc, StraightLine
from ..problem.problem import Problem
from ..problem.ranking import Ranking
from ..quantities import STORED

Columns = dict[str, Any]
#: Largest size of a stored reach [strokes].
LARGEST = 12.5
#: Smallest transmission angle of a stored reach [deg]; except at a dead point, where it is stored
#: as 0.
LEAST_TRANSMISSION = 2.0
#: Lines and arcs of unit length, as in `catalogue show`; their tolerance has no meaning.
PROBLEMS = {
    circle: Problem.of(request, Constraints(), Ranking({"deviation": 1.0}))
    for circle, request in ((False, StraightLine(1.0, 0.1)), (True, CircularArc(1.0, 0.1)))
}
#: Sides of a box in their order.
SIDES = ("x0", "y0", "x1", "y1")
#: Secant steps towards the longest stroke of a level: stored guides are starts and may be a little
#: short.
SECANTS = 1


def mechanism_columns(linkage: Linkage) -> Columns:
    """Compute the columns of linkages in their canonical frame, without names and provenance."""
    instant = Instant(linkage, np.zeros(len(linkage), complex))
    at = instant.curvature
    finite = np.isfinite(at.rho0)
    return {
        "family": instant.linkage.family,
        "configuration": instant.configuration,
        "pivots": instant.linkage.pivots.reshape(-1, 12),
        "rho0": np.where(finite, at.rho0, np.nan),
        **{k: np.where(finite, getattr(at, k), np.nan) for k in ("kappa", "kappa_star", "s")},
    }


def concatenate(parts: list[tuple[Columns, Columns]]) -> tuple[Columns, Columns]:
    """Concatenate columns of guides and of their reaches."""
    if not parts:
        return {"mechanism": np.zeros(0, int), "kind": np.zeros(0, str)}, {"guide": np.zeros(0, int)}
    guides, reaches = (join(*tables) for tables in zip(*parts, strict=True))
    before = np.cumsum([0, *(len(g["mechanism"]) for g, _ in parts[:-1])])
    reaches["guide"] += np.repeat(before, [len(r["guide"]) for _, r in parts])
    return guides, reaches


def guide_columns(linkage: Linkage, points: Columns, usual: Floats | None = None) -> list[tuple[Columns, Columns]]:
    """Trace guided points of linkages in their canonical frame, on lines, then on circles.

    Parameters
    ----------
    linkage : Linkage
    points : mapping of str to ndarray, shape (n,)
        ``kind``, ``x``, ``y``, ``contact_order``, ``centre`` (complex, of a circle) and further
        columns.
    usual : ndarray, shape (n,), optional
        Half strokes to try as well.

    Returns
    -------
    list of (mapping, mapping)
        Columns of guides and of their reaches that hold a level; see `concatenate` and
        `catalogue.store.write_batch`.
    """
    circle = ~np.isin(points["kind"], STRAIGHT)
    parts = []
    for curved in (False, True):
        some = np.flatnonzero(circle == curved)
        parts.append(_of_one_nominal(linkage[some], take(points, some), curved, take(usual, some)))
    return [part for part in parts if part is not None]


def _of_one_nominal(
    linkage: Linkage, points: Columns, circle: bool, usual: Floats | None
) -> tuple[Columns, Columns] | None:
    """Return the columns of `guide_columns` for points on lines or on circles.

    None if no level is held.
    """
    if not len(linkage):
        return None
    z = points["x"] + 1j * points["y"]
    guides = coupler_curve(linkage, z, pole=np.zeros_like(z))
    usable = guides.extent.min(0) > 0.01
    guides, points = guides[usable], take(points, usable)
    if not len(guides):
        return None
    ladder = scan(guides, circle=circle, three=(_inflections(points) == 3) & (not circle) & ~guides.cusp)
    steps = np.array(sorted(LEVELS))
    with np.errstate(all="ignore"):
        step, k = np.nonzero((ladder.traced.relative <= 10.0 ** steps[:, None, None]).any(1))
    tried, ladder = guides[k], ladder[k]
    half, traced = reach(tried, ladder, 10.0 ** steps[step], circle=circle, steps=SECANTS)
    small = _rigid_size(guides)[k] <= LARGEST * traced.fit.stroke
    step = step[small]
    _, first, same = np.unique((k + 1j * half)[small], return_index=True, return_inverse=True)
    first = np.flatnonzero(small)[
        first
    ]  # keep one of several rows of a guide over one window, which a loose level repeats
    reaches = _reaches(tried[first], half[first], ladder.centre[first], traced[first], circle)
    reaches = take(reaches | {"guide": k[first]}, same)
    if usual is not None:
        traced = trace(guides, usual[usable], circle=circle, split=True, nodes=16)
        more = _reaches(guides, usual[usable], np.zeros(len(guides)), traced, circle)
        more |= {"guide": np.arange(len(guides))}
        reaches = join(reaches, *[more] * len(steps))
        step = np.concatenate([step, np.repeat(np.arange(len(steps)), len(guides))])
    least = np.where(at_design(guides.linkage) >= LEAST_TRANSMISSION, LEAST_TRANSMISSION, 0.0)
    best = _longest_reaches(reaches, step, steps, least, circle)
    if not (best >= 0).any():
        return None
    # a reach that is the longest at several levels is stored at each: a search reads one or two
    # levels, and would miss it elsewhere; a fourth of the rows are such copies
    step, guide = np.nonzero(best >= 0)
    reaches = take(reaches, best[step, guide]) | {"level": steps[step]}
    del reaches["at_pivot"]
    for name, column in STORED.items():
        if not column.is_nullable:
            reaches[name] = np.nan_to_num(reaches[name])  # linkages of two slides have no arm
    used, reaches["guide"] = np.unique(reaches["guide"], return_inverse=True)
    columns = take(points, used)
    guides, order = guides[used], columns["contact_order"]
    tangent, exact = guides.tangent, order == EXACT
    centre, z = columns.pop("centre"), columns["x"] + 1j * columns["y"]
    radius = centre - z if circle else np.zeros_like(z)
    leading = leading_error(guides.linkage, guides.point, circle=circle, order=order, pole=guides.pole).coefficient
    columns |= {
        "tangent_x": tangent.real,
        "tangent_y": tangent.imag,
        "curvature": np.copysign(1 / np.abs(radius), (radius * tangent.conj()).imag) if circle else radius.real,
        "inflections": np.where(exact | circle | guides.cusp, 0, _inflections(columns)),
        "leading": np.where(exact, np.nan, np.abs(leading)),
    }
    return columns, take(reaches, np.lexsort((-reaches["level"], reaches["guide"])))


def _inflections(points: Columns) -> Integers:
    """Count the inflections of paths along lines; default: those merged at the design point."""
    return np.asarray(points.get("inflections", points["contact_order"] - 1))


def at_design(linkage: Linkage) -> Floats:
    """Return the transmission angle in the design position, shape (n,) [deg]."""
    z = linkage.points
    return transmission(linkage, [np.stack([z[:, i, 1]] * 2) for i in (0, 1)], np.zeros((2, len(linkage)), complex))[0]


def _rigid_size(guides: CouplerCurve) -> Floats:
    """Compute the longest invariant distance, a lower bound of the size, shape (n,) [canonical]."""
    finite, z = guides.linkage.finite, guides.linkage.points
    fixed, moving = (np.where(finite[:, :, plane], z[:, :, plane], np.nan) for plane in (0, 1))
    pairs = [*(moving - fixed).T, *np.diff(fixed).T, *np.diff(moving).T, *(moving.T - guides.point)]
    return np.asarray(np.fmax.reduce(np.abs(pairs), initial=0.0))


def _longest_reaches(reaches: Columns, step: Indices, steps: Integers, least: Floats, circle: bool) -> Integers:
    """Select the longest row of each guide at each level, shape (steps, guides); -1 for none.

    Where the longest window of a level ends at a dead point, or is shorter than that of a tighter
    level, the row of the tighter level is selected.
    """
    best = np.full((len(steps), len(least)), -1)
    guide = reaches["guide"]
    with np.errstate(all="ignore"):
        good = (reaches["deviation"] <= 10.0 ** steps[step]) & (reaches["size"] <= LARGEST)
        good &= (reaches["min_transmission"] >= least[guide]) & ~reaches["at_pivot"]
        good &= (reaches["sweep"] > 0) | (not circle)
        order = np.argsort(reaches["stroke"], kind="stable")
        order = order[good[order]]
        for i in range(len(steps)):
            rows = order[step[order] <= i]
            best[i, guide[rows]] = rows  # later rows overwrite earlier ones
    return best


def _reaches(guides: CouplerCurve, half: Floats, centre: Floats, traced: Traced, circle: bool) -> Columns:
    """Measure one reach of each guide as it will be placed for a request.

    NaN where it could not be placed.

    Parameters
    ----------
    half, centre : ndarray, shape (n,)
        Half windows [canonical], and positions of their middles [half windows].
    traced : Traced
        Traces over these windows.
    """
    half, centre, traced = about_change_points(guides, half, centre, traced, circle=circle)
    found = on_path(PROBLEMS[circle], Origin.made(guides.linkage, ""), guides, traced)
    measured, back = found.measures, found.traced.fit.along.real < 0
    boxes: Columns = {}
    for name, box in (("fixed", measured.fixed_box), ("all", measured.box)):
        box = np.where(back[:, None], -box[:, [2, 3, 0, 1]], box)  # box for a path from (0, 0) to (1, 0), not back
        boxes |= {f"{name}_{side}": box[:, i] + (0.5, 0.0, 0.5, 0.0)[i] for i, side in enumerate(SIDES)}
    with np.errstate(all="ignore"):
        sweep = np.abs(found.traced.fit.curvature) if circle else np.zeros(len(guides))
    return {
        "half": half,
        "centre": centre,
        "stroke": traced.fit.stroke,
        "deviation": found.deviation,
        "sweep": sweep,
        "at_pivot": measured.at_pivot,
        **{name: getattr(measured, name) for name in (*STORED, "rotates")},
        **boxes,
    }
