"""What is read off a motion as a data frame, a row per pose; of a batch one mechanism after the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from .motion import Motion


def framed(motion: Motion, columns: Mapping[str, Any], index: str = "") -> pd.DataFrame:
    """Return columns (n s,) after that of the drive, or indexed by it, with a level ``mechanism`` for a batch.

    Of several drives the frame is indexed by all of them.
    """
    n, s = motion.states.shape[:2]
    if motion.others:
        return pd.DataFrame(dict(columns), index=motion.index)
    drive = f"drive [{motion.drive_unit}]"
    if index:
        return pd.DataFrame(dict(columns), index=motion.index)
    each = {drive: [*motion.drive_shown] * n, **columns}
    pose = pd.MultiIndex.from_product([range(n), range(s)], names=["mechanism", "pose"]) if n > 1 else None
    return pd.DataFrame(each, index=pose)
