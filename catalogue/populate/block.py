"""One block of a build, from drawing to the columns that are stored.  Pure: same arguments, same columns."""

from __future__ import annotations

import json
from dataclasses import dataclass
from itertools import islice

import numpy as np

from ..candidates.select import ranks
from ..curvature_theory.analysis import PARALLEL_SINE
from ..curvature_theory.instant import Instant
from ..guide.kinds import SLOTS, STRAIGHT
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Indices
from ..series.sampling import BLOCK, PLAN, Drawn, draw
from ..series.series import Series
from .cover import cells_of, designs, order
from .elements import elements_worth_tracing
from .rows import Columns, guide_columns, mechanism_columns, together

#: Most guides that a block gives.
MOST = 256
#: So many times as many candidates are traced as guides are wanted, and a few more: some hold no level.
LOSS, SPARE = 1.15, 8
#: So many are tried of a configuration and kind that would else be empty.
RESCUED = 8


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


def block(series: Series, key: str, seed: int, number: int, wanted: int, plugin: str, version: str) -> Block:
    """Return the first guides, in their order of coverage, of block `number` of a member of a series.

    Parameters
    ----------
    wanted : int
        How many, if there are so many; see `MOST`.
    """
    member = series.member(key)
    drawn = draw(series, member, seed, number)
    found = elements_worth_tracing(series, drawn)
    slots = np.isin(found["kind"], list(SLOTS.values()))[:, None, None, None]
    pivots = drawn.linkage.pivots[found["mechanism"]]
    linkage = Linkage(np.where(slots, pivots[:, :, ::-1], pivots))
    names = Instant(drawn.linkage, np.zeros(len(drawn.linkage), complex)).configuration
    guides, reaches = _traced(linkage, found, names[found["mechanism"]], wanted)
    used, guides["mechanism"] = np.unique(guides["mechanism"], return_inverse=True)
    guides["cover"] = ranks(guides["kind"].astype(str))
    count = len(guides["mechanism"])
    batch = {
        "series": series.code, "member": key, "plugin": plugin, "plugin_version": version, "plan": PLAN,
        "seed": seed, "number": number, "drawn": BLOCK, "kept": len(used), "guides": count, "wanted": wanted,
    }  # fmt: skip
    return Block(batch, _mechanisms(series, key, drawn, used), guides, reaches)


def _traced(linkage: Linkage, found: Columns, names: Array, wanted: int) -> tuple[Columns, Columns]:
    """Return the columns of guides and of reaches of the first candidates that hold a level, in their order.

    As many are traced as are likely to be needed, and more until there are enough, or no more worth it; and some of
    each configuration and kind of which none has held a level.

    Parameters
    ----------
    linkage : Linkage of n
        Of each candidate, of a slot the inverse one.
    found : mapping of columns
    names : ndarray of str, shape (n,)
        Configurations.
    wanted : int
    """
    if not len(names):
        return together([])
    z, pole = found["x"] + 1j * found["y"], np.abs(linkage.sine) >= PARALLEL_SINE
    everything = designs(linkage, z, found["centre"], found["kind"], pole)
    following = order(everything, cells_of(found["kind"], names, found["label"]))
    cells = cells_of(found["kind"], names)
    turn = np.full(len(cells), -1)  # of those that were tried
    parts: list[tuple[Columns, Columns]] = []
    count = tried = 0
    while count < wanted:
        chosen = np.fromiter(islice(following, SPARE + int(LOSS * (wanted - count))), int)
        if not len(chosen):
            break
        turn[chosen] = np.arange(tried, tried + len(chosen))
        tried += len(chosen)
        parts += _parts(linkage, found, turn, chosen)
        count = sum(len(guides["x"]) for guides, _ in parts)
    held = np.concatenate([guides["turn"] for guides, _ in parts]) if parts else np.zeros(0, int)
    lost = ~np.isin(cells, cells[np.isin(turn, held) & (turn >= 0)]) & (turn < 0)
    rescued = np.flatnonzero(lost)[np.argsort(-everything.weight[lost], kind="stable")]
    rescued = rescued[ranks(cells[rescued]) < RESCUED]
    turn[rescued] = np.arange(len(rescued)) - len(rescued)
    more = _parts(linkage, found, turn, rescued)
    for guides, _ in more:  # the soundest of each comes first of all, the others last
        _, soundest = np.unique(cells[rescued[guides["turn"] + len(rescued)]], return_index=True)
        others = np.delete(np.arange(len(guides["turn"])), soundest)
        guides["turn"][others] += len(cells) + len(rescued)
    return _first(*together(parts + more), wanted)


def _parts(linkage: Linkage, found: Columns, turn: Array, chosen: Indices) -> list[tuple[Columns, Columns]]:
    """Return the columns of guides, with their ``turn``, and of reaches of some candidates, by their nominals."""
    circle = ~np.isin(found["kind"][chosen], STRAIGHT)
    parts = []
    for curved in (False, True):
        some = chosen[circle == curved]
        points = {name: column[some] for name, column in found.items()} | {"turn": turn[some]}
        parts.append(guide_columns(linkage[some], points, curved))
    return [part for part in parts if part is not None]


def _first(guides: Columns, reaches: Columns, wanted: int) -> tuple[Columns, Columns]:
    """Return the first guides by their turn, with their reaches."""
    if not len(guides["mechanism"]):
        return guides, reaches
    kept = np.argsort(guides.pop("turn"))[:wanted]
    place = np.full(len(guides["mechanism"]), -1)
    place[kept] = np.arange(len(kept))
    guides = {name: column[kept] for name, column in guides.items()}
    owner = place[reaches["guide"]]
    rows = np.flatnonzero(owner >= 0)
    rows = rows[np.argsort(owner[rows], kind="stable")]
    return guides, {name: column[rows] for name, column in reaches.items()} | {"guide": owner[rows]}


def _mechanisms(series: Series, key: str, drawn: Drawn, used: Indices) -> Columns:
    names = list(drawn.free)
    rows = zip(*(drawn.free[name][used].tolist() for name in names), strict=True) if names else [()] * len(used)
    return {
        **mechanism_columns(drawn.linkage[used]),
        "series": series.code,
        "member": key,
        "name": None,
        "parameters": [json.dumps(dict(zip(names, row, strict=True))) for row in rows],
    }
