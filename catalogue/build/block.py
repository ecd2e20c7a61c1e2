"""One block of a build, from drawing to the columns that are stored.  Pure: same arguments, same columns."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np

from ..instant.analysis import PARALLEL_SINE
from ..linkage import Array
from ..series import Series
from .draw import BLOCK, PLAN, Drawn, draw
from .rows import Columns, guide_columns, mechanism_columns, together

#: Guided points nearer to the pole than this guide badly; farther ones need an unwieldy coupler (units of rho0).
NEAREST_POINT, FARTHEST_POINT = 0.15, 6.0
RADII = (0.1, 50.0)
#: A guided point nearer than this to a moving pivot is that pivot, which needs no guide.
NEAREST_PIVOT = 0.03


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
    parts = [guide_columns(drawn.linkage, _points(series, drawn, circle), circle) for circle in (False, True)]
    guides, reaches = together([part for part in parts if part is not None])
    used, guides["mechanism"] = np.unique(guides["mechanism"], return_inverse=True)
    batch = {
        "series": series.code, "member": key, "plugin": plugin, "plugin_version": version, "plan": PLAN,
        "seed": seed, "number": number, "drawn": BLOCK, "kept": len(used), "guides": len(guides["mechanism"]),
    }  # fmt: skip
    return Block(batch, _mechanisms(series, key, drawn, used), guides, reaches)


def _mechanisms(series: Series, key: str, drawn: Drawn, used: Array) -> Columns:
    names = list(drawn.free)
    rows = zip(*(drawn.free[name][used].tolist() for name in names), strict=True) if names else [()] * len(used)
    return {
        **mechanism_columns(drawn.linkage[used]),
        "series": series.code,
        "member": key,
        "name": None,
        "parameters": [json.dumps(dict(zip(names, row, strict=True))) for row in rows],
    }


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
                "centre": centre[k],
            }
        )
    return {k: np.concatenate([f[k] for f in found]) for k in found[0]}
