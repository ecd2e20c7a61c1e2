"""Motion along a path, compiled by numba: what the modules beside this room do for many bodies at
once by numpy.

One body after the other: `guides` are the charts of `geometry`, `pose` the equations of
`equations`, which `native.curve` follows, `sweep` what `follow` and `position` make of them;
`guided.compiled` calls it.
"""

from ...native.curve import nodes
from .pose import Bodies, Plan, plan, work
from .sweep import Measured, Scales, Ways, led, measured

__all__ = ["Bodies", "Measured", "Plan", "Scales", "Ways", "led", "measured", "nodes", "plan", "work"]
