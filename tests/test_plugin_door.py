"""The public door for plugins: it opens to all that it lists, and plugins use no other."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import catalogue.plugin
from catalogue.folders import folder

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


@pytest.mark.parametrize("path", FILES, ids=lambda p: f"{p.parent.name}/{p.name}")
def test_plugins_use_the_door(path: Path) -> None:
    for line, module, name in imported(path):
        assert module == "catalogue.plugin", f"{path}:{line}: a plugin imports from `catalogue.plugin` alone"
        assert name in catalogue.plugin.__all__, f"{path}:{line}: {name} is not one of the names in `catalogue.plugin`"


@pytest.mark.parametrize("name", catalogue.plugin.__all__)
def test_the_door_opens(name: str) -> None:
    assert getattr(catalogue.plugin, name) is not None
    assert name in dir(catalogue.plugin)


def test_no_other_name() -> None:
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        catalogue.plugin.nothing  # noqa: B018  (the access is what is tested)


def test_the_door_itself_loads_nothing() -> None:
    code = "import sys, catalogue.plugin; assert not [m for m in sys.modules if m in ('numpy', 'scipy', 'pluggy')]"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(catalogue.__file__).parents[1])
