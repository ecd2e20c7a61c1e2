"""How many of the feasible requests are answered, how well, and how fast.

    python tests/benchmarks/recall.py DB [--effort 1,4] [--only NAME] [--independent FILE] [--json OUT]

Each request of `recall_requests.json` has an answer that was found without the catalogue.  The first answer of the
catalogue is measured by `independent`, which shares nothing with it, and compared with the known one, and with what an
independent search found (`independent_search.py`).
"""

from __future__ import annotations

import json
import math
import time
from pathlib import Path
from statistics import median
from typing import Any

from independent import Measured, cost, measured, violations
from measuring import arguments, table, title

import catalogue

HERE = Path(__file__).parent
EXPLAINED = """\
Costs are those of `independent.cost`: less is better.  Where a crank is to turn fully the transmission angle is that
over its turn, read in 4,001 positions.
"""
#: By which part a constraint may be broken.
WITHIN = 1e-6
#: An answer is as good as another if it costs no more than this part more.
AS_GOOD = 0.01


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
    circle, stroke, rank = entry["kind"] == "circular-arc", entry["stroke"], entry["rank_by"]
    turns = "full_rotation" in entry["constraints"]
    m = measured(found.pivots, found.guided, stroke, circle=circle, radius=entry["radius"], turns=turns)
    out = {name: getattr(found, name) for name in ("id", "family", "pivots", "guided", "deviation")}
    if m is None:
        return out | {"verified": False, "broken": {"path": 1.0}, "cost": None, "excess": None}
    broken = {k: v for k, v in parts_broken(m, entry).items() if v > WITHIN}
    if entry["constraints"].get("families") and found.family not in entry["constraints"]["families"]:
        broken["families"] = 1.0
    if entry["constraints"].get("pins_only") and len(m.fixed + m.moving) < 4:
        broken["pins_only"] = 1.0
    value = cost(m, rank, stroke, turns)
    return out | {
        "verified": not broken, "broken": broken, "cost": value, "measured": m.deviation,
        "excess": excess(value, entry["known"]["cost"], rank),
    }  # fmt: skip


def parts_broken(m: Measured, entry: dict[str, Any]) -> dict[str, float]:
    """Return by which part of a bound (of the stroke) each constraint is broken."""
    stroke, bounds = entry["stroke"], entry["constraints"]
    out = violations(m, bounds, entry["deviation"], stroke)
    for name, value in out.items():
        bound = entry["deviation"] if name == "deviation" else bounds.get(name)
        if isinstance(bound, float):
            out[name] = value * (90 / bound if name == "min_transmission" else stroke / bound)
    out["place"] = m.off / stroke - 4 * entry["deviation"] / stroke
    if m.radius is not None and m.radius < 0:
        out["bulge"] = 1.0
    return out


def run(cat: Any, entry: dict[str, Any], effort: int) -> dict[str, Any]:
    """Return how a request is answered."""
    start = time.perf_counter()
    try:
        found = cat.find(asked(entry), **entry["constraints"], rank_by=entry["rank_by"], limit=1, effort=effort)
    except catalogue.CatalogueError as error:
        return {"answered": False, "seconds": time.perf_counter() - start, "error": str(error)}
    seconds = time.perf_counter() - start
    if not len(found):
        return {"answered": False, "seconds": seconds}
    return {"answered": True, "seconds": seconds, **judged(entry, found[0])}


# -- reports ----------------------------------------------------------------------------------------------------------
def report(entries: list[dict[str, Any]], results: list[dict[str, Any]]) -> None:
    """Print what was answered, group by group, and what was not, or not well."""
    groups = [*dict.fromkeys(e["group"] for e in entries), None]
    rows = []
    for group in groups:
        some = [r for e, r in zip(entries, results, strict=True) if group in (None, e["group"])]
        good = [r["excess"] for r in some if r.get("verified")]
        times = [r["seconds"] for r in some]
        rows.append([
            group or "all", len(some), sum(r["answered"] for r in some), len(good), sum(v <= AS_GOOD for v in good),
            f"{median(good):+.3f}" if good else "", f"{max(good):+.3f}" if good else "",
            f"{median(times):.2f}", f"{max(times):.2f}",
        ])  # fmt: skip
    what = ("requests", "asked", "answered", "verified", "as good as known", "median excess", "worst")
    table([*what, "median s", "max s"], rows)
    said = [
        (abs(r["deviation"] / r["measured"] - 1), e["name"])
        for e, r in zip(entries, results, strict=True)
        if r.get("verified") and r["measured"] > 1e-9 * e["stroke"]
    ]
    if said:
        print(f"Deviations are measured within {max(said)[0]:.1e} of what verified answers say ({max(said)[1]}).\n")
    bad = []
    for e, r in zip(entries, results, strict=True):
        wrong = "nothing found" if not r["answered"] else ", ".join(f"{k} {v:.1e}" for k, v in r["broken"].items())
        if wrong or r["excess"] > AS_GOOD:
            now = "" if r.get("cost") is None else f"{r['cost']:.4g}"
            more = "" if r.get("excess") is None else f"{r['excess']:+.3f}"
            known = f"{e['known']['cost']:.4g}"
            bad.append([e["name"], e["rank_by"], " ".join(e["constraints"]), wrong, now, known, more])
    if bad:
        print("Not answered, not as said, or worse than what is known:\n")
        table(["name", "ranked by", "constraints", "what is wrong", "cost", "known", "excess"], bad)


