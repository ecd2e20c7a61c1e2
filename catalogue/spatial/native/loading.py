"""Load compiled kernels, where numba is installed: ten times faster than numpy.

numba caches compiled functions beside the module, or in the user's cache folder if that is
read-only (`NUMBA_CACHE_DIR` overrides both).  With `NUMBA_DISABLE_JIT=1` numpy does all.
"""

from __future__ import annotations

import os
import warnings
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import Any

import numpy as np

from ...foreign_code import uncounted
from ...kinematics.types import Array
from ...progress import busy


def load(name: str) -> ModuleType | None:
    """Return a module of compiled functions; None without numba."""
    if find_spec("numba") is None or os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
        return None
    try:
        return import_module(name)
    except (ImportError, KeyError) as error:  # numba refuses a newer numpy; an option may have been removed
        warnings.warn(f"numba cannot be used, sweeps go by numpy: {error}", RuntimeWarning, stacklevel=2)
        return None


def call(function: Any, *given: Any) -> Any:
    """Call a compiled function; show a message while numba compiles it."""
    if function.overloads:
        return function(*given)
    with busy("compiling sweeps in space, for this and later processes"), uncounted():
        return function(*given)


def plain(v: Array) -> Array:
    """Return a contiguous array of doubles: the array type of kernels."""
    return np.ascontiguousarray(v, float)
