"""Forces in links and joints, by the transpose of the Jacobian (virtual work)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from ...given import Stated, instance, several
from ...kinematics.types import Array
from .elements import Link
from .frame import make_frame
from .motion import RANK_TOLERANCE, Motion
from .vectors import cross


@dataclass(frozen=True, eq=False)
class Load(Stated):
    """A force and a moment on a body; the point of application is given in the design pose."""

    body: str
    force: Sequence[float] | Any
    at: Sequence[float] | Any
    moment: Sequence[float] | Any = (0.0, 0.0, 0.0)


def reactions(motion: Motion, loads: Sequence[Load]) -> pd.DataFrame:
    """Compute reactions of joints and links, and drive forces, in massless equilibrium.

    Parameters
    ----------
    motion : Motion
    loads : sequence of Load
        Forces in newtons, moments in newtons times the unit of length.

    Returns
    -------
    pandas.DataFrame
        One row per pose, for a batch indexed by mechanism and pose.  A link has its force, positive
        for tension; an element with several conditions has one numbered column for each, a force,
        or a moment for a condition on directions; drive and held scalars have the force or moment
        that acts on them.  NaN for elements with redundant conditions: statics does not determine
        them.

    Raises
    ------
    InvalidRequest
        If an entry is no load, or its body is unknown.
    InvalidLinkage
        If a force, a moment or a point is not three finite numbers.
    """
    loads = several("loads", loads, Load)
    curve, y = instance("motion", motion, Motion).flat()
    system, unit = curve.system, motion.mechanism.unit
    rotation, shift = system.poses(y)
    screws = system.screws(y, rotation, shift)
    push = np.zeros((len(y), system.unknowns))
    for load in loads:
        b = motion.body_number(load.body)
        p = (motion.each(load.at, "Load.at") - system.centre) / system.unit
        force = motion.each(load.force, "Load.force")
        at = (rotation[0][:, b] @ p[..., None])[..., 0] + shift[0][:, b]
        moment = cross(at, np.broadcast_to(force, at.shape)) + motion.each(load.moment, "Load.moment") / system.unit
        wrench = np.concatenate([np.broadcast_to(force, at.shape), moment], axis=1)
        push += (screws @ wrench[..., None])[..., 0] * motion.carries(b)
    borne = -(np.swapaxes(motion.inverse(), 1, 2) @ push[..., None])[..., 0]
    links = {_label for _label, x in zip(system.labelled, motion.mechanism.joints, strict=True) if isinstance(x, Link)}
    angular = set(range(system.starts[1], system.starts[2]))
    columns: dict[str, Any] = {}
    lost = _is_indeterminate(motion)
    times: dict[str, int] = {}
    for r, name in enumerate(system.names):
        if r >= system.starts[3]:
            continue  # an idle rotation carries no load
        times[name] = times.get(name, 0) + 1
        many = sum(n == name for n in system.names) > 1
        label = f"{name} {times[name]}" if many else name
        value = borne[:, r] * (-1 if name in links else 1) * (unit_of := system.unit if r in angular else 1.0)
        columns[f"{label} [{'N' if unit_of == 1.0 and r not in angular else 'N ' + unit}]"] = np.where(
            lost[:, [n == name for n in system.names]].any(1), np.nan, value
        )
    for k, scalar in enumerate(system.scalars, system.rows):
        what = "drive" if k == system.rows + len(system.scalars) - 1 else f"held {k - system.rows + 1}"
        if scalar.angular:
            columns[f"{what} [N {unit}]"] = borne[:, k] * system.unit
        else:
            columns[f"{what} [N]"] = borne[:, k]
    return make_frame(motion, columns)


def _is_indeterminate(motion: Motion) -> Array:
    """Return a mask (n s, conditions) of statically indeterminate reactions."""
    curve, y = motion.flat()
    rows = curve.system.rows
    if not curve.system.redundant:
        return np.zeros((len(y), rows), bool)
    jacobian = curve.system.evaluate(y)[2][:, :rows]
    out = np.zeros((len(y), rows), bool)
    good = np.isfinite(jacobian).all((1, 2))
    u, s, _ = np.linalg.svd(jacobian[good], full_matrices=True)
    share = np.zeros(u.shape[::2])
    share[:, : s.shape[1]] = s > RANK_TOLERANCE * s[:, :1]
    out[good] = ((u * ~share.astype(bool)[:, None]) ** 2).sum(2) > RANK_TOLERANCE
    return out
