"""Least deviation against wall time: this catalogue and optimisers, on the same jobs in the same run.

``python tests/benchmarks/error_time.py DATABASE [SECONDS]`` writes ``data/reports/error_time.md`` and ``.svg``; SECONDS
is what each optimiser is given for each job, 60 if not given.
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as the command does

import contextlib
import io
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from measuring import table, title
from scipy.optimize import differential_evolution

import catalogue
from catalogue import CircularArc, StraightLine
from catalogue.guide.measures import measure
from catalogue.guide.place import at_stroke
from catalogue.guide.span import span
from catalogue.linkage import Linkage

Array = np.ndarray[Any, Any]
History = list[tuple[float, float]]
REPORT = Path(__file__).parents[2] / "data" / "reports" / "error_time"
#: When the best so far is read [s].
TIMES = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0)
EFFORTS = (1, 2, 4, 8, 16)
EXPLAINED = """\
Half the width of the narrowest strip (annulus) over the stroke, of the best linkage known after so many seconds; each
is measured on its finite motion, whatever its way took it for.  Optimisers vary the eight coordinates of the pivots,
the guided point being the origin; they were stopped after {:g} s.  The plain objective samples the path at crank
angles; the other one is the measurement of this catalogue, 320 linkages at once.
"""
#: Positions of the crank that a plain objective looks at.
POSITIONS = 241


@dataclass(frozen=True)
class Job:
    """What is asked of a four-bar: a request of stroke 1 and constraints, all in strokes."""

    name: str
    text: str
    request: Any
    constraints: dict[str, Any]
    size: float

    @property
    def bounds(self) -> list[tuple[float, float]]:
        """x and y of A1, A1*, A2, A2* with the guided point in (0, 0), in mid-stroke."""
        return [(-self.size, self.size)] * 8


JOBS = (
    Job("a", "wide: stroke 1, fixed pivots, sides and arm at most 4", StraightLine(1, 0.01),
        {"max_ground": 4.0, "max_link": 4.0, "max_arm": 4.0}, 6.0),
    Job("b", "compact: the same with 1.5, transmission angle at least 40 degrees", StraightLine(1, 0.01),
        {"max_ground": 1.5, "max_link": 1.5, "max_arm": 1.5, "min_transmission": 40.0}, 2.5),
    Job("d", "arc of radius 1 over 60 degrees, all pivots in a box of 3 x 3", CircularArc(1, 1, 0.01),
        {"pivots_in": (-1.0, -1.5, 2.0, 1.5)}, 2.0),
)  # fmt: skip


# -- the truth --------------------------------------------------------------------------------------------------------
def measured(job: Job, x: Array) -> Array:
    """Return the deviations (n,) of linkages x (8, n) over a stroke of 1 about their reference position.

    Plus 1 for each constraint that is not met; 10 where the stroke is not reached."""
    pivots = np.ones((x.shape[1], 2, 2, 3))
    pivots[..., :2] = x.T.reshape(-1, 2, 2, 2)
    linkage, valid = Linkage.valid(pivots)
    out = np.full(len(pivots), 10.0)
    circle = job.request.kind == "circle"
    with np.errstate(all="ignore"):
        guides = span(linkage, np.zeros(len(linkage), dtype=complex))
        traced = at_stroke(guides, 1.0, circle=circle, nodes=16, extend=False)
        m = measure(guides, traced)
        c, fit = job.constraints, traced.fit
        lengths = [(m.max_ground, "max_ground"), (m.max_link, "max_link"), (m.max_arm, "max_arm")]
        broken = sum(1.0 * ~(value <= c[name]) for value, name in lengths if name in c) + np.zeros(len(linkage))
        broken += ~(m.min_transmission >= c.get("min_transmission", 0.0))
        broken += ~(m.max_arm >= 0.05)
        if circle:
            broken += ~(np.abs(1 / np.abs(fit.curvature) - job.request.radius) < 1e-3)
            broken += np.abs(1 / np.abs(fit.curvature) - job.request.radius)
        if "pivots_in" in c:
            box = np.where((fit.curvature > 0)[:, None], m.box * [1, -1, 1, -1], m.box)  # the arc is to bulge to +y
            x0, x1, y0, y1 = c["pivots_in"][0] - 0.5, c["pivots_in"][2] - 0.5, c["pivots_in"][1], c["pivots_in"][3]
            low, high = np.minimum(box[:, 1], box[:, 3]), np.maximum(box[:, 1], box[:, 3])
            broken += ~((box[:, 0] >= x0) & (box[:, 2] <= x1) & (low >= y0) & (high <= y1))
        value = np.where(np.isfinite(fit.deviation), fit.deviation + broken, 10.0)
    out[valid] = value
    return out


class OutOfTime(Exception):
    """An optimiser has had its time."""


class Watch:
    """The best that was seen, and when."""

    def __init__(self, limit: float) -> None:
        self.start, self.limit, self.history = time.perf_counter(), limit, [(0.0, np.inf)]

    def saw(self, deviation: float) -> None:
        """Note a true deviation; stop what has had its time."""
        now = time.perf_counter() - self.start
        if deviation < self.history[-1][1]:
            self.history.append((now, deviation))
        if now > self.limit:
            raise OutOfTime


# -- ways ---------------------------------------------------------------------------------------------------------
def with_find(job: Job, database: Path, refine: bool) -> History:
    """Warm: the file is open and was asked before."""
    history: History = []
    with catalogue.open(database, build=False) as cat:
        ask = partial(cat.find, job.request, families=["four-bar"], rank_by="deviation", limit=5, **job.constraints)
        ask(refine=refine)
        for effort in EFFORTS:
            start = time.perf_counter()
            found = ask(refine=refine, effort=effort)
            history.append((time.perf_counter() - start, found[0].deviation if found else np.inf))
    return history


def with_cold_find(job: Job, database: Path) -> History:
    """A new process: imports, opens, finds, refines."""
    r = job.request
    line = f"StraightLine({r.stroke}, {r.deviation})"
    request = line if r.kind == "line" else f"CircularArc({r.stroke}, {r.radius}, {r.deviation})"
    code = (
        f"import catalogue; from catalogue import *; c = catalogue.open({str(database)!r}, build=False); "
        f"print(c.find({request}, families=['four-bar'], rank_by='deviation', limit=5, refine=True, "
        f"**{job.constraints})[0].deviation)"
    )
    start = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return [(time.perf_counter() - start, float(done.stdout))]


def evolved_on_kernel(job: Job, limit: float, seed: int = 1) -> History:
    """Differential evolution in batches, on this catalogue's own measurement."""
    watch = Watch(limit)

    def objective(x: Array) -> Array:
        value = measured(job, x)
        watch.saw(float(value.min()))
        return value

    with contextlib.suppress(OutOfTime):
        differential_evolution(objective, job.bounds, vectorized=True, updating="deferred", popsize=40, tol=0,
                               atol=0, maxiter=10**6, polish=False, seed=seed)  # fmt: skip
    return watch.history


