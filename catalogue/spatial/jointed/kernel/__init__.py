"""The equations of one pose and Newton's method on them, compiled by numba: what `tree`, `system`, `newton` and
`tracing` do for many poses at once by numpy, without surfaces and curves.

Each function is that of the same name there, with its formulas and tests: `pose` has the equations, `newton` their
solution, `curve` the steps along the curve of poses, `sweep` what is called from outside, by `jointed.compiled`.
"""

from .curve import SINGULAR, Limits, Nodes, nodes
from .newton import Accuracy
from .pose import CYLINDRICAL, FREE, PRISMATIC, REVOLUTE, Geometry, Plan, work
from .sweep import Sweep, evaluated, solved, steps, swept

__all__ = [
    "CYLINDRICAL", "FREE", "PRISMATIC", "REVOLUTE", "SINGULAR", "Accuracy", "Geometry", "Limits", "Nodes", "Plan",
    "Sweep", "evaluated", "nodes", "solved", "steps", "swept", "work",
]  # fmt: skip
