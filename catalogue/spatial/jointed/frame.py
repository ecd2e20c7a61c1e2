"""Data frames of readings, one row per pose; of a batch one mechanism after the other."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd

from .motion import Motion


def make_frame(motion: Motion, columns: Mapping[str, Any], index: str = "") -> pd.DataFrame:
    """Return a data frame of columns (n s,), the drive as first column or index.

    The index of a batch has a level ``mechanism``.

    Several drives are all in the index.
    """
    n, s = motion.states.shape[:2]
    index_, named = motion.index if motion.others or index else None, dict(columns)
    if index_ is None:
        named = {f"drive [{motion.drive_unit}]": np.tile(motion.drive_shown, n), **named}
        index_ = pd.MultiIndex.from_product([range(n), range(s)], names=["mechanism", "pose"]) if n > 1 else None
    values = np.stack(list(named.values()))
    return pd.DataFrame(values.T, columns=_headings(tuple(named)), index=index_, copy=False)


@lru_cache(maxsize=64)
def _headings(names: tuple[str, ...]) -> pd.Index[str]:
    """Return headings as an index; cached, for making it takes longer than a small table."""
    return pd.Index(names)
