"""Worker processes: what ends one is said, and nothing else of the caller or of a plugin reaches them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from catalogue.errors import PluginError
from catalogue.plugin.registry import Registry
from catalogue.populate.workers import Workers

GOOD = ("T.few", "four-bar general", 0, 0, 64, "few", "1")


def bad(code: str) -> tuple[str, str, int, int, int, str, str]:
    return code, "four-bar general", 0, 0, 64, "rude", "1"


@pytest.mark.slow
def test_worker_that_dies_is_named_and_replaced(rude: Registry) -> None:
    with Workers(1, rude.folders) as pool:
        for code, end in (("R.ends", "ended with exit code 7"), ("R.killed", "was killed by SIGKILL")):
            with pytest.raises(PluginError, match=f"^the process that makes {code} {end}$"):
                pool.submit(*bad(code)).result()
            assert pool.submit(*GOOD).result().count > 0


@pytest.mark.slow
def test_error_of_a_plugin_is_one_line_and_the_worker_goes_on(rude: Registry) -> None:
    with Workers(1, rude.folders) as pool:
        with pytest.raises(PluginError, match=r"^ZeroDivisionError: first line$"):
            pool.submit(*bad("R.raises")).result()
        assert pool.submit(*GOOD).result().count > 0


@pytest.mark.slow
def test_plugin_may_print_and_read(rude: Registry, capfd: pytest.CaptureFixture[str]) -> None:
    with Workers(1, rude.folders) as pool:
        assert pool.submit(*bad("R.prints")).result().count > 0
        assert pool.submit(*GOOD).result().count > 0
    output, messages = capfd.readouterr()
    assert output == ""
    assert "what a plugin prints" in messages
    assert "past the buffer" in messages


@pytest.mark.slow
def test_leaving_the_pool_ends_its_processes(
    rude: Registry, environment: dict[str, str], monkeypatch: pytest.MonkeyPatch, all_gone: Callable[[float], None]
) -> None:
    for name in ("CATALOGUE_PLUGINS", "TEST_LOCKS"):
        monkeypatch.setenv(name, environment[name])
    with Workers(2, rude.folders) as pool:
        assert all(future.result().count for future in [pool.submit(*GOOD) for _ in range(4)])
        with pytest.raises(AssertionError, match="still run"):
            all_gone(0.1)
    all_gone(1)
    with pytest.raises(KeyboardInterrupt), Workers(2, rude.folders) as pool:  # noqa: PT012, the pool is what is interrupted
        futures = [pool.submit(*GOOD) for _ in range(40)]
        futures[0].result()
        raise KeyboardInterrupt
    all_gone(1)
    assert futures[-1].cancelled()


SCRIPT = """
import catalogue
from pathlib import Path
log = Path("imports.txt")
log.write_text((log.read_text() if log.exists() else "") + __name__)
with catalogue.open("some.db", build=False) as cat:
    print(cat.build(count=600, series=["T.few"], processes=2).guides)
"""


@pytest.mark.slow
def test_script_needs_no_guard_and_its_folder_hides_no_module(tmp_path: Path, environment: dict[str, str]) -> None:
    (tmp_path / "script.py").write_text(SCRIPT)
    # a worker must not find these, which stand in the folder where it is started, but not beside the script
    (tmp_path / "here").mkdir()
    for name in ("numpy", "catalogue", "pickle"):
        (tmp_path / "here" / f"{name}.py").write_text("raise ImportError('the wrong one')")
    run = subprocess.run(
        [sys.executable, "../script.py"], cwd=tmp_path / "here", env=environment, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    assert int(run.stdout) >= 600
    assert (tmp_path / "here" / "imports.txt").read_text() == "__main__"
