"""A build is killed at random moments, and finished: nothing is lost, nothing is left.

    python tests/attacks/kills.py [--write] [--times 100] [--seed 1895]

Each time a build in a new file is sent SIGKILL, SIGTERM or Ctrl-C, its main process, a worker or all of them, at a
moment drawn evenly from its duration; then `catalogue build` is run to its end.  The file must then be that of an
undisturbed build, to the last id, with nothing beside it, and no process may be left a few seconds after the signal.
Prints a table; ``--write`` writes ``data/reports/kills.md``; ends with exit code 1 if anything was lost.
"""

from __future__ import annotations

import io
import os
import random
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from contextlib import closing, redirect_stdout, suppress
from pathlib import Path

ROOT = Path(__file__).parents[2]
REPORT = ROOT / "data" / "reports" / "kills.md"
POPULATE = ROOT / "tests" / "populate"
SIGNALS = ("SIGKILL", "SIGTERM", "SIGINT")
WHOM = ("main", "worker", "all")
#: How long a process may live on [s].
GRACE = 5.0


def start(path: Path, count: int) -> subprocess.Popen[bytes]:
    """Start a build of two small series in a file; the pids of its processes are in the folder ``locks`` beside it."""
    locks = path.parent / "locks"
    locks.mkdir(exist_ok=True)
    words = ["build", "--count", str(count), "--series", "T.few", "--series", "T.less", "--processes", "2"]
    return subprocess.Popen(
        [sys.executable, "-c", _MAIN, *words, "--db", str(path)],
        env={
            **os.environ,
            "CATALOGUE_PLUGINS": os.pathsep.join(str(POPULATE / name) for name in ("dropin", "watched")),
            "PYTHONPATH": str(ROOT),
            "TEST_LOCKS": str(locks),
        },
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


#: A shell keeps Ctrl-C from what it runs in the background.
_MAIN = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); from catalogue.cli import main; main()"
)


def dump(path: Path) -> list[str]:
    """Return all that a file holds, ids included."""
    with closing(sqlite3.connect(path)) as connection:
        return list(connection.iterdump())


def running(folder: Path) -> set[int]:
    """Return the processes that have left their pid in a folder and still live: they hold a lock on it."""
    import fcntl

    found = set()
    for file in folder.iterdir():
        with file.open() as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                found.add(int(file.name))
    return found


def killed(path: Path, name: str, whom: str, delay: float, count: int) -> str:
    """Disturb one build, and return what became of it."""
    locks = path.parent / "locks"
    with start(path, count) as process:
        with suppress(subprocess.TimeoutExpired):
            process.wait(delay)
        pids = {"main": {process.pid}, "all": {process.pid, *running(locks)},
                "worker": set(sorted(running(locks) - {process.pid})[:1])}[whom]  # fmt: skip
        for pid in pids if process.poll() is None else ():
            with suppress(ProcessLookupError):
                os.kill(pid, getattr(signal, name))
        if whom != "worker":
            process.wait(30)
        process.wait(120)
    end = time.monotonic() + GRACE
    while (left := running(locks)) and time.monotonic() < end:
        time.sleep(0.05)
    if left:
        return "a process is left"
    with closing(sqlite3.connect(path)) as connection:
        try:
            done = connection.execute("SELECT count(*) FROM batch").fetchone()[0]
        except sqlite3.OperationalError:
            done = 0
    return f"exit code {process.returncode}, {done} blocks there"


def disturbed(folder: Path, moments: list[tuple[str, str, float]], count: int, whole: list[str]) -> tuple[bool, str]:
    """Disturb a build by signals to whom after some seconds, each time it is run again; finish it, and return whether
    nothing is lost and nothing left, and what became of it."""
    path = folder / "some.db"
    became = "; ".join(killed(path, *moment, count) for moment in moments)
    with start(path, count) as process:
        code = process.wait(120)
    files = sorted(file.name for file in folder.iterdir() if file.name != "locks")
    lost = code != 0 or dump(path) != whole
    good = not lost and files == ["some.db"] and "a process is left" not in became
    return good, became + "; content differs" * lost + f"; left: {files}" * (files != ["some.db"])


def undisturbed(folder: Path, count: int) -> tuple[list[str], float]:
    """Return the content of a build that nobody disturbs, and how long it takes."""
    clock = time.perf_counter()
    with start(folder / "whole.db", count) as process:
        assert process.wait(120) == 0
    return dump(folder / "whole.db"), time.perf_counter() - clock


def main() -> None:
    """Print the table, and write it if it is asked for."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
    from measuring import arguments, table, title

    parser = arguments()
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--times", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1895)
    given = parser.parse_args()
    draw, count, rows = random.Random(given.seed), 600, []
    with tempfile.TemporaryDirectory() as folder:
        whole, duration = undisturbed(Path(folder), count)
    for number in range(given.times):
        name, whom = SIGNALS[number % 3], WHOM[number // 3 % 3]
        delay = draw.uniform(0, duration)
        with tempfile.TemporaryDirectory() as folder:
            good, became = disturbed(Path(folder), [(name, whom, delay)], count, whole)
        rows.append((number + 1, name, whom, f"{delay:.2f}", "whole" if good else "LOST", became))
        print(*rows[-1], sep="  ", file=sys.stderr, flush=True)
    lost = sum(row[4] == "LOST" for row in rows)
    text = io.StringIO()
    with redirect_stdout(text):
        title("Builds that are killed")
        print(f"{len(rows)} builds of {duration:.1f} s, {count} guides, two workers; {lost} lost anything.\n")
        table(("", "signal", "to", "after [s]", "in the end", "meanwhile"), rows)
    print(text.getvalue())
    if given.write:
        REPORT.write_text(text.getvalue(), "utf-8")
    sys.exit(lost > 0)


if __name__ == "__main__":
    main()
