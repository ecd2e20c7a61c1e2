"""Dispatch questions to worker processes, cache answers, and cancel questions of departed clients.

A search holds the interpreter, so it runs in a separate process.  Fast and slow questions have
separate workers, and the slow ones run at lower priority.
"""

from __future__ import annotations

import asyncio
import os
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Hashable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, NamedTuple

from ..engines import Begin, Engine
from ..engines.processes import Processes
from ..errors import CatalogueError, WorkerKilled


class DeskLimits(NamedTuple):
    """Limits of the questions to workers."""

    kept: int = 256  #: cached answers: an hour of one user
    poll: float = 0.1  #: time between checks whether the client still waits [s]
    #: Time limit of a question [s]: a refined search takes 1 s on an idle machine, the longest one
    #: permitted by the form about 15 s.
    limit: float = 60.0
    #: Largest number of waiting questions of a lane: a longer queue would exceed the time limit
    #: several times.
    max_waiting: int = 12
    #: Time that an abandoned question may still run before its process is killed and restarted
    #: [s].
    left: float = 2.0
    niceness: int = 10  #: niceness of the workers of slow questions


DESK = DeskLimits()

Gone = Callable[[], Awaitable[bool]]


class NobodyWaits(Exception):
    """The client has disconnected."""


class Busy(CatalogueError):
    """No worker is available: too many questions wait, or its process was killed twice."""

    exit_code = 5


def process(begin: Begin, niceness: int) -> Engine:
    """Create a worker process."""
    return Processes(1, begin, niceness=niceness)


class Thread(Engine):
    """A worker thread of this process: it starts fast, but blocks all others."""

    def __init__(self, begin: Begin, niceness: int) -> None:  # noqa: ARG002  # a thread has none of its own
        self._threads, self._begin = ThreadPoolExecutor(1, "catalogue"), begin
        self._begun = False

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **keywords: Any) -> Future[Any]:
        """Run a task after those submitted before."""
        return self._threads.submit(self._run, function, arguments, keywords)

    def _run(self, function: Callable[..., Any], arguments: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
        if not self._begun:
            self._begin()
            self._begun = True
        return function(*arguments, **keywords)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self._threads.shutdown(wait, cancel_futures=cancel_futures)


class Worker:
    """A process that answers one question at a time; restarted if stuck."""

    def __init__(self, make: Callable[[], Engine]) -> None:
        self._make = make
        self.begin()

    def begin(self) -> None:
        """Start the process, which opens the catalogue."""
        self._engine = self._make()
        self._engine.submit(os.getpid)  # the process starts with the first task

    async def run(self, task: Callable[..., Any], *arguments: Any) -> Any:
        """Run a function in the process and return its result."""
        try:
            return await asyncio.get_running_loop().run_in_executor(self._engine, task, *arguments)
        except WorkerKilled:
            raise Busy("the process that answers was killed twice: is there enough memory?") from None

    def close(self) -> None:
        """Kill the process; a thread runs to its end."""
        self._engine.kill()


class Lane:
    """Workers for questions of one kind, served in order of arrival."""

    def __init__(self, make: Callable[[], Engine], count: int) -> None:
        self._workers = [Worker(make) for _ in range(count)]
        self._free: asyncio.Queue[Worker] = asyncio.Queue()
        self._waiting = 0
        for worker in self._workers:
            self._free.put_nowait(worker)
        self.count, self._closed = count, False

    async def run(self, task: Callable[..., Any], *arguments: Any) -> Any:
        """Run a function in the next free worker and return its result.

        If the caller is cancelled in the meantime, the function gets `DESK.left` seconds to finish;
        then the process is restarted.

        Raises
        ------
        Busy
            If too many questions wait, or this one takes longer than `DESK.limit`.
        """
        if self._waiting >= DESK.max_waiting:
            raise Busy(f"{DESK.max_waiting} questions are waiting already: ask again in a minute")
        self._waiting += 1
        try:
            worker = await self._free.get()
        finally:
            self._waiting -= 1
        running = asyncio.ensure_future(worker.run(task, *arguments))
        try:
            done, _ = await asyncio.wait({running}, timeout=DESK.limit)
            if done:
                return running.result()
            raise Busy(f"this takes longer than the {DESK.limit:.0f} s of a question: ask for less, or ask the command")
        except asyncio.CancelledError:
            if not self._closed:
                await asyncio.wait({running}, timeout=DESK.left)
            raise
        finally:
            if not running.done():
                running.cancel()
                worker.close()
                if not self._closed:
                    worker.begin()
            self._free.put_nowait(worker)

    def close(self) -> None:
        """Stop all workers."""
        self._closed = True
        for worker in self._workers:
            worker.close()


class Desk:
    """Dispatches questions and caches answers."""

    def __init__(self, begin: Begin, make: Callable[[Begin, int], Engine] = process) -> None:
        count = max(2, min(4, os.cpu_count() or 1))
        self.quick = Lane(lambda: make(begin, 0), count)
        self.thorough = Lane(lambda: make(begin, DESK.niceness), count)
        self._kept: OrderedDict[Hashable, asyncio.Task[Any]] = OrderedDict()
        self._waiting: dict[Hashable, int] = {}

    async def ask(self, key: Hashable, lane: Lane, gone: Gone, task: Callable[..., Any], *arguments: Any) -> Any:
        """Answer a question, from the cache if it was asked before.

        Raises
        ------
        NobodyWaits
            If the client has disconnected; the question is cancelled unless another client waits
            for it.
        CatalogueError
            Errors of the task.
        """
        running = self._kept.get(key)
        if running is None or running.cancelled():
            running = self._kept[key] = asyncio.create_task(lane.run(task, *arguments))
            while len(self._kept) > DESK.kept:
                self._kept.pop(next(iter(self._kept)))
        self._kept.move_to_end(key)
        self._waiting[key] = self._waiting.get(key, 0) + 1
        try:
            while not running.done():
                await asyncio.wait({running}, timeout=DESK.poll)
                if not running.done() and await gone():
                    raise NobodyWaits
        finally:
            self._waiting[key] -= 1
            if not self._waiting[key]:
                del self._waiting[key]
                if not running.done():
                    running.cancel()
                    self._kept.pop(key, None)
        if running.cancelled() or running.exception() is not None:
            self._kept.pop(key, None)
        return running.result()

    def knows(self, key: Hashable) -> bool:
        """Tell whether an answer is cached."""
        found = self._kept.get(key)
        return found is not None and found.done() and not found.cancelled() and found.exception() is None

    async def close(self) -> None:
        """Stop all workers; pending questions get no answer."""
        self.quick.close()
        self.thorough.close()
        asked = [one for one in self._kept.values() if not one.done()]
        for one in asked:
            one.cancel()
        await asyncio.gather(*asked, return_exceptions=True)
