"""Rotations for users: the functions of `rotation`, with checked arrays."""

from __future__ import annotations

from typing import Any

from ...given import array
from ...kinematics.types import Array
from . import rotation


def matrix(q: Any) -> Array:
    """Return rotation matrices (3, 3, n) of quaternions (4, n), scalar first.

    Raises
    ------
    InvalidRequest
        If q has a wrong shape or is not numeric.
    """
    return rotation.matrix(array("q", q, (4, ...)))


def quaternion(r: Any) -> Array:
    """Return unit quaternions (4, n), scalar first, of rotation matrices (3, 3, n).

    Raises
    ------
    InvalidRequest
        If r has a wrong shape or is not numeric.
    """
    return rotation.quaternion(array("r", r, (3, 3, None), (3, 3, 0)))
