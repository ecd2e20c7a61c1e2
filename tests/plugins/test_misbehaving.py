"""Plugins that misbehave are found, named, contained: a sample of `tests/attacks/misbehaving.py`."""

from __future__ import annotations

import os
import re
import runpy
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import catalogue.errors
from catalogue.cli import _interrupt_again
from catalogue.errors import PluginError, one_line, printable
from catalogue.foreign_code import foreign, uncounted
from catalogue.plugin.registry import Registry

ALL = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[1] / "attacks" / "misbehaving.py")))
KINDS = {kind.name: kind for kind in ALL.kinds()}
#: One that each of the defences holds against.
SAMPLE = [
    "error whose text exits", "error with markup", "BaseException", "KeyboardInterrupt", "prints when imported",
    "code of another plugin", "classify exits", "classify loops", "pivots close all files", "measure exits",
    "forks", "goes to another folder", "classify without end", "classify changes the curvature",
    "pivots write into parameters", "pivots fork and do not end",
]  # fmt: skip
#: What fails while it is loaded, asked or checked: that needs no process of its own.
LOADED = [
    kind for kind in KINDS.values()
    if kind.how == "classify" and kind.ends == ALL.LEFT_OUT and not re.search("classify|loop|fork|Ctrl-C", kind.name)
]  # fmt: skip


def test_there_are_a_hundred_kinds() -> None:
    assert len(KINDS) == len(list(ALL.kinds())) >= 100


@pytest.mark.slow
@pytest.mark.parametrize("name", SAMPLE)
def test_a_plugin_that_misbehaves_is_contained(name: str, tmp_path: Path) -> None:
    good, line = ALL.seen(KINDS[name], tmp_path / "mine")
    assert good, line


@pytest.mark.parametrize("kind", LOADED[::6], ids=lambda kind: kind.name)
def test_what_cannot_be_taken_from_a_plugin_is_a_record(kind: Any, tmp_path: Path) -> None:
    for name, text, hook in (("bad", kind.text, kind.hook), ("good", "CODE = 'X.good'", ALL.HOOK)):
        written = ALL.PLUGIN.format(text=text, hook=hook).encode("utf-8", "surrogatepass")
        (tmp_path / f"{name}.py").write_bytes(written)
    with pytest.warns(catalogue.errors.PluginWarning, match="^plugin bad .*bad.py. is left out: ") as caught:
        registry = Registry([str(tmp_path)])
    assert "X.good" in registry.series
    assert not {"X.bad", "X.0"} & registry.series.keys()
    assert str(caught[0].message).isprintable()
    assert len(str(caught[0].message)) < 1000


def test_whatever_is_raised_is_an_error_of_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    for error in (GeneratorExit(), SystemExit(0), StopIteration(), ValueError("\x1b[2J\nmore")):
        with pytest.raises(PluginError, match=f"^{type(error).__name__}") as caught, foreign("a plugin"):  # noqa: PT012
            print("aside")
            raise error
        assert str(caught.value).isprintable()
    assert capsys.readouterr().out == ""
    with pytest.raises(KeyboardInterrupt, match="plugin mine"), foreign("plugin mine"):
        raise KeyboardInterrupt


def test_the_current_folder_and_the_handler_of_ctrl_c_are_what_they_were(ctrl_c: Any) -> None:
    before = Path.cwd()
    with foreign("a plugin"):
        os.chdir("/")
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    assert Path.cwd() == before
    assert signal.getsignal(signal.SIGINT) is ctrl_c


@pytest.mark.slow
@pytest.mark.parametrize("swallowed", [1, 3])
@pytest.mark.usefixtures("ctrl_c")
def test_ctrl_c_is_repeated_until_it_is_heard(monkeypatch: pytest.MonkeyPatch, swallowed: int) -> None:
    monkeypatch.setattr("catalogue.foreign_code.LIMIT", 2.0)
    monkeypatch.setattr("catalogue.foreign_code.PAUSE", 0.2)
    with pytest.raises(PluginError, match=r"^it takes longer than 2 s$"), foreign("a plugin"):  # noqa: PT012
        for _ in range(swallowed):
            with suppress(KeyboardInterrupt):
                time.sleep(60)
        time.sleep(60)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="nothing forks here")
def test_a_process_that_a_plugin_forks_ends_at_the_door() -> None:
    with foreign("a plugin"):
        child = os.fork()
    if not child:
        os._exit(3)
    assert os.waitpid(child, 0)[1] == 0


@pytest.fixture
def ctrl_c(request: pytest.FixtureRequest) -> Iterator[Any]:
    """Let Ctrl-C be heard, or be handled as a test says, whatever the shell has the tests do."""
    handler = getattr(request, "param", signal.default_int_handler)
    before = signal.signal(signal.SIGINT, handler)
    yield handler
    signal.signal(signal.SIGINT, before)


@pytest.mark.slow
@pytest.mark.parametrize(
    "ctrl_c", [signal.default_int_handler, signal.SIG_IGN], ids=["heard", "ignored"], indirect=True
)
def test_what_takes_too_long_is_interrupted(monkeypatch: pytest.MonkeyPatch, ctrl_c: Any) -> None:
    """Also where Ctrl-C is ignored, as it is meanwhile and afterwards."""

    def endless() -> None:
        if ctrl_c is signal.SIG_IGN:
            signal.raise_signal(signal.SIGINT)
        time.sleep(60)

    monkeypatch.setattr("catalogue.foreign_code.LIMIT", 0.3)
    start = time.monotonic()
    with pytest.raises(PluginError, match=r"^it takes longer than 0.3 s$"), foreign("a plugin"):
        endless()
    assert 0.3 <= time.monotonic() - start < 5
    assert signal.getsignal(signal.SIGINT) is ctrl_c


@pytest.mark.slow
@pytest.mark.usefixtures("ctrl_c")
def test_work_of_the_program_inside_a_plugin_does_not_count_to_its_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("catalogue.foreign_code.LIMIT", 0.3)
    with foreign("a plugin"), uncounted():
        time.sleep(1.0)
    with pytest.raises(PluginError, match=r"^it takes longer than 0.3 s$"), foreign("a plugin"):  # noqa: PT012
        with uncounted():
            time.sleep(0.5)
        time.sleep(60)


def test_an_error_that_cannot_speak_is_still_told() -> None:
    class Mute(Exception):
        def __str__(self) -> str:
            raise SystemExit

    assert one_line(Mute()) == "an error that cannot say what it is"
    assert printable("a\x1b[2J\udcff\u202eκ") == "a\\x1b[2J\\udcff\\u202eκ"


@pytest.mark.slow
@pytest.mark.usefixtures("ctrl_c")
def test_ctrl_c_while_garbage_is_collected_is_not_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    class Garbage:
        def __del__(self) -> None:
            signal.raise_signal(signal.SIGINT)
            time.sleep(0.01)

    monkeypatch.setattr(sys, "unraisablehook", _interrupt_again)
    assert threading.current_thread() is threading.main_thread()
    Garbage()
    with pytest.raises(KeyboardInterrupt):
        time.sleep(60)
