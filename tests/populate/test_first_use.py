"""The first use: one builds, the others wait, whoever is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import catalogue

ROOT = Path(catalogue.__file__).parents[1]
#: A default of a hundred guides, and as little patience with one that is dead.
CODE = """
import sys, catalogue
import catalogue.populate.fill, catalogue.populate.first_use, catalogue.progress
catalogue.populate.fill.COUNT = 100
catalogue.populate.first_use.STILL = 5.0
catalogue.progress.PATIENCE = 0.1
with catalogue.open(sys.argv[1]) as cat:
    print(cat.complete, len(cat.guides()))
"""


def first_user(file: Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", CODE, str(file)]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.slow
def test_several_first_users_at_once_have_the_same_catalogue(tmp_path: Path) -> None:
    every = [first_user(tmp_path / "some.db") for _ in range(2)]
    done = [one.communicate(timeout=300) for one in every]
    assert all("Traceback" not in told for _, told in done), done
    assert len({answer for answer, _ in done}) == 1
    assert done[0][0].startswith("True ")
    told = "".join(told for _, told in done)
    assert "another process builds the catalogue: waiting for it ..." in told


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows kills otherwise")
def test_a_first_user_goes_on_with_what_a_killed_one_has_begun(tmp_path: Path) -> None:
    file = tmp_path / "some.db"
    first = first_user(file)
    while not file.exists() or file.stat().st_size < 100_000:
        time.sleep(0.05)
        assert first.poll() is None
    second = first_user(file)
    time.sleep(3.0)
    first.send_signal(signal.SIGKILL)
    first.communicate()
    answer, told = second.communicate(timeout=300)
    assert answer.startswith("True "), told
