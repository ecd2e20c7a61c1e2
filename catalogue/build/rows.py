"""The columns of mechanisms, of what they guide, and of how far: the same for a block and for a design."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..guide.measures import Measures, measure, transmission
from ..guide.reach import LEVELS, reach, scan
from ..guide.span import Span, span
from ..guide.trace import Traced, trace
from ..instant import Instant
from ..linkage import Array, Linkage
from ..series import EXACT

Columns = dict[str, Any]
#: A reach is stored while the mechanism is smaller than this many strokes and this transmission angle is held.  Where
#: the design position is a dead point no crank can drive; then the angle is stored as it is, 0.
LARGEST, LEAST_TRANSMISSION = 12.5, 2.0


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
    guides, reaches = ({k: np.concatenate([p[i][k] for p in parts]) for k in parts[0][i]} for i in (0, 1))
    before = np.cumsum([0, *(len(g["mechanism"]) for g, _ in parts[:-1])])
    reaches["guide"] += np.repeat(before, [len(r["guide"]) for _, r in parts])
    return guides, reaches


def guide_columns(
    linkage: Linkage, points: Columns, circle: bool, usual: Array | None = None
) -> tuple[Columns, Columns] | None:
    """Trace guided points of linkages in their canonical frame; None if there is no guide among them.

    Parameters
    ----------
    linkage : Linkage
    points : mapping of columns
        ``mechanism``: which of the linkages; ``label``, ``x``, ``y``, ``contact_order``, and
        ``centre``, that of a circle as a complex number.
    circle : bool
        Their nominal; else a straight line.
    usual : ndarray, shape (n,), optional
        Half strokes to fall back to at levels for which the longest stroke cannot be stored.

    Returns
    -------
    guides, reaches : mapping of columns
        Those that hold a level; see `catalogue.store.write_batch`.
    """
    if not len(points["mechanism"]):
        return None
    z = points["x"] + 1j * points["y"]
    guides = span(linkage[points["mechanism"]], z, pole=np.zeros_like(z))
    usable = guides.extent.min(0) > 0.01
    guides, points = guides[usable], {k: v[usable] for k, v in points.items()}
    if not len(guides):
        return None
    known = None
    if usual is not None:
        usual, middle = usual[usable], np.zeros(len(guides))
        known = trace(guides, usual, circle=circle, split=True, nodes=16)
        costs = measure(guides, known)
    least = np.where(_at_design(guides.linkage) >= LEAST_TRANSMISSION, LEAST_TRANSMISSION, 0.0)
    ladder = scan(guides, circle=circle, three=(points["contact_order"] == 4) & (not circle))
    rows: list[Columns] = []
    for level in sorted(LEVELS):
        half, traced = reach(guides, ladder, 10.0**level, circle=circle)
        row, good = _reaches(guides, traced, measure(guides, traced), half, ladder.centre, level, circle, least)
        if usual is not None and known is not None:
            other, fits = _reaches(guides, known, costs, usual, middle, level, circle, least)
            row = {k: np.where(good, v, other[k]) for k, v in row.items()}
            good = good | fits
        if rows:  # where the longest window runs into a dead point, or its path is shorter, a straighter one serves
            good &= ~(rows[-1]["good"] & (rows[-1]["stroke"] > row["stroke"]))
            row = {k: np.where(good, v, rows[-1][k]) if k != "level" else v for k, v in row.items()}
            good = good | rows[-1]["good"]
        rows.append({**row, "good": good})
    reaches = {k: np.concatenate([r[k] for r in rows]) for k in rows[0]}
    good = reaches.pop("good")
    reaches = {k: v[good] for k, v in reaches.items()}
    used, reaches["guide"] = np.unique(reaches["guide"], return_inverse=True)
    if not len(used):
        return None
    columns = {k: v[used] for k, v in points.items() if circle or k != "centre"}
    tangent = guides.tangent[used]
    radius = columns.pop("centre") - (columns["x"] + 1j * columns["y"]) if circle else np.zeros(len(used), complex)
    columns |= {
        "kind": np.full(len(used), "circle" if circle else "line"),
        "tangent_x": tangent.real,
        "tangent_y": tangent.imag,
        "curvature": np.copysign(1 / np.abs(radius), (radius * tangent.conj()).imag) if circle else radius.real,
        "inflections": np.where((columns["contact_order"] == EXACT) | circle, 0, columns["contact_order"] - 1),
    }
    order = np.lexsort((-reaches["level"], reaches["guide"]))
    return columns, {k: v[order] for k, v in reaches.items()}


def _at_design(linkage: Linkage) -> Array:
    """Return the transmission angle in the design position, shape (n,) [deg]."""
    z = linkage.points
    return transmission(linkage, [np.stack([z[:, i, 1]] * 2) for i in (0, 1)], np.zeros((2, len(linkage)), complex))


def _reaches(
    guides: Span,
    traced: Traced,
    measured: Measures,
    half: Array,
    centre: Array,
    level: int,
    circle: bool,
    least: Array,
) -> tuple[Columns, Array]:
    """Return the columns of one level, and where they may be stored, shape (n,)."""
    stroke = traced.fit.stroke
    with np.errstate(all="ignore"):
        relative = traced.relative
        size = measured.size / stroke
        good = (relative <= 10.0**level) & (size <= LARGEST) & (measured.min_transmission >= least)
        no_arm = ~guides.linkage.finite[:, :, 1].any(1)  # two slides
        good &= np.isfinite(measured.max_arm) | no_arm
        sweep = np.abs(traced.fit.curvature) * stroke if circle else np.zeros(len(stroke))
        good &= (sweep > 0) if circle else good
        # the path runs from (0, 0) to (1, 0)
        boxes = {
            f"{name}_{side}": box[:, i] / stroke + (0.5 if i % 2 == 0 else 0.0)
            for name, box in (("fixed", measured.fixed_box), ("all", measured.box))
            for i, side in enumerate(("x0", "y0", "x1", "y1"))
        }
        lengths = {k: getattr(measured, k) / stroke for k in ("size", "max_link", "min_link", "max_ground", "max_arm")}
        lengths["max_arm"] = np.where(no_arm, 0.0, lengths["max_arm"])
    columns = {
        "guide": np.arange(len(guides)), "level": np.full(len(guides), level), "stroke": stroke, "half": half,
        "centre": centre, "deviation": relative, "sweep": sweep, **lengths,
        "min_transmission": measured.min_transmission, "balance": size - measured.min_transmission / 90,
        "rotates": measured.rotates, **boxes,
    }  # fmt: skip
    return columns, good
