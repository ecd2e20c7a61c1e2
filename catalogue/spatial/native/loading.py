"""Load compiled kernels, where numba is installed: ten times faster than numpy.

numba keeps what it has compiled beside the module, or, where it cannot write there, in the user's
cache folder (`NUMBA_CACHE_DIR` says another); `NUMBA_DISABLE_JIT=1` leaves all to numpy.
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
    except (ImportError, KeyError) as error:  # numba refuses a numpy newer than itself; an option may have gone
        warnings.warn(f"numba cannot be used, sweeps go by numpy: {error}", RuntimeWarning, stacklevel=2)
        return None


def call(function: Any, *given: Any) -> Any:
    """Call a compiled function; where numba takes its time to compile it, say so."""
    if function.overloads:
        return function(*given)
    with busy("compiling sweeps in space, for this and later processes"), uncounted():
        return function(*given)


def plain(v: Array) -> Array:
    """Return an array as kernels are compiled for: of doubles, in order."""
    return np.ascontiguousarray(v, float)
