"""The public door for plugins: it opens to all that it lists, and plugins use no other."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import catalogue.plugin
import catalogue.spatial
from catalogue.folders import folder

#: What every plugin may import from, and what those that hold mechanisms in space may besides.
DOORS = {module.__name__: module for module in (catalogue.plugin, catalogue.spatial)}
DROPINS = [path for path in Path(__file__).parent.glob("*/*/*.py") if "hookimpl" in path.read_text("utf-8")]
FILES = sorted([*folder("plugins").rglob("*.py"), *DROPINS])


def imported(path: Path) -> Iterator[tuple[int, str, str]]:
    """Yield line, module and name of all that a file imports of the catalogue; those within functions too."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.split(".")[0] == "catalogue":
                    yield node.lineno, alias.name, ""
        elif isinstance(node, ast.ImportFrom) and not node.level and (node.module or "").split(".")[0] == "catalogue":
            for alias in node.names:
                yield node.lineno, node.module or "", alias.name


def test_plugins_use_the_door() -> None:
    assert [
        (path, line, module, name)
        for path in FILES
        for line, module, name in imported(path)
        if module not in DOORS or name not in DOORS[module].__all__
    ] == []


@pytest.mark.parametrize("door", DOORS)
def test_the_door_opens(door: str) -> None:
    for name in DOORS[door].__all__:
        assert getattr(DOORS[door], name) is not None
        assert name in dir(DOORS[door])


@pytest.mark.parametrize("door", DOORS)
def test_no_other_name(door: str) -> None:
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        DOORS[door].nothing  # noqa: B018  (the access is what is tested)


@pytest.mark.parametrize("door", DOORS)
def test_the_door_itself_loads_nothing(door: str) -> None:
    code = f"import sys, {door}; assert not [m for m in sys.modules if m in ('numpy', 'scipy', 'pluggy')]"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(catalogue.__file__).parents[1])


def test_the_guide_tells_of_all_that_the_door_opens_to() -> None:
    told = (folder("plugins") / "README.md").read_text("utf-8")
    known = {name for name in vars(catalogue.plugin.Instant) if not name.startswith("_")} | {"linkage", "pole"}
    wanted = [*catalogue.plugin.__all__, *(f"instant.{name}" for name in known)]
    assert "instant.along_axes" in wanted
    assert [name for name in wanted if f"| `{name}` |" not in told] == []
