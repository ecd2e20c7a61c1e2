"""Refinement: move the pivots and the guided point so that the deviation over the stroke becomes least."""

from .certificate import Certificate, certified
from .drift import Drifts, drift
from .refine import refined
from .task import Free, Moves, Parametric, Task

__all__ = ["Certificate", "Drifts", "Free", "Moves", "Parametric", "Task", "certified", "drift", "refined"]
