"""Dispatch questions to worker processes, cache answers, and cancel questions of departed clients.

A search holds the interpreter, so it runs in a separate process.  Fast and slow questions have
separate workers, and the slow ones run at lower priority.
"""

from __future__ import annotations

import asyncio
import os
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Hashable
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import active_children, get_context
from typing import Any

from ..errors import CatalogueError

#: Number of cached answers: an hour of one user.
KEPT = 256
#: Time between checks whether the client still waits [s].
POLL = 0.1
#: Time limit of a question [s]: a refined search takes 1 on an idle machine, the longest that the
#: form permits about 15.
LIMIT = 60.0
#: Most waiting questions of a lane: with one more a client would wait several times `LIMIT`.
MAX_WAITING = 12
#: Time that an abandoned question may still run before its process is killed and restarted [s].
LEFT = 2.0
#: Niceness of the workers of slow questions.
PATIENCE = 10
#: Initialises a worker with its niceness.
Begin = Callable[[int], None]
Gone = Callable[[], Awaitable[bool]]


class NobodyWaits(Exception):
    """The client has disconnected."""


class Busy(CatalogueError):
    """No worker is available: too many questions wait, or its process was killed twice."""

    exit_code = 5


def process(begin: Begin, patience: int) -> Executor:
    """Create a worker process."""
    return ProcessPoolExecutor(1, get_context("spawn"), begin, (patience,))


def thread(begin: Begin, patience: int) -> Executor:  # noqa: ARG001  # a thread has no niceness of its own
    """Create a worker thread of this process: fast to start, but it blocks all others."""
    return ThreadPoolExecutor(1, "catalogue", begin, (0,))


class Worker:
    """A process that answers one question at a time; restarted if killed or stuck."""

    def __init__(self, make: Callable[[], Executor]) -> None:
        self._make = make
        self.begin()

    def begin(self) -> None:
        """Start the process, which opens the catalogue."""
        others = {*active_children()}
        self._executor = self._make()
        self._executor.submit(os.getpid)  # the process starts with the first task
        self._children = {*active_children()} - others

    async def run(self, task: Callable[..., Any], *arguments: Any) -> Any:
        """Run a function in the process and return its result."""
        for _ in range(2):
            try:
                return await asyncio.get_running_loop().run_in_executor(self._executor, task, *arguments)
            except BrokenExecutor:
                self.close()
                self.begin()
        raise Busy("the process that answers was killed twice: is there enough memory?")

    def close(self) -> None:
        """Kill the process; a thread runs to its end."""
        self._executor.shutdown(wait=False, cancel_futures=True)
        for child in self._children:
            child.terminate()


class Lane:
    """Workers for questions of one kind, served in order of arrival."""

    def __init__(self, make: Callable[[], Executor], count: int) -> None:
        self._workers = [Worker(make) for _ in range(count)]
        self._free: asyncio.Queue[Worker] = asyncio.Queue()
        self._waiting = 0
        for worker in self._workers:
            self._free.put_nowait(worker)
        self.count, self._closed = count, False

    async def run(self, task: Callable[..., Any], *arguments: Any) -> Any:
        """Run a function in the next free worker and return its result.

        If the caller is cancelled meanwhile, the function gets `LEFT` seconds to finish; then the
        process is restarted.

        Raises
        ------
        Busy
            If too many questions wait, or this one takes longer than `LIMIT`.
        """
        if self._waiting >= MAX_WAITING:
            raise Busy(f"{MAX_WAITING} questions are waiting already: ask again in a minute")
        self._waiting += 1
        try:
            worker = await self._free.get()
        finally:
            self._waiting -= 1
        running = asyncio.ensure_future(worker.run(task, *arguments))
        try:
            done, _ = await asyncio.wait({running}, timeout=LIMIT)
            if done:
                return running.result()
            raise Busy(f"this takes longer than the {LIMIT:.0f} s of a question: ask for less, or ask the command")
        except asyncio.CancelledError:
            if not self._closed:
                await asyncio.wait({running}, timeout=LEFT)
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

    def __init__(self, begin: Begin, make: Callable[[Begin, int], Executor] = process) -> None:
        count = max(2, min(4, os.cpu_count() or 1))
        self.quick = Lane(lambda: make(begin, 0), count)
        self.thorough = Lane(lambda: make(begin, PATIENCE), count)
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
            while len(self._kept) > KEPT:
                self._kept.pop(next(iter(self._kept)))
        self._kept.move_to_end(key)
        self._waiting[key] = self._waiting.get(key, 0) + 1
        try:
            while not running.done():
                await asyncio.wait({running}, timeout=POLL)
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
