"""Motion along a path, compiled by numba: what the modules beside this room do for many bodies at once by numpy.

One body after the other, by the formulas and with the tests of these modules: `guides` are the
charts of `geometry`, `pose` the equations of `equations` and the corrector of `predictor_corrector`, `walk` the steps
of `continuation`, `sweep` what `filling`, `follow` and `position` make of them, but that a second correction at a node
is by the factored matrix of the first (`native.elimination`); `guided.compiled` calls it.
"""

from .pose import Bodies, Limits, Plan, work
from .sweep import Measured, Scales, Ways, led, measured, room

__all__ = ["Bodies", "Limits", "Measured", "Plan", "Scales", "Ways", "led", "measured", "room", "work"]
