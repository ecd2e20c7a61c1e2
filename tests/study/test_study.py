"""Studies: monotone, the same on every engine and after a kill, in a file that can be carried elsewhere."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext

import catalogue
from catalogue import Catalogue, DatabaseError, InvalidRequest, Request, StraightLine, Study
from catalogue.guides.codes import code_of
from catalogue.problem.order import Order
from catalogue.study import run as running
from catalogue.study import task
from catalogue.study.models import Base
from catalogue.study.results_file import ResultsFile
from catalogue.study.task import Done

LARGE = [-150, -100, 250, 100]
BASE: dict[str, Any] = {"stroke": 150, "unit": "mm", "limit": 2}
ROWS: list[dict[str, Any]] = [
    {"deviation": 0.2, "fixed_pivots_in": LARGE},
    {"deviation": 0.5, "fixed_pivots_in": LARGE},
    {"deviation": 0.5, "fixed_pivots_in": LARGE, "max_size": 149, "pins_only": True},  # smaller than the path
    {"deviation": 0.2, "fixed_pivots_in": LARGE, "min_transmission": 50},
    {"deviation": 0.5, "fixed_pivots_in": LARGE, "min_transmission": 50},
    {"deviation": 0.5},
]  # fmt: skip


def requests() -> list[Request]:
    return [Request.from_dict({**BASE, **row}) for row in ROWS]


@pytest.fixture(scope="session")
def chart(small: Catalogue, tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Return a study of six requests, one without an answer, run in this process."""
    return Study(requests(), tmp_path_factory.mktemp("study") / "chart.study").run(small, engine="serial")


def tables(study: Study) -> tuple[str, str]:
    return study.to_pandas().to_csv(), study.answers().to_csv()


@pytest.mark.slow
def test_no_cell_is_worse_than_the_answer_to_a_tighter_one(chart: Study) -> None:
    """Each answer is judged by the ranking of the looser request."""
    cells = {number: chart[number] for number in range(1, len(chart) + 1)}
    pairs = 0
    for index, below, _ in Order.of([cell.request for cell in cells.values()]).tighter():
        looser = cells[index + 1]
        for other in below:
            if cells[int(other) + 1].records:
                pairs += 1
                text = looser.request.to_json()
                own, its = (task.costs(text, [one.records[0]])[0] for one in (looser, cells[int(other) + 1]))
                assert own <= its + running.STUDY.worse
    assert pairs >= 7


@pytest.mark.slow
def test_several_requests_are_answered_as_in_the_first_round_of_a_study(chart: Study, small: Catalogue) -> None:
    """In the order given, and equal ones once."""
    wanted = requests()[::-1]
    found = small.find_many([*wanted, wanted[0]])
    assert found[-1] is found[0]
    assert [one.request for one in found[:-1]] == wanted
    file = ResultsFile(chart.path)
    first = file.records(dict.fromkeys(file.of_round(0), 0))
    assert [[one.code for one in answers] for answers in found[-2::-1]] == [
        [code_of(text) for text in first[number]] for number in range(1, len(chart) + 1)
    ]
    path: Any = StraightLine(150, 0.1)
    with pytest.raises(InvalidRequest, match="wants Request objects, not StraightLine"):
        small.find_many([path])


@pytest.mark.slow
def test_cells_have_answers_that_meet_their_request_or_advice(chart: Study) -> None:
    for number in range(1, len(chart) + 1):
        cell = chart[number]
        if cell.status == "answers":
            assert cell.answers
            assert all(one.deviation <= cell.request.path.deviation for one in cell.answers)
            assert all(one.min_transmission >= cell.request.constraints.min_transmission for one in cell.answers)
        else:
            assert cell.reason
            assert cell.advice.alternatives
            assert {one.option for one in cell.advice.alternatives[0]} == {"max_size", "pins_only"}
    assert [chart[k].status for k in range(1, 7)] == ["answers", "answers", "none", "answers", "answers", "answers"]


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["processes:2", "dask:2"])
def test_the_table_is_the_same_on_every_engine(chart: Study, small: Catalogue, tmp_path: Path, engine: str) -> None:
    states: list[running.State] = []
    other = Study(requests(), tmp_path / "other.study").run(small, engine=engine, report=states.append)
    assert tables(other) == tables(chart)
    assert states[-1].done == states[-1].wanted
    assert other.complete


