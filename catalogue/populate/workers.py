"""Worker processes that make blocks.

They are started as ``python -m catalogue.populate.worker`` and talk over their pipes: unlike the
standard pools they do not import the caller's main module, so that a script needs no guard and a
notebook works.  They end when their pipe closes, also when this process is killed.  What a plugin
does to one is said; what the system kills is tried again.  Where no process can be started, in a
browser or with a full process table, blocks are made one after the other in this one.
"""

from __future__ import annotations

import os
import pickle  # nosec B403  # of what a process sends that was started here; no file is read by it
import signal
import subprocess  # nosec B404  # this Python, with this package
import sys
import threading
from collections.abc import Sequence
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import PluginError, WorkerKilled
from ..foreign_code import foreign
from ..plugin.registry import Registry
from ..threads import Threads
from .block import LIMIT, Block, block

#: How long a process that closed its pipe may take to end [s].
GRACE = 5.0
#: So often a block is tried whose process the system kills.
TRIES = 3
#: Signals by which a system, or who runs it, ends a process; by others it ends itself.
SYSTEM = ("SIGKILL", "SIGTERM", "SIGHUP", "SIGINT", "SIGXCPU")


class Workers:
    """A pool of `count` processes that load the plugins of `folders` and the usual ones."""

    def __init__(self, count: int, folders: Sequence[str] = ()) -> None:
        self.count = count
        self._folders = tuple(folders)
        self._threads = Threads(count)
        self._local = threading.local()
        self._processes: list[subprocess.Popen[bytes]] = []
        self._registry: Registry | None = None
        self._over = False

    def submit(self, *task: Any) -> Future[Block]:
        """Make a block; `task` are the arguments of `block` with the code of the series first."""
        return self._threads.submit(self._ask, task)

    def _ask(self, task: tuple[Any, ...], tries: int = TRIES) -> Block:
        try:
            return self._made(task)
        except WorkerKilled as error:
            if tries > 1 and not self._over:
                return self._ask(task, tries - 1)
            remedy = "free some memory, or build with fewer --processes"
            raise WorkerKilled(f"{error}, {TRIES} times: {remedy}, and run `catalogue build` again") from error

    def _process(self) -> subprocess.Popen[bytes] | None:
        """Return the process of this thread; None where none can be started."""
        process: subprocess.Popen[bytes] | None = getattr(self._local, "process", None)
        if process is None:
            # each process computes on one core: several threads of linear algebra would only get in
            # their way
            single = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}
            # the same modules as here are found there: -P, lest a file in the current folder take
            # the place of one
            path = os.pathsep.join(str(Path(p).absolute()) for p in sys.path)
            try:
                process = self._local.process = subprocess.Popen(  # nosec B603
                    [sys.executable, "-P", "-m", "catalogue.populate.worker", *self._folders],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    env={**os.environ, **single, "PYTHONPATH": path},
                    start_new_session=True,  # Ctrl-C reaches this process alone, which then closes the pipes
                )
            except OSError:
                return None
            self._processes.append(process)
            if self._over:
                _kill(process)
        return process

    def _made(self, task: tuple[Any, ...]) -> Block:
        process, late = self._process(), threading.Event()
        if process is None:
            return self._made_here(*task)

        def end() -> None:
            late.set()
            _kill(process)

        alarm = threading.Timer(LIMIT, end)
        alarm.daemon = True
        assert process.stdin is not None  # both are pipes
        assert process.stdout is not None
        try:
            with suppress(RuntimeError):  # without threads the process watches itself
                alarm.start()
            pickle.dump(task, process.stdin)
            process.stdin.flush()
            answer: Block | PluginError = pickle.load(process.stdout)  # nosec B301
        except (EOFError, OSError, pickle.UnpicklingError) as error:
            self._local.process = None  # the next task gets a new one
            kind, how = _end(process)
            if late.is_set():
                raise PluginError(f"a block of {task[0]} takes longer than {LIMIT:g} s") from error
            raise kind(f"the process that makes {task[0]} {how}") from error
        finally:
            alarm.cancel()
        if isinstance(answer, PluginError):
            raise answer
        return answer

    def _made_here(self, code: str, *rest: Any) -> Block:
        """Make a block in this process."""
        if self._registry is None:
            self._registry = Registry(self._folders)
        with foreign(f"series {code}"):
            return block(self._registry.get(code), *rest)

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._threads.shutdown(wait=False, cancel_futures=True)
        if kind is not None:
            self._over = True
            for process in self._processes:
                _kill(process)
        self._threads.shutdown(wait=True)
        for process in self._processes:
            for pipe in filter(None, (process.stdin, process.stdout)):
                with suppress(OSError):  # what it was sent and never read cannot be flushed
                    pipe.close()
            process.wait()


def _kill(process: subprocess.Popen[bytes]) -> None:
    """Kill a process with all processes forked by a plugin, which keep its pipes open."""
    if process.returncode is None and hasattr(os, "killpg"):
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()


def _end(process: subprocess.Popen[bytes]) -> tuple[type[PluginError], str]:
    """Describe the end of a process with a closed pipe, and its cause."""
    try:
        code = process.wait(GRACE)
    except subprocess.TimeoutExpired:
        _kill(process)
        return PluginError, "closed its channel"
    if code >= 0:
        return PluginError, f"ended with exit code {code}"
    name = signal.Signals(-code).name
    return WorkerKilled if name in SYSTEM else PluginError, f"was killed by {name}"