def compare(entries: list[dict[str, Any]], results: list[dict[str, Any]], file: Path) -> None:
    """Print how answers compare with those of the independent search."""
    stored = json.loads(file.read_text())["results"]
    rows = []
    for e, r in zip(entries, results, strict=True):
        other = stored.get(e["name"])
        if other is None:
            continue
        here, there = r.get("cost") if r.get("verified") else None, other["cost"]
        more = "" if here is None or there is None else f"{excess(here, there, e['rank_by']):+.3f}"
        shown = [f"{v:.4g}" if v is not None else "none" for v in (here, there, e["known"]["cost"])]
        rows.append([e["name"], e["rank_by"], *shown, more])
    print("Beside the independent search:\n")
    table(["name", "ranked by", "cost", "independent", "known", "excess"], rows)


def since(entries: list[dict[str, Any]], results: list[dict[str, Any]], file: Path) -> None:
    """Print what has become of answers that were recorded with an earlier revision."""
    before = json.loads(file.read_text())
    pairs = [(e, r, before[e["name"]]) for e, r in zip(entries, results, strict=True) if e["name"] in before]
    rows = []
    for e, r, old in pairs:
        more = math.inf if not r.get("verified") else -math.inf if old is None else excess(r["cost"], old, e["rank_by"])
        rows.append((more, e["name"], e["rank_by"], old, r.get("cost")))
    answered = sum(old is not None for *_, old in pairs)
    better = sum(more < -AS_GOOD for more, *_ in rows)
    alike = sum(abs(more) <= AS_GOOD for more, *_ in rows)
    print(
        f"Of {len(rows)} requests recorded with revision 18e2582 {answered} had a sound answer then; now {better} have"
    )
    print(f"a better one, by 1 % or more, and {alike} one as good.\n")
    worse = [
        [name, rank, f"{old:.4g}", f"{now:.4g}", f"{more:+.3f}"]
        for more, name, rank, old, now in rows
        if more > AS_GOOD
    ]
    if worse:
        table(["worse", "ranked by", "before", "now", "excess"], worse)


def main() -> None:
    """Ask, measure, print."""
    parser = arguments()
    parser.add_argument("database")
    parser.add_argument("--effort", default="1", help="one or several, 1,4")
    parser.add_argument("--only", help="names that begin so")
    parser.add_argument("--independent", type=Path, help="results of the independent search")
    parser.add_argument("--before", type=Path, help="costs recorded with an earlier revision")
    parser.add_argument("--json", type=Path, help="where to put all results")
    given = parser.parse_args()
    entries = [e for e in json.loads((HERE / "recall_requests.json").read_text())
               if e["name"].startswith(given.only or "")]  # fmt: skip
    cat = catalogue.open(given.database)
    title("Recall of feasible requests")
    print(EXPLAINED)
    cat.find(catalogue.StraightLine(1, 0.001), limit=1)  # what is loaded once
    kept = {}
    for effort in map(int, given.effort.split(",")):
        print(f"## Effort {effort}\n", flush=True)
        results = [run(cat, entry, effort) for entry in entries]
        kept[effort] = {e["name"]: r for e, r in zip(entries, results, strict=True)}
        report(entries, results)
        if given.independent:
            compare(entries, results, given.independent)
        if given.before:
            since(entries, results, given.before)
    if given.json:
        given.json.write_text(json.dumps(kept, indent=1))


if __name__ == "__main__":
    main()
