"""The plugin's rooms stand on each other: geometry, kinematics, collection; none imports from one above it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from catalogue.folders import folder
from catalogue.plugin.registry import Registry

ROOT = folder("plugins") / "spatial_guidance"
#: From the bottom to the top.
ROOMS = ("geometry", "kinematics", "collection")
MODULES = sorted(path for path in ROOT.rglob("*.py") if path.parent != ROOT)


def imported(text: str, package: tuple[str, ...]) -> Iterator[tuple[str, int]]:
    """Yield the rooms that a module of a package imports from, those within functions too, with the line."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = package[: len(package) - node.level + 1]
            for name in [node.module] if node.module else [alias.name for alias in node.names]:
                yield (*base, *name.split("."))[0], node.lineno


@pytest.mark.parametrize("path", MODULES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_imports_lead_down(path: Path) -> None:
    package = path.relative_to(ROOT).parts[:-1]
    below = ROOMS[: ROOMS.index(package[0]) + 1]
    for other, line in imported(path.read_text("utf-8"), package):
        assert other in below, f"{path}:{line}: {package[0]} imports {other}, which is not below it"


def test_every_room_is_there() -> None:
    assert {path.name for path in ROOT.glob("[!_]*")} == set(ROOMS)
    assert {path.relative_to(ROOT).parts[0] for path in MODULES} == set(ROOMS)


def test_rooms_are_not_taken_for_plugins() -> None:
    names = [record.name for record in Registry().records]
    assert "spatial_guidance" in names
    assert not set(names) & set(ROOMS)


@pytest.mark.parametrize(
    ("statement", "room"),
    [
        ("from ..kinematics.follow import follow", "kinematics"),
        ("from .. import kinematics", "kinematics"),
        ("from .kinds import Kind", "geometry"),
        ("def f():\n    from ..collection import draw", "collection"),
    ],
)
def test_every_way_to_import_is_seen(statement: str, room: str) -> None:
    assert [name for name, _ in imported(statement, ("geometry",))] == [room]
