"""Whether a looser request ever gives a worse answer.

    python tests/benchmarks/monotone.py DB [--pairs 300] [--effort 1] [--seed 1] [--rank-by score] [--json OUT]

Of the feasible requests (`recall_requests.json`) one or several constraints, or the deviation, are loosened by 5 to
50 %, all else being equal.  A reversal is a looser request whose best answer costs more by 1 % (by 0.01 where the cost
is about zero), or that has no answer where the tighter one has one.  Tighter members of pairs are themselves loosened
requests in part, so that chains are looked at too.  Where a pair is reversed the looser request is asked again, with
the answer to the tighter one as a start.  With `--rank-by` all are ranked by that, and not as they were recorded.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from measuring import arguments, table, title
from recall import AS_GOOD, HERE, asked, excess

import catalogue

#: By which part constraints are loosened.
LOOSER = (0.05, 0.5)


def loosened(entry: dict[str, Any], rng: Any) -> tuple[dict[str, Any], list[str]]:
    """Return a request loosened in one or several of its constraints, and in which."""
    bounds = dict(entry["constraints"])
    names = [n for n in bounds if n != "full_rotation"]
    ranked = [] if entry["rank_by"] == "deviation" and rng.random() < 0.5 else ["deviation"]
    names = [n for n in names if n not in ("families", "pins_only")] + ranked
    if "full_rotation" in bounds and rng.random() < 0.3:
        names.append("full_rotation")
    if not names:
        names = ["deviation"]
    count = 1 if rng.random() < 0.5 else int(rng.integers(1, len(names) + 1))
    chosen = [str(n) for n in rng.choice(names, count, replace=False)]
    out = {**entry, "constraints": bounds}
    for name in chosen:
        by = float(rng.uniform(*LOOSER))
        if name == "deviation":
            out["deviation"] = min(entry["deviation"] * (1 + by), 0.1 * entry["stroke"])
        elif name == "full_rotation":
            del bounds[name]
        elif name.endswith("_in"):
            x0, y0, x1, y1 = bounds[name]
            wide, high = by * (x1 - x0) * rng.random(2), by * (y1 - y0) * rng.random(2)
            bounds[name] = [float(v) for v in (x0 - wide[0], y0 - high[0], x1 + wide[1], y1 + high[1])]
        elif name == "keep_out":
            bounds[name] = [shrunk(box, by) for box in bounds[name]]
        else:
            bounds[name] *= 1 - by if name.startswith("min_") else 1 + by
    return out, chosen


def shrunk(box: list[float], by: float) -> list[float]:
    """Return a box smaller by a part, about the same middle."""
    x0, y0, x1, y1 = box
    wide, high = 0.5 * min(by, 0.9) * (x1 - x0), 0.5 * min(by, 0.9) * (y1 - y0)
    return [x0 + wide, y0 + high, x1 - wide, y1 - high]


def pairs(
    entries: list[dict[str, Any]], count: int, seed: int
) -> list[tuple[dict[str, Any], dict[str, Any], list[str]]]:
    """Return pairs of a request and a looser one, and in which constraints it is looser."""
    rng = np.random.default_rng(seed)
    out: list[tuple[dict[str, Any], dict[str, Any], list[str]]] = []
    for i in range(count):
        tight = entries[i % len(entries)]
        if i >= len(entries) and i % 2:  # follow a chain
            tight = out[i - len(entries)][1]
        out.append((tight, *loosened(tight, rng)))
    return out


Known = tuple[float | None, float, list[Any]]


def best(cat: Any, entry: dict[str, Any], effort: int, known: dict[str, Known], starts: Any = ()) -> Known:
    """Return what the first answer costs by its own numbers, None if there is none, the seconds it took, and it."""
    key = json.dumps([entry[k] for k in ("kind", "stroke", "radius", "deviation", "constraints", "rank_by")])
    if key not in known or starts:
        start = time.perf_counter()
        how = {"rank_by": entry["rank_by"], "limit": 1, "effort": effort, "starts": starts}
        try:
            found = [*cat.find(asked(entry), **entry["constraints"], **how)]
        except catalogue.InvalidRequest:
            found = []
        value = price(found[0], entry) if found else None
        known[key] = value, time.perf_counter() - start, found
    return known[key]


def price(found: Any, entry: dict[str, Any]) -> float:
    """Return what a candidate says that it costs; its crank is judged over the whole turn where that is to turn."""
    stroke, rank = entry["stroke"], entry["rank_by"]
    turns = any(entry["constraints"].get(name) for name in ("full_rotation", "min_transmission_turn"))
    transmission = min(found.min_transmission, found.min_transmission_turn if turns else 90)
    prices: dict[str, Callable[[], float]] = {
        "size": lambda: found.size / stroke,
        "balance": lambda: found.size / stroke - transmission / 90,
        "transmission": lambda: 1 - transmission / 90,
        "deviation": lambda: found.deviation / stroke,
        "score": lambda: 1 - found.score / 100,
    }
    return prices[rank]()


def main() -> None:
    """Ask, compare, print."""
    parser = arguments()
    parser.add_argument("database")
    parser.add_argument("--pairs", type=int, default=300)
    parser.add_argument("--effort", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rank-by", help="rank all requests by this")
    parser.add_argument("--json", type=Path, help="where to put all results")
    given = parser.parse_args()
    entries = json.loads((HERE / "recall_requests.json").read_text())
    if given.rank_by:
        entries = [entry | {"rank_by": given.rank_by} for entry in entries]
    cat = catalogue.open(given.database)
    title("Monotonicity over nested requests")
    print("A score depends on the tolerance: a linkage scores less at a looser one, as pairs that loosen it show.\n")
    known: dict[str, Known] = {}
    rows, kept, worse, lost, both, neither, again = [], [], 0, 0, 0, 0, 0

    def reversed_(one: float | None, two: float | None) -> bool:
        if one is None or two is None:
            return one is not None
        return excess(two, one, tight["rank_by"]) > AS_GOOD and abs(two - one) > 1e-9

    for tight, loose, names in pairs(entries, given.pairs, given.seed):
        (one, _, found), (two, *_) = (best(cat, e, given.effort, known) for e in (tight, loose))
        more = excess(two, one, tight["rank_by"]) if one is not None and two is not None else None
        both += more is not None
        neither += one is None and two is None
        gone, reversal = one is not None and two is None, reversed_(one, two)
        worse += reversal and not gone
        lost += gone
        again += reversal and reversed_(one, best(cat, loose, given.effort, {}, found)[0])
        kept.append({"name": tight["name"], "looser": names, "tight": one, "loose": two, "reversal": reversal})
        if reversal:
            shown = [f"{v:.4g}" if v is not None else "nothing" for v in (one, two)]
            rows.append([tight["name"], tight["rank_by"], " ".join(names), *shown, "" if gone else f"{more:+.3f}"])
    times = [t for _, t, _ in known.values()]
    head = ["pairs", "both answered", "neither", "reversals", "of these empty", "with the start", "median s", "max s"]
    counts = [given.pairs, both, neither, worse + lost, lost, again, f"{median(times):.2f}", f"{max(times):.2f}"]
    table(head, [counts])
    if rows:
        table(["name", "ranked by", "looser in", "tight", "loose", "excess"], rows)
    if given.json:
        given.json.write_text(json.dumps(kept, indent=1))


if __name__ == "__main__":
    main()
