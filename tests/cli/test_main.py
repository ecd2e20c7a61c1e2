"""What the command says of names, numbers, devices and packages that nobody should give it: one line each."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Run = Callable[..., Any]
LINE = ("find", "straight-line", "--stroke", "1", "--deviation", "0.01", "--no-refine", "--limit", "1")
LONG, DEEP, NINES = "a" * 5000, "a/" * 3000 + "x", "9" * 400


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("show", LONG), 2),
        (("show", "1" * 400), 2),
        (("show", NINES), 2),
        (("show", f"{DEEP}.json"), 2),
        (("show", "~nosuch/x"), 2),
        (("measure", LONG, "--stroke", 1), 2),
        (("classify", LONG), 2),
        (("classify", ""), 2),
        (("plate", LONG), 5),
        (("plate", "II.xy", "--out", f"{DEEP}.svg"), 2),
        (("export", "--out", LONG), 2),
        (("export", "--out", DEEP), 2),
        (("census", "--db", LONG), 4),
        (("census", "--db", DEEP), 4),
        (("census", "--db", "~nosuch/x/y.db"), 4),
        (("plugins", "--plugins", LONG), 5),
        (("plugins", "--plugins", "~nosuch/x"), 5),
        ((*LINE[:2], "--stroke", "1e305", "--deviation", "1e300"), 2),
        ((*LINE, "--effort", NINES), 2),
        ((*LINE, "--limit", NINES), 2),
        (("build", "--seed", NINES), 2),
        (("show", "1", "--level", NINES), 2),
        (("show", "watt", "--stroke", "1e308"), 2),
    ],
    ids=lambda value: " ".join(map(str, value))[:40] if isinstance(value, tuple) else "",
)
def test_names_and_numbers_that_are_too_long_are_one_line(
    run: Run, small_db: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: Any, code: int
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CATALOGUE_DB", str(small_db))
    done = run(*arguments)
    assert done.code == code
    assert len(done.line) < 1100
    assert not [*tmp_path.iterdir()]


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [("--help",), ("plugins",), ("export",), LINE, (*LINE, "--format", "json")])
def test_output_to_a_full_device_is_one_line(environment: dict[str, str], small_db: Path, arguments: Any) -> None:
    """Also at the end, when what was kept back is written."""
    command = [sys.executable, "-m", "catalogue", *arguments]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            command, env={**environment, "CATALOGUE_DB": str(small_db)}, stdout=full, stderr=subprocess.PIPE, text=True,
            check=False, timeout=120,
        )  # fmt: skip
    told = done.stderr.removeprefix("searching ...\n")  # on a slow machine
    assert (done.returncode, told.count("\n")) == (2, 1)
    assert "No space left on device" in told


@pytest.mark.slow
def test_output_that_is_closed_is_no_error(environment: dict[str, str]) -> None:
    """As in ``catalogue schema >&-``."""
    shell = f"{sys.executable} -m catalogue schema --format csv >&-"
    done = subprocess.run(["sh", "-c", shell], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.slow
def test_a_device_is_not_replaced_by_a_file(run: Run, small_db: Path, tmp_path: Path) -> None:
    os.mkfifo(pipe := tmp_path / "pipe")
    done = run("export", "--out", pipe, "--force", "--db", small_db)
    assert done.code == 2
    assert "a folder or a device is there" in done.line
    done = run(*LINE, "--save", pipe, "--force", "--db", small_db)
    assert done.code == 2
    assert "a folder or a device is there" in done.err
    assert pipe.is_fifo()
