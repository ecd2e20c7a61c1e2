"""Peak of resident memory of each process of the commands, on files of different size, and its growth per guide.

    python tests/benchmarks/memory.py DATABASE [LARGER_DATABASE] [--build 12000,1000000] [--write]

Each command runs in a process of its own; it and its worker processes are watched in /proc (Linux).  Without a larger
file there is no growth.  `--write`: the table goes to ``data/reports/memory.md`` too.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import sqlite3
import subprocess
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

from measuring import arguments, table, title

REPORT = Path(__file__).parents[2] / "data" / "reports" / "memory.md"
LINE = "--stroke 150 --deviation 0.05"
MINE = {"crank": 100, "rocker": 250, "ground": 220, "coupler": 250, "along": 125, "across": 80}
#: What reads a database, and what does not.
READING = {
    "find straight-line": f"find straight-line {LINE}",
    "find straight-line, nothing meets it": "find straight-line --stroke 150 --deviation 0.0005 --min-transmission 70"
    " --max-size 170 --pins-only",
    "find circular-arc": "find circular-arc --stroke 100 --radius 150 --deviation 0.05",
    "find dwell": "find dwell --angle 90 --residual 0.5 --swing 30",
    "census": "census",
    "show": "show watt",
    "export, a row per reach": "export --reaches --force --out {folder}/reaches.csv",
    "doctor": "doctor",
}
ALONE = {"measure": "measure {mine} --stroke 120", "--help": "--help"}
#: Seconds between two looks, and megabytes from kilobytes.
PAUSE, MB = 0.05, 1 / 1024


def peaks(command: list[str]) -> tuple[float, list[float], int]:
    """Return the peak of a command's process, those of the processes it begins, and how it ended [MB]."""
    with tempfile.TemporaryFile() as told:
        began = subprocess.Popen(command, stdout=told, stderr=told)
        most: dict[int, float] = {}
        while True:
            for pid in [began.pid, *_below(began.pid)]:
                with contextlib.suppress(OSError, StopIteration):
                    lines = Path(f"/proc/{pid}/status").read_text("utf-8").splitlines()
                    peak = next(float(line.split()[1]) for line in lines if line.startswith("VmHWM"))
                    most[pid] = max(most.get(pid, 0.0), peak * MB)
            # the process's own count has no gaps between two looks
            pid, status, used = os.wait4(began.pid, os.WNOHANG)
            if pid:
                began.returncode = os.waitstatus_to_exitcode(status)
                own = used.ru_maxrss * MB
                workers = [peak for other, peak in most.items() if other != began.pid and peak > 20]
                return own, workers, began.returncode
            time.sleep(PAUSE)


def _below(pid: int) -> list[int]:
    """Return all processes that a process began, and those that they did."""
    found = []
    with contextlib.suppress(OSError):
        for thread in Path(f"/proc/{pid}/task").iterdir():
            for child in map(int, (thread / "children").read_text("utf-8").split()):
                found += [child, *_below(child)]
    return found


def guides(database: Path) -> int:
    with closing(sqlite3.connect(f"file:{database}?mode=ro", uri=True)) as file:
        return int(file.execute("SELECT count(*) FROM guide").fetchone()[0])


def main() -> None:
    parser = arguments()
    parser.add_argument("databases", nargs="+", type=Path)
    parser.add_argument("--build", default="12000", help="how many guides to build, beside each database")
    parser.add_argument("--write", action="store_true")
    asked = parser.parse_args()
    counts, builds = [guides(database) for database in asked.databases], [int(n) for n in asked.build.split(",")]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        (mine := Path(folder) / "mine.json").write_text(json.dumps(MINE), "utf-8")

        def run(words: str, *more: str) -> tuple[float, list[float]]:
            command = [sys.executable, "-m", "catalogue", *words.format(mine=mine, folder=folder).split(), *more]
            own, workers, code = peaks(command)
            if code not in (0, 1):  # 1: nothing was found
                raise SystemExit(f"{words}: exit code {code}")
            print(words, *more, f"{own:.0f} MB, workers {[round(w) for w in workers]}", file=sys.stderr, flush=True)
            return own, workers

        for name, words in ALONE.items():
            own, workers = run(words)
            rows.append([name, f"{own:.0f}", *[""] * len(counts[1:]), _told(workers), ""])

        def row(name: str, found: list[tuple[float, list[float]]], guides: list[int]) -> None:
            each = [one for one, _ in found]
            growth = f"{1024**2 * (each[-1] - each[0]) / (guides[-1] - guides[0]):.0f}" if len(each) > 1 else ""
            cells = [f"{one:.0f}" for one in each] + [""] * (len(counts) - len(each))
            rows.append([name, *cells, _told([w for _, ws in found for w in ws]), growth])

        for name, words in READING.items():
            row(name, [run(words, "--db", str(database)) for database in asked.databases], counts)
        built = [run(f"build --count {n}", "--db", str(Path(folder) / f"{n}.db")) for n in builds[: len(counts)]]
        row(f"build --count {', '.join(map(str, builds))}", built, builds)
    with contextlib.redirect_stdout(io.StringIO()) as report:
        title("Memory")
        print("Peak of resident memory [MB] of the command's process, by how many guides its file holds; of the\n"
              "largest of its worker processes; growth of the first per guide.\n")  # fmt: skip
        head = ["command", *(f"{count:,} guides" for count in counts), "largest worker", "bytes per guide"]
        table(head, rows)
    print(report.getvalue())
    if asked.write:
        REPORT.write_text(report.getvalue(), "utf-8")


def _told(workers: list[float]) -> str:
    return f"{max(workers):.0f}" if workers else ""


if __name__ == "__main__":
    main()
