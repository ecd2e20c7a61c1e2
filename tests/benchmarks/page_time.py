"""How long people wait for the page: one of them, ten at once, beside a build, and while a linkage is dragged.

``python tests/benchmarks/page_time.py DATABASE > data/reports/page_time.md``: the command `catalogue serve` is asked by
HTTP for wishes that it has not been asked before; the refined answers are asked for when the first ones are there, as
the page does.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlencode
from urllib.request import HTTPCookieProcessor, build_opener, install_opener, urlopen

from measuring import arguments, table, title

#: Wishes: what changes from one to the next is the deviation.
WISHES = (
    {"path": "straight-line", "stroke": 150},
    {"path": "straight-line", "stroke": 150, "family": "four-bar", "min_transmission": 40},
    {"path": "circular-arc", "stroke": 100},
    {"path": "straight-line", "stroke": 100, "max_size": 200},
    {"path": "straight-line", "stroke": 150, "fixed_pivots_in": "-300 -300 300 300"},
)
ALONE, TOGETHER, DRAGGED = 5, 10, 20
WATT = "[[[-50, 30], [%g, 30]], [[50, -30], [0, -30]]]"
_asked = iter(range(10**6))


@contextmanager
def served(database: Path) -> Iterator[str]:
    """Yield the address of a page, warm."""
    command = [sys.executable, "-m", "catalogue", "serve", "--port", "0", "--db", str(database)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            found = re.match(r"((http://\S+)/\?token=\S+) ", process.stdout.readline())
            assert found
            install_opener(build_opener(HTTPCookieProcessor()))
            urlopen(found[1]).read()
            got(found[2], "/gallery")
            wait(found[2], 2)
            yield found[2]
        finally:
            process.terminate()


@contextmanager
def building() -> Iterator[None]:
    """Fill another catalogue meanwhile."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "catalogue", "build", "--count", "300000", "--db", str(Path(folder) / "b.db")]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            try:
                time.sleep(5)
                yield
            finally:
                process.terminate()


def got(address: str, page: str, **said: object) -> float:
    """Return how long an answer takes [s]."""
    start = time.perf_counter()
    with urlopen(f"{address}{page}?{urlencode(said)}", timeout=300) as answer:
        answer.read()
    return time.perf_counter() - start


def wait(address: str, number: int) -> tuple[list[float], list[float]]:
    """Return how long as many people wait for first answers and for refined ones who ask at once [s]."""
    wishes = [{**WISHES[k % len(WISHES)], "deviation": 0.05 + 1e-4 * next(_asked)} for k in range(number)]

    def ask(wish: dict[str, object]) -> tuple[float, float]:
        first = got(address, "/answers", **wish, stage="draft")
        return first, first + got(address, "/answers", **wish, stage="refined")

    with ThreadPoolExecutor(number) as people:
        times = [*people.map(ask, wishes)]
    return [one for one, _ in times], [both for _, both in times]


def row(name: str, times: Sequence[float]) -> tuple[str, ...]:
    ordered = sorted(times)
    print(name, f"{ordered[len(ordered) // 2]:.2f} s", file=sys.stderr)  # while more is measured
    return name, *(f"{1000 * ordered[k]:.0f}" for k in (0, len(ordered) // 2, -1))


def rows(address: str, where: str) -> Iterator[tuple[str, ...]]:
    alone = [wait(address, 1) for _ in range(ALONE)]
    for k, what in enumerate(("first", "refined")):
        yield row(f"{what} answers, one person{where}", [one[k][0] for one in alone])
    together = wait(address, TOGETHER)
    for k, what in enumerate(("first", "refined")):
        yield row(f"{what} answers, {TOGETHER} at once{where}", together[k])
    moved = [got(address, "/own/measured", linkage=WATT % (0.01 * next(_asked)), x=0, y=0, stroke=40, stage="draft")
             for _ in range(DRAGGED)]  # fmt: skip
    yield row(f"a dragged linkage{where}", moved)


if __name__ == "__main__":
    parser = arguments()
    parser.add_argument("database", type=Path)
    given = parser.parse_args()
    title("What people wait for the page")
    for name in ("OMP", "OPENBLAS", "MKL"):
        os.environ.setdefault(f"{name}_NUM_THREADS", "1")
    with served(given.database) as page:
        told = [*rows(page, "")]
        known = {**WISHES[0], "deviation": 0.2}
        for stage in ("draft", "refined"):
            got(page, "/answers", **known, stage=stage)
        told.append(row("a wish that was asked before", [got(page, "/answers", **known) for _ in range(ALONE)]))
        with building():
            told += rows(page, ", a build beside it")
    print(
        "First answers are stored guides as they are, one of each kind, drawn; refined ones are those of `find`, with\n"
        f"the time of the first ones in them.  Milliseconds; of {ALONE} wishes one after the other, of {TOGETHER}\n"
        f"people who ask at once, of {DRAGGED} places of a pivot.\n"
    )
    table(["", "least", "median", "longest"], told)
