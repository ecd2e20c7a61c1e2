"""Plan a build: blocks of each member, and numbers of guides."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import NamedTuple

from sqlalchemy import func, select

from ..plugin.registry import Record, Registry
from ..series.sampling import PLAN
from ..series.series import Member, Series
from ..store import Batch, Database, Guide, Mechanism
from .block import BLOCKS, Block

#: Number of successive blocks without a guide after which a member is abandoned.
MAX_EMPTY_BLOCKS = 8

Key = tuple[str, str]


class Held(NamedTuple):
    """A stored block."""

    id: int
    guides: int
    wanted: int


@dataclass
class Source:
    """The blocks of one member, in order.

    Each block has `BLOCKS.most` guides; the last one may have fewer. When a larger build continues
    the file, such blocks are `short`: they are removed and made again.
    """

    series: Series
    plugin: Record
    member: Member
    target: int
    held: dict[int, Held]
    asked: list[Future[Block]] = field(default_factory=list)  # blocks in progress, in order
    next: int = 0
    guides: int = 0
    barren: int = 0
    failure: str = ""  # reason for omitting the member
    lost: bool = False  # whether a worker failed, not the member: the build stays incomplete
    short: list[int] = field(default_factory=list)

    @property
    def key(self) -> Key:
        """Series and member."""
        return self.series.code, self.member.key

    def skip(self) -> None:
        """Skip the stored blocks."""
        while not self.full and (block := self.held.get(self.next)):
            if block.wanted < self._missing_count:
                self.short = [b.id for number, b in self.held.items() if number >= self.next]
                self.held = {}
                return
            self.count(block.guides)

    def count(self, guides: int) -> None:
        """Count the next block, with its number of guides, as done."""
        self.next += 1
        self.guides += guides
        self.barren = 0 if guides else self.barren + 1

    @property
    def full(self) -> bool:
        """Whether the member needs no more guides, or cannot provide more."""
        single = not self.member.parameters and self.next > 0  # a single design, which the first block holds
        return bool(self.failure) or self.guides >= self.target or self.barren >= MAX_EMPTY_BLOCKS or single

    @property
    def lacking(self) -> int:
        """Number of guides of the next block; 0 if none, or while it depends on pending blocks."""
        if self.full:
            return 0
        if not self.asked:
            return self._missing_count
        return BLOCKS.most if self.guides + (len(self.asked) + 1) * BLOCKS.most <= self.target else 0

    @property
    def _missing_count(self) -> int:
        return min(BLOCKS.most, self.target - self.guides)


def plan(database: Database, registry: Registry, codes: Sequence[str], count: int, seed: int) -> list[Source]:
    """Return the sources of a build, beyond the blocks that the file holds.

    The share of a series grows with its number of free parameters, as a cover of more dimensions
    needs more guides; its members divide it by their weights. A member without parameters is a
    single design, which is not counted.
    """
    held = _stored_blocks(database, seed)
    shares = {code: _share(registry.series[code]) for code in codes}
    sources = []
    for code in codes:
        one = registry.series[code]
        share = count * shares[code] / sum(shares.values())
        total = sum(m.weight for m in one.members if m.parameters) or 1.0
        for member in one.members:
            target = BLOCKS.most if not member.parameters else max(round(share * member.weight / total), 1)
            sources.append(Source(one, registry.provider(code), member, target, held.get((code, member.key), {})))
            sources[-1].skip()
    return sources


def _share(series: Series) -> int:
    """Return the share of a series in a build, relative to others."""
    return 1 + max(len(member.parameters) for member in series.members)


def share_of(registry: Registry, codes: Sequence[str], count: int) -> int:
    """Return the given series' part of `count` guides of all series, at least one."""
    every = sum(map(_share, registry.series.values()))
    return max(
        round(count * sum(_share(registry.series[code]) for code in codes if code in registry.series) / every), 1
    )


def outdated_batches(database: Database, codes: Sequence[str]) -> list[int]:
    """Return the batches of series that were sampled by an older method."""
    found = database.read(select(Batch.id).where(Batch.plan != PLAN, Batch.series.in_(codes)))
    return [int(number) for number in found["id"]]


def places(database: Database) -> defaultdict[Key, Counter[str]]:
    """Count the stored guides by series, member and kind.

    The count is one more than the last place in their order of coverage.
    """
    place = (Mechanism.series, Mechanism.member, Guide.kind)
    held = database.read(
        select(*place, (1 + func.max(Guide.cover)).label("places"))
        .join(Guide, Guide.mechanism_id == Mechanism.id)
        .where(Mechanism.batch_id.is_not(None))
        .group_by(*place)
    )
    found: defaultdict[Key, Counter[str]] = defaultdict(Counter)
    for code, member, kind, number in zip(*held.values(), strict=True):
        found[code, member][kind] = int(number)
    return found


def _stored_blocks(database: Database, seed: int) -> dict[Key, dict[int, Held]]:
    columns = (Batch.series, Batch.member, Batch.number, Batch.id, Batch.guides, Batch.wanted)
    rows = database.read(select(*columns).where(Batch.seed == seed, Batch.plan == PLAN))
    found: dict[Key, dict[int, Held]] = {}
    for code, member, number, *what in zip(*rows.values(), strict=True):
        found.setdefault((code, member), {})[int(number)] = Held(*map(int, what))
    return found
