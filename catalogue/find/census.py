"""Count the stored mechanisms by series, family and configuration; explain empty cells."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np
from sqlalchemy import func, select

from ..curvature_theory.instant import Instant
from ..errors import PluginError, PluginWarning
from ..foreign_code import foreign
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array
from ..plugin.registry import Registry
from ..series.sampling import in_proportion
from ..series.series import Member, Series
from ..store import Batch, Database, Guide, Mechanism, Reach, SpecimenRow

#: Number of sampled points of a member's domain: enough to find configurations that fill 0.2 % of
#: it.
SAMPLED_POINTS = 2048
#: Configurations of a linkage in general position by family (Allievi 1895, sec. 3).
NORMAL = {
    "four-bar": ("PP", "PX", "PN", "XX", "XN", "NN"),
    "slider-crank": ("TP", "TX", "TN"),
    "inverted-slider-crank": ("CP", "CX", "CN"),
    "swinging-block": ("TC",),
    "elliptic-trammel": ("TT",),
    "oldham": ("CC",),
}
#: Four-bar configurations of the series I, II, II*, III and III* by Allievi's count (sec. 22).  His
#: six additional ones cannot be identified without his figures: he may count II.yy as the six of
#: I.yy, three of which are impossible.
ALLIEVI_COUNT = 54
#: Number of these configurations when counted by the letters of the dyads.
LETTER_COUNT = 48


@dataclass(frozen=True)
class Cell:
    """One series in one family and configuration, or a family of a collection."""

    series: str  #: code of the series, or name of the collection
    family: str
    configuration: str
    dimension: int  #: number of free parameters of its largest member, up to similarity
    mechanisms: int  #: number of stored mechanisms
    guides: int  #: number of stored guides
    smallest: dict[int, float]  #: smallest size over stroke of a stored guide, by level
    remark: str  #: reason for an empty cell; else empty
    named: int = 0  #: number of named guides, besides the other counts


def census(database: Database, registry: Registry) -> list[Cell]:
    """Count the mechanisms in each cell of the series, then in families of collections."""
    database.check()
    held = _count_stored(database)
    built = set(database.read(select(Batch.series.label("code")).distinct())["code"])
    cells = []
    for series in registry.series.values():
        found: dict[tuple[str, str], tuple[int, Array]] = {}
        try:
            with foreign(f"series {series.code}"):
                looked = [(member, _configurations(series, member)) for member in series.members]
        except PluginError as error:
            warnings.warn(series.left_out(error), PluginWarning, stacklevel=2)
            continue
        for member, configurations in looked:
            for configuration, counts in configurations.items():
                key = (member.family, configuration)
                dimension, before = found.get(key, (0, 0))
                found[key] = (max(dimension, len(member.parameters)), before + counts)
        keys = [*found, *(k[1:] for k in held if k[0] == series.code and k[1:] not in found)]
        for family, configuration in keys:
            dimension, counts = found.get((family, configuration), (0, np.zeros(3, int)))
            mechanisms, guides, smallest = held.get((series.code, family, configuration), (0, 0, {}))
            remark = "" if guides else _why(*counts.tolist())
            if remark and counts[-1] and series.code not in built:
                remark = f"not built: `catalogue build --series {series.code}`"
            cells.append(Cell(series.code, family, configuration, dimension, mechanisms, guides, smallest, remark))
    unknown = {key: of for key, of in held.items() if key[0] not in registry.series}
    cells += [Cell(*key, 0, *of, "no plugin brings this series") for key, of in unknown.items()]
    named = _count_named(database)
    cells = [replace(c, named=named.pop((c.series, c.family, c.configuration), 0)) for c in cells]
    cells += [Cell(*key, 0, 0, 0, {}, "named guides alone", number) for key, number in named.items()]
    return cells + _count_specimens(database)


def impossible(series: Series, cells: list[Cell]) -> list[tuple[str, str]]:
    """List the families and normal configurations that no member of a series covers."""
    there = {(c.family, c.configuration) for c in cells if c.series == series.code}
    special = {c for _, c in there if not any(c in names for names in NORMAL.values())}
    if special:  # the series has special configurations, such as a pivot at the pole
        return []
    return [(f, c) for f in series.families for c in NORMAL.get(f, ()) if (f, c) not in there]


def _why(drawn: int, sound: int, guiding: int) -> str:
    if not drawn:
        return "not reached by the domain of any member"
    if not guiding:
        return "impossible: what it guides is imaginary, or part of the linkage itself"
    if not sound:
        return f"none of {drawn} drawn is in proportion"
    return f"{sound} of {drawn} drawn are in proportion, none holds a usable guide"


def _configurations(series: Series, member: Member) -> dict[str, Array]:
    """Count samples of a member by configuration: drawn, well-proportioned, guiding."""
    random = np.random.default_rng(1895)
    free = {p.name: p.spread(random.random(SAMPLED_POINTS)) for p in member.parameters}
    linkage, valid = Linkage.valid(member.synthesise(free))
    guides = np.zeros(len(valid), bool)
    for one in series.guided(member.complete(free)):
        guides |= np.isfinite(one.pairs).all(axis=(1, 2))
    names = Instant(linkage, np.zeros(len(linkage), complex)).configuration
    sound = in_proportion(linkage)
    each = np.stack([np.ones_like(sound), sound, guides[valid]])
    return {str(n): each[:, names == n].sum(1) for n in np.unique(names)}


def _count_named(database: Database) -> dict[tuple[str, str, str], int]:
    """Count the named guides by series, family and configuration."""
    place = (Mechanism.series, Mechanism.family, Mechanism.configuration)
    found = database.read(
        select(*place, func.count(Guide.id).label("guides"))
        .join(Guide, Guide.mechanism_id == Mechanism.id)
        .where(Mechanism.batch_id.is_(None))
        .group_by(*place)
    )
    return {tuple(key): int(number) for *key, number in zip(*found.values(), strict=True)}


def _count_specimens(database: Database) -> list[Cell]:
    """Count the stored mechanisms of collections by family; each guides one point."""
    place = (SpecimenRow.collection, SpecimenRow.family)
    found = database.read(select(*place, func.count().label("number")).group_by(*place).order_by(*place))
    rows = zip(*found.values(), strict=True)
    return [Cell(collection, family, "", 0, int(n), int(n), {}, "") for collection, family, n in rows]


def _count_stored(database: Database) -> dict[tuple[str, str, str], tuple[int, int, dict[int, float]]]:
    place = (Mechanism.series, Mechanism.family, Mechanism.configuration)
    counted = database.read(
        select(*place, func.count(Mechanism.id.distinct()).label("mechanisms"), func.count(Guide.id).label("guides"))
        .join(Guide, Guide.mechanism_id == Mechanism.id)
        .where(Mechanism.batch_id.is_not(None))  # `_count_named` counts the others
        .group_by(*place)
    )
    best = database.read(
        select(*place, Reach.level, func.min(Reach.__table__.c["size"]).label("smallest"))
        .join(Guide, Guide.mechanism_id == Mechanism.id)
        .join(Reach, Reach.guide_id == Guide.id)
        .where(Mechanism.batch_id.is_not(None))
        .group_by(*place, Reach.level)
    )
    smallest: dict[tuple[str, str, str], dict[int, float]] = {}
    for *key, level, size in zip(*best.values(), strict=True):
        smallest.setdefault(tuple(key), {})[int(level)] = float(size)
    return {
        tuple(key): (int(mechanisms), int(guides), smallest.get(tuple(key), {}))
        for *key, mechanisms, guides in zip(*counted.values(), strict=True)
    }
