"""Fill a database: determine the missing blocks, have workers make them, write them in order."""

from __future__ import annotations

import re
import sqlite3
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from ..engines import Engine, check_name, engine
from ..errors import DatabaseBusy, InvalidRequest, PluginError, PluginWarning, WorkerKilled, one_line, quoted
from ..given import names, whole
from ..plugin.registry import Registry
from ..progress import Progress
from ..store import (
    Database,
    drop_indexes,
    finish,
    is_indexed,
    make_indexes,
    prepare,
    remove_batches,
    write_batch,
)
from .block import BLOCKS, Block
from .make import begin, make
from .named_guides import write_named_guides
from .plan import Source, outdated_batches, places, plan
from .rows import Columns


class FillOptions(NamedTuple):
    """Size of the default database, and look-ahead of the workers."""

    guides: int = 12_000  #: number of guides in the default database
    ahead: int = 32  #: number of blocks per process that may be made ahead of those to be written next


FILL = FillOptions()

#: Error message of the database for a block or a named guide that it holds already.
ALREADY_STORED = re.compile(r"batch\.number|mechanism\.name")


def fill(
    database: Database,
    registry: Registry,
    *,
    count: int = FILL.guides,
    series: Sequence[str] = (),
    seed: int = 0,
    processes: int | None = None,
    on: str = "processes",
    report: Callable[[Progress], None] = lambda _: None,
) -> Progress:
    """Fill a database up to a number of guides.

    Stored blocks count, but the last block of a member is replaced if more guides of it are needed.
    An interrupted build is continued, and ends with the content of an uninterrupted one. Blocks of
    another sampling method are replaced. Equal seeds and counts give equal content. All registered
    series are sampled unless `series` names some; the named guides are always written, and first.
    `catalogue.populate.plan` describes how `count` is divided. Blocks are made on the engine `on`
    (`catalogue.engines.engine`); if its name has no number, with `processes` workers, by default
    one per processor. The content is the same on every engine. `report` is called after each block.

    Raises
    ------
    InvalidRequest
        If count, seed or processes is too small, or a code is unknown.
    DatabaseError
        If the file is damaged or cannot be written; `DatabaseBusy` if another process is filling
        it.
    """
    count, seed = whole("count", count, 1), whole("seed", seed, 0)
    processes = None if processes is None else whole("processes", processes, 1)
    series = names("series", series)
    check_name(on)
    if not callable(report):
        raise InvalidRequest(f"report must be a function of Progress, not {quoted(report)}")
    unknown = [code for code in series if code not in registry.series]
    if unknown:
        raise InvalidRequest(f"unknown series {unknown[0]}; there are {', '.join(registry.series)}")
    database.check()  # a file changed since it was sealed must not be sealed again
    start, rows = time.perf_counter(), 0
    sources = plan(database, registry, series or list(registry.series), count, seed)

    def progress(wanted: int | None = None, making: str = "") -> Progress:
        done, failed = sum(s.guides for s in sources), tuple(s.failure for s in sources if s.failure)
        return Progress(done, wanted or done, rows, time.perf_counter() - start, making, failed)

    before, old = sum(s.guides for s in sources), outdated_batches(database, series or list(registry.series))
    prepare(database)
    for key, value in {"count": count, "seed": seed, "series": " ".join(series), "complete": "no"}.items():
        database.set_setting(key, str(value))
    workers = engine(
        on, begin(registry.folders), count=processes, limit=BLOCKS.limit, tries=3
    )  # a lack of memory may be temporary
    with _exclusive(database), database.engine.connect() as connection, workers as pool:
        remove_batches(connection, [*old, *(batch for s in sources for batch in s.short)])
        covered = places(database)
        if any(not s.full for s in sources) and count > 2 * before:
            drop_indexes(connection)
        write_named_guides(database, connection, registry)
        for source, block in _blocks(sources, pool, seed):
            try:
                guides = _place_in_cover(block.guides, covered[source.key])
                write_batch(connection, block.batch, block.mechanisms, guides, block.reaches)
            except sqlite3.IntegrityError as error:
                if ALREADY_STORED.search(str(error)):
                    raise
                _record_failure(source, error)  # a constraint of the tables rejects data of the plugin
                continue
            source.count(block.count)
            rows += len(block.mechanisms["pivots"]) + block.count + len(block.reaches["guide"])
            report(progress(count, source.series.code))
        if not is_indexed(connection):
            make_indexes(connection)
    database.set_setting("complete", "no" if any(s.lost for s in sources) else "yes")
    finish(database)
    report(done := progress())
    return done


@contextmanager
def _exclusive(database: Database) -> Iterator[None]:
    """Report that another process has written a block, or a named guide, in the meantime."""
    try:
        yield
    except sqlite3.IntegrityError as error:
        if not ALREADY_STORED.search(str(error)):
            raise
        raise DatabaseBusy(
            f"{database.path} is being filled by another process: wait until that has finished"
        ) from error


def _place_in_cover(guides: Columns, before: Counter[str]) -> Columns:
    """Return the guides of a block, numbered after those of the previous blocks."""
    kinds = guides["kind"].tolist()
    cover = guides["cover"] + np.array([before[kind] for kind in kinds], int)
    before.update(kinds)
    return guides | {"cover": cover}


def _blocks(sources: list[Source], pool: Engine, seed: int) -> Iterator[tuple[Source, Block]]:
    """Yield the planned blocks in order, while workers build the next ones."""
    for position, source in enumerate(sources):
        while not source.full:
            _ask_ahead(sources[position:], pool, seed)
            try:
                block = source.asked.pop(0).result()
            except PluginError as error:
                _record_failure(source, error)
                break
            yield source, block
            source.skip()
        for future in source.asked:
            future.cancel()
        source.asked.clear()


def _record_failure(source: Source, error: Exception) -> None:
    plugin, what = source.plugin, f"{source.series.code} {source.member.key}"
    reason = str(error) if isinstance(error, PluginError) else one_line(error)
    source.failure, source.lost = f"{plugin.name}: {reason}", isinstance(error, WorkerKilled)
    warnings.warn(f"plugin {plugin.name} ({plugin.origin}): {what} is left out: {reason}", PluginWarning, stacklevel=2)


def _ask_ahead(sources: list[Source], pool: Engine, seed: int) -> None:
    """Submit the next block of the first source, and further ones while workers are free."""
    asked = [future for source in sources for future in source.asked]
    room = min(2 * pool.count - sum(not future.done() for future in asked), FILL.ahead * pool.count - len(asked))
    if not sources[0].asked:
        room = max(room, 1)
    for source in sources:
        while room > 0 and (wanted := source.lacking):
            number, plugin = source.next + len(source.asked), source.plugin
            source.asked.append(pool.submit(make, *source.key, seed, number, wanted, plugin.name, plugin.version))
            room -= 1
