"""The constraints of a problem as pieces, those that have derivatives in closed form.

A limit holds where none of its pieces is positive.
"""

from __future__ import annotations

from ..candidates.feasibility import PIVOT_REGIONS, UPPER_BOUNDS
from ..guidance.metrics import LEAST_ARM
from ..problem.constraints import DRIVE
from ..problem.problem import Problem
from .quantities import Pieces, Quantities

#: Bounds on transmission angles, which pieces have in right angles.
TRANSMISSION = {
    "min_transmission": "transmission",
    "min_transmission_turn": "transmission_turn",
}
#: All bounds that hold for one measure, by what they bound.
BOUNDS = {**UPPER_BOUNDS, "min_link": "min_link", "min_ground": "min_ground", **TRANSMISSION}


def limits(problem: Problem, read: Quantities) -> dict[str, Pieces]:
    """Return by how much guides break each constraint, in strokes and right angles."""
    wanted, found = problem.constraints, {"collapse": read.collapse()}
    found["distance from the moving pivots"] = read("least_arm").less(-LEAST_ARM)
    for name, measure in BOUNDS.items():
        if bound := getattr(wanted, name):
            sign = 1.0 if name in UPPER_BOUNDS else -1.0
            unit = 90.0 if name in TRANSMISSION else 1.0
            found[name] = read(measure).less(sign * bound / unit)
    if wanted.full_rotation:
        found["full_rotation"] = read("full_rotation")
    for name in PIVOT_REGIONS:
        if getattr(wanted, name) is not None:
            found[name] = read(name)
    if has_room(problem):
        found["swept_in"] = read("swept_in")
    if drives := [name for name in DRIVE if getattr(wanted, name) is not None]:
        from .driving import Driving

        driving = Driving(read)
        found |= {name: driving(name) for name in drives}
    return found


def has_room(problem: Problem) -> bool:
    """Return whether links are to stay in a room of which pieces are known: a convex one."""
    room = problem.constraints.swept_in
    return room is not None and room.is_convex and not problem.constraints.slots


def differenced(problem: Problem) -> list[str]:
    """Return the constraints that have no derivatives in closed form."""
    wanted = problem.constraints
    rough = [name for name in ("keep_out", "min_lift") if getattr(wanted, name)]
    if wanted.slots and wanted.max_arm:  # written down for points only
        rough.append("max_arm")
    if wanted.swept_in is not None and not has_room(problem):
        rough.append("swept_in")
    return rough
