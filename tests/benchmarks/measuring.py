"""What the benchmarks share: medians of several runs, and a report in markdown on standard output."""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from datetime import date
from importlib.metadata import version
from pathlib import Path
from statistics import median
from typing import Any


def seconds(run: Callable[..., Any], times: int) -> float:
    """Return the median time of several runs, after one that is not counted; what `run` takes has defaults."""
    run()
    taken = []
    for _ in range(times):
        start = time.perf_counter()
        run()
        taken.append(time.perf_counter() - start)
    return median(taken)


def arguments() -> argparse.ArgumentParser:
    """Return a parser of the command's arguments, whose help is what the command's file says of itself."""
    return argparse.ArgumentParser(
        description=sys.modules["__main__"].__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )


def wanted_count(default: int) -> int:
    """Return how many are wanted: the only argument of a command."""
    parser = arguments()
    parser.add_argument("count", nargs="?", type=int, default=default)
    return int(parser.parse_args().count)


def title(text: str) -> None:
    """Print a heading, the command, and where, when and with which revision it ran."""
    spec = sys.modules["__main__"].__spec__
    how = f"-m {spec.name}" if spec else f"tests/{Path(sys.argv[0]).resolve().parent.name}/{Path(sys.argv[0]).name}"
    given = ("DATABASE" if a.endswith(".db") else "FOLDER" if a.startswith("/") else a for a in sys.argv[1:])
    words = " ".join([f"python {how}", *given])
    machine = f"{os.cpu_count()} cores, {platform.machine()}, load {os.getloadavg()[0]:.1f}"
    python = f"Python {platform.python_version()}, numpy {version('numpy')}"
    git = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty"]
    revision = subprocess.run(git, capture_output=True, text=True, check=False).stdout.strip() or "unknown"
    print(f"# {text}\n\n`{words}`\n\n{date.today()}; {machine}; {python}; revision {revision}.\n", flush=True)


def table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """Print a table: the first column to the left, the others to the right."""
    cells = [[str(c) for c in row] for row in (head, *rows)]
    width = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = [
        "| "
        + " | ".join(c.ljust(w) if i == 0 else c.rjust(w) for i, (c, w) in enumerate(zip(row, width, strict=True)))
        + " |"
        for row in cells
    ]
    rule = "|" + "|".join(("-" * (w + 2)) if i == 0 else "-" * (w + 1) + ":" for i, w in enumerate(width)) + "|"
    print("\n".join([lines[0], rule, *lines[1:]]) + "\n", flush=True)