SCRIPT = """
import catalogue, sys
from catalogue import Request, Study
requests = [Request.from_dict(one) for one in {rows!r}]
def report(state):
    print(state.round, state.done, flush=True)
with catalogue.open({db!r}) as cat:
    Study(requests, {file!r}).run(cat, engine={engine!r}, report=report)
"""


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["serial", "processes:2"])
def test_a_study_that_is_killed_goes_on_and_ends_with_the_same_table(
    chart: Study, small_db: Path, tmp_path: Path, engine: str
) -> None:
    """It is killed after each few results, again and again."""
    file = tmp_path / "killed.study"
    script = SCRIPT.format(rows=[{**BASE, **row} for row in ROWS], file=str(file), db=str(small_db), engine=engine)
    environment = {**os.environ, "PYTHONPATH": str(Path(catalogue.__file__).parents[1])}
    kills = 0
    while True:
        with subprocess.Popen(
            [sys.executable, "-c", script], env=environment, stdout=subprocess.PIPE, text=True
        ) as process:
            assert process.stdout is not None
            for line, _ in enumerate(process.stdout, 1):
                if line == 2 and kills < 2:
                    time.sleep(0.1)
                    process.send_signal(signal.SIGKILL)
                    kills += 1
        if process.returncode == 0:
            break
        assert process.returncode == -signal.SIGKILL
    assert kills >= 2
    assert tables(Study.open(file)) == tables(chart)


