"""Guides of all six families, and a DXF file read as plain text."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import pytest

import catalogue

LINKS = {
    "four-bar": {"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80},
    "slider-crank": {"crank": 100, "coupler": 300, "offset": 30, "along": 150, "across": 50},
    "inverted-slider-crank": {"ground": 300, "crank": 100, "offset": 20, "along": 100, "across": 50},
    "swinging-block": {"height": 100, "offset": 40, "along": 100, "across": 50},
    "elliptic-trammel": {"coupler": 200, "between": 70, "along": 100, "across": 50},
    "oldham": {"ground": 200, "between": 70, "along": 100, "across": 50},
}


@pytest.fixture(scope="session")
def six() -> dict[str, catalogue.Stretch]:
    """Return a guide over a stroke of 60 of each family, by its name."""
    found = catalogue.measure([catalogue.guide(links) for links in LINKS.values()], stroke=60, limit=1)
    return {one.family: one for one in found}


@pytest.fixture(scope="session")
def arc() -> catalogue.Stretch:
    """Return a four-bar that guides its point along an arc of a radius."""
    found: catalogue.Stretch = catalogue.measure(catalogue.guide(LINKS["four-bar"]), stroke=80, radius=400, limit=1)[0]
    return found


Tags = list[tuple[int, str]]


@dataclass
class Entity:
    """One entity: its kind and its group codes in their order."""

    kind: str
    tags: Tags = field(default_factory=list)

    def all(self, code: int) -> list[str]:
        return [value for number, value in self.tags if number == code]

    def one(self, code: int, other: str = "0") -> str:
        return next(iter(self.all(code)), other)

    def point(self, code: int = 10) -> complex:
        return complex(float(self.one(code)), float(self.one(code + 10)))

    @property
    def layer(self) -> str:
        return self.one(8)


@dataclass
class Dxf:
    """A DXF file: header variables, names of tables, blocks and entities of the model space."""

    header: dict[str, str]
    tables: dict[str, list[str]]
    blocks: dict[str, list[Entity]]
    entities: list[Entity]

    def of(self, kind: str, layer: str | None = None) -> list[Entity]:
        return [one for one in self.entities if one.kind == kind and layer in (None, one.layer)]

    def placed(self) -> Iterator[tuple[str, Entity, Callable[[complex], complex]]]:
        """Yield what blocks of links hold, with the name of the block and the map to the model space."""
        for insert in self.of("INSERT"):
            turn = cmath.exp(1j * math.radians(float(insert.one(50))))
            at, scale = insert.point(), (float(insert.one(41, "1")), float(insert.one(42, "1")))
            assert scale == (1.0, 1.0)
            for one in self.blocks[insert.one(2)]:
                yield insert.one(2), one, lambda z, at=at, turn=turn: at + turn * z  # type: ignore[misc]


def _read(text: str) -> Dxf:
    lines = text.splitlines()
    tags = [(int(code), value.strip()) for code, value in zip(lines[::2], lines[1::2], strict=True)]
    assert tags[-1] == (0, "EOF")
    sections: dict[str, Tags] = {}
    for i, (code, value) in enumerate(tags):
        if (code, value) == (0, "SECTION"):
            end = next(k for k in range(i, len(tags)) if tags[k] == (0, "ENDSEC"))
            sections[tags[i + 1][1]] = tags[i + 2 : end]
    names = [i for i, (code, _) in enumerate(sections["HEADER"]) if code == 9]
    header = {sections["HEADER"][i][1]: sections["HEADER"][i + 1][1] for i in names}
    tables: dict[str, list[str]] = {}
    for one in _entities(sections["TABLES"]):
        if one.kind not in ("TABLE", "ENDTAB"):
            tables.setdefault(one.kind, []).append(one.one(2))
    blocks: dict[str, list[Entity]] = {}
    for one in _entities(sections["BLOCKS"]):
        if one.kind == "BLOCK":
            blocks[one.one(2)] = []
            assert one.point() == 0
        elif one.kind != "ENDBLK":
            blocks[[*blocks][-1]].append(one)
    return Dxf(header, tables, blocks, _entities(sections["ENTITIES"]))


def _entities(tags: Tags) -> list[Entity]:
    found: list[Entity] = []
    for code, value in tags:
        if code == 0:
            found.append(Entity(value))
        else:
            found[-1].tags.append((code, value))
    return found


@pytest.fixture(scope="session")
def read_dxf() -> Callable[[str], Dxf]:
    """Return a reader of DXF that knows group codes and nothing of the program that wrote them."""
    return _read
