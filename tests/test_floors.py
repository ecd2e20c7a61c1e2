"""The architecture: rooms of the core on floors; no room imports from its own floor or one above it.

Imports inside functions and for type checkers count, so there are no circles between rooms.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import catalogue
from catalogue.guides.verbs import VERBS, verb

ROOT = Path(catalogue.__file__).parent
#: From the bottom to the top.  A room is a package, or a module at the top level of the core.
FLOORS = (
    ("errors", "interrupt", "markup"),
    ("folders", "foreign_code", "given", "html_table", "installed", "progress", "threads", "units"),
    ("engines", "kinematics", "paper", "quantities"),
    ("chains", "curvature_theory", "problem", "spatial", "store"),
    ("guidance", "collections"),
    ("series", "candidates"),
    ("refine",),
    ("guides",),
    ("draw", "export"),
    ("search", "plugin"),
    ("populate", "find"),
    ("api",),
    ("study",),
    ("web",),
    ("cli", "testing"),
    ("__main__",),
)
FLOOR = {room: number for number, rooms in enumerate(FLOORS) for room in rooms}


def room(path: Path) -> str:
    parts = path.relative_to(ROOT).parts
    return parts[0] if len(parts) > 1 else path.stem


def imported(path: Path) -> Iterator[tuple[str, int]]:
    """Yield the rooms that a module imports from, with the line."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    package = path.relative_to(ROOT).parts[:-1]
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            if node.level:
                base = package[: len(package) - node.level + 1]
                for name in [node.module] if node.module else [alias.name for alias in node.names]:
                    yield (*base, *name.split("."))[0], node.lineno
            elif node.module and node.module.split(".")[0] == "catalogue":
                yield (*node.module.split("."), "__init__")[1], node.lineno


MODULES = sorted(
    p for p in ROOT.rglob("*.py") if not any(part.startswith("_") for part in p.relative_to(ROOT).parts[:-1])
)


def test_imports_lead_down() -> None:
    climbs = [
        f"{path}:{line}: {other}"
        for path in MODULES
        if (here := room(path)) in FLOOR
        for other, line in imported(path)
        if other not in (here, "__version__") and FLOOR.get(other, len(FLOORS)) >= FLOOR[here]
    ]
    assert climbs == []


def test_every_room_is_there() -> None:
    assert set(FLOOR) == {room(path) for path in MODULES} - {"__init__"}


def test_verbs_of_guides_lead_to_functions_of_rooms_above() -> None:
    assert all(callable(verb(name)) for name in VERBS)
    assert all(FLOOR[module.split(".")[0]] > FLOOR["guides"] for module in VERBS.values())
