"""Report of a fit: deviations before and after, displacements, active bounds of boxes, misses."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from ...kinematics.types import Array
from ..jointed.mechanism import Mechanism
from .trials import Trial

if TYPE_CHECKING:
    from .fit import Search

#: Largest excess of a kept bound [tolerances].
BOUND_TOLERANCE = 1e-5
#: Largest distance of a variable at a bound of its box.
AT_END = 1e-6
#: Singular value, relative to the largest or to 1 (a tolerance per box), below which a direction
#: has no effect on any target.
INEFFECTIVE = 1e-7


class Fit:
    """Result of a fit: the mechanism with moved hard points, and its deviations.

    Attributes
    ----------
    mechanism : Mechanism
        The given one with moved hard points.
    success : bool
        Whether every target is met within its tolerance and every bound is kept.
    motions : tuple of Motion
        Motions of `mechanism`, one for each sweep, in the order of `sweeps`.
    targets, bounds, points, held_back : pandas.DataFrame
        Largest and root mean square deviations before and after; bounds before and after;
        displacements of the points in the boxes; reached ends of boxes, with the decrease of the
        sum of squares per unit of length beyond.  Before is NaN if the given mechanism does not
        complete the sweeps.
    undetermined : int
        Number of independent displacements without effect on any target: above 0, the solution is
        one of many.
    refused : dict
        Number of refused trials by reason; `trials` is the number of all.
    missed : tuple of str
        Missed targets and bounds, with their positions.
    """

    def __init__(self, search: Search, given: Trial | None, found: Trial) -> None:
        self._search, self._given, self._found = search, given, found
        self._variables = search.trials.variables
        self.sweeps = tuple(search.trials.sweeps)
        self.mechanism: Mechanism = found.motions[0].mechanism
        self.motions = found.motions
        self.success = search.done(found)
        self.refused = dict(search.trials.refused)
        self.trials = search.trials.made

    @cached_property
    def displacements(self) -> dict[str, tuple[float, float, float]]:
        """Displacement of every hard point that a box may move, in the unit of length."""
        moved = self._variables.displacement(self._found.u[None])[0]
        return {self._variables.labels[h]: _as_triple(moved[h]) for h in sorted(self._variables.at_home)}

    @cached_property
    def targets(self) -> pd.DataFrame:
        before = self._search.deviations(self._given) if self._given else None
        after = self._search.deviations(self._found)
        rows = []
        for k, target in enumerate(self._search.targets):
            row: dict[str, Any] = {"target": target.name, "unit": target.unit, "tolerance": target.tolerance}
            for when, off in (("before", before[k] if before else None), ("after", after[k])):
                size = np.sqrt((off * off).sum(1)) if off is not None else np.array([np.nan])
                row |= {f"largest {when}": size.max(), f"rms {when}": np.sqrt((size * size).mean())}
            row["met"] = bool(row["largest after"] <= target.tolerance)
            rows.append(row)
        return pd.DataFrame(rows)

    @cached_property
    def bounds(self) -> pd.DataFrame:
        """Least and largest reading before and after, with the bounds."""
        skip = len(self._search.targets)
        rows = []
        for k, bound in enumerate(self._search.bounds):
            row: dict[str, object] = {
                "bound": bound.name,
                "unit": bound.unit,
                "at least": bound.least,
                "at most": bound.most,
            }
            for when, trial in (("before", self._given), ("after", self._found)):
                read = trial.read[skip + k] if trial else np.array([np.nan])
                row |= {f"least {when}": read.min(), f"most {when}": read.max()}
            row["kept"] = bool(self._search.excesses(self._found)[k].max() <= BOUND_TOLERANCE * bound.tolerance)
            rows.append(row)
        return pd.DataFrame(rows)

    @cached_property
    def points(self) -> pd.DataFrame:
        rows = [(name, *d, float(np.hypot(np.hypot(d[0], d[1]), d[2]))) for name, d in self.displacements.items()]
        unit = self.mechanism.unit
        return pd.DataFrame(rows, columns=["point", *(f"d{k} [{unit}]" for k in "xyz"), f"moved [{unit}]"])

    @cached_property
    def _slopes(self) -> Array:
        return self._search.slopes(self._found)[0]

    @cached_property
    def held_back(self) -> pd.DataFrame:
        u, half = self._found.u, self._variables.half
        gain = -2 * self._slopes.T @ self._search.residual(self._found) * np.sign(u) / half
        rows = [
            (self._variables.names[k], float(u[k] * half[k]), float(max(gain[k], 0.0)))
            for k in np.flatnonzero(np.abs(u) > 1 - AT_END)
        ]
        unit = self.mechanism.unit
        table = pd.DataFrame(rows, columns=["coordinate", f"moved [{unit}]", f"gain [1/{unit}]"])
        return table.sort_values(f"gain [1/{unit}]", ascending=False, ignore_index=True)

    @cached_property
    def undetermined(self) -> int:
        s = np.linalg.svd(self._slopes, compute_uv=False)
        return len(self._variables.half) - int((s > INEFFECTIVE * max(1.0, s.max(initial=0))).sum())

    @cached_property
    def missed(self) -> tuple[str, ...]:
        search, found, out = self._search, self._found, []
        for k, off in enumerate(search.deviations(found)):
            target, size = search.targets[k], np.sqrt((off * off).sum(1))
            if size.max() > target.tolerance:
                out.append(f"{target.name} is missed by {self._largest_deviation(size, target.unit, k)}")
        for k, excess in enumerate(search.excesses(found), len(search.targets)):
            bound, size = search.bounds[k - len(search.targets)], excess.max(1)
            if size.max() > BOUND_TOLERANCE * bound.tolerance:
                out.append(f"{bound.name} is broken by {self._largest_deviation(size, bound.unit, k)}")
        return tuple(out)

    def _largest_deviation(self, size: Array, unit: str, curve: int) -> str:
        """Return the largest deviation and its position in the sweep, as text."""
        worst, motion = int(size.argmax()), self.motions[self._search.trials.over[curve]]
        amount = f"{size[worst]:.3g} {unit}".strip()
        return f"{amount} where the drive is {motion.drive_shown[worst]:.6g} {motion.drive_unit}"

    def __str__(self) -> str:
        """Return the report as consecutive tables."""
        shown = [self.targets, *([self.bounds] if self._search.bounds else []), self.points]
        shown += [self.held_back] if len(self.held_back) else []
        lines = [t.to_string(index=False, float_format=lambda v: f"{v:.4g}") for t in shown]
        return "\n\n".join([*lines, "\n".join(self.remarks())])

    def remarks(self) -> list[str]:
        """Return remarks on missed targets, refused trials and undetermined displacements."""
        lines = list(self.missed) or [
            "all targets are met, all bounds kept" if self._search.bounds else "all targets are met"
        ]
        if self.undetermined:
            lines.append(
                f"{self.undetermined} of {len(self._variables.half)} coordinates are not determined by the targets"
            )
        if self._given is None:
            lines.append("the mechanism as given does not get through all sweeps")
        lines += [f"{n} of {self.trials} trials refused: {reason}" for reason, n in self.refused.items()]
        return lines


def _as_triple(v: Array) -> tuple[float, float, float]:
    x, y, z = (float(k) for k in v)
    return x, y, z
