"""Every benchmark and attack says how it is used, and does nothing else, when it is asked."""

from __future__ import annotations

import ast
import os
import runpy
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
COMMANDS = [
    path.relative_to(ROOT)
    for folder in ("benchmarks", "attacks")
    for path in sorted((ROOT / "tests" / folder).glob("*.py"))
    if '\nif __name__ == "__main__":' in path.read_text("utf-8")
]


@pytest.fixture
def alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    """Let a file run as a command in this process, and leave nothing of it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(ROOT), *sys.path])
    before = {*sys.modules}
    yield
    for name in {*sys.modules} - before:
        if (getattr(sys.modules[name], "__file__", None) or "").startswith(str(ROOT / "tests")):
            del sys.modules[name]


def run_as_command(path: Path, text: str) -> None:
    """Run a file as `python FILE` does, or as `python -m` if it imports others by its folder."""
    if f"from {path.parts[0]}." in text:
        name = ".".join(path.with_suffix("").parts)
        sys.modules.pop(name, None)  # another test may have imported it
        runpy.run_module(name, run_name="__main__", alter_sys=True)
    else:
        sys.path.insert(0, str((ROOT / path).parent))
        runpy.run_path(str(ROOT / path), run_name="__main__")


@pytest.mark.usefixtures("alone")
@pytest.mark.parametrize("path", COMMANDS, ids=str)
def test_help_is_what_the_file_says_of_itself(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (ROOT / path).read_text("utf-8")
    monkeypatch.setattr(sys, "argv", [str(ROOT / path), "--help"])
    with pytest.raises(SystemExit) as end:
        run_as_command(path, text)
    said, wrong = capsys.readouterr()
    assert not end.value.code, wrong
    assert said.startswith("usage:")
    assert (ast.get_docstring(ast.parse(text)) or "-").splitlines()[0] in said
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("how", [["-m", "tests.attacks.stability"], [str(ROOT / "tests/benchmarks/recall.py")]])
def test_a_file_runs_as_a_command_of_its_own(how: list[str], tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, *how, "--help"], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True, text=True, timeout=100, check=True,
    )  # fmt: skip
    assert done.stdout.startswith("usage:")
