"""The first use: one builds, the others wait, whoever is killed."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing, suppress
from pathlib import Path

import pytest

import catalogue

pytestmark = pytest.mark.slow

ROOT = Path(catalogue.__file__).parents[1]
#: A default of a hundred guides of five series, with a pause before the first block that is written and another before
#: the others, and as little patience with a process that is dead.
CODE = """
import sys, time, catalogue
import catalogue.progress
from catalogue.populate import fill as filling, first_use
plan, write = filling.plan, filling.write_batch
pauses = sys.argv[2:]
def slowly(*given):
    time.sleep(float(pauses[0]))
    del pauses[:-1]
    write(*given)
few = ["I.GG", "I.yy", "II.xy", "II*.xy", "IV.l"]
filling.plan = lambda database, registry, _, *how: plan(database, registry, few, *how)
filling.write_batch = slowly
filling.FILL = filling.FILL._replace(guides=100)
first_use.FIRST_USE = first_use.FIRST_USE._replace(still=10.0)
catalogue.progress.PATIENCE = 0.1
with catalogue.open(sys.argv[1]) as cat:
    print(cat.complete, len(cat.guides()))
"""
WAITS = "another process builds the catalogue: waiting for it ..."


def first_user(file: Path, first: float, others: float) -> subprocess.Popen[str]:
    """Open a catalogue that is not built yet, and pause before blocks are written [s]."""
    command = [sys.executable, "-c", CODE, str(file), str(first), str(others)]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def has_block(file: Path) -> bool:
    if not file.exists():
        return False
    with closing(sqlite3.connect(f"{file.as_uri()}?mode=ro", uri=True)) as opened, suppress(sqlite3.OperationalError):
        return bool(opened.execute("SELECT count(*) FROM batch").fetchone()[0])
    return False  # there is no table yet


def test_several_first_users_at_once_have_the_same_catalogue(tmp_path: Path) -> None:
    every = [first_user(tmp_path / "some.db", 0.2, 0.2) for _ in range(2)]
    done = [one.communicate(timeout=300) for one in every]
    assert all("Traceback" not in told for _, told in done), done
    assert len({answer for answer, _ in done}) == 1
    assert done[0][0].startswith("True ")
    told = "".join(told for _, told in done)
    assert WAITS in told


@pytest.mark.skipif(os.name == "nt", reason="Windows kills otherwise")
def test_a_first_user_goes_on_with_what_a_killed_one_has_begun(tmp_path: Path) -> None:
    file = tmp_path / "some.db"
    first = first_user(file, 0.0, 4.0)
    while not has_block(file):
        time.sleep(0.05)
        assert first.poll() is None
    second = first_user(file, 6.0, 0.0)  # meanwhile the first writes the block with which the second would begin
    assert second.stderr is not None
    assert any(WAITS in line for line in iter(second.stderr.readline, ""))
    assert first.poll() is None
    first.send_signal(signal.SIGKILL)
    first.communicate()
    answer, told = second.communicate(timeout=300)
    assert answer.startswith("True "), told
