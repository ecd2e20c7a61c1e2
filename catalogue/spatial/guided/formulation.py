"""Which equations a mechanism is computed by: those of its pose, of Euler angles, or of curvilinear
distances.
"""

from __future__ import annotations

from typing import Any

from ...kinematics.types import Array
from .distances import Distances, distance_series
from .equations import System
from .euler_angles import EulerAngles, euler_series
from .mechanism import Mechanisms
from .series import pose_series
from .unknowns import State

#: Equations, and the power series of a motion by them.
WAYS: dict[str, tuple[Any, Any]] = {
    "pose": (System, pose_series),
    "euler-angles": (EulerAngles, euler_series),
    "distances": (Distances, distance_series),
}


def formulated(mechanisms: Mechanisms) -> System:
    """Return the equations of mechanisms, in their formulation."""
    system: System = WAYS[mechanisms.formulation][0].of(mechanisms)
    return system


def series(
    mechanisms: Mechanisms, system: System, state: State, q: Array, metric: Array, inverse: Array
) -> tuple[Array, Array]:
    """Return series of points (order + 1, 3, p, n) and angular velocity (order, 3, n):
    `pose_series`.
    """
    found: tuple[Array, Array] = WAYS[mechanisms.formulation][1](mechanisms, system, state, q, metric, inverse)
    return found
