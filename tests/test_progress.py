"""What takes long shows that it goes on: a bar on a terminal, a line elsewhere."""

from __future__ import annotations

import io
import time
from collections.abc import Callable

import pytest

from catalogue import progress
from catalogue.progress import Progress, busy, shown


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def taken(monkeypatch: pytest.MonkeyPatch) -> Callable[[io.StringIO], None]:
    """Let a stream be standard error, for as long as a test runs."""
    monkeypatch.setenv("TERM", "xterm")
    for name in ("NO_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(progress, "PATIENCE", 0.01)
    return lambda stream: monkeypatch.setattr("sys.stderr", stream)


def test_a_bar_appears_after_a_while(taken: Callable[[io.StringIO], None]) -> None:
    taken(stream := Terminal())
    with busy("searching"):
        end = time.monotonic() + 10
        while "searching" not in stream.getvalue() and time.monotonic() < end:
            time.sleep(0.01)
    assert "searching" in stream.getvalue()


def test_one_line_appears_where_nobody_looks(taken: Callable[[io.StringIO], None]) -> None:
    taken(stream := io.StringIO())
    with busy("searching"):
        time.sleep(0.3)
    assert stream.getvalue() == "searching ...\n"


def test_a_build_tells_where_nobody_looks_how_far_it_is(
    taken: Callable[[io.StringIO], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "AGAIN", 0.0)
    taken(stream := io.StringIO())
    with shown(quiet=False, label="building") as report:
        time.sleep(0.3)
        report(Progress(guides=3, wanted=9))
        report(Progress(guides=9, wanted=9, rows=9, seconds=1.0))
    lines = stream.getvalue().splitlines()
    assert lines[:3] == ["building ...", "building: 3 of 9 guides ...", "building: 9 of 9 guides ..."]
    assert lines[3].startswith("building: 9 guides, 9 rows in 1.0 s")


def test_a_build_that_is_refused_at_once_says_nothing(
    taken: Callable[[io.StringIO], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    taken(stream := io.StringIO())
    monkeypatch.setattr(progress, "PATIENCE", 10.0)
    with shown(quiet=False, label="building"):
        pass
    assert stream.getvalue() == ""


def test_no_bar_appears_for_what_is_soon_done(
    taken: Callable[[io.StringIO], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    taken(stream := Terminal())
    monkeypatch.setattr(progress, "PATIENCE", 10.0)
    with busy("searching"):
        time.sleep(0.1)
    assert stream.getvalue() == ""


@pytest.mark.slow
def test_an_interruption_passes_and_ends_the_bar(taken: Callable[[io.StringIO], None]) -> None:
    def interrupted() -> None:
        with busy("searching"):
            time.sleep(0.3)
            raise KeyboardInterrupt

    taken(stream := Terminal())
    with pytest.raises(KeyboardInterrupt):
        interrupted()
    written = stream.getvalue()
    time.sleep(0.3)
    assert stream.getvalue() == written
