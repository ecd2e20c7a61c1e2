"""How hard the requests of a list are: the share of raced Euler-Savary starts that end feasible.

    python tests/benchmarks/hardness.py [--requests FILE] [--every 1] [--json OUT]

Of the linkages that `catalogue.search.euler_savary` draws for a request the most promising are refined, each for as
many rounds as any.  A request is hard if few of them come to meet its constraints; there are none for families whose
second dyad is a slide.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from measuring import arguments, table, title
from recall import HERE, asked

from catalogue.candidates.feasibility import cost, feasibility
from catalogue.kinematics.batch import join
from catalogue.problem.constraints import Constraints
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking
from catalogue.refine.sqp import Refinement
from catalogue.search import euler_savary
from catalogue.search.draws import allowed

#: Linkages drawn of each family.
DRAWN = 600
#: The most promising of them, by cost and violation, that are refined.
RACED = 24
#: Rounds of refinement: more lead hardly any other in.
ROUNDS = 10
#: Price of a violation beside the cost where they are compared.
PENALTY = 4.0


def problem_of(entry: dict[str, Any]) -> Problem:
    """Return the problem of an entry of the list of requests."""
    request = asked(entry)
    ranking = Ranking.of(request, entry["rank_by"], limit=1)
    return Problem.of(request, Constraints.of(entry["constraints"]), ranking, 1, 1).tightened()


def share_feasible(problem: Problem, seed: int = 0) -> float | None:
    """Return the share of raced starts that end feasible, None where there are none."""
    random = np.random.default_rng(seed)
    families = allowed(problem, euler_savary.PINNED)
    drawn = [euler_savary.starts(problem, name, DRAWN, random) for name in families]
    found = [starts for starts in drawn if starts is not None and len(starts)]
    if not found:
        return None
    starts = join(*found)
    with np.errstate(invalid="ignore"):
        merit = cost(problem, starts) + PENALTY * feasibility(problem, starts).total
    best = np.argsort(np.where(np.isnan(merit), np.inf, merit), kind="stable")[:RACED]
    best = best[np.isfinite(merit[best])]
    if not len(best):
        return 0.0
    refined = Refinement.of(problem, starts[best]).run(ROUNDS)
    return float(np.isfinite(refined.best_cost).mean())


def main() -> None:
    """Race, print."""
    parser = arguments()
    parser.add_argument("--requests", type=Path, default=HERE / "recall_requests.json")
    parser.add_argument("--every", type=int, default=1, help="look at every n-th request only")
    parser.add_argument("--json", type=Path, help="where to put all shares")
    given = parser.parse_args()
    title("Hardness of requests")
    shares: dict[str, float | None] = {}
    groups: dict[str, list[float]] = {}
    for entry in json.loads(given.requests.read_text())[:: given.every]:
        share = shares[entry["name"]] = share_feasible(problem_of(entry))
        print(entry["name"], share, file=sys.stderr, flush=True)
        if share is not None:
            groups.setdefault(entry["group"], []).append(share)
    every = [share for some in groups.values() for share in some]
    rows = [
        [group, len(some), f"{min(some):.2f}", f"{median(some):.2f}", f"{max(some):.2f}"]
        for group, some in [*groups.items(), ("all", every)]
    ]
    table(["requests", "raced", "least share", "median", "largest"], rows)
    if given.json:
        given.json.write_text(json.dumps(shares, indent=1) + "\n")


if __name__ == "__main__":
    main()
