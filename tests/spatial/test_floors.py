"""The rooms of `catalogue.spatial` stand on each other; none imports from one beside or above it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import catalogue

ROOT = Path(catalogue.__file__).parent / "spatial"
#: What each room may import from, besides itself.
ROOMS = {
    "geometry": (),
    "native": ("continuation",),
    "continuation": (),
    "guided": ("geometry", "native", "continuation"),
    "drawing": (),
    "jointed": ("geometry", "drawing", "native", "continuation"),
    "fitting": ("jointed",),
}
MODULES = sorted(path for path in ROOT.rglob("*.py") if path.parent != ROOT)


def imported(text: str, package: tuple[str, ...]) -> Iterator[tuple[str, int]]:
    """Yield the rooms that a module of a package imports from, those within functions too, with the line."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and 0 < node.level <= len(package) + 1:
            base = package[: len(package) - node.level + 1]
            for name in [node.module] if node.module else [alias.name for alias in node.names]:
                yield (*base, *name.split("."))[0], node.lineno


@pytest.mark.parametrize("here", ROOMS)
def test_imports_lead_down(here: str) -> None:
    climbs = [
        f"{path}:{line}: {other}"
        for path in (ROOT / here).rglob("*.py")
        for other, line in imported(path.read_text("utf-8"), path.relative_to(ROOT).parts[:-1])
        if other not in (here, *ROOMS[here])
    ]
    assert climbs == []


def test_every_room_is_there() -> None:
    assert {path.name for path in ROOT.glob("[!_]*")} == {*ROOMS, "README.md"}
    assert {path.relative_to(ROOT).parts[0] for path in MODULES} == set(ROOMS)


@pytest.mark.parametrize(
    ("statement", "room"),
    [
        ("from ..guided.follow import follow", "guided"),
        ("from .. import guided", "guided"),
        ("from .kinds import Kind", "geometry"),
        ("def f():\n    from ..guided import newton", "guided"),
    ],
)
def test_every_way_to_import_is_seen(statement: str, room: str) -> None:
    assert [name for name, _ in imported(statement, ("geometry",))] == [room]
