"""The equations of one pose and Newton's method on them, compiled by numba: what the modules beside
this room do for many poses at once by numpy, without surfaces and curves.

The formulas are theirs: `pose` has the equations (`tree`, `system`, `scalars`), which
`native.newton` solves and `native.curve` follows, by the tests and constants of `continuation`;
`sweep` is what is called from outside, by `jointed.compiled` (`sweeping`).
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
