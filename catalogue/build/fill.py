"""Fill a database: decide which blocks are wanted, have them made, write them in order."""

from __future__ import annotations

import os
import sqlite3
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field

from sqlalchemy import select

from ..errors import DatabaseError, InvalidRequest, PluginError
from ..plugins import PluginWarning, Registry, one_line
from ..series import Member, Series
from ..store import Batch, Database, drop_indexes, finish, is_indexed, make_indexes, prepare, set_setting, write_batch
from .block import Block
from .draw import PLAN
from .named import write_designs
from .workers import Workers

#: Guides in the default database.
COUNT = 200_000
#: A member that gives no guide in so many blocks in a row gives none.
BARREN = 8


@dataclass(frozen=True)
class Progress:
    """State of a build, as it is reported after each block.

    Attributes
    ----------
    guides, wanted : int
        Guides of the chosen series in the file, and how many there should be.
    rows : int
        Rows written by this run.
    seconds : float
        Wall time of this run.
    series : str
        What is being made; empty when done.
    failed : tuple of str
        Plugins that raised, with the reason; their series are left out.
    """

    guides: int
    wanted: int
    rows: int = 0
    seconds: float = 0.0
    series: str = ""
    failed: tuple[str, ...] = ()

    @property
    def rate(self) -> float:
        """Rows written per second."""
        return self.rows / self.seconds if self.seconds else 0.0


@dataclass
class _Source:
    """The blocks of one member, in order."""

    series: Series
    member: Member
    target: int
    done: dict[int, int]  # guides in the blocks that the file holds, by number
    asked: dict[int, Future[Block]] = field(default_factory=dict)
    next: int = 0
    guides: int = 0
    barren: int = 0
    broken: bool = False  # its plugin raised

    def skip(self) -> None:
        """Go past the blocks that the file holds."""
        while self.next in self.done and not self.full:
            self.count(self.done[self.next])

    def count(self, guides: int) -> None:
        """Go past the next block, of so many guides."""
        self.next += 1
        self.guides += guides
        self.barren = 0 if guides else self.barren + 1

    @property
    def full(self) -> bool:
        single = not self.member.parameters and self.next > 0  # one design, which the first block holds
        return self.broken or self.guides >= self.target or self.barren >= BARREN or single

    def want(self) -> int | None:
        """Return the number of a block that will surely, or very likely, be needed."""
        if self.full:
            return None
        number = self.next + len(self.asked)
        made = [f.result().count for f in self.asked.values() if f.done() and not f.cancelled() and not f.exception()]
        if not self.next and not made:
            return number if not self.asked else None
        mean = max((self.guides + sum(made)) / (self.next + len(made)), 1.0)
        return number if self.guides + mean * len(self.asked) < self.target else None


