"""Worker processes of this machine.

They are started as ``python -m catalogue.engines.worker`` and communicate over pipes.  Unlike the
standard pools they do not import the caller's main module, so that a script needs no guard and a
notebook works.  They end when their pipe closes, also when this process is killed.  If a task ends
its process, that is reported; if the system kills the process, the task is tried again.  Where no
process can be started, in a browser or with a full process table, tasks run one by one in this one.
"""

from __future__ import annotations

import os
import pickle  # nosec B403  # only messages of a process started here, never a file
import signal
import subprocess  # nosec B404  # this Python, with this package
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from ..errors import PluginError, WorkerKilled, one_line, shortened
from ..threads import Threads
from .base import TRIES, Begin, Engine
from .worker import receive, send

#: Time for a process that closed its pipe to end [s].
GRACE = 5.0
#: Signals from outside a process: its task is tried again.  Others are faults of the task.
SYSTEM_SIGNALS = ("SIGKILL", "SIGTERM", "SIGHUP", "SIGINT", "SIGXCPU")


class Processes(Engine):
    """A pool of processes, each started for its first task.

    Parameters
    ----------
    count : int
        Number of processes.
    begin : Begin, optional
        Prepares each process.
    limit : float, optional
        Time limit of a task [s]; beyond it the process is killed.
    tries : int
        Attempts at a task whose process the system kills.
    niceness : int
        Added to the niceness of the processes.
    """

    def __init__(
        self,
        count: int,
        begin: Begin | None = None,
        *,
        limit: float | None = None,
        tries: int = TRIES,
        niceness: int = 0,
    ) -> None:
        self.count, self.limit, self.tries, self.niceness = count, limit, tries, niceness
        self._begin = begin
        self._threads = Threads(count)
        self._local = threading.local()
        self._processes: list[subprocess.Popen[bytes]] = []
        self._begun = self._over = False

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **keywords: Any) -> Future[Any]:
        """Run a task in the next free process; messages name it by its first argument."""
        return self._threads.submit(self._send_task, (function, arguments, keywords), self.tries)

    def _send_task(self, task: tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]], tries: int) -> Any:
        if self._over:
            raise WorkerKilled("the workers have ended")
        try:
            return self._made(task)
        except WorkerKilled as error:
            if tries > 1 and not self._over:
                return self._send_task(task, tries - 1)
            raise WorkerKilled(f"{error}, {self.tries} times: free some memory, or use fewer processes") from error

    def _process(self) -> subprocess.Popen[bytes] | None:
        """Return the process of this thread; None where none can be started."""
        process: subprocess.Popen[bytes] | None = getattr(self._local, "process", None)
        if process is None:
            # each process computes on one core: several threads of linear algebra would compete for
            # it
            single = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}
            # the process imports the modules of this one; with -P a file in the current folder
            # cannot replace one
            path = os.pathsep.join(str(Path(p).absolute()) for p in sys.path)
            try:
                process = self._local.process = subprocess.Popen(  # nosec B603
                    [sys.executable, "-P", "-m", "catalogue.engines.worker"],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    env={**os.environ, **single, "PYTHONPATH": path},
                    start_new_session=True,  # Ctrl-C reaches this process alone, which then closes the pipes
                )
            except OSError:
                return None
            self._processes.append(process)
            _send(process, (self._begin, self.limit, self.niceness))
            if self._over:
                _kill(process)
        return process

    def _made(self, task: tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]) -> Any:
        function, arguments, _ = task
        name = arguments[0] if arguments and isinstance(arguments[0], str) else _name(function)
        name = shortened(name, 60)
        process, late = self._process(), threading.Event()
        if process is None:
            return self._execute_here(*task)
        alarm = None
        if self.limit is not None:

            def end() -> None:
                late.set()
                _kill(process)

            alarm = threading.Timer(self.limit, end)
            alarm.daemon = True
            with suppress(RuntimeError):  # without threads the process watches its own time limit
                alarm.start()
        assert process.stdout is not None  # a pipe
        try:
            _send(process, task)
            content = receive(process.stdout)
        except (EOFError, OSError) as error:
            self._local.process = None  # the next task gets a new one
            kind, how = _end(process)
            if late.is_set():
                raise PluginError(f"{name} takes longer than {self.limit:g} s") from error
            raise kind(f"the worker process of {name} {how}") from error
        finally:
            if alarm is not None:
                alarm.cancel()
        try:
            done, answer = pickle.loads(content)  # nosec B301  # from the process that was started above
        except Exception as error:
            raise PluginError(f"the result of {name} cannot be read here: {one_line(error)}") from error
        if not done:
            raise answer
        return answer

    def _execute_here(self, function: Callable[..., Any], arguments: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
        """Run a task in this process."""
        if self._begin is not None and not self._begun:
            self._begin()
        self._begun = True
        return function(*arguments, **keywords)

    def kill(self) -> None:
        """End all processes at once; pending tasks are cancelled, running ones fail."""
        self._over = True
        self._threads.shutdown(wait=False, cancel_futures=True)
        for process in self._processes:
            _kill(process)
        self.shutdown(wait=True)  # the threads end with their processes

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let running tasks end, and then the processes."""
        self._threads.shutdown(wait=wait, cancel_futures=cancel_futures)
        for process in self._processes:
            for pipe in filter(None, (process.stdin, process.stdout)):
                with suppress(OSError):  # unread messages cannot be flushed
                    pipe.close()
            if wait:
                process.wait()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self.kill()
        else:
            self.shutdown(wait=True, cancel_futures=True)


def _send(process: subprocess.Popen[bytes], message: Any) -> None:
    assert process.stdin is not None  # a pipe
    send(process.stdin, pickle.dumps(message))


def _name(function: Callable[..., Any]) -> str:
    """Name a task: its function, also inside a partial one, or its class."""
    while isinstance(function, partial):
        function = function.func
    return getattr(function, "__name__", type(function).__name__)


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
    return WorkerKilled if name in SYSTEM_SIGNALS else PluginError, f"was killed by {name}"
