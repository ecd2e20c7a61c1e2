"""Worker processes that make blocks.

They are started as ``python -m catalogue.populate.worker`` and talk over their pipes: unlike the standard pools they do
not import the caller's main module, so that a script needs no guard and a notebook works.  They end when their pipe
closes, also when this process is killed.
"""

from __future__ import annotations

import os
import pickle  # nosec B403  # of what a process sends that was started here; no file is read by it
import signal
import subprocess  # nosec B404  # this Python, with this package
import sys
import threading
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import PluginError
from .block import Block

#: How long a process that closed its pipe may take to end [s].
GRACE = 5.0


class Workers:
    """A pool of `count` processes that load the plugins of `folders` besides those that every registry searches."""

    def __init__(self, count: int, folders: Sequence[str] = ()) -> None:
        self.count = count
        self._folders = tuple(folders)
        self._threads = ThreadPoolExecutor(count)
        self._local = threading.local()
        self._processes: list[subprocess.Popen[bytes]] = []

    def submit(self, *task: Any) -> Future[Block]:
        """Make a block; `task` are the arguments of `block` with the code of the series first."""
        return self._threads.submit(self._ask, task)

    def _ask(self, task: tuple[Any, ...]) -> Block:
        process: subprocess.Popen[bytes] | None = getattr(self._local, "process", None)
        if process is None:
            # each process computes on one core: several threads of linear algebra would only get in their way
            single = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}
            # the same modules as here are found there: -P, lest a file in the current folder take the place of one
            path = os.pathsep.join(str(Path(p).absolute()) for p in sys.path)
            process = self._local.process = subprocess.Popen(  # nosec B603
                [sys.executable, "-P", "-m", "catalogue.populate.worker", *self._folders],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**os.environ, **single, "PYTHONPATH": path},
                start_new_session=True,  # Ctrl-C reaches this process alone, which then closes the pipes
            )
            self._processes.append(process)
        assert process.stdin is not None  # both are pipes
        assert process.stdout is not None
        try:
            pickle.dump(task, process.stdin)
            process.stdin.flush()
            answer = pickle.load(process.stdout)  # nosec B301
        except (EOFError, OSError) as error:
            self._local.process = None  # the next task gets a new one
            raise PluginError(f"the process that makes {task[0]} {_end(process)}") from error
        if isinstance(answer, str):
            raise PluginError(answer)
        assert isinstance(answer, Block)
        return answer

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._threads.shutdown(wait=False, cancel_futures=True)
        if kind is not None:
            for process in self._processes:
                process.kill()
        self._threads.shutdown(wait=True)
        for process in self._processes:
            for pipe in filter(None, (process.stdin, process.stdout)):
                with suppress(OSError):  # what it was sent and never read cannot be flushed
                    pipe.close()
            process.wait()


def _end(process: subprocess.Popen[bytes]) -> str:
    """Say how a process ended that closed its pipe."""
    try:
        code = process.wait(GRACE)
    except subprocess.TimeoutExpired:
        process.kill()
        return "closed its channel"
    return f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
