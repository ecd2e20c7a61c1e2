"""Answers of collections of many bars, by their codes, on the command line."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from catalogue.guides.codes import remember, save
from tests.plugins.test_answers_of_bars import answer

pytestmark = pytest.mark.slow


@pytest.mark.slow
@pytest.mark.parametrize("verb", ["show", "trace", "export", "sheet", "measure"])
def test_each_verb_takes_an_answer_by_its_code(
    run: Callable[..., Any], small_db: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, verb: str
) -> None:
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(tmp_path / "answers.db"))
    one = answer("six-bars", "watt-1")
    (code,) = remember([one])
    more: dict[str, list[Any]] = {
        "show": ["--plot", tmp_path / "a.svg"],
        "trace": ["--samples", 3],
        "export": ["--format", "csv", "--positions", 3],
        "sheet": ["--out", tmp_path / "a.pdf"],
        "measure": ["--stroke", 200, "--format", "json"],
    }
    done = run(verb, code, *more[verb], "--db", small_db)
    assert done.code == 0, done.err
    if verb in ("trace", "export"):
        rows = list(csv.DictReader(io.StringIO(done.out)))
        assert float(rows[0]["P x [mm]"]) == pytest.approx(20, abs=one.deviation + 1e-3)
    if verb == "measure":
        assert min(row["deviation"] for row in json.loads(done.out)) <= one.deviation * 1.01
    if verb in ("show", "sheet"):
        assert next(tmp_path.glob("a.*")).stat().st_size > 5000


@pytest.mark.slow
def test_saved_answers_are_taken_too(run: Callable[..., Any], small_db: Path, tmp_path: Path) -> None:
    one = answer("exact-cells", "peaucellier-lipkin")
    save([one], tmp_path / "answers.json")
    done = run("export", tmp_path / "answers.json", "--out", tmp_path / "a.dxf", "--db", small_db)
    assert done.code == 0, done.err
    assert "which is no planar guide" not in done.err
