"""Workers of dask.distributed, on this machine or on others."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from ..errors import EngineError, MissingExtra, WorkerKilled, one_line
from .base import TRIES, Begin, Engine

#: Time to wait for a running cluster [s].
PATIENCE = 10.0

_BEGUN: set[Begin] = set()
_LOCK = threading.Lock()


class Cluster(Engine):
    """A cluster of dask: its scheduler replaces killed workers and tries their tasks again.

    Parameters
    ----------
    begin : Begin, optional
        Prepares each worker before its first task.
    address : str
        Address of the scheduler of a running cluster; empty: start one on this machine, with a
        process of one thread for each worker.
    count : int
        Number of workers to start.
    tries : int
        Attempts at a task that kills its worker; a running cluster uses its own configuration
        (``distributed.scheduler.allowed-failures`` and 1).

    Raises
    ------
    MissingExtra
        If dask.distributed is not installed.
    EngineError
        If the cluster cannot be reached.
    """

    def __init__(self, begin: Begin | None = None, *, address: str = "", count: int = 1, tries: int = TRIES) -> None:
        try:
            import dask
            from distributed import Client, LocalCluster
        except ImportError as error:
            raise MissingExtra(
                'the engine dask needs dask.distributed: pip install "mechanism-catalogue[dask]"'
            ) from error
        self._begin, self._cluster = begin, None
        try:
            if not address:
                with dask.config.set({"distributed.scheduler.allowed-failures": tries - 1}):
                    # else it serves its state to everybody, on a port that may be taken
                    self._cluster = LocalCluster(
                        n_workers=count, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0"
                    )
            self._client = Client(address or self._cluster, timeout=PATIENCE)
        except (OSError, ValueError, TimeoutError) as error:
            raise EngineError(
                f"the cluster {address or 'of this machine'} cannot be reached: {one_line(error)}"
            ) from None
        self._executor = self._client.get_executor(pure=False)
        self.count = max(sum(self._client.nthreads().values()), 1)

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **keywords: Any) -> Future[Any]:
        """Run a task on a worker of the cluster."""
        outer: Future[Any] = Future()
        outer.set_running_or_notify_cancel()
        inner = self._executor.submit(_run, self._begin, function, arguments, keywords)

        def passed_on(done: Future[Any]) -> None:
            error = None if done.cancelled() else done.exception()
            if done.cancelled():
                outer.set_exception(EngineError("the cluster has cancelled a task: has its scheduler ended?"))
            elif error is not None:
                outer.set_exception(_as_own_error(error))
            else:
                outer.set_result(done.result())

        inner.add_done_callback(passed_on)
        return outer

    def spread(self, holds: Callable[[], bool], receive: Callable[[bytes], None], content: Callable[[], bytes]) -> None:
        """Send content to the machines of workers that do not hold it."""
        held, hosts = self._client.run(holds), self._client.run(socket.gethostname)
        missing = {hosts[worker]: worker for worker, has in held.items() if not has}
        if missing:
            self._client.run(receive, content(), workers=[*missing.values()])

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: ARG002  # always
        """Leave the cluster; end one that was started here."""
        self._client.close()
        if self._cluster is not None:
            self._cluster.close()


def _run(begin: Begin | None, function: Callable[..., Any], arguments: Any, keywords: Any) -> Any:
    with _LOCK:
        if begin is not None and begin not in _BEGUN:
            begin()
            _BEGUN.clear()  # the worker now belongs to the latest caller
            _BEGUN.add(begin)
    return function(*arguments, **keywords)


def _as_own_error(error: BaseException) -> BaseException:
    """Return the error of a task; `WorkerKilled` where the scheduler gave it up."""
    from distributed.scheduler import KilledWorker

    if not isinstance(error, KilledWorker):
        return error
    return WorkerKilled("the task has killed its worker each time: free some memory, or use fewer workers")
