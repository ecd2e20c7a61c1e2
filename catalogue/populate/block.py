"""A block of a build, from sampling to stored columns; its arguments determine its content."""

from __future__ import annotations

import json
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

import numpy as np

from ..candidates.select import ranks
from ..candidates.stored import linkages
from ..curvature_theory.analysis import DEGENERATE
from ..curvature_theory.instant import Instant
from ..kinematics.batch import take
from ..kinematics.linkage import Linkage
from ..kinematics.types import Indices, Texts
from ..series.sampling import BLOCK, PLAN, draw
from ..series.series import Series
from .cover import cells_of, designs, order
from .elements import elements_worth_tracing
from .rows import Columns, concatenate, guide_columns, mechanism_columns


class BlockOptions(NamedTuple):
    """Sizes and limits of a block, the unit of work."""

    limit: float = 120.0  #: time limit of a block [s]: it takes a second or two
    most: int = 256  #: largest number of guides
    loss: float = 1.15  #: traced candidates per requested guide: some reach no level
    spare: int = 8  #: number of traced candidates beyond the requested ones
    rescued: int = 8  #: number of candidates tried per configuration and kind that would otherwise be empty


BLOCKS = BlockOptions()


@dataclass(frozen=True)
class Block:
    """Rows that a block adds to each table; see `catalogue.store.write_batch`."""

    batch: Columns
    mechanisms: Columns
    guides: Columns
    reaches: Columns

    @property
    def count(self) -> int:
        """Number of guides."""
        return len(self.guides["mechanism"])


def block(series: Series, key: str, seed: int, number: int, wanted: int, plugin: str, version: str) -> Block:
    """Build up to `wanted` guides of block `number` of a member, in order of coverage."""
    drawn = draw(series, series.member(key), seed, number)
    found = elements_worth_tracing(series, drawn)
    linkage = linkages(drawn.linkage.pivots[found["mechanism"]], found["kind"])
    names = Instant(drawn.linkage, np.zeros(len(drawn.linkage), complex)).configuration
    guides, reaches = _traced(linkage, found, names[found["mechanism"]], wanted)
    used, guides["mechanism"] = np.unique(guides["mechanism"], return_inverse=True)
    guides["cover"] = ranks(guides["kind"].astype(str))
    batch = {
        "series": series.code,
        "member": key,
        "plugin": plugin,
        "plugin_version": version,
        "plan": PLAN,
        "seed": seed,
        "number": number,
        "drawn": BLOCK,
        "kept": len(used),
        "guides": len(guides["mechanism"]),
        "wanted": wanted,
    }
    free = {name: values[used].tolist() for name, values in drawn.free.items()}
    mechanisms = {
        **mechanism_columns(drawn.linkage[used]),
        "series": series.code,
        "member": key,
        "name": None,
        "parameters": [json.dumps({name: values[i] for name, values in free.items()}) for i in range(len(used))],
    }
    return Block(batch, mechanisms, guides, reaches)


def _traced(linkage: Linkage, found: Columns, names: Texts, wanted: int) -> tuple[Columns, Columns]:
    """Trace candidates in order until enough reach a level; return columns of guides and reaches.

    The first batch usually suffices; further ones follow until `wanted` candidates reach a level,
    or the rest is not worth tracing. Finally some candidates are traced of each configuration
    (`names`) and kind that has no guide yet. `linkage` holds the inversions of linkages with slots.
    """
    if not len(names):
        return concatenate([])
    found = found | {"candidate": np.arange(len(names))}
    z, pole = found["x"] + 1j * found["y"], np.abs(linkage.sine) >= DEGENERATE.parallel_sine
    everything = designs(linkage, z, found["centre"], found["kind"], pole)
    following = order(everything, cells_of(found["kind"], names, found["label"]))
    cells = cells_of(found["kind"], names)
    turn = np.full(len(cells), -1)  # rank of each cell in the order of trials
    parts: list[tuple[Columns, Columns]] = []
    count = tried = 0
    while count < wanted and (chosen := list(islice(following, BLOCKS.spare + int(BLOCKS.loss * (wanted - count))))):
        turn[chosen] = np.arange(tried, tried + len(chosen))
        tried += len(chosen)
        parts += guide_columns(linkage[chosen], take(found, chosen))
        count = sum(len(guides["x"]) for guides, _ in parts)
    held = [i for guides, _ in parts for i in guides["candidate"]]
    lost = ~np.isin(cells, cells[held]) & (turn < 0)
    rescued = np.flatnonzero(lost)[np.argsort(-everything.weight[lost], kind="stable")]
    rescued = rescued[ranks(cells[rescued]) < BLOCKS.rescued]
    turn[rescued] = np.arange(len(rescued)) - len(rescued)
    more = guide_columns(linkage[rescued], take(found, rescued))
    for guides, _ in more:  # the soundest candidate of each cell comes first, the others last
        _, soundest = np.unique(cells[guides["candidate"]], return_index=True)
        turn[np.delete(guides["candidate"], soundest)] += len(cells) + len(rescued)
    return _select_first(*concatenate(parts + more), turn, wanted)


def _select_first(guides: Columns, reaches: Columns, turn: Indices, wanted: int) -> tuple[Columns, Columns]:
    """Return the first guides in the order of their candidates, with their reaches."""
    if not len(guides["mechanism"]):
        return guides, reaches
    kept = np.argsort(turn[guides.pop("candidate")])[:wanted]
    place = np.full(len(guides["mechanism"]), len(kept))
    place[kept] = np.arange(len(kept))
    owner = place[reaches["guide"]]
    rows = np.argsort(owner, kind="stable")[: np.sum(owner < len(kept))]
    return take(guides, kept), take(reaches, rows) | {"guide": owner[rows]}
