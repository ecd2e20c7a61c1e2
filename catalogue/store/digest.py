"""Digest of a file's content, to compare copies on other machines."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

from .seal import BLOCK


def content_digest(path: Path) -> str:
    """Return the SHA-256 of a file; computed once while the file is unchanged."""
    found = path.stat()
    return _digest(path, found.st_size, found.st_mtime_ns)


@lru_cache(maxsize=16)
def _digest(path: Path, size: int, changed: int) -> str:  # noqa: ARG001  # they are the key
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(BLOCK):
            digest.update(block)
    return digest.hexdigest()
