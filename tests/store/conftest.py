"""An empty database, made-up batches, and a set of migrations to add to."""

from __future__ import annotations

import os
import runpy
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import catalogue
from catalogue.folders import folder
from catalogue.store import Database
from catalogue.store.engine import revisions

FILLER = Path(__file__).with_name("filler.py")


@pytest.fixture(scope="session")
def sample() -> Callable[..., Any]:
    """Return the maker of batches; see `filler.py`."""
    made: Callable[..., Any] = runpy.run_path(str(FILLER))["sample"]
    return made


@pytest.fixture(scope="session")
def filler() -> Path:
    """Return the script that writes batches without end."""
    return FILLER


@pytest.fixture(scope="session")
def environment() -> dict[str, str]:
    """Return an environment in which a new process imports the catalogue that is tested here."""
    return {**os.environ, "PYTHONPATH": str(Path(catalogue.__file__).parents[1])}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return a name for a database."""
    return tmp_path / "some.db"


@pytest.fixture(scope="session")
def empty(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the file of an empty database, to be copied."""
    path = tmp_path_factory.mktemp("empty") / "empty.db"
    Database.open(path).close()
    return path


@pytest.fixture
def database(path: Path, empty: Path) -> Iterator[Database]:
    """Return a new, empty database."""
    with Database.open(shutil.copy(empty, path)) as opened:
        yield opened


@pytest.fixture
def add_migration(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Return a function that adds the next revision, of a given body, to a copy of the migrations, and uses that."""
    copy = tmp_path / "migrations"

    def add(body: str) -> None:
        shutil.copytree(folder("migrations"), copy, ignore=shutil.ignore_patterns("__pycache__"))
        newest = revisions()[-1]
        following = f"{int(newest) + 1:04}"
        text = (
            f"import sqlalchemy as sa\nfrom alembic import op\nrevision = {following!r}\ndown_revision = {newest!r}\n"
        )
        indented = "".join(f"    {line}\n" for line in body.splitlines())
        (copy / "versions" / f"{following}_more.py").write_text(f"{text}def upgrade():\n{indented}")
        monkeypatch.setattr("catalogue.store.engine.folder", lambda name: tmp_path / name)

    return add
