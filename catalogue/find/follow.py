"""Answer a request from the answers to tighter ones, without a search."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..candidates.batch import CandidateBatch
from ..candidates.feasibility import cost, faults, feasibility
from ..candidates.select import select_top
from ..kinematics.batch import join
from ..problem.problem import Problem
from ..refine.sqp import Refinement
from ..search.search import BUDGET


class FollowOptions(NamedTuple):
    """Options of the refinement of known answers."""

    refined: int = 4  #: number of best answers refined for one round
    kept: int = 2  #: number of these refined further if that round gains
    rounds: int = 5  #: number of further rounds
    #: Least gain of a round that is followed by another: a hundredth of a point of score.
    gain: float = 1e-4


FOLLOW = FollowOptions()
#: Budget of a search from known answers that also explores requests beside the given one.
EXPLORING = replace(BUDGET, beside=20, known_followed=10)


def followed(problem: Problem, known: CandidateBatch) -> CandidateBatch | None:
    """Refine known answers, if they fill the list and the best is within the gap.

    Parameters
    ----------
    problem : Problem
    known : CandidateBatch
        Answers to tighter problems, placed along the path.

    Returns
    -------
    CandidateBatch or None
        The feasible ones, both refined and unrefined.
    """
    known = known[np.flatnonzero(feasibility(problem, known).all & (faults(problem, known) == 0))]
    if not len(known) or problem.effort != 1 or problem.ranking.front:
        return None
    known, _ = select_top(problem, known)
    if len(known) < problem.limit:
        return None
    costs = cost(problem, known)
    least = costs.min()
    if not least <= problem.ranking.good:
        return None
    best = np.argsort(costs, kind="stable")[: FOLLOW.refined]
    refinement = Refinement.of(problem, known[best], hasty=True)
    refinement.step(1)
    found = join(known, refinement.best)
    if refinement.best_cost.min() < least - FOLLOW.gain:
        farther = refinement[np.argsort(refinement.merit, kind="stable")[: FOLLOW.kept]]
        found = join(found, farther.run(FOLLOW.rounds).best)
    return found[np.flatnonzero(feasibility(problem, found).all)]