def evolved_on_plain(job: Job, limit: float, seed: int = 1) -> History:
    """Differential evolution on a sampled path, as one would write it; what it takes for better is measured truly."""
    watch = Watch(limit)
    best = np.inf

    def objective(x: Array) -> float:
        nonlocal best
        value = sampled(job, x)
        if value < best:
            best = value
            watch.saw(float(measured(job, x[:, None])[0]))
        elif time.perf_counter() - watch.start > limit:
            raise OutOfTime
        return value

    with contextlib.suppress(OutOfTime):
        differential_evolution(objective, job.bounds, popsize=15, tol=0, atol=0, maxiter=10**6, polish=False, seed=seed)
    return watch.history


def sampled(job: Job, x: Array) -> float:
    """Deviation of the sampled path over a stroke of 1 about the reference position, with penalties."""
    a, m, b, k = (complex(x[i], x[i + 1]) for i in (0, 2, 4, 6))
    c = job.constraints
    angle = np.linspace(-1.5, 1.5, POSITIONS)
    with np.errstate(all="ignore"):
        first = a + (m - a) * np.exp(1j * angle)
        base, r, s = b - first, abs(k - m), abs(k - b)
        along = (np.abs(base) ** 2 + r * r - s * s) / (2 * np.abs(base))
        across = np.sqrt(r * r - along**2)
        side = np.sign(((b - m).conjugate() * (k - m)).imag)
        second = first + (along + 1j * side * across) * base / np.abs(base)
        path = first + (second - first) / (k - m) * (0 - m)
        middle = POSITIONS // 2
        tangent = path[middle + 1] - path[middle - 1]
        w = path * np.conj(tangent) / abs(tangent)
    inside = np.isfinite(w) & (np.abs(w.real) <= 0.5)
    low, high = middle, middle
    while low > 0 and inside[low - 1] and w.real[low - 1] < w.real[low]:
        low -= 1
    while high < POSITIONS - 1 and inside[high + 1] and w.real[high + 1] > w.real[high]:
        high += 1
    reach = w.real[high] - w.real[low] if high > low else 0.0
    if not reach > 0.95:
        return 10.0 - (reach if np.isfinite(reach) else 0.0)
    u, v = w.real[low : high + 1], w.imag[low : high + 1]
    degree = 1
    if job.request.kind == "circle":
        v = np.abs(w[low : high + 1] - 1j * job.request.radius) - job.request.radius
        degree = 0
    error = np.polyval(np.polyfit(u, v, degree), u) - v
    links = [abs(m - a), abs(k - b), abs(m - k)]
    broken = max(0.0, *(n - c["max_link"] for n in links)) if "max_link" in c else 0.0
    broken += max(0.0, abs(a - b) - c["max_ground"]) if "max_ground" in c else 0.0
    broken += max(0.0, min(abs(m), abs(k)) - c["max_arm"]) if "max_arm" in c else 0.0
    if "min_transmission" in c:
        p, q = second[low : high + 1] - first[low : high + 1], second[low : high + 1] - b
        sine = np.abs((p.conj() * q).imag) / np.abs(p) / np.abs(q)
        broken += max(0.0, np.sin(np.radians(c["min_transmission"])) - sine.min())
    if "pivots_in" in c:
        turn = np.conj(tangent) / abs(tangent)
        for z in (a, m, b, k):
            p = z * turn + 0.5
            x0, y0, x1, y1 = c["pivots_in"]
            broken += max(0.0, x0 - p.real, p.real - x1) + max(0.0, y0 - p.imag, p.imag - y1)
    return float(0.5 * np.ptp(error) + broken)


