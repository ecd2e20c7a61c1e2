"""How kernels are compiled by numba, and kept from one process to the next."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from numba import njit

from ..continuation import curve as formulas

#: Arrays come from outside and stay there while a function runs: not to count who uses them makes
#: it four times faster.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}, "_nrt": False}
compiled = njit(**_OPTIONS)
#: The same for what is called at every position: calls with many arrays take longer than what they
#: do.
inlined = njit(forceinline=True, **_OPTIONS)
#: The same for what is called from outside: numba keeps it, and with it what it calls.
kept = njit(cache=True, **_OPTIONS)

#: Numbers that variables begin with: for a literal numba compiles what they are given to once more.
NOUGHT: Any = np.int64(0)
ONE: Any = np.int64(1)


def version(file: str, *more: str) -> int:
    """Return a checksum of a folder of kernels, this one, `continuation.curve` and `more`.

    As a default of kept functions it is part of their types, so that numba does not take for them
    what it has kept of another version: that depends to it on the file of each alone.
    """
    sources = [path for folder in (__file__, file) for path in sorted(Path(folder).parent.glob("*.py"))]
    sources.append(Path(formulas.__file__))
    return crc32(b"".join([*(source.read_bytes() for source in sources), *(text.encode() for text in more)]))
