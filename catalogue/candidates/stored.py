"""Stored guides in their canonical frame, and as candidates."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..guidance.coupler_curve import CouplerCurve, coupler_curve
from ..guidance.kinds import SLOTS
from ..guidance.trace import trace
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Floats
from ..problem.problem import Problem
from ..store import stacked_pivots
from .batch import CandidateBatch, Origin, on_path


def linkages(pivots: Floats, kind: Array) -> Linkage:
    """Return the linkages of stored guides; for slots their inversions."""
    pivots = np.asarray(pivots).reshape(-1, 2, 2, 3)
    slot = np.isin(kind.astype(str), list(SLOTS.values()))[:, None, None, None]
    return Linkage.trusted(np.where(slot, pivots[:, :, ::-1], pivots))


def canonical(rows: Mapping[str, Array]) -> CouplerCurve:
    """Return stored guides in their canonical frame, whose origin is the pole.

    Guides with slots are inverted: they move as the slot does.
    """
    z = rows["x"] + 1j * rows["y"]
    return coupler_curve(linkages(stacked_pivots(rows), rows["kind"]), z, pole=np.zeros_like(z))


def origin(rows: Mapping[str, Array]) -> Origin:
    """Return the identities of stored guides, as origins of candidates."""
    none = np.zeros(len(rows["id"]), int)
    return Origin(rows["id"], rows["family"], rows["series"], rows["configuration"], rows["contact_order"], none)


def as_stored(problem: Problem, rows: Mapping[str, Array]) -> CandidateBatch:
    """Place stored reaches along a path, unchanged, at their stored strokes."""
    guides = canonical(rows)
    traced = trace(guides, rows["half"], circle=problem.curved, split=True, centre=rows["centre"], nodes=16)
    return on_path(problem, origin(rows), guides, traced)
