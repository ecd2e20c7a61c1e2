"""Whether long double is wider than double here: not on Windows, not on macOS with ARM, not with `TEST_DOUBLE=1`."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

#: Whether it is taken for double in this process only, not in those that tests begin.
SWITCHED = bool(os.environ.get("TEST_DOUBLE"))
#: Precision of paths that need more digits, which the types of arrays do not state.
LONG: Any = np.longdouble
EXTENDED = bool(np.finfo(np.longdouble).eps < np.finfo(float).eps)
