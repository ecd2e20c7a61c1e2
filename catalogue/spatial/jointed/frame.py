"""What is read off a motion as a data frame, a row per pose; of a batch one mechanism after the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from .motion import Motion


def framed(motion: Motion, columns: Mapping[str, Any], index: str = "") -> pd.DataFrame:
    """Return columns (n s,) after that of the drive, or indexed by it, with a level ``mechanism`` for a batch."""
    n, s = motion.states.shape[:2]
    drive = f"drive [{motion.drive_unit}]"
    shown = motion.drive_shown
    if index:
        rows = pd.MultiIndex.from_product([range(n), shown], names=["mechanism", drive])
        return pd.DataFrame(dict(columns), index=rows if n > 1 else pd.Index(shown, name=drive))
    each = {drive: [*shown] * n, **columns}
    pose = pd.MultiIndex.from_product([range(n), range(s)], names=["mechanism", "pose"]) if n > 1 else None
    return pd.DataFrame(each, index=pose)
