"""Motion along a path, compiled by numba, one body after the other.

The modules of `guided` do this by numpy for many bodies at once.  `guides` repeats the charts of
`geometry`, `pose` the `equations`, which `native.curve` follows, and `sweep` the functions of
`follow` and `position`; `guided.compiled` calls it.
"""

from ...native.curve import nodes
from .pose import Bodies, Plan, plan, work
from .sweep import Measured, Scales, Ways, led, measured

__all__ = ["Bodies", "Measured", "Plan", "Scales", "Ways", "led", "measured", "nodes", "plan", "work"]
