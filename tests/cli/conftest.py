"""The command, called in this process or in one of its own."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import catalogue
from catalogue.cli import main


@dataclass
class Ran:
    """What a command did."""

    code: int
    out: str
    err: str

    @property
    def line(self) -> str:
        """The one line of an expected error."""
        lines = self.err.strip().splitlines()
        assert len(lines) == 1, self.err
        assert lines[0].startswith("catalogue: ")
        assert self.out == ""
        return lines[0]


@pytest.fixture(autouse=True)
def _brief(brief: None) -> None:
    """Search briefly: what the command makes of answers is tested here."""


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., Ran]:
    """Return the command as a function; warnings are shown as they are to a user."""
    monkeypatch.setattr("warnings.showwarning", None)
    monkeypatch.setattr("catalogue.progress.PATIENCE", 1e6)  # a slow machine is not told of
    monkeypatch.delenv("CATALOGUE_PLUGINS", raising=False)
    monkeypatch.delenv("CATALOGUE_DB", raising=False)
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "home"))  # whose database is nobody's
    for name in ("OMP", "OPENBLAS", "MKL"):  # the command sets them: that is to end with the test
        monkeypatch.setenv(f"{name}_NUM_THREADS", "1")

    def call(*arguments: Any, stdin: str | bytes = "") -> Ran:
        given = stdin.encode() if isinstance(stdin, str) else stdin
        monkeypatch.setattr(sys, "argv", ["catalogue", *map(str, arguments)])
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(given), "utf-8"))
        capsys.readouterr()
        with pytest.raises(SystemExit) as end:
            main()
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return Ran(int(end.value.code or 0), out, err)

    return call


@pytest.fixture(scope="session")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return an environment in which a new process imports the catalogue that is tested here, at home nowhere."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith("CATALOGUE_")}
    home = str(tmp_path_factory.mktemp("home"))
    root = str(Path(catalogue.__file__).parents[1])
    return {**kept, "PYTHONPATH": root, "XDG_DATA_HOME": home, "HOME": home, "COLUMNS": "120", "NO_COLOR": "1"}


@pytest.fixture(scope="session")
def process(environment: dict[str, str]) -> Callable[..., Ran]:
    """Return the command as a process."""

    def call(*arguments: Any, stdin: str = "", **extra: str) -> Ran:
        done = subprocess.run(
            [sys.executable, "-m", "catalogue", *map(str, arguments)],
            env={**environment, **extra}, input=stdin, capture_output=True, text=True, timeout=120,
        )  # fmt: skip
        assert "Traceback" not in done.stdout + done.stderr, done.stderr
        told = [line for line in done.stderr.splitlines(keepends=True) if not line.endswith(" ...\n")]  # how far it is
        return Ran(done.returncode, done.stdout, "".join(told))

    return call


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """Return a file with a linkage of one's own, by its link lengths."""
    file = tmp_path / "mine.json"
    file.write_text(
        json.dumps({"crank": 100, "rocker": 250, "ground": 220, "coupler": 250, "along": 125, "across": 80})
    )
    return file


@pytest.fixture
def code(run: Callable[..., Ran], mine: Path) -> str:
    """Return the code of a stretch of it."""
    return str(json.loads(run("measure", mine, "--stroke", 120, "--limit", 1, "--format", "json").out)[0]["code"])
