"""Decorators that compile kernels by numba and cache them on disk."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from numba import njit

from ..continuation import curve as formulas

#: The caller keeps all arrays alive, so numba need not count references: four times faster.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}, "_nrt": False}
compiled = njit(**_OPTIONS)
#: Compile a function inline: for short functions with many arrays, whose calls would dominate.
inlined = njit(forceinline=True, **_OPTIONS)
#: Compile an entry point and cache it on disk, together with the functions that it calls.
kept = njit(cache=True, **_OPTIONS)

#: Typed initial values of variables: literals would make numba compile called functions again.
ZERO: Any = np.int64(0)
ONE: Any = np.int64(1)


def version(file: str, *more: str) -> int:
    """Return a checksum of a folder of kernels, this folder, `continuation.curve` and `more`.

    As a default argument of cached functions it is part of their types.  Without it numba would
    check only the file of a function and might load the cache of another version.
    """
    sources = [path for folder in (__file__, file) for path in sorted(Path(folder).parent.glob("*.py"))]
    sources.append(Path(formulas.__file__))
    return crc32(b"".join([*(source.read_bytes() for source in sources), *(text.encode() for text in more)]))