def fill(
    database: Database,
    registry: Registry,
    *,
    count: int = COUNT,
    series: Sequence[str] = (),
    seed: int = 0,
    processes: int | None = None,
    report: Callable[[Progress], None] = lambda _: None,
) -> Progress:
    """Fill a database up to a number of guides.

    The blocks that are already there count; a build that was interrupted goes on where it stopped and ends with the
    content of one that was not.  Same seed and count, same content.  The named guides are there from the
    start, whichever series are chosen.

    Parameters
    ----------
    database : Database
    registry : Registry
    count : int
        Guides wanted, shared equally by the series and by weight among their members.
    series : sequence of str
        Codes; all that are registered if empty.
    seed : int
    processes : int, optional
        Worker processes; as many as there are processors if not given.
    report : callable
        Called with a `Progress` after each block.

    Raises
    ------
    InvalidRequest
        If count, seed or processes is too small, or a code is unknown.
    DatabaseError
        If the file cannot be written, or another process is filling it.
    """
    if count < 1 or seed < 0:
        raise InvalidRequest(f"a build needs a count of at least 1 and a seed of at least 0, not {count} and {seed}")
    if processes is not None and processes < 1:
        raise InvalidRequest(f"a build needs at least one process, not {processes}")
    unknown = [code for code in series if code not in registry.series]
    if unknown:
        raise InvalidRequest(f"unknown series {unknown[0]}; there are {', '.join(registry.series)}")
    codes = list(series) or list(registry.series)
    failed: list[str] = []
    start, rows = time.perf_counter(), 0
    sources = _sources(database, registry, codes, count, seed)
    before = sum(s.guides for s in sources)
    prepare(database)
    for key, value in (("count", str(count)), ("seed", str(seed)), ("series", " ".join(series))):
        set_setting(database, key, value)
    set_setting(database, "complete", "no")
    workers = processes or os.cpu_count() or 1
    with database.engine.connect() as connection, Workers(workers, registry.folders) as pool:
        if any(not s.full for s in sources) and count > 2 * before:
            drop_indexes(connection)
        write_designs(database, connection, registry)
        for source, block in _blocks(sources, registry, pool, seed, failed):
            try:
                write_batch(connection, block.batch, block.mechanisms, block.guides, block.reaches)
            except sqlite3.IntegrityError as error:
                if "batch.number" in str(error):
                    raise DatabaseError(
                        f"{database.path} is being filled by another process: wait until that has finished"
                    ) from error
                _leave_out(source, registry, error, failed)  # the tables refuse what the plugin gave
                continue
            source.count(block.count)
            rows += len(block.mechanisms["pivots"]) + block.count + len(block.reaches["guide"])
            done = sum(s.guides for s in sources)
            report(Progress(done, count, rows, time.perf_counter() - start, source.series.code, tuple(failed)))
        if not is_indexed(connection):
            make_indexes(connection)
    set_setting(database, "complete", "yes")
    finish(database)
    done = sum(s.guides for s in sources)
    last = Progress(done, done, rows, time.perf_counter() - start, "", tuple(failed))
    report(last)
    return last


def _sources(database: Database, registry: Registry, codes: Sequence[str], count: int, seed: int) -> list[_Source]:
    held = database.read(
        select(Batch.series, Batch.member, Batch.number, Batch.guides).where(Batch.seed == seed, Batch.plan == PLAN)
    )
    done: dict[tuple[str, str], dict[int, int]] = {}
    for code, member, number, guides in zip(*held.values(), strict=True):
        done.setdefault((code, member), {})[int(number)] = int(guides)
    sources = []
    for code in codes:
        one = registry.series[code]
        total = sum(m.weight for m in one.members)
        for member in one.members:
            target = round(count / len(codes) * member.weight / total)
            sources.append(_Source(one, member, target, done.get((code, member.key), {})))
            sources[-1].skip()
    return sources


def _blocks(
    sources: list[_Source], registry: Registry, pool: Workers, seed: int, failed: list[str]
) -> Iterator[tuple[_Source, Block]]:
    """Yield the blocks that are wanted, in the order of sources and numbers, while the next are being made."""
    for position, source in enumerate(sources):
        while not source.full:
            _ask_ahead(sources[position:], registry, pool, seed)
            future = source.asked.pop(source.next)
            try:
                block = future.result()
            except PluginError as error:
                _leave_out(source, registry, error, failed)
                break
            yield source, block
            source.skip()
        for future in source.asked.values():
            future.cancel()
        source.asked.clear()


def _leave_out(source: _Source, registry: Registry, error: Exception, failed: list[str]) -> None:
    source.broken = True
    record = registry.provider(source.series.code)
    reason = str(error) if isinstance(error, PluginError) else one_line(error)
    failed.append(f"{record.name}: {reason}")
    warnings.warn(
        f"plugin {record.name} ({record.origin}): {source.series.code} {source.member.key} is left out: {reason}",
        PluginWarning,
        stacklevel=2,
    )


def _ask_ahead(sources: list[_Source], registry: Registry, pool: Workers, seed: int) -> None:
    waiting = sum(not f.done() for s in sources for f in s.asked.values())
    for source in sources:
        record = registry.provider(source.series.code)
        while waiting < 2 * pool.count and (number := source.want()) is not None:
            source.asked[number] = pool.submit(
                source.series.code, source.member.key, seed, number, record.name, record.version
            )
            waiting += 1
    first = sources[0]
    if not first.full and first.next not in first.asked:  # the guess was short
        record = registry.provider(first.series.code)
        first.asked[first.next] = pool.submit(
            first.series.code, first.member.key, seed, first.next, record.name, record.version
        )
