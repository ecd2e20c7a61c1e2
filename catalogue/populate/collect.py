"""Fill a database with the specimens of a collection, one transaction per block.

Several processes may do so at once: a block that another one has stored in the meantime is not
stored again.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import islice
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np
from sqlalchemy import Connection, delete, func, insert, select

from ..collections.spec import Collection
from ..errors import DatabaseError, PluginError
from ..foreign_code import foreign
from ..given import whole
from ..progress import Progress
from ..store import Database, Setting, SpecimenRow


class CollectOptions(NamedTuple):
    """Limits of specimens of a collection."""

    barren: int = 8  #: number of successive blocks without a specimen after which a family is abandoned
    most: int = 50  #: largest number of specimens of a mechanism, which may guide several elements


COLLECTING = CollectOptions()


def collect(
    database: Database,
    collection: Collection,
    version: str,
    *,
    count: int | None = None,
    seed: int | None = None,
    report: Callable[[Progress], None] = lambda _: None,
) -> Progress:
    """Fill a database up to a number of specimens of a collection, evenly by family.

    Stored blocks count: an interrupted build is continued, and a larger count extends a smaller
    one. Equal seeds and counts give equal content, in whole blocks; specimens of another seed, plan
    or version of the plugin are removed first. Default count and seed: those of the last build, or
    the collection's count and 0. `report` is called after each block.

    Raises
    ------
    InvalidRequest
        If count or seed is impossible.
    PluginError
        If the collection raises or breaks its contract.
    DatabaseError
        If the file is damaged or locked, the disk is full, or another process samples the
        collection with other arguments.
    """
    name, families = collection.name, collection.families
    begun = state(database, name)
    count = begun.get("count", collection.specimens) if count is None else count
    seed = begun.get("seed", 0) if seed is None else seed
    count, seed = whole("count", count, 1), whole("seed", seed, 0)
    database.check()
    source = {"seed": seed, "plan": collection.plan, "version": version}
    with database.begin() as connection:
        if not source.items() <= _read_state(connection, name).items():
            connection.execute(delete(SpecimenRow).where(SpecimenRow.collection == name))
        _store_state(connection, name, {**source, "count": count, "complete": False})
    share = -(-count // len(families))
    held, clock = dict.fromkeys(families, (0, 0)) | stored(database, name), time.perf_counter()
    before = sum(number for number, _ in held.values())

    def progress(family: str) -> Progress:
        made = sum(number for number, _ in held.values())
        return Progress(made, share * len(families), made - before, time.perf_counter() - clock, family)

    for family in families:
        barren = 0
        while held[family][0] < share and barren < COLLECTING.barren:
            number, block = held[family]
            rows = _draw(collection, family, seed, block)
            with _remaining_blocks(database, name, source) as connection:
                made = _store(connection, rows)
            held[family] = number + made, block + 1
            barren = 0 if made else barren + 1
            report(progress(family))
    with _remaining_blocks(database, name, source) as connection:
        _store_state(connection, name, {**source, "count": count, "complete": True})
    database.seal()
    report(done := progress(""))
    return done


def state(database: Database, name: str) -> dict[str, Any]:
    """Read the state of a build: seed, plan, version, count, complete; empty if there is none."""
    return database.objects([database.get_setting(f"collection {name}") or "{}"])[0]


def is_current(database: Database, collection: Collection, version: str) -> bool:
    """Tell whether a collection was sampled completely by the installed version of its plugin."""
    begun = state(database, collection.name)
    return bool(begun.get("complete")) and (begun.get("plan"), begun.get("version")) == (collection.plan, version)


def stored(database: Database, name: str) -> dict[str, tuple[int, int]]:
    """Count the stored specimens of a collection by family, and return the next block."""
    row = SpecimenRow
    found = database.read(
        select(row.family, func.count(row.id).label("number"), func.coalesce(func.max(row.block), 0).label("last"))
        .where(row.collection == name)
        .group_by(row.family)
    )
    return {f: (int(n), int(b) + 1) for f, n, b in zip(found["family"], found["number"], found["last"], strict=True)}


def _read_state(connection: Connection, name: str) -> dict[str, Any]:
    """Return `state` within a transaction."""
    kept = connection.scalar(select(Setting.value).where(Setting.key == f"collection {name}"))
    found: dict[str, Any] = json.loads(kept or "{}")
    return found


def _store_state(connection: Connection, name: str, values: dict[str, Any]) -> None:
    setting = {"key": f"collection {name}", "value": json.dumps(values)}
    connection.execute(insert(Setting).prefix_with("OR REPLACE"), setting)


@contextmanager
def _remaining_blocks(database: Database, name: str, source: dict[str, Any]) -> Iterator[Connection]:
    """Yield a transaction, unless another process samples the collection differently.

    Raises
    ------
    DatabaseError
        If another process samples with another seed or version.
    """
    with database.begin() as connection:
        if not source.items() <= _read_state(connection, name).items():
            raise DatabaseError(
                f"in {database.path} another process draws {name} with another seed or version: wait for its end"
            )
        yield connection


def _store(connection: Connection, rows: list[dict[str, Any]]) -> int:
    """Store a block unless it is stored already, and return its number of specimens."""
    if rows:
        block = [getattr(SpecimenRow, key) == rows[0][key] for key in ("collection", "family", "block")]
        if not connection.scalar(select(func.count(SpecimenRow.id)).where(*block)):
            connection.execute(insert(SpecimenRow), rows)
    return len(rows)


def _draw(collection: Collection, family: str, seed: int, number: int) -> list[dict[str, Any]]:
    """Sample one block of specimens from its own stream of random numbers, as rows to store."""
    rng = np.random.default_rng([seed, crc32(f"{collection.name} {family}".encode()), number])
    compact = json.JSONEncoder(separators=(",", ":"), allow_nan=False).encode
    try:
        with foreign(f"collection {collection.name}"):
            specimens = list(islice(collection.draw(family, rng, collection.block), COLLECTING.most * collection.block))
            for specimen in specimens:
                collection.owns(specimen)
            return [
                {
                    **{tag: getattr(s, tag) for tag in ("family", "series", "configuration", "kind")},
                    "collection": collection.name,
                    "block": number,
                    "place": place,
                    "deviation": float(s.deviation),
                    "parameters": compact(dict(s.parameters)),
                    "metrics": compact({k: float(v) for k, v in s.metrics.items()}),
                }
                for place, s in enumerate(specimens)
            ]
    except PluginError as error:
        raise PluginError(f"collection {collection.name} cannot be drawn: {error} ({collection.origin})") from error
