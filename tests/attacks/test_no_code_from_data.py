"""No file, argument or stored value becomes code: what could do that is not called; `pickle` runs between processes."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
#: Builtins and functions of modules that turn data into code or objects of any class, or start a shell.
CALLS = {"eval", "exec", "compile", "__import__", "system", "popen", "allow_pickle", "read_pickle", "unsafe_load"}
MODULES = {"pickle", "marshal", "shelve", "dill", "joblib", "cloudpickle", "yaml", "code", "codeop"}
#: What the main process and its workers say to each other, over a pipe that one of them made.
PIPES = {"catalogue/engines/worker.py": {"pickle"}, "catalogue/engines/processes.py": {"pickle"}}


def suspicious(tree: ast.AST) -> Iterator[str]:
    """Yield names that are called, imported or given as a keyword and are of those above."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield str(node.module).partition(".")[0]
        elif isinstance(node, ast.Call):
            # methods like re.compile or json's are of other modules; builtins are bare names
            if isinstance(node.func, ast.Name):
                yield node.func.id
            elif isinstance(node.func, ast.Attribute) and isinstance(node.func.value, ast.Name):
                yield node.func.attr if node.func.value.id in {"os", "pd"} else ""
            yield from (str(keyword.arg) for keyword in node.keywords if keyword.arg == "allow_pickle")
            yield from ("shell" for keyword in node.keywords if keyword.arg == "shell")


def found(source: str) -> set[str]:
    return {*suspicious(ast.parse(source))} & (CALLS | MODULES | {"shell"})


@pytest.mark.slow
def test_data_become_no_code() -> None:
    files = [file for part in ("catalogue", "plugins", "migrations") for file in (ROOT / part).rglob("*.py")]
    assert len(files) > 150
    used = {file.relative_to(ROOT).as_posix(): found(file.read_text("utf-8")) for file in files}
    assert {name: what for name, what in used.items() if what} == PIPES


@pytest.mark.parametrize(
    "source",
    ["eval('1')", "import pickle", "from marshal import loads", "np.load(f, allow_pickle=True)", "run(c, shell=True)",
     "os.system('x')", "pd.read_pickle(f)", "def f():\n import yaml.cyaml"],
)  # fmt: skip
def test_what_does_is_found(source: str) -> None:
    assert found(source)
