"""Guides and rows per second of the build, and of writing the same rows in bulk and through SQLAlchemy."""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as the worker processes do

import numpy as np
from measuring import table, title, wanted_count
from sqlalchemy import insert

from catalogue.plugin.registry import Registry
from catalogue.populate.block import BLOCKS, Block, block
from catalogue.populate.fill import fill
from catalogue.progress import Progress
from catalogue.store import PIVOTS, Database, Guide, Mechanism, Reach, drop_indexes, make_indexes, write_batch


def built(folder: Path, registry: Registry, number: int) -> None:
    """Build into a new file, with one process and with two."""
    rows = []
    for processes in (1, 2):
        seen: list[Progress] = []
        with Database.open(folder / f"{processes}.db") as database:
            start = time.perf_counter()
            done = fill(database, registry, count=number, processes=processes, report=seen.append)
            taken = time.perf_counter() - start
        size = (folder / f"{processes}.db").stat().st_size / 1e6
        after = done.seconds - seen[-2].seconds
        figures = (
            done.guides,
            done.rows,
            f"{taken:.1f}",
            f"{after:.1f}",
            f"{done.guides / taken:.0f}",
            f"{done.rows / taken:.0f}",
        )
        rows.append((processes, *figures, f"{size:.0f}"))
    print(f"`fill(count={number})` into a new file; 'indexing' is the time after the last block.\n")
    table(["processes", "guides", "rows", "s", "indexing s", "guides/s", "rows/s", "MB"], rows)


def shares(registry: Registry) -> None:
    """Where the time of a block goes: second block of some members, one core."""
    rows = []
    for code, key in (
        ("I.GG", "four-bar general"),
        ("II.ooo", "slider-crank isosceles"),
        ("IV*.l", "four-bar general"),
    ):
        block(registry.get(code), key, 0, 0, BLOCKS.most, "x", "1")
        start = time.perf_counter()
        made = block(registry.get(code), key, 0, 1, BLOCKS.most, "x", "1")
        taken = time.perf_counter() - start
        rows.append(
            (
                f"{code}, {key}",
                made.count,
                len(made.reaches["guide"]),
                f"{taken:.2f}",
                f"{1e6 * taken / made.count:.0f}",
            )
        )
    print("One block of 1024 draws, in this process.\n")
    table(["series, member", "guides", "reaches", "s", "us per guide"], rows)


def written(folder: Path, registry: Registry) -> None:
    """Write the same blocks in three ways."""
    blocks = [block(registry.get("I.GG"), "four-bar general", 0, n, BLOCKS.most, "x", "1") for n in range(6)]
    count = sum(len(b.mechanisms["pivots"]) + b.count + len(b.reaches["guide"]) for b in blocks)
    ways = {
        "bulk, indexes made afterwards (as built)": (_bulk, True),
        "bulk, indexes kept": (_bulk, False),
        "SQLAlchemy Core executemany, indexes made afterwards": (_core, True),
    }
    rows = []
    for name, (write, late) in ways.items():
        taken = []
        for run in range(3):
            with Database.open(folder / f"{write.__name__}{late}{run}.db") as database, database.engine.connect() as to:
                start = time.perf_counter()
                if late:
                    drop_indexes(to)
                for made in blocks:
                    write(to, made)
                if late:
                    make_indexes(to)
                taken.append(time.perf_counter() - start)
        rows.append((name, f"{median(taken):.2f}", f"{count / median(taken):.0f}"))
    print(f"The same {count} rows of {len(blocks)} blocks, each in a transaction, into a new file; median of 3.\n")
    table(["way", "s", "rows/s"], rows)


def _bulk(to: Any, made: Block) -> None:
    write_batch(to, made.batch, made.mechanisms, made.guides, made.reaches)


def _core(to: Any, made: Block) -> None:
    """Dictionaries, as SQLAlchemy takes them."""
    parents, owners = made.guides["mechanism"], made.reaches["guide"]
    with to.begin():
        first = [1 + (to.exec_driver_sql(f"SELECT max(id) FROM {t}").scalar() or 0) for t in ("mechanism", "guide")]
        pivots = {column.key: values for column, values in zip(PIVOTS, made.mechanisms["pivots"].T, strict=True)}
        m = {k: v for k, v in made.mechanisms.items() if k != "pivots"} | pivots
        m["id"] = np.arange(first[0], first[0] + len(made.mechanisms["pivots"]))
        to.execute(insert(Mechanism), _rows(m, len(m["id"])))
        g = {k: v for k, v in made.guides.items() if k != "mechanism"}
        g |= {"id": np.arange(first[1], first[1] + made.count), "mechanism_id": first[0] + parents, "series": "I.GG"}
        to.execute(insert(Guide), _rows(g, made.count))
        r = {k: v for k, v in made.reaches.items() if k != "guide"}
        r |= {"guide_id": first[1] + owners, "series": "I.GG"}
        r |= {name: made.guides[name][owners] for name in ("kind", "cover")}
        to.execute(insert(Reach), _rows(r, len(owners)))


def _rows(columns: dict[str, Any], count: int) -> list[dict[str, Any]]:
    lists = [
        c.tolist() if isinstance(c, np.ndarray) and c.ndim else c if isinstance(c, list) else [c] * count
        for c in columns.values()
    ]
    return [dict(zip(columns, row, strict=True)) for row in zip(*lists, strict=True)]


if __name__ == "__main__":
    wanted = wanted_count(12_000)
    title("Rate of the build")
    with tempfile.TemporaryDirectory() as name:
        plugins = Registry()
        built(Path(name), plugins, wanted)
        shares(plugins)
        written(Path(name), plugins)
