"""A database with the specimens of the drop-in."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import catalogue
from catalogue import Catalogue

DROPIN = Path(__file__).with_name("dropin")


@pytest.fixture(scope="session")
def dropin() -> Path:
    """Return the folder of the drop-in."""
    return DROPIN


@pytest.fixture
def make(tmp_path: Path) -> Callable[..., Catalogue]:
    """Return an opener of catalogues that know the drop-in, nothing built, by name of the file."""
    return lambda name="some": catalogue.open(tmp_path / f"{name}.db", plugins=[str(DROPIN)], build=False)


@pytest.fixture(scope="session")
def swings_db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a database with 400 specimens or more; do not write to it."""
    file = tmp_path_factory.mktemp("swings") / "swings.db"
    with catalogue.open(file, plugins=[str(DROPIN)], build=False) as opened:
        opened.build_collection("swings", count=400)
    return file


@pytest.fixture(scope="session")
def swings(swings_db: Path) -> Iterator[Catalogue]:
    """Return the catalogue of `swings_db`."""
    with catalogue.open(swings_db, plugins=[str(DROPIN)], build=False) as opened:
        yield opened
