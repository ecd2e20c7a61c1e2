"""Worker processes: what ends one is said, and nothing else of the caller or of a plugin reaches them."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import time
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue.engines.processes import Processes
from catalogue.engines.worker import receive, send
from catalogue.errors import PluginError, WorkerKilled
from catalogue.plugin.registry import Registry
from catalogue.populate.block import BLOCKS
from catalogue.populate.make import begin, make

pytestmark = pytest.mark.slow

GOOD = ("T.few", "four-bar general", 0, 0, 64, "few", "1")


def workers(count: int, registry: Registry) -> Processes:
    """Return worker processes as a build has them."""
    return Processes(count, begin(registry.folders), limit=BLOCKS.limit, tries=3)


def bad(code: str) -> tuple[str, str, int, int, int, str, str]:
    return code, "four-bar general", 0, 0, 64, "rude", "1"


def test_worker_that_dies_is_named_and_replaced(rude: Registry) -> None:
    with workers(1, rude) as pool:
        for code, end in (("R.ends", "ended with exit code 7"), ("R.aborts", "was killed by SIGABRT")):
            with pytest.raises(PluginError, match=f"^the worker process of {code} {end}$"):
                pool.submit(make, *bad(code)).result()
            assert pool.submit(make, *GOOD).result().count > 0


def test_block_whose_process_the_system_kills_is_tried_again(
    rude: Registry, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TEST_ONCE", str(tmp_path / "once"))
    with workers(1, rude) as pool:
        assert pool.submit(make, *bad("R.once")).result().count > 0
        assert (tmp_path / "once").exists()
        for code, end in (("R.killed", "the worker process of R.killed was killed by SIGKILL"),
                          ("R.greedy", "MemoryError")):  # fmt: skip
            with pytest.raises(WorkerKilled, match=f"^{end}, 3 times: free some memory, or use fewer processes$"):
                pool.submit(make, *bad(code)).result()
        assert pool.submit(make, *GOOD).result().count > 0


def test_endless_block_is_ended_and_named(rude: Registry) -> None:
    with workers(1, rude) as pool:
        assert pool.submit(make, *GOOD).result().count > 0
        pool.limit = 0.5
        with pytest.raises(PluginError, match=r"^R.endless takes longer than 0.5 s$"):
            pool.submit(make, *bad("R.endless")).result()


def test_worker_does_not_outlive_a_killed_build(
    tmp_path: Path, environment: dict[str, str], all_gone: Callable[[float], None]
) -> None:
    folders = [environment["CATALOGUE_PLUGINS"], str(Path(__file__).parent / "rude")]
    command = [sys.executable, "-m", "catalogue", "build", "--series", "R.endless", "--db", str(tmp_path / "some.db")]
    with subprocess.Popen(
        command, env={**environment, "CATALOGUE_PLUGINS": os.pathsep.join(folders)}, stderr=subprocess.PIPE
    ) as process:
        end = time.monotonic() + 60
        while len(list((tmp_path / "locks").iterdir())) < 2 and time.monotonic() < end:
            time.sleep(0.05)
        time.sleep(3)  # until the block has begun
        process.kill()
    all_gone(3)


def test_fewer_rows_than_parameters_are_refused(rude: Registry) -> None:
    shape = r"pivots have shape \(7, 2, 2, 3\).*n = 1024"
    with workers(1, rude) as pool, pytest.raises(PluginError, match=shape):
        pool.submit(make, *bad("R.few")).result()


def test_error_of_a_plugin_is_one_line_and_the_worker_goes_on(rude: Registry) -> None:
    with workers(1, rude) as pool:
        with pytest.raises(PluginError, match=r"^ZeroDivisionError: first line$"):
            pool.submit(make, *bad("R.raises")).result()
        assert pool.submit(make, *GOOD).result().count > 0


def test_plugin_may_print_and_read(rude: Registry, capfd: pytest.CaptureFixture[str]) -> None:
    with workers(1, rude) as pool:
        assert pool.submit(make, *bad("R.prints")).result().count > 0
        assert pool.submit(make, *GOOD).result().count > 0
    output, messages = capfd.readouterr()
    assert output == ""
    assert "what a plugin prints" in messages
    assert "past the buffer" in messages


def test_leaving_the_pool_ends_its_processes(
    rude: Registry, environment: dict[str, str], monkeypatch: pytest.MonkeyPatch, all_gone: Callable[[float], None]
) -> None:
    for name in ("CATALOGUE_PLUGINS", "TEST_LOCKS"):
        monkeypatch.setenv(name, environment[name])
    with workers(2, rude) as pool:
        assert all(future.result().count for future in [pool.submit(make, *GOOD) for _ in range(4)])
        with pytest.raises(AssertionError, match="still run"):
            all_gone(0.1)
    all_gone(1)
    with pytest.raises(KeyboardInterrupt), workers(2, rude) as pool:  # noqa: PT012, the pool is what is interrupted
        futures = [pool.submit(make, *GOOD) for _ in range(40)]
        futures[0].result()
        raise KeyboardInterrupt
    all_gone(1)
    assert futures[-1].cancelled()


@pytest.mark.parametrize("processes", [True, False])
def test_without_threads_blocks_are_made_one_after_the_other(
    rude: Registry, monkeypatch: pytest.MonkeyPatch, processes: bool
) -> None:
    """Also where no process starts, as in a browser: then in this one, which what a plugin raises does not end."""
    with workers(2, rude) as pool:
        expected = pool.submit(make, *GOOD).result()

    def no_thread(_: object) -> None:
        raise RuntimeError("can't start new thread")

    def no_process(*_: object, **__: object) -> None:
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr("threading.Thread.start", no_thread)
    if not processes:
        monkeypatch.setattr("subprocess.Popen", no_process)
    with workers(2, rude) as pool:
        asked = [pool.submit(make, *GOOD), pool.submit(make, *bad("R.raises")), pool.submit(make, *GOOD)]
        assert all(future.done() for future in asked)
        for future in asked[::2]:
            made = future.result()
            for name in ("batch", "mechanisms", "guides", "reaches"):
                columns, others = getattr(made, name), getattr(expected, name)
                assert columns.keys() == others.keys()
                for key, values in columns.items():
                    np.testing.assert_array_equal(values, others[key], err_msg=key)
        with pytest.raises(PluginError):
            asked[1].result()


def test_a_process_without_threads_makes_blocks() -> None:
    """It reads tasks where it makes blocks, and ends when its pipe closes."""
    code = (
        "import threading\n"
        "def no_thread(_): raise RuntimeError\n"
        "threading.Thread.start = no_thread\n"
        "from catalogue.engines.worker import main\n"
        "main()"
    )
    root = str(Path(catalogue.__file__).parents[1])
    asked = BytesIO()
    messages: tuple[Any, ...] = (
        (begin(()), BLOCKS.limit, 0),
        (make, ("I.GG", "four-bar general", 0, 0, 8, "i_gg", "1"), {}),
    )
    for message in messages:
        send(asked, pickle.dumps(message))
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=root, input=asked.getvalue(), capture_output=True, timeout=120, check=True
    )
    is_done, block = pickle.loads(receive(BytesIO(done.stdout)))
    assert is_done
    assert block.count == 8


@pytest.mark.slow
def test_a_process_that_makes_blocks_imports_no_database() -> None:
    code = "import sys, catalogue.engines.worker, catalogue.populate.make\n"
    code += "print({'sqlalchemy', 'alembic', 'pandas'} & {*sys.modules})"
    root = str(Path(catalogue.__file__).parents[1])
    done = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


SCRIPT = """
import catalogue
from pathlib import Path
log = Path("imports.txt")
log.write_text((log.read_text() if log.exists() else "") + __name__)
with catalogue.open("some.db", build=False) as cat:
    print(cat.build(count=600, series=["T.few"], processes=2).guides)
"""


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
