"""Select the linkages of a plate: the best-proportioned sample of each family and configuration."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..curvature_theory.analysis import Curvature
from ..curvature_theory.instant import Instant
from ..errors import PluginError
from ..foreign_code import foreign
from ..kinematics.linkage import Linkage
from ..kinematics.types import Floats
from ..series.sampling import BLOCK, draw_at
from ..series.series import Guided, Member, Series


class Cells(NamedTuple):
    """Options of the cells of a plate."""

    #: Largest number of cells of a plate; members with special conditions fill the places that
    #: configurations leave.
    most: int = 20
    seed: int = 0  #: seed of the sample: a series always has the same plate
    #: distance from the pole beyond which guided points do not extend the drawing [rho0]
    far: float = 3.0


CELLS = Cells()

ORDER = "DVTCPXN"


@dataclass(frozen=True)
class Cell:
    """A linkage at its instant in the canonical frame, with its guided elements."""

    family: str
    configuration: str
    member: str  #: name of the member of the series
    parameters: dict[str, float]  #: free parameters, by name
    linkage: Linkage  #: a single linkage
    curvature: Curvature  #: curvature of this linkage
    guided: list[Guided]  #: real guided elements; points with w = 1, or unit directions with w = 0


@dataclass(frozen=True)
class _Sampled:
    member: Member
    free: dict[str, Floats]
    instant: Instant
    guided: list[Guided]
    cost: Floats

    def cell(self, i: int) -> Cell:
        guided = [
            Guided(g.label, g.pairs[i : i + 1], int(np.broadcast_to(g.order, len(self.cost))[i]))
            for g in self.guided
            if not np.isnan(g.pairs[i]).any()
        ]
        free = {name: float(values[i]) for name, values in self.free.items()}
        return Cell(
            self.member.family,
            str(self.instant.configuration[i]),
            self.member.name,
            free,
            self.instant.linkage[i],
            self.instant.curvature[i],
            guided,
        )


def cells(series: Series) -> list[Cell]:
    """Sample one cell for each family and configuration of a series, then for special members.

    Raises
    ------
    PluginError
        If its formulas raise.
    """
    try:
        with foreign(f"series {series.code}"):
            sampled = [one for member in series.members if len((one := _sampled(series, member)).cost)]
    except PluginError as error:
        raise PluginError(f"series {series.code} cannot be drawn: {error} ({series.origin})") from error
    found: list[Cell] = []
    for family in series.families:
        mine = [one for one in sampled if one.member.family == family]
        names = {str(name) for one in mine for name in one.instant.configuration}
        for name in sorted(names, key=lambda name: [(ORDER.find(letter), letter) for letter in name]):
            best = (_best_cell(one, name) for one in mine if name in one.instant.configuration)
            # prefer the general member of the series to members with additional conditions
            found.append(min(best, key=lambda choice: (choice[0].member != "general", choice[1]))[0])
    shown = {(cell.family, cell.member) for cell in found}
    special = [one for one in sampled if (one.member.family, one.member.name) not in shown]
    called = [one.member.name for one in special]
    # one member of each name, before a second of any
    varied = sorted(range(len(special)), key=lambda i: called[:i].count(called[i]))
    return found + [_best_cell(special[i])[0] for i in varied[: max(0, CELLS.most - len(found))]]


def _best_cell(one: _Sampled, configuration: str | None = None) -> tuple[Cell, float]:
    """Return the cell of least cost, and its cost."""
    cost = one.cost
    if configuration is not None:
        cost = np.where(one.instant.configuration == configuration, cost, np.inf)
    i = int(np.argmin(cost))
    return one.cell(i), float(cost[i])


def _sampled(series: Series, member: Member) -> _Sampled:
    # uniform random shares: a low-discrepancy sequence would load scipy.stats, which takes half a
    # second
    shares = np.random.default_rng(CELLS.seed).random((BLOCK, len(member.parameters)))
    drawn = draw_at(member, shares)
    n = len(drawn.linkage)
    instant = Instant(drawn.linkage, np.zeros(n, complex))
    with np.errstate(all="ignore"):
        guided = [replace(g, pairs=_scale_to_unit_weight(g.pairs)) for g in series.guided(drawn.complete)] if n else []
        cost = _look_cost(drawn.linkage, guided) if n else np.zeros(0)
    return _Sampled(member, drawn.free, instant, guided, cost)


def _scale_to_unit_weight(pairs: Floats) -> Floats:
    """Scale homogeneous points to w = 1; points beyond 1e6 rho0 become unit directions."""
    length, w = np.hypot(pairs[..., 0], pairs[..., 1]), pairs[..., 2]
    far = np.abs(w) < 1e-6 * length
    scaled = pairs / np.where(far, length, w)[..., None]
    scaled[..., 2] = np.where(np.isnan(scaled[..., 0]), np.nan, ~far)
    return np.asarray(scaled)


def _look_cost(linkage: Linkage, guided: list[Guided]) -> Floats:
    """Score the look of each linkage: large, uneven, crowded, distant or imaginary points cost."""
    n = len(linkage)
    pivots = np.where(linkage.finite, linkage.points, np.nan).reshape(n, 4)
    pairs = np.array([g.pairs for g in guided]).reshape(len(guided), n, 2, 3)
    point = np.where(pairs[..., 2] != 0, pairs[..., 0] + 1j * pairs[..., 1], np.nan)
    reach = np.where(np.abs(point) <= CELLS.far, point, np.nan)
    points = np.concatenate([pivots, np.moveaxis(reach, 1, 0).reshape(n, -1)], axis=1)
    z = np.concatenate([points, np.broadcast_to([0, 1j, -1j, 0.5 + 0.5j, -0.5 - 0.5j], (n, 5))], axis=1)
    size = np.maximum(np.nanmax(z.real, 1) - np.nanmin(z.real, 1), np.nanmax(z.imag, 1) - np.nanmin(z.imag, 1))
    lengths = np.abs(pivots[:, [0, 2, 1, 0]] - pivots[:, [1, 3, 3, 2]])
    uneven = np.log(np.fmax.reduce(lengths, 1) / np.fmin.reduce(lengths, 1))
    apart = np.abs(points[:, :, None] - points[:, None, :])[:, *np.triu_indices(points.shape[1], 1)]
    # two points that coincide do so in every linkage: they do not count as crowded
    crowded = np.nansum(np.where(apart < 1e-9, 0, np.clip(0.1 - apart / size[:, None], 0, None)), axis=1)
    near_pole = np.nansum(np.clip(0.08 - np.abs(points) / size[:, None], 0, None), axis=1)
    sine = np.abs(linkage.sine)
    lost = np.isnan(pairs).any((-1, -2)).sum(0) + 0.7 * ((np.abs(point[..., 1]) > CELLS.far).sum(0))
    lost = lost + 0.25 * (np.abs(point[..., 0]) > CELLS.far).sum(0)
    cost = 0.6 * size + 0.35 * uneven + 14 * crowded + 9 * near_pole + 2 * np.clip(0.4 - sine, 0, None) + 0.9 * lost
    return np.asarray(np.nan_to_num(cost, nan=np.inf, posinf=1e9))
