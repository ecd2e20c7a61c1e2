"""A build that is killed at ten moments, in whole or in part: finished later it is what it would have been.

A sample of `tests/attacks/kills.py`, which says more.
"""

from __future__ import annotations

import runpy
import sqlite3
from contextlib import closing
from itertools import cycle
from pathlib import Path
from types import SimpleNamespace

import pytest

KILLS = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[1] / "attacks" / "kills.py")))
COUNT = 200


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[str], float]:
    found: tuple[list[str], float] = KILLS.undisturbed(tmp_path_factory.mktemp("whole"), COUNT)
    return found


@pytest.mark.slow
def test_killed_again_and_again_and_finished_is_undisturbed(tmp_path: Path, whole: tuple[list[str], float]) -> None:
    content, duration = whole
    kills = (("SIGKILL", 0.3), ("SIGTERM", 0.6), ("SIGINT", 0.7), ("SIGKILL", 0.8))
    moments = [(signal, whom, part * duration) for whom, (signal, part) in zip(cycle(KILLS.WHOM), kills, strict=False)]
    good, became = KILLS.disturbed(tmp_path, moments, COUNT, content)
    assert good, became
    with closing(sqlite3.connect(tmp_path / "some.db")) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert connection.execute("PRAGMA foreign_key_check").fetchall() == []
