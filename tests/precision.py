"""Whether long double is wider than double here: not on Windows, not on macOS with ARM, not with `TEST_DOUBLE=1`."""

from __future__ import annotations

import numpy as np

EXTENDED = bool(np.finfo(np.longdouble).eps < np.finfo(float).eps)