@pytest.mark.slow
def test_a_request_that_kills_its_worker_becomes_a_row(
    small: Catalogue, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its worker kills itself for one of the requests."""
    (tmp_path / "deadly.py").write_text(
        "import os, signal\nfrom catalogue.study import task\n"
        "def answer(text, starts, **how):\n"
        "    if '0.4' in text:\n        os.kill(os.getpid(), signal.SIGKILL)\n"
        "    return task.answer(text, starts, **how)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    deadly: Any = __import__("deadly")
    monkeypatch.setattr("catalogue.study.run.task.answer", deadly.answer)
    base = {"stroke": 150, "limit": 1, "refine": False}
    study = Study.grid(base, tmp_path / "x.study", deviation=[0.3, 0.4, 0.5]).run(small, engine="processes:1")
    assert [*study.to_pandas()["status"]] == ["answers", "failed", "answers"]
    assert "killed by SIGKILL, 2 times" in study[2].reason


@pytest.mark.slow
def test_answers_are_found_by_code_where_no_catalogue_is(chart: Study, tmp_path: Path) -> None:
    shutil.copy(chart.path, tmp_path / "carried.study")
    carried = Study.open(tmp_path / "carried.study")
    table = carried.answers()
    one = carried.answer(table["code"][0])
    assert one.size == table["size"][0]
    assert one == chart[int(table["number"][0])].answers[0]
    with pytest.raises(InvalidRequest, match="has no answer"):
        carried.answer("abcdefg")
    assert len(table) == chart.to_pandas()["answers"].sum()


@pytest.mark.slow
def test_requests_may_be_added(chart: Study, small: Catalogue, tmp_path: Path) -> None:
    shutil.copy(chart.path, tmp_path / "more.study")
    looser = Request.from_dict({**BASE, "deviation": 1.0})
    more = Study([looser, chart[6].request], tmp_path / "more.study")
    assert len(more) == 7
    assert not more.complete
    assert more[7].status == "open"
    more.run(small, engine="serial")
    assert tables(more)[0].splitlines()[1] == tables(chart)[0].splitlines()[1]
    own, its = (task.costs(looser.to_json(), [more[k].records[0]])[0] for k in (7, 6))
    assert own <= its + running.STUDY.worse


@pytest.mark.slow
def test_a_study_belongs_to_one_catalogue(small: Catalogue, tmp_path: Path) -> None:
    study = Study([Request.of(StraightLine(150, 0.5), limit=1, refine=False)], tmp_path / "x.study")
    study.run(small, engine="serial")
    shutil.copy(small.database.path, tmp_path / "other.db")
    with catalogue.open(tmp_path / "other.db") as other:
        other.database.set_setting("count", "7")
        with pytest.raises(DatabaseError, match="results from another catalogue"):
            study.run(other, engine="serial")


@pytest.mark.slow
def test_requests_that_take_no_starts_are_asked_alone(small: Catalogue, tmp_path: Path) -> None:
    base = {"stroke": 150, "limit": 1, "slots": True, "refine": False}
    study = Study.grid(base, tmp_path / "x.study", deviation=[0.3, 0.5]).run(small, engine="serial")
    assert [*study.to_pandas()["status"]] == ["answers", "answers"]


def test_a_catalogue_is_known_by_its_digest_and_copied_where_it_is_missing(
    small: Catalogue, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(task, "user_folder", lambda: tmp_path)
    begin = task.begin(small)
    path, digest, plugins = begin.arguments
    assert task.holds(path, digest)
    gone = str(tmp_path / "gone.db")
    assert not task.holds(gone, digest)
    with pytest.raises(DatabaseError, match="is not on this machine"):
        begin.function(gone, digest, plugins)
    task.receive(digest, Path(path).read_bytes())
    assert task.holds(gone, digest)
    begin.function(gone, digest, plugins)


# -- the file ------------------------------------------------------------
def test_the_tables_are_those_of_the_models(tmp_path: Path) -> None:
    file = ResultsFile(tmp_path / "x.study")
    with file.database.engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []


def test_the_last_round_counts_and_rounds_before_are_told(tmp_path: Path) -> None:
    file = ResultsFile(tmp_path / "x.study")
    file.add(
        [Request.of(StraightLine(150, 0.5)), Request.of(StraightLine(150, 0.6)), Request.of(StraightLine(150, 0.5))]
    )
    assert len(file.requests()) == 2
    file.write([(1, 0, Done(reason="none")), (2, 0, Done(('{"a": 1}', '{"b": 2}'), cost=1.0))])
    file.write([(1, 2, Done(('{"c": 3}',), cost=2.0))])
    assert file.done() == {1: (2, "answers", 2.0), 2: (0, "answers", 1.0)}
    assert file.done(before=2)[1] == (0, "none", None)
    assert file.of_round(2) == {1}
    assert file.records({1: 2, 2: 0}, 1) == {1: ['{"c": 3}'], 2: ['{"a": 1}']}
    assert [row.answers for row in file.last()] == [1, 2]


def test_other_databases_are_refused(small_db: Path, tmp_path: Path, chart_file: Callable[[], Path]) -> None:
    with pytest.raises(DatabaseError, match="not one of a study"):
        ResultsFile(small_db)
    with pytest.raises(DatabaseError, match="not one of the catalogue"), closing(catalogue.open(chart_file())):
        pass
    with pytest.raises(DatabaseError, match="does not exist"):
        Study.open(tmp_path / "none.study")


@pytest.fixture
def chart_file(tmp_path: Path) -> Callable[[], Path]:
    return lambda: ResultsFile(tmp_path / "new.study").path


# -- the command ------------------------------------------------------------
@pytest.mark.slow
def test_the_command_asks_a_file_and_writes_a_table(small_db: Path, tmp_path: Path) -> None:
    (file := tmp_path / "chart.toml").write_text(
        "stroke = 150\nunit = 'mm'\nlimit = 1\nrefine = false\n[grid]\ndeviation = [0.3, 0.5]\n"
    )
    command = [sys.executable, "-m", "catalogue", "study", str(file), "--db", str(small_db), "--engine", "serial",
               "--table", str(tmp_path / "chart.csv")]  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": str(Path(catalogue.__file__).parents[1])}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "2 requests: 2 with answers" in done.stdout
    assert len((tmp_path / "chart.csv").read_text().splitlines()) == 3
    assert (tmp_path / "chart.study").exists()
    again = subprocess.run([*command, "--force"], env=environment, capture_output=True, text=True, check=False)
    assert again.stdout == done.stdout
    wrong = subprocess.run([*command[:4], str(tmp_path / "none.csv")], env=environment, capture_output=True, text=True)
    assert (wrong.returncode, len(wrong.stderr.splitlines())) == (2, 1)
