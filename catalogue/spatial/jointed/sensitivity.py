"""Derivatives of quantities read off a motion by the coordinates of hard points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from ...given import instance
from .curve import Curve
from .frame import make_frame
from .motion import Motion, taken
from .newton import solved

#: Displacement of a hard point for central differences of exact solutions [sizes of the mechanism].
STEP = 2.0**-17


def sensitivities(motion: Motion, reading: Callable[[Motion], Any]) -> pd.DataFrame:
    """Differentiate a reading by every coordinate of every hard point, over the sweep.

    Hard points are displaced in the design pose, so lengths of links change with them.  Each
    displaced mechanism is solved anew from the poses of the given one; central differences give
    about nine digits.

    Parameters
    ----------
    motion : Motion
    reading : callable
        Function of a motion that returns a number per pose, shape (s,), or (n, s) for a batch.

    Returns
    -------
    pandas.DataFrame
        One row per pose, indexed by the drive, of a batch by mechanism and drive; columns such as
        ``"upper front.from x"``.

    Raises
    ------
    InvalidRequest
        If the reading is no function, fails, or does not return numbers.
    """
    system = instance("motion", motion, Motion).curve.system
    columns = {}
    who, which = np.nonzero(np.isfinite(motion.states).all(2))
    held = motion.flat()[0].held.reshape(*motion.states.shape[:2], -1)
    target = motion.drive[which] / system.scalars[-1].unit
    for k, label in enumerate(system.labels):
        if label.split(".")[0] in ("Travel", "Length"):
            continue
        for axis in range(3):
            read = []
            for shift in (STEP, -STEP):
                points = system.points.copy()
                points[:, k, axis] += shift
                moved = system.with_points(points)
                curve = Curve(moved.take(who), held[who, which])
                states = np.full_like(motion.states, np.nan)
                states[who, which], _ = solved(curve, motion.states[who, which], target)
                moved_motion = replace(motion, curve=Curve(moved, motion.curve.held), states=states, _cache={})
                read.append(motion.rows(taken(moved_motion, reading, "reading")))
            columns[f"{label} {'xyz'[axis]}"] = (read[0] - read[1]) / (2 * STEP * system.unit)
    return make_frame(motion, columns, index="drive")
