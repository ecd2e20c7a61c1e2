"""Threads that cannot be started: what is asked is done one after the other, with equal results."""

from __future__ import annotations

import threading

import pytest

from catalogue import Catalogue, StraightLine
from catalogue.threads import Threads


@pytest.fixture
def no_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no thread start, as in a browser or where the table of processes is full."""

    def no_thread(_: object) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr("threading.Thread.start", no_thread)


def test_functions_run_in_other_threads_where_there_are_any() -> None:
    with Threads(2) as threads:
        found = threads.submit(threading.get_ident).result()
        assert found != threading.get_ident()
        assert [*threads.map(divmod, [7, 9], [2, 4])] == [(3, 1), (2, 1)]


@pytest.mark.usefixtures("no_threads")
def test_functions_run_at_once_where_no_thread_starts() -> None:
    seen: list[int] = []
    with Threads(2) as threads:
        asked = threads.submit(seen.append, 3)
        assert seen == [3]
        assert asked.result() is None
        assert threads.submit(threading.get_ident).result() == threading.get_ident()
        assert [*threads.map(divmod, [7, 9], [2, 4])] == [(3, 1), (2, 1)]
        failed = threads.submit(divmod, 1, 0)
        with pytest.raises(ZeroDivisionError):
            failed.result()


def test_what_an_earlier_thread_runs_is_done_where_no_further_one_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    begin = threading.Thread.start
    begun: list[threading.Thread] = []

    def one_thread(self: threading.Thread) -> None:
        if begun:
            raise RuntimeError("can't start new thread")
        begun.append(self)
        begin(self)

    monkeypatch.setattr("threading.Thread.start", one_thread)
    with Threads(4) as threads:
        assert [*threads.map(pow, range(50), [2] * 50)] == [k * k for k in range(50)]


@pytest.mark.slow
def test_a_search_without_threads_has_the_same_answers(small: Catalogue, request: pytest.FixtureRequest) -> None:
    line = StraightLine(150, 0.05)
    expected = small.find(line, limit=3, round_to=1.0)
    request.getfixturevalue("no_threads")
    found = small.find(line, limit=3, round_to=1.0)
    assert len(found) == 3
    assert [*found] == [*expected]
