"""One block of a build, from drawing to the columns that are stored.  Pure: same arguments, same columns."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..guide.measures import Measures, measure
from ..guide.reach import LEVELS, reach, scan
from ..guide.span import Span, span
from ..guide.trace import Traced
from ..instant import Instant
from ..instant.analysis import PARALLEL_SINE
from ..linkage import Array
from ..series import EXACT, Series
from .draw import BLOCK, PLAN, Drawn, draw

Columns = dict[str, Any]
#: Guided points nearer to the pole than this guide badly; farther ones need an unwieldy coupler (units of rho0).
NEAREST_POINT, FARTHEST_POINT = 0.15, 6.0
RADII = (0.1, 50.0)
#: A guided point nearer than this to a moving pivot is that pivot, which needs no guide.
NEAREST_PIVOT = 0.03
#: A reach is stored while the mechanism is smaller than this many strokes and this transmission angle is held.
LARGEST, LEAST_TRANSMISSION = 12.5, 2.0


@dataclass(frozen=True)
class Block:
    """What a block adds to each table; see `catalogue.store.write_batch`."""

    batch: Columns
    mechanisms: Columns
    guides: Columns
    reaches: Columns

    @property
    def count(self) -> int:
        """Number of guides."""
        return len(self.guides["mechanism"])


def block(series: Series, key: str, seed: int, number: int, plugin: str, version: str) -> Block:
    """Return block `number` of a member of a series."""
    member = series.member(key)
    drawn = draw(series, member, seed, number)
    parts = [part for circle in (False, True) if (part := _traced(series, drawn, circle)) is not None]
    guides: Columns = {"mechanism": np.zeros(0, int), "kind": np.zeros(0, str)}
    reaches: Columns = {"guide": np.zeros(0, int)}
    if parts:
        guides = {k: np.concatenate([g[k] for g, _ in parts]) for k in parts[0][0]}
        reaches = {k: np.concatenate([r[k] for _, r in parts]) for k in parts[0][1]}
        before = np.cumsum([0, *(len(g["mechanism"]) for g, _ in parts[:-1])])
        reaches["guide"] += np.repeat(before, [len(r["guide"]) for _, r in parts])
    used, guides["mechanism"] = np.unique(guides["mechanism"], return_inverse=True)
    batch = {
        "series": series.code, "member": key, "plugin": plugin, "plugin_version": version, "plan": PLAN,
        "seed": seed, "number": number, "drawn": BLOCK, "kept": len(used), "guides": len(guides["mechanism"]),
    }  # fmt: skip
    return Block(batch, _mechanisms(series, key, drawn, used), guides, reaches)


def _mechanisms(series: Series, key: str, drawn: Drawn, used: Array) -> Columns:
    instant = Instant(drawn.linkage[used], np.zeros(len(used), complex))
    at = instant.curvature
    finite = np.isfinite(at.rho0)
    names = list(drawn.free)
    rows = zip(*(drawn.free[name][used].tolist() for name in names), strict=True) if names else [()] * len(used)
    return {
        "family": instant.linkage.family,
        "configuration": instant.configuration,
        "series": series.code,
        "member": key,
        "name": None,
        "parameters": [json.dumps(dict(zip(names, row, strict=True))) for row in rows],
        "pivots": instant.linkage.pivots.reshape(-1, 12),
        "rho0": np.where(finite, at.rho0, np.nan),
        **{k: np.where(finite, getattr(at, k), np.nan) for k in ("kappa", "kappa_star", "s")},
    }


def _traced(series: Series, drawn: Drawn, circle: bool) -> tuple[Columns, Columns] | None:
    """Trace the guided points with a circle (or line) for nominal; return columns of guides and reaches."""
    points = _points(series, drawn, circle)
    if not len(points["mechanism"]):
        return None
    z = points["x"] + 1j * points["y"]
    guides = span(drawn.linkage[points["mechanism"]], z, pole=np.zeros_like(z))
    usable = guides.extent.min(0) > 0.01
    guides, points = guides[usable], {k: v[usable] for k, v in points.items()}
    if not len(guides):
        return None
    ladder = scan(guides, circle=circle, three=(points["contact_order"] == 4) & (not circle))
    rows: list[Columns] = []
    for level in sorted(LEVELS):
        half, traced = reach(guides, ladder, 10.0**level, circle=circle)
        row, good = _reaches(guides, traced, measure(guides, traced), half, ladder.centre, level, circle)
        if rows:  # where the longest stroke runs into a dead point, a shorter one that is straighter still serves
            row = {k: np.where(good, v, rows[-1][k]) if k != "level" else v for k, v in row.items()}
            good = good | rows[-1]["good"]
        rows.append({**row, "good": good})
    reaches = {k: np.concatenate([r[k] for r in rows]) for k in rows[0]}
    good = reaches.pop("good")
    reaches = {k: v[good] for k, v in reaches.items()}
    used, reaches["guide"] = np.unique(reaches["guide"], return_inverse=True)
    if not len(used):
        return None
    columns = {k: v[used] for k, v in points.items()}
    tangent = guides.tangent[used]
    side = (
        np.sign((columns.pop("centre") - (columns["x"] + 1j * columns["y"])) * tangent.conj()).imag if circle else 0.0
    )
    columns |= {
        "kind": np.full(len(used), "circle" if circle else "line"),
        "tangent_x": tangent.real,
        "tangent_y": tangent.imag,
        "curvature": np.copysign(columns.pop("curvature"), side) if circle else columns.pop("curvature"),
        "inflections": np.where((columns["contact_order"] == EXACT) | circle, 0, columns["contact_order"] - 1),
    }
    columns.pop("centre", None)
    order = np.lexsort((-reaches["level"], reaches["guide"]))
    return columns, {k: v[order] for k, v in reaches.items()}


def _points(series: Series, drawn: Drawn, circle: bool) -> dict[str, Array]:
    """Return the guided points of all linkages that can be used, with their nominal."""
    found = []
    n = len(drawn.linkage)
    rays = drawn.linkage.rays
    no_pole = np.abs((rays[:, 0].conj() * rays[:, 1]).imag) < PARALLEL_SINE
    for guided in series.guided(drawn.complete):
        pairs = np.broadcast_to(guided.pairs, (n, 2, 3))
        fixed, moving = pairs[:, 0], pairs[:, 1]
        with np.errstate(all="ignore"):
            z = (moving[:, 0] + 1j * moving[:, 1]) / moving[:, 2]
            centre = (fixed[:, 0] + 1j * fixed[:, 1]) / fixed[:, 2]
            far = np.abs(fixed[:, 2]) * RADII[1] < np.hypot(fixed[:, 0], fixed[:, 1])
            radius = np.abs(z - centre)
            pivot = np.where(drawn.linkage.finite[:, :, 1], drawn.linkage.points[:, :, 1], np.inf)
            apart = np.abs(pivot - z[:, None]).min(1)
            good = np.isfinite(pairs).all(axis=(1, 2)) & (apart >= NEAREST_PIVOT)
            good &= ((np.abs(z) >= NEAREST_POINT) | no_pole) & (np.abs(z) <= FARTHEST_POINT)
            good &= ~far & (radius >= RADII[0]) & (radius <= RADII[1]) if circle else fixed[:, 2] == 0
        k = np.flatnonzero(good)
        found.append(
            {
                "mechanism": k,
                "label": np.full(len(k), guided.label, dtype=object),
                "x": z[k].real,
                "y": z[k].imag,
                "contact_order": np.broadcast_to(guided.order, n)[k],
                "curvature": 1 / radius[k] if circle else np.zeros(len(k)),
                "centre": centre[k],
            }
        )
    return {k: np.concatenate([f[k] for f in found]) for k in found[0]}


def _reaches(
    guides: Span, traced: Traced, measured: Measures, half: Array, centre: Array, level: int, circle: bool
) -> tuple[Columns, Array]:
    """Return the columns of one level, and where they may be stored, shape (n,)."""
    stroke = traced.fit.stroke
    with np.errstate(all="ignore"):
        relative = traced.relative
        size = measured.size / stroke
        good = (relative <= 10.0**level) & (size <= LARGEST) & (measured.min_transmission >= LEAST_TRANSMISSION)
        good &= np.isfinite(measured.max_arm)
        sweep = np.abs(traced.fit.curvature) * stroke if circle else np.zeros(len(stroke))
        good &= (sweep > 0) if circle else good
        # the path runs from (0, 0) to (1, 0)
        boxes = {
            f"{name}_{side}": box[:, i] / stroke + (0.5 if i % 2 == 0 else 0.0)
            for name, box in (("fixed", measured.fixed_box), ("all", measured.box))
            for i, side in enumerate(("x0", "y0", "x1", "y1"))
        }
        lengths = {k: getattr(measured, k) / stroke for k in ("size", "max_link", "min_link", "max_ground", "max_arm")}
    columns = {
        "guide": np.arange(len(guides)), "level": np.full(len(guides), level), "stroke": stroke, "half": half,
        "centre": centre, "deviation": relative, "sweep": sweep, **lengths,
        "min_transmission": measured.min_transmission, "balance": size - measured.min_transmission / 90,
        "rotates": measured.rotates, **boxes,
    }  # fmt: skip
    return columns, good
