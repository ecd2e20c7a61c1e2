"""How far a search goes: how many starts it has, and how many of them are followed."""

from __future__ import annotations

from dataclasses import dataclass

from ..candidates.feasibility import PIVOT_REGIONS
from ..problem.problem import Problem

#: Constraints that choose among sorts of guides.
SORTS = ("families", "series", "configurations", "pins_only", "order", "slots", "returns")


def is_constrained(problem: Problem) -> bool:
    """Return whether more is asked for than sorts of guides."""
    return any(name not in SORTS for name in problem.constraints.active())


def is_narrow(problem: Problem) -> bool:
    """Return whether few designs are left: pivots are to stand in a region, a crank is to turn fully, or the coupler
    hardly at all."""
    wanted = problem.constraints
    limited = any(getattr(wanted, name) is not None for name in ("max_rotation", *PIVOT_REGIONS))
    return bool(wanted.full_rotation) or limited


@dataclass(frozen=True)
class Extent:
    """How far a search goes."""

    measured: int  #: stored starts of a stage that are measured
    drawn: int  #: linkages drawn to measure for a stage, of each kind
    tried: int  #: starts of each kind that are refined for a round, and of all kinds for another
    kept: tuple[int, int, int]  #: starts refined farther, of the first stage, of the first two together, of later ones
    #: points that may be measured in refinement where nothing was found, and where less than enough: a bound in time
    #: would make answers depend on the machine
    in_vain: int
    points: int

    @classmethod
    def of(cls, problem: Problem) -> Extent:
        """Return the extent of a search for a problem."""
        if not is_constrained(problem):
            return FREE
        return SCORED if problem.ranking.only == "score" else CONSTRAINED


#: Where sorts of guides are asked for; where there are other constraints, which leave many best places that are no
#: better than their neighbours, so that it is the number of starts that finds the best of them; and where those are
#: ranked by score, of which the best places have nearly the same.
FREE = Extent(60, 600, 24, (12, 32, 16), 700, 2000)
CONSTRAINED = Extent(200, 2500, 90, (30, 60, 30), 2000, 6000)
SCORED = Extent(200, 1200, 40, (24, 40, 24), 2000, 6000)
