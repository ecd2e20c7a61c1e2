"""What the project consists of: the files that git tracks, or those of an unpacked sdist."""

from __future__ import annotations

import subprocess
from pathlib import Path, PurePosixPath

import pytest

ROOT = Path(__file__).resolve().parents[2]
LEFT_BEHIND = {"__pycache__", "build", "dist", "made", "PKG-INFO"}  # by tools; git ignores them
OWN_DOT_ENTRIES = {".ci", ".conda", ".gitignore", ".news", ".pre-commit-config.yaml"}


def _tracked() -> list[str]:
    listing = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True)
    return [name for name in listing.stdout.split("\0") if name and (ROOT / name).is_file()]


def _walked() -> list[str]:
    def own(part: str) -> bool:
        return part not in LEFT_BEHIND and (not part.startswith(".") or part in OWN_DOT_ENTRIES)

    paths = (path.relative_to(ROOT) for path in ROOT.rglob("*") if path.is_file())
    return [path.as_posix() for path in paths if all(map(own, path.parts))]


@pytest.fixture(scope="session")
def root() -> Path:
    """Return the top folder of the project."""
    return ROOT


@pytest.fixture(scope="session")
def project_files() -> list[PurePosixPath]:
    """Return the project's own files, relative to its top folder."""
    names = _tracked() if (ROOT / ".git").exists() else _walked()
    return [PurePosixPath(name) for name in sorted(names)]
