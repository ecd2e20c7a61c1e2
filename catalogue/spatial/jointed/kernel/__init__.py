"""Equations of one pose and Newton's method, compiled by numba.

The modules of `jointed` do this by numpy for many poses at once; they also treat surfaces and
curves.

`pose` repeats the formulas of `tree`, `system` and `scalars`; `native.newton` solves them and
`native.curve` follows their curve, by the tests and constants of `continuation`.  `sweep` has the
functions that `jointed.compiled` calls.
"""

from ...native.curve import SINGULAR, Nodes, nodes
from .pose import CYLINDRICAL, FREE, PRISMATIC, REVOLUTE, Geometry, Plan, work
from .sweep import Sweep, evaluated, rated, solved, steps, swept

__all__ = [
    "CYLINDRICAL",
    "FREE",
    "PRISMATIC",
    "REVOLUTE",
    "SINGULAR",
    "Geometry",
    "Nodes",
    "Plan",
    "Sweep",
    "evaluated",
    "nodes",
    "rated",
    "solved",
    "steps",
    "swept",
    "work",
]
