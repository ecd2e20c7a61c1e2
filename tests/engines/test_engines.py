"""Engines run the same tasks to the same results, whatever becomes of their workers."""

from __future__ import annotations

import math
import operator
import os
import signal
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Future
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from catalogue.engines import Begin, Engine, engine
from catalogue.errors import InvalidRequest, MissingExtra, PluginError, WorkerKilled

NAMES = ["serial", "processes:2", pytest.param("dask:2", marks=pytest.mark.slow)]


@pytest.fixture(params=NAMES)
def pool(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Engine]:
    """Return an engine, whose workers stand in a folder of their own."""
    before = Path.cwd()
    with engine(request.param, Begin(os.chdir, (str(tmp_path),))) as started:
        yield started
    os.chdir(before)


def test_an_engine_begins_in_its_workers_and_returns_results(pool: Engine, tmp_path: Path) -> None:
    futures = [pool.submit(math.factorial, k) for k in range(20)]
    assert [future.result(60) for future in futures] == [math.factorial(k) for k in range(20)]
    assert Path(pool.submit(os.getcwd).result(60)) == tmp_path
    assert pool.count >= 1


def test_a_task_may_be_a_partial_function(pool: Engine) -> None:
    assert pool.submit(partial(operator.truediv, 6), 2).result(60) == 3


@pytest.mark.parametrize(
    "task",
    [operator.methodcaller("bit_length"), partial(operator.methodcaller("bit_length")), int.bit_length, (5).__rpow__],
)
def test_a_task_may_be_any_object_that_is_called(pool: Engine, task: Any) -> None:
    assert pool.submit(task, 2).result(60) == task(2)


class Unreadable(Exception):
    """An error that can be pickled, but not made again."""

    def __init__(self, one: str, other: str) -> None:
        super().__init__(f"{one} and {other}")


def failing() -> None:
    print("a task may print")
    raise Unreadable("this", "that")


@pytest.mark.slow
def test_an_error_that_cannot_be_made_again_is_told(pool: Engine) -> None:
    with pytest.raises(Exception, match="this and that"):
        pool.submit(failing).result(60)
    assert pool.submit(operator.add, 1, 2).result(60) == 3


def test_errors_of_tasks_are_raised_as_they_are(pool: Engine) -> None:
    with pytest.raises(ZeroDivisionError):
        pool.submit(operator.truediv, 1, 0).result(60)
    assert pool.submit(operator.add, 1, 2).result(60) == 3


@pytest.mark.slow
def test_a_task_whose_process_is_killed_is_tried_again() -> None:
    with engine("processes:1") as pool:
        first = pool.submit(os.getpid).result(60)
        waiting = pool.submit(time.sleep, 1.0)
        time.sleep(0.3)
        os.kill(first, signal.SIGKILL)
        assert waiting.result(60) is None
        assert pool.submit(os.getpid).result(60) != first


@pytest.mark.slow
def test_a_task_that_kills_each_process_is_named() -> None:
    with engine("processes:1") as pool:
        with pytest.raises(WorkerKilled, match=r"^the worker process of raise_signal was killed by SIGKILL, 2 times"):
            pool.submit(signal.raise_signal, signal.SIGKILL).result(60)
        assert pool.submit(operator.add, 1, 2).result(60) == 3


@pytest.mark.slow
def test_a_task_whose_worker_of_a_cluster_is_killed_is_tried_again() -> None:
    with engine("dask:2") as pool:
        first = pool.submit(os.getpid).result(60)
        futures: list[Future[Any]] = [pool.submit(time.sleep, 0.5) for _ in range(8)]
        time.sleep(0.4)
        os.kill(first, signal.SIGKILL)
        assert [future.result(60) for future in futures] == [None] * 8
        with pytest.raises(WorkerKilled, match="has killed its worker each time"):
            pool.submit(signal.raise_signal, signal.SIGKILL).result(60)


@pytest.mark.slow
def test_what_does_not_begin_is_told_for_each_task() -> None:
    with engine("processes:1", Begin(os.chdir, ("/nowhere",))) as pool:
        for _ in range(2):
            with pytest.raises(FileNotFoundError):
                pool.submit(os.getpid).result(60)


@pytest.mark.slow
def test_a_task_that_takes_too_long_is_ended() -> None:
    with engine("processes:1", limit=3) as pool:
        with pytest.raises(PluginError, match=r"^sleep takes longer than 3 s$"):
            pool.submit(time.sleep, 60).result(60)
        assert pool.submit(operator.add, 1, 2).result(60) == 3


@pytest.mark.slow
def test_what_cannot_be_pickled_is_told_and_the_worker_goes_on() -> None:
    with engine("processes:1") as pool:
        with pytest.raises(Exception, match="pickle"):
            pool.submit(operator.add, lambda: 0, 1).result(60)
        with pytest.raises(PluginError, match="pickle"):
            pool.submit(open, os.devnull).result(60)
        assert pool.submit(operator.add, 1, 2).result(60) == 3


@pytest.mark.slow
def test_tasks_and_results_of_unknown_modules_are_told_and_the_worker_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A module that was imported here is gone when the worker looks for it."""
    (tmp_path / "passing.py").write_text("class Mark:\n    pass\n\ndef mark():\n    return Mark()\n")
    with engine("processes:1") as pool:
        monkeypatch.syspath_prepend(tmp_path)
        task = __import__("passing").mark
        with engine("processes:1") as knowing:
            assert type(knowing.submit(task).result(60)).__name__ == "Mark"
            monkeypatch.delattr("passing.Mark")
            with pytest.raises(PluginError, match="the result of mark cannot be read here"):
                knowing.submit(task).result(60)
            assert knowing.submit(operator.add, 1, 2).result(60) == 3
        first = pool.submit(os.getpid)
        (tmp_path / "passing.py").unlink()
        with pytest.raises(PluginError, match=r"a worker cannot import a task.*passing"):
            pool.submit(task).result(60)
        assert pool.submit(os.getpid).result(60) == first.result(60)


@pytest.mark.parametrize("name", ["threads", "serial:2", "processes:0", "processes:many", "", 3])
def test_names_of_no_engine_are_refused(name: Any) -> None:
    with pytest.raises(InvalidRequest):
        engine(name)


def test_a_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtra, match=r"mechanism-catalogue\[dask\]"):
        engine("dask")
