"""The starts of a stage: no stored guide twice, and those that a build made meanwhile."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

import catalogue
from catalogue import Catalogue, StraightLine
from catalogue.errors import DatabaseError
from catalogue.kinematics.types import Indices
from catalogue.problem.constraints import Constraints
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking
from catalogue.search import retrieve
from catalogue.search.starts import MAX_READS, SearchReport, Starts
from catalogue.store import Database

pytestmark = pytest.mark.slow

LINE = StraightLine(1, 1e-3)


@pytest.mark.slow
def test_no_stored_guide_is_a_start_twice(small: Catalogue) -> None:
    """But those of the short phase, which are starts again; and as many are given as are asked for, of each kind."""
    problem, report = Problem.of(LINE, Constraints(families=["four-bar"], max_size=4.0), Ranking()), SearchReport()
    starts, each = Starts(problem, small.database, report), 60
    short = starts.short(30)
    assert short is not None
    assert 0 < len(short) <= 30
    gathered = [starts.broad(0, each, None), starts.broad(1, each, None)]
    stored: list[int] = []
    for batch, kinds in zip(gathered, (2, 2), strict=True):
        assert batch is not None
        assert len(batch) <= kinds * each
        stored += [i for i in batch.origin.id.tolist() if i >= 0]
    assert len(stored) > 40
    assert len(set(stored)) == len(stored)
    assert set(stored) <= set(starts.taken.tolist())
    assert set(short.origin.id.tolist()) & set(stored)
    assert report.measured >= sum(len(batch) for batch in gathered if batch is not None)


@pytest.mark.slow
@pytest.mark.parametrize("times", [1, MAX_READS])
def test_what_a_build_replaces_meanwhile_is_read_again(
    small_db: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, times: int
) -> None:
    """Between the list of stored guides and their numbers the first of them is gone, once or every time."""
    path, read = Path(shutil.copy(small_db, tmp_path / "built.db")), retrieve._read_guides
    gone: list[int] = []

    def replaced(problem: Problem, database: Database, reaches: retrieve.Reaches, chosen: Indices) -> Any:
        if len(gone) < times:
            gone.append(int(reaches.guide[chosen[0]]))
            with closing(sqlite3.connect(path)) as other, other:
                other.execute("DELETE FROM reach WHERE guide_id = ?", (gone[-1],))
                other.execute("PRAGMA user_version = 0")  # its seal
        return read(problem, database, reaches, chosen)

    monkeypatch.setattr(retrieve, "_read_guides", replaced)
    with catalogue.open(path, build=False) as opened:
        if times == MAX_READS:
            with pytest.raises(DatabaseError, match="has changed while it was read"):
                opened.find(LINE, refine=False, limit=5)
            return
        found = opened.find(LINE, refine=False, limit=5)
    assert found
    assert gone[0] not in {c.id for c in found}
