"""The columns of mechanisms, of what they guide, and of how far: the same for a block and for a design."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..curvature_theory.instant import Instant
from ..curvature_theory.leading_error import EXACT, leading_error
from ..guidance.coupler_curve import CouplerCurve, coupler_curve
from ..guidance.kinds import STRAIGHT
from ..guidance.metrics import LEAST_ARM, measure, transmission
from ..guidance.reach import LEVELS, reach, scan
from ..guidance.trace import Traced, trace
from ..kinematics.batch import join, take
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Floats, Indices

Columns = dict[str, Any]
#: A reach is stored while the mechanism is smaller than this many strokes and this transmission angle is held.  Where
#: the design position is a dead point no crank can drive; then the angle is stored as it is, 0.
LARGEST, LEAST_TRANSMISSION = 12.5, 2.0
#: Secant steps towards the longest stroke of a level: what is stored is a start, which may be a little short.
SECANTS = 1


def mechanism_columns(linkage: Linkage) -> Columns:
    """Return the columns of linkages in their canonical frame, but for what they are called and come from."""
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


def together(parts: list[tuple[Columns, Columns]]) -> tuple[Columns, Columns]:
    """Return columns of guides and of their reaches from several such, one after the other."""
    if not parts:
        return {"mechanism": np.zeros(0, int), "kind": np.zeros(0, str)}, {"guide": np.zeros(0, int)}
    guides, reaches = (join(*tables) for tables in zip(*parts, strict=True))
    before = np.cumsum([0, *(len(g["mechanism"]) for g, _ in parts[:-1])])
    reaches["guide"] += np.repeat(before, [len(r["guide"]) for _, r in parts])
    return guides, reaches


def guide_columns(linkage: Linkage, points: Columns, usual: Floats | None = None) -> list[tuple[Columns, Columns]]:
    """Trace guided points of linkages in their canonical frame: ``kind``, ``x``, ``y``, ``contact_order``, ``centre``
    (complex, of a circle), and what else there is to say of them; half strokes `usual` (n,) are tried as well.

    Return the columns of guides and of their reaches that hold a level, on lines and then on circles; see `together`
    and `catalogue.store.write_batch`.
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
    """Return columns as `guide_columns` does, of points on lines or on circles; None if no level is held."""
    if not len(linkage):
        return None
    z = points["x"] + 1j * points["y"]
    guides = coupler_curve(linkage, z, pole=np.zeros_like(z))
    usable = guides.extent.min(0) > 0.01
    guides, points = guides[usable], take(points, usable)
    if not len(guides):
        return None
    ladder = scan(guides, circle=circle, three=(points["contact_order"] == 4) & (not circle) & ~guides.cusp)
    steps = np.array(sorted(LEVELS))
    with np.errstate(all="ignore"):
        step, k = np.nonzero((ladder.traced.relative <= 10.0 ** steps[:, None, None]).any(1))
    tried, ladder = guides[k], ladder[k]
    half, traced = reach(tried, ladder, 10.0 ** steps[step], circle=circle, steps=SECANTS)
    reaches = _reaches(tried, traced, circle) | {"guide": k, "half": half, "centre": ladder.centre}
    if usual is not None:
        more = _reaches(guides, trace(guides, usual[usable], circle=circle, split=True, nodes=16), circle)
        more |= {"guide": np.arange(len(guides)), "half": usual[usable], "centre": np.zeros(len(guides))}
        reaches = join(reaches, *[more] * len(steps))
        step = np.concatenate([step, np.repeat(np.arange(len(steps)), len(guides))])
    least = np.where(at_design(guides.linkage) >= LEAST_TRANSMISSION, LEAST_TRANSMISSION, 0.0)
    best = _longest(reaches, step, steps, least, circle)
    if not (best >= 0).any():
        return None
    # a reach that is the longest at looser levels too, a fourth of the rows, is stored at each of them: a search reads
    # a level or two, and would miss guides that are better than was asked
    step, guide = np.nonzero(best >= 0)
    reaches = take(reaches, best[step, guide]) | {"level": steps[step]}
    reaches["max_arm"] = np.nan_to_num(reaches["max_arm"])  # two slides: there is no arm
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
        "inflections": np.where(exact | circle | guides.cusp, 0, order - 1),
        "leading": np.where(exact, np.nan, np.abs(leading)),
    }
    return columns, take(reaches, np.lexsort((-reaches["level"], reaches["guide"])))


def at_design(linkage: Linkage) -> Floats:
    """Return the transmission angle in the design position, shape (n,) [deg]."""
    z = linkage.points
    return transmission(linkage, [np.stack([z[:, i, 1]] * 2) for i in (0, 1)], np.zeros((2, len(linkage)), complex))[0]


def _longest(reaches: Columns, step: Indices, steps: Array, least: Floats, circle: bool) -> Array:
    """Return for each step of the ladder which row of a guide is the longest that holds it, shape (steps, guides); -1
    where none does.  A tighter one serves where the longest window runs into a dead point, or its path is shorter.
    """
    best = np.full((len(steps), len(least)), -1)
    guide = reaches["guide"]
    with np.errstate(all="ignore"):
        good = (reaches["deviation"] <= 10.0 ** steps[step]) & (reaches["size"] <= LARGEST)
        good &= (reaches["min_transmission"] >= least[guide]) & ~(reaches["max_arm"] < LEAST_ARM)
        good &= (reaches["sweep"] > 0) | (not circle)
        order = np.argsort(reaches["stroke"], kind="stable")
        order = order[good[order]]
        for i in range(len(steps)):
            rows = order[step[order] <= i]
            best[i, guide[rows]] = rows  # the last one stays
    return best


def _reaches(guides: CouplerCurve, traced: Traced, circle: bool) -> Columns:
    """Return the columns of one reach of each guide."""
    measured = measure(guides, traced)
    stroke = traced.fit.stroke
    with np.errstate(all="ignore"):
        # the path runs from (0, 0) to (1, 0)
        boxes = {
            f"{name}_{side}": box[:, i] / stroke + (0.5 if i % 2 == 0 else 0.0)
            for name, box in (("fixed", measured.fixed_box), ("all", measured.box))
            for i, side in enumerate(("x0", "y0", "x1", "y1"))
        }
        lengths = {k: getattr(measured, k) / stroke for k in ("size", "max_link", "min_link", "max_ground", "max_arm")}
        sweep = np.abs(traced.fit.curvature) * stroke if circle else np.zeros(len(stroke))
    return {
        "stroke": stroke, "deviation": traced.relative, "sweep": sweep, **lengths,
        "min_transmission": measured.min_transmission, "rotates": measured.rotates, **boxes,
        "drive_angle": measured.drive_angle, "rotation": measured.rotation,
    }  # fmt: skip
