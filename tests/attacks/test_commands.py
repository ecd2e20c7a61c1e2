"""Every benchmark and attack says how it is used, and does nothing else, when it is asked."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COMMANDS = [
    path.relative_to(ROOT)
    for folder in ("benchmarks", "attacks")
    for path in sorted((ROOT / "tests" / folder).glob("*.py"))
    if '\nif __name__ == "__main__":' in path.read_text("utf-8")
]


@pytest.mark.slow
@pytest.mark.parametrize("path", COMMANDS, ids=str)
def test_help_is_what_the_file_says_of_itself(path: Path, tmp_path: Path) -> None:
    text = (ROOT / path).read_text("utf-8")
    module = ".".join(path.with_suffix("").parts)
    how = ["-m", module] if f"from {'.'.join(path.parts[:1])}." in text else [str(ROOT / path)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, *how, "--help"], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
        timeout=100,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("usage:")
    assert (ast.get_docstring(ast.parse(text)) or "-").splitlines()[0] in done.stdout
    assert not list(tmp_path.iterdir())
