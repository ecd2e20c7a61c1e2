"""The equations of one pose and Newton's method on them, compiled by numba: what the modules beside this room do for
many poses at once by numpy, without surfaces and curves.

The formulas, tests and constants are theirs, the division into functions is not: `pose` has the equations (`tree`,
`system`, `scalars`), `newton` their solution (`newton`), `curve` the steps along the curve of poses and its dead points
(`tracing`, `dead_points`), `sweep` what is called from outside, by `jointed.compiled` (`sweeping`).
"""

from .curve import SINGULAR, Limits, Nodes, nodes
from .newton import Accuracy
from .pose import CYLINDRICAL, FREE, PRISMATIC, REVOLUTE, Geometry, Plan, work
from .sweep import Sweep, evaluated, rated, solved, steps, swept

__all__ = [
    "CYLINDRICAL", "FREE", "PRISMATIC", "REVOLUTE", "SINGULAR", "Accuracy", "Geometry", "Limits", "Nodes", "Plan",
    "Sweep", "evaluated", "nodes", "rated", "solved", "steps", "swept", "work",
]  # fmt: skip
