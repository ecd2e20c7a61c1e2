"""What a small displacement of each hard point does to whatever is read off a motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from .compiling import directions
from .motion import Motion
from .tracing import Curve, solved

#: Displacement of a hard point, in the size of the mechanism, for central differences of exact solutions.
STEP = 2.0**-17


def sensitivities(motion: Motion, reading: Callable[[Motion], Any]) -> pd.DataFrame:
    """Return the derivative of a reading by every coordinate of every hard point, over the sweep.

    A hard point is displaced in the design pose, so that lengths of links follow it, as when a design is varied.  Each
    displaced mechanism is solved anew from the poses of the given one; central differences, good to about nine digits.

    Parameters
    ----------
    motion : Motion
        Of one mechanism.
    reading : callable
        From a motion to a number per pose, shape (s,).

    Returns
    -------
    pandas.DataFrame
        One row per pose, indexed by the drive; columns such as ``"upper front.from x"``.
    """
    system = motion.curve.system
    motion.of_one("sensitivities")
    columns = {}
    good = np.flatnonzero(np.isfinite(motion.states[0]).all(1))
    target = motion.drive[good] / system.scalars[-1].unit
    for k, label in enumerate(system.labels):
        if label.split(".")[0] in ("Travel", "Length"):
            continue
        for axis in range(3):
            read = []
            for way in (STEP, -STEP):
                points = system.points.copy()
                points[:, k, axis] += way
                moved = replace(system, points=points, directions=directions(system.specs, points))
                curve = Curve(moved, motion.curve.held)
                states = np.full_like(motion.states, np.nan)
                states[0, good], _ = solved(curve.take(np.zeros(len(good), int)), motion.states[0, good], target)
                read.append(np.asarray(reading(replace(motion, curve=curve, states=states, _cache={})), float))
            columns[f"{label} {'xyz'[axis]}"] = (read[0] - read[1]) / (2 * STEP * system.unit)
    return pd.DataFrame(columns, index=pd.Index(motion.drive_shown, name=f"drive [{motion.drive_unit}]"))
