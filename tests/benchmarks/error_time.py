"""Least deviation against wall time: this catalogue and optimisers, on the same jobs in the same run.

``python tests/benchmarks/error_time.py DATABASE [SECONDS [JOBS]]`` writes ``data/reports/error_time.md`` and ``.svg``;
SECONDS is what each optimiser is given for each job, 60 if not given.  With JOBS, as ``ab``, only these are done, and
their letters are added to the names of the files.
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as the command does

import contextlib
import io
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from jobs import JOBS, Job
from measuring import arguments, table, title
from rivals import History, evolved_compiled, evolved_on_kernel, evolved_on_plain, multistarted, swarmed

import catalogue

REPORT = Path(__file__).parents[2] / "data" / "reports" / "error_time"
#: When the best so far is read [s].
TIMES = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0, 200.0, 600.0)
EFFORTS = (1, 2, 4, 8, 16)
EXPLAINED = """\
Half the width of the narrowest strip (annulus) over the stroke, of the best linkage known after so many seconds; each
is measured on its finite motion, whatever its way took it for.  Optimisers vary the eight coordinates of the pivots,
the guided point being the origin (job c: the moving pivots and the height of the point); they had {:g} s.  The
plain objective samples the path at crank angles; compiled it is written for the jobs (a) to (c) only; the one in
batches is the measurement of this catalogue, 320 linkages at once; the swarm is that of pylinkage; least squares and
minimax start from random linkages, over and over.
"""


# -- ways ---------------------------------------------------------------------------------------------------------
def with_find(job: Job, database: Path, refine: bool) -> History:
    """Warm: the file is open and was asked before."""
    history: History = [(0.0, np.inf)]
    if job.fixed and not refine:  # such guides are always refined
        return history
    with catalogue.open(database, build=False) as cat:
        ask = partial(cat.find, job.request, families=["four-bar"], rank_by="deviation", limit=5, **job.constraints)
        ask(refine=refine)
        for effort in EFFORTS:
            start = time.perf_counter()
            found = ask(refine=refine, effort=effort)
            history.append((time.perf_counter() - start, found[0].deviation if found else np.inf))
    return history


def with_improving(job: Job, database: Path) -> History:
    """Warm: the answers while the search goes on."""
    history: History = [(0.0, np.inf)]
    request = catalogue.Request.of(job.request, families=["four-bar"], rank_by="deviation", limit=5, **job.constraints)
    with catalogue.open(database, build=False) as cat:
        cat.find(request)
        start = time.perf_counter()
        for found in cat.improving(request):
            history.append((time.perf_counter() - start, found[0].deviation if found else np.inf))
    return history


def with_cold_find(job: Job, database: Path) -> History:
    """A new process: imports, opens, finds, refines."""
    r = job.request
    line = f"StraightLine({r.stroke}, {r.deviation})"
    request = line if r.kind == "line" else f"CircularArc({r.stroke}, {r.deviation}, {r.radius})"
    code = (
        f"import catalogue; from catalogue import *; c = catalogue.open({str(database)!r}, build=False); "
        f"print(c.find({request}, families=['four-bar'], rank_by='deviation', limit=5, refine=True, "
        f"**{job.constraints})[0].deviation)"
    )
    start = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return [(time.perf_counter() - start, float(done.stdout))]


WAYS: dict[str, Callable[[Job, Path, float], History]] = {
    "find, refined, cold process": lambda job, file, _: with_cold_find(job, file),
    "find, warm": lambda job, file, _: with_find(job, file, refine=False),
    "find, warm, refined": lambda job, file, _: with_find(job, file, refine=True),
    "find, warm, improving": lambda job, file, _: with_improving(job, file),
    "differential evolution, plain objective": lambda job, _, limit: evolved_on_plain(job, limit),
    "differential evolution, compiled objective": lambda job, _, limit: evolved_compiled(job, limit),
    "differential evolution, this kernel in batches": lambda job, _, limit: evolved_on_kernel(job, limit),
    "swarm of pylinkage, plain objective": lambda job, _, limit: swarmed(job, limit),
    "least squares and minimax, many starts": lambda job, _, limit: multistarted(job, limit),
}


def best_after(history: History, moment: float) -> float:
    """Return the best that was known at a moment."""
    return min((value for at, value in history if at <= moment), default=np.inf)


def runs(jobs: Sequence[Job], database: Path, limit: float) -> Iterator[tuple[Job, str, History]]:
    """Do jobs in every way."""
    for job in jobs:
        for name, way in WAYS.items():
            print(f"job {job.name}: {name}", file=sys.stderr)
            yield job, name, way(job, database, limit)


def main() -> None:
    """Write the report."""
    parser = arguments()
    parser.add_argument("database", type=Path)
    parser.add_argument("seconds", nargs="?", type=float, default=60.0)
    parser.add_argument("jobs", nargs="?", default="")
    given = parser.parse_args()
    limit, jobs = given.seconds, [job for job in JOBS if job.name in given.jobs or not given.jobs]
    report = REPORT.with_name("_".join(["error_time", *([given.jobs] if given.jobs else [])]))
    found = list(runs(jobs, given.database, limit))
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        title("Error against run time")
        print(EXPLAINED.format(limit))
        for job in jobs:
            print(f"Job ({job.name}), {job.text}.\n")
            times = [t for t in TIMES if t <= limit]
            rows = [[name, *(_number(best_after(h, t)) for t in times)] for j, name, h in found if j is job]
            table(["way", *(f"{t:g} s" for t in times)], rows)
        print(f"![error against run time]({report.name}.svg)")
    report.with_suffix(".md").write_text(text.getvalue(), "utf-8")
    print(text.getvalue())
    plot(report, jobs, found, limit)


def _number(value: float) -> str:
    return f"{value:.2e}" if value < 1 else "-"


def plot(report: Path, jobs: Sequence[Job], found: list[tuple[Job, str, History]], limit: float) -> None:
    """Draw the curves, one panel a job."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, len(jobs), figsize=(3.8 * len(jobs) + 1, 4.6), sharey=True, squeeze=False)
    colours = ["#0072b2", "#56b4e9", "#d55e00", "#999999", "#555555", "#009e73", "#cc79a7", "#e69f00", "#f0e442"]
    for axes, job in zip(panels[0], jobs, strict=True):
        for colour, name in zip(colours, WAYS, strict=True):
            (history,) = [h for j, n, h in found if j is job and n == name]
            at = np.array([t for t, v in history if v < 1])
            best = np.minimum.accumulate([v for _, v in history if v < 1]) if at.size else np.array([])
            if name.startswith("find"):
                axes.loglog(at, best, "o-", color=colour, label=name, ms=4)
            elif at.size:
                axes.loglog(np.append(at, limit), np.append(best, best[-1]), color=colour, label=name,
                            drawstyle="steps-post")  # fmt: skip
        axes.set_title(f"({job.name}) {job.text}", fontsize=7.5)
        axes.set_xlim(0.05, max(limit, 10))
        axes.set_xlabel("wall time [s]")
        axes.grid(which="major", alpha=0.25)
    panels[0, 0].set_ylabel("deviation / stroke")
    panels[0, 0].legend(fontsize=7, frameon=False)
    figure.tight_layout()
    figure.savefig(report.with_suffix(".svg"), metadata={"Date": None})


if __name__ == "__main__":
    main()
