"""The arc with arrow heads at the driving crank, in stills and animations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kinematics.types import Complexes, Floats


class DriveMark(NamedTuple):
    """Arc about the fixed pivot of the driving crank."""

    radius: float = 25.0  #: radius [pt]
    head: float = 4.0  #: length of an arrow head [pt]
    #: angle between the shaft of an arrow and either side of its head [rad]
    head_angle: float = 0.5
    least: float = 1.1  #: least angle of the arc, so that its two heads do not meet [rad]
    points: int = 33  #: points of the arc


MARK = DriveMark()

#: Range of angles from which on a crank is drawn as turning fully: one arrow, in its sense [rad].
FULL_TURN = 1.9 * np.pi
#: Start and end of the arc of a full turn, about the first position [rad].
OPEN_ARC = (-0.9 * np.pi, 0.6 * np.pi)


def drive_marks(angle: Floats) -> list[Complexes]:
    """Return the arc and its arrow heads about the origin, y upwards.

    Parameters
    ----------
    angle : ndarray, shape (m,)
        Angles of the driving crank over the motion, without jumps [rad].

    Returns
    -------
    list of complex ndarray
        Polylines [point]: the arc, shape (33,), then a head, shape (3,), or two.
    """
    low, high = float(angle.min()), float(angle.max())
    turns = high - low > FULL_TURN
    if turns:
        low, high = angle[0] + OPEN_ARC[0], angle[0] + OPEN_ARC[1]
    elif high - low < MARK.least:
        low, high = 0.5 * (low + high - MARK.least), 0.5 * (low + high + MARK.least)
    ends = (high,) if turns and angle[-1] > angle[0] else (low,) if turns else (low, high)
    marks: list[Complexes] = [MARK.radius * np.exp(1j * np.linspace(low, high, MARK.points))]
    for end in ends:
        tip = MARK.radius * np.exp(1j * end)
        forward = (1j if end == high else -1j) * np.exp(1j * end)
        sides = [tip - MARK.head * forward * np.exp(side * 1j * MARK.head_angle) for side in (-1, 1)]
        marks.append(np.array([sides[0], tip, sides[1]]))
    return marks
