"""How many hard requests are answered, how near to the best known, how fast, and with how many programmes.

    python tests/benchmarks/recall.py DB [--effort 1,4] [--only NAME] [--every N] [--out FILE] [--curve]

Each request of `recall_requests.json` has an answer that was found without the catalogue: the linkage of which it was
made, or a better one of `independent_search`.  The first answer of the catalogue is measured by `independent_figures`,
which shares nothing with it, and compared with the known one.  `--out` keeps each result as soon as it is there, one a
line of JSON; what is in the file is not asked again.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from independent_figures import ANGLES, BOUNDS, RATIOS, Figures, cost, measured, violations
from independent_programme import Task
from measuring import arguments, table, title

import catalogue

HERE = Path(__file__).parent
EXPLAINED = """\
Excess is the part by which an answer costs more than the best known one (`independent_figures.cost`); of costs about
zero their difference.  Where a crank is to turn fully the transmission angle is that over its turn.  *Programmes* are
those that the search solved, or the points that its refinement measured where it does not count programmes.
"""
#: By which part a constraint may be broken.
WITHIN = 1e-6
#: By which part an allowance may be missed: it is drawn here, and known to one or two per cent on both sides.
DRAWN_WITHIN = 0.03
#: An answer is as good as another if it costs no more than this part more; nearly as good.
AS_GOOD, NEARLY = 0.01, 0.05
#: Processor times at which answers are compared [s].
CURVE = (0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0)


def asked(entry: dict[str, Any]) -> catalogue.StraightLine | catalogue.CircularArc:
    """Return the request of an entry."""
    if entry["kind"] == "straight-line":
        return catalogue.StraightLine(entry["stroke"], entry["deviation"])
    return catalogue.CircularArc(entry["stroke"], entry["deviation"], entry["radius"])


def excess(value: float, other: float, rank_by: str) -> float:
    """Return how much worse a cost is than another, as a part of it; of costs about zero in their own unit."""
    floor = 0.0 if rank_by in ("size", "deviation") else 1.0
    return (value - other) / max(abs(other), floor)


def judged(entry: dict[str, Any], found: Any) -> dict[str, Any]:
    """Return what an answer is worth: its cost, and the constraints that it breaks by more than `WITHIN`.

    Parameters
    ----------
    found : Candidate
    """
    circle, stroke, rank, task = entry["kind"] == "circular-arc", entry["stroke"], entry["rank_by"], Task.of(entry)
    m = measured(found.pivots, found.guided, stroke, circle=circle, radius=entry["radius"], turns=task.turns,
                 tolerance=entry["deviation"] if task.scatters else None)  # fmt: skip
    out = {name: getattr(found, name) for name in ("id", "family", "pivots", "guided", "deviation")}
    if m is None:
        return out | {"verified": False, "broken": {"path": 1.0}, "cost": None}
    broken = {
        name: value
        for name, value in parts_broken(m, entry).items()
        if value > (DRAWN_WITHIN if name == "min_allowance" else WITHIN)
    }
    if entry["constraints"].get("families") and found.family not in entry["constraints"]["families"]:
        broken["families"] = 1.0
    if entry["constraints"].get("pins_only") and not all(w for dyad in found.pivots for *_, w in dyad):
        broken["pins_only"] = 1.0
    value = cost(m, rank, stroke, task.turns, entry["deviation"])
    return out | {"verified": not broken, "broken": broken, "cost": value, "measured": m.deviation}


def parts_broken(m: Figures, entry: dict[str, Any]) -> dict[str, float]:
    """Return by which part of a bound (of the stroke) each constraint is broken."""
    stroke, bounds = entry["stroke"], entry["constraints"]
    out = violations(m, bounds, entry["deviation"], stroke)
    for name, value in out.items():
        bound = entry["deviation"] if name == "deviation" else bounds.get(name)
        if name == "deviation" or name in BOUNDS:
            figure = BOUNDS.get(name)
            out[name] = value * (90 if figure in ANGLES else 1 if figure in RATIOS else stroke) / bound
    out["place"] = m.off / stroke - 4 * entry["deviation"] / stroke
    if m.radius is not None and m.radius < 0:
        out["bulge"] = 1.0
    return out


def run(cat: Any, entry: dict[str, Any], effort: int) -> dict[str, Any]:
    """Return how a request is answered."""
    start = time.process_time()
    try:
        found = cat.find(asked(entry), **entry["constraints"], rank_by=entry["rank_by"], limit=1, effort=effort)
    except catalogue.CatalogueError as error:
        return {"answered": False, "seconds": time.process_time() - start, "error": str(error)}
    out = {"answered": bool(len(found)), "seconds": time.process_time() - start, "programmes": programmes(found)}
    return {**out, **judged(entry, found[0])} if len(found) else out


def programmes(found: Any) -> int | None:
    """Return how many programmes a search solved, or points its refinement measured; None if it tells neither."""
    report = getattr(found.explanation, "report", None)
    return getattr(report, "programmes", None) or getattr(report, "refined", None)


def results_of(cat: Any, entries: list[dict[str, Any]], effort: int, file: Path | None) -> list[dict[str, Any]]:
    """Return how requests are answered, those that are in a file as they stand there; add the others to it."""
    there = map(json.loads, file.read_text().splitlines()) if file and file.exists() else ()
    known = {r["name"]: r for r in there if r["effort"] == effort}
    for entry in entries:
        if (name := entry["name"]) not in known:
            known[name] = {"name": name, "effort": effort, **run(cat, entry, effort)}
            if file:
                with file.open("a") as lines:
                    lines.write(json.dumps(known[name]) + "\n")
    return [known[entry["name"]] for entry in entries]


# -- while the search goes on ------------------------------------------------------------------------------------------
def curve(cat: Any, entries: list[dict[str, Any]]) -> None:
    """Print how many requests are answered after a time, and how near to the best known and to the last answer."""
    asked_for = []
    for entry in entries:
        request = catalogue.Request.of(asked(entry), **entry["constraints"], rank_by=entry["rank_by"], limit=1)
        seen, spent, start = [], 0.0, time.process_time()
        for found in cat.improving(request):
            spent += time.process_time() - start
            value = judged(entry, found[0])["cost"] if len(found) else None
            seen.append((spent, np.inf if value is None else excess(value, entry["known"]["cost"], entry["rank_by"])))
            start = time.process_time()
        asked_for.append(seen)
    rows = []
    for moment in CURVE:
        then = [min([by for spent, by in seen if spent <= moment], default=np.inf) for seen in asked_for]
        last = [min(by for _, by in seen) for seen in asked_for]
        near = sum(by <= end + 0.1 for by, end in zip(then, last, strict=True))
        rows.append([f"{moment:g} s", sum(np.isfinite(then)), sum(np.array(then) <= NEARLY), near,
                     f"{np.median(then):.3f}", sum(seen[-1][0] <= moment for seen in asked_for)])  # fmt: skip
    what = ["answered", "within 5 % of the best known", "within 10 % of the last", "median excess", "ended"]
    table(["after", *what], rows)


# -- reports ----------------------------------------------------------------------------------------------------------
def report(entries: list[dict[str, Any]], results: list[dict[str, Any]]) -> None:
    """Print what was answered, group by group, and what was not, or not well."""
    more = [None if r.get("cost") is None else excess(r["cost"], e["known"]["cost"], e["rank_by"])
            for e, r in zip(entries, results, strict=True)]  # fmt: skip
    rows = []
    for group in [*dict.fromkeys(e["group"] for e in entries), None]:
        of = [i for i, e in enumerate(entries) if group in (None, e["group"])]
        some = [results[i] for i in of]
        good = [by for i in of if results[i].get("verified") and (by := more[i]) is not None]
        times, counts = [r["seconds"] for r in some], [r["programmes"] for r in some if r.get("programmes")]
        rows.append([
            group or "all", len(some), sum(r["answered"] for r in some), len(good), sum(v <= AS_GOOD for v in good),
            sum(v <= NEARLY for v in good), f"{median(times):.2f}", f"{np.quantile(times, 0.95):.2f}",
            f"{max(times):.2f}", f"{median(counts):.0f}" if counts else "",
        ])  # fmt: skip
    what = ("requests", "asked", "answered", "verified", "within 1 %", "within 5 %")
    table([*what, "median CPU s", "95 % s", "most s", "programmes"], rows)
    bad = []
    for e, r, by in zip(entries, results, more, strict=True):
        wrong = "nothing found" if not r["answered"] else ", ".join(f"{k} {v:.1e}" for k, v in r["broken"].items())
        if wrong or (by or 0.0) > AS_GOOD:
            now = "" if r.get("cost") is None else f"{r['cost']:.4g}"
            worse = "" if by is None else f"{by:+.3f}"
            known = f"{e['known']['cost']:.4g}"
            bad.append([e["name"], e["rank_by"], " ".join(e["constraints"]), wrong, now, known, worse])
    if bad:
        print("Not answered, not as said, or worse than what is known:\n")
        table(["name", "ranked by", "constraints", "what is wrong", "cost", "known", "excess"], bad)


def main() -> None:
    """Ask, measure, print."""
    parser = arguments()
    parser.add_argument("database")
    parser.add_argument("--effort", default="1", help="one or several, 1,4")
    parser.add_argument("--requests", type=Path, default=HERE / "recall_requests.json")
    parser.add_argument("--only", default="", help="names that begin so")
    parser.add_argument("--every", type=int, default=1, help="ask every n-th request only")
    parser.add_argument("--out", type=Path, help="file of results, one a line")
    parser.add_argument("--curve", action="store_true", help="print the answers over time instead")
    given = parser.parse_args()
    entries = [e for e in json.loads(given.requests.read_text()) if e["name"].startswith(given.only)][:: given.every]
    cat = catalogue.open(given.database)
    title("Recall of hard requests")
    print(EXPLAINED)
    cat.find(catalogue.StraightLine(1, 0.001), limit=1)  # what is loaded once
    if given.curve:
        curve(cat, entries)
        return
    for effort in map(int, given.effort.split(",")):
        print(f"## Effort {effort}\n", flush=True)
        report(entries, results_of(cat, entries, effort, given.out))


if __name__ == "__main__":
    main()
