"""A database with a few specimens of every family, and an answer of each."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from shutil import copyfile
from typing import Any
from unittest.mock import MagicMock

import pytest

import catalogue
from catalogue import Catalogue, StraightLine
from catalogue.find import specimens
from catalogue.kinematics.linkage import Linkage
from catalogue.plugin.registry import Registry
from catalogue.populate.collect import collect

DROPIN = str(Path(__file__).parents[1] / "collections" / "dropin")
REGISTRY = Registry([DROPIN])
#: Collection and family of each row of the matrix; a new family of a plugin is a new row.
ROWS = [
    (name, family)
    for name in sorted(REGISTRY.collections)
    for family in REGISTRY.collection(name).families
    if name != "spatial-guidance" or family == "II"
]
#: Path of all requests [mm]: a tolerance that many random mechanisms meet.
LINE = StraightLine(100, 2, unit="mm")
#: Length of the paths of random linkages of two dyads, of size about 1.
STROKE = 0.6
#: Mechanisms drawn together: of each family one block.
BLOCK = 24


@pytest.fixture(scope="session")
def families_db(small_db: Path, once: Callable[..., Path]) -> Path:
    """Return a database with a block of specimens of every family; do not write to it."""

    def build(path: Path) -> None:
        copyfile(small_db, path)
        with catalogue.open(path, plugins=[DROPIN], build=False) as opened:
            for name in {name for name, _ in ROWS if REGISTRY.collection(name).mechanism is not None}:
                small = replace(opened.registry.collection(name), block=BLOCK, specimens=1)
                collect(opened.database, small, opened.registry.provider(name).version)

    return once("families.db", build)


@pytest.fixture(scope="module")
def families(families_db: Path) -> Iterator[Catalogue]:
    """Return the catalogue of `families_db`; it finds no planar guides to make mechanisms of."""
    with catalogue.open(families_db, plugins=[DROPIN], build=False) as opened, pytest.MonkeyPatch.context() as patch:
        patch.setattr(Catalogue, "find", lambda *_, **__: ())
        patch.setattr(specimens, "VERIFY", specimens.VERIFY._replace(batch=4, batches=4))
        yield opened


@pytest.fixture(scope="session")
def stretches(random_linkages: Callable[..., Linkage]) -> Callable[[str], list[Any]]:
    """Return a maker of the straightest stretches of random linkages of two dyads."""

    @cache
    def measured(family: str) -> list[Any]:
        pivots = random_linkages(family, 24, 3).pivots.tolist()
        every = catalogue.measure([catalogue.guide(one, (0.7, 0.4), unit="mm") for one in pivots], stroke=STROKE)
        return [one for one in every if one.deviation < 0.02 and one.min_transmission > 15][:4]

    return measured


@pytest.fixture
def solids(monkeypatch: pytest.MonkeyPatch) -> Callable[[Any], list[str]]:
    """Return an exporter to STEP that lists the solids; its kernel is seldom installed."""
    cad = MagicMock()
    cad.Solid.extrude.side_effect = lambda *_: MagicMock(moved=lambda _: MagicMock())
    cad.export_step = lambda whole, file, **_: Path(file).write_text("\n".join(whole), "utf-8")
    cad.Compound = lambda label, children: [label, *(str(child.label) for child in children)]
    monkeypatch.setitem(sys.modules, "build123d", cad)
    return lambda guide: str(guide.export(format="step")).splitlines()[1:]


@pytest.fixture(scope="module")
def answers_of(families: Catalogue) -> Callable[..., Any]:
    """Return a finder of some answers of a row, anywhere, without constraints."""

    @cache
    def found(name: str, family: str) -> Any:
        return families.find_in(name, LINE, families=[family], limit=8, quiet=True)

    return found