WAYS: dict[str, Callable[[Job, Path, float], History]] = {
    "find, refined, cold process": lambda job, file, _: with_cold_find(job, file),
    "find, warm": lambda job, file, _: with_find(job, file, refine=False),
    "find, warm, refined": lambda job, file, _: with_find(job, file, refine=True),
    "differential evolution, plain objective": lambda job, _, limit: evolved_on_plain(job, limit),
    "differential evolution, this kernel in batches": lambda job, _, limit: evolved_on_kernel(job, limit),
}


def best_after(history: History, moment: float) -> float:
    """Return the best that was known at a moment."""
    return min((value for at, value in history if at <= moment), default=np.inf)


def runs(database: Path, limit: float) -> Iterator[tuple[Job, str, History]]:
    """Do every job in every way."""
    for job in JOBS:
        for name, way in WAYS.items():
            print(f"job {job.name}: {name}", file=sys.stderr)
            yield job, name, way(job, database, limit)


def main() -> None:
    """Write the report."""
    database, limit = Path(sys.argv[1]), float(sys.argv[2]) if len(sys.argv) > 2 else 60.0
    found = list(runs(database, limit))
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        title("Error against run time")
        print(EXPLAINED.format(limit))
        for job in JOBS:
            print(f"Job ({job.name}), {job.text}.\n")
            times = [t for t in TIMES if t <= limit]
            rows = [[name, *(_number(best_after(h, t)) for t in times)] for j, name, h in found if j is job]
            table(["way", *(f"{t:g} s" for t in times)], rows)
        print("![error against run time](error_time.svg)")
    REPORT.with_suffix(".md").write_text(text.getvalue(), "utf-8")
    print(text.getvalue())
    plot(found, limit)


def _number(value: float) -> str:
    return f"{value:.2e}" if value < 1 else "-"


def plot(found: list[tuple[Job, str, History]], limit: float) -> None:
    """Draw the curves, one panel a job."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, len(JOBS), figsize=(13, 4.6), sharey=True)
    colours = ["#0072b2", "#56b4e9", "#d55e00", "#999999", "#555555"]
    for axes, job in zip(panels, JOBS, strict=True):
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
    panels[0].set_ylabel("deviation / stroke")
    panels[0].legend(fontsize=7, frameon=False)
    figure.tight_layout()
    figure.savefig(REPORT.with_suffix(".svg"), metadata={"Date": None})


if __name__ == "__main__":
    main()
