"""The desk: questions go to a few processes, first answers before thorough ones; what nobody waits for is dropped.

A search holds the interpreter: it runs in a process of its own, so that the page goes on.  Quick questions and thorough
ones have processes of their own, and the thorough ones let the quick ones go first.
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

#: Answers that are kept, and how often it is asked whether somebody still waits [s].
KEPT, POLL = 256, 0.1
#: How long a question may take, so that others get their turn [s]: a refined search takes 1 on a machine with nothing
#: else to do, the most that the form allows about 15.
LIMIT = 60.0
#: Questions that may wait in a lane: with one more somebody would wait several times `LIMIT`.
MAX_WAITING = 12
#: How long what nobody waits for may run on before its process is killed, and begun anew [s].
LEFT = 2.0
#: By how much thorough questions let others go first.
PATIENCE = 10
#: Begins a process, or the only one, with its patience.
Begin = Callable[[int], None]
Gone = Callable[[], Awaitable[bool]]


class NobodyWaits(Exception):
    """Who asked has gone."""


class Busy(CatalogueError):
    """No process answers: too much is asked, or they were killed twice."""

    exit_code = 5


def process(begin: Begin, patience: int) -> Executor:
    """Return a process."""
    return ProcessPoolExecutor(1, get_context("spawn"), begin, (patience,))


def thread(begin: Begin, patience: int) -> Executor:  # noqa: ARG001  # a thread cannot be more patient
    """Return a thread of this process: quick to begin, but it holds all others up."""
    return ThreadPoolExecutor(1, "catalogue", begin, (0,))


class Worker:
    """A process that answers one question at a time; begun anew if it is killed, or hangs on what nobody wants."""

    def __init__(self, make: Callable[[], Executor]) -> None:
        self._make = make
        self.begin()

    def begin(self) -> None:
        """Begin the process, which opens the catalogue."""
        others = {*active_children()}
        self._executor = self._make()
        self._executor.submit(os.getpid)  # with the first question it is there
        self._children = {*active_children()} - others

    async def run(self, task: Callable[..., Any], *arguments: Any) -> Any:
        """Return what a function returns."""
        for _ in range(2):
            try:
                return await asyncio.get_running_loop().run_in_executor(self._executor, task, *arguments)
            except BrokenExecutor:
                self.close()
                self.begin()
        raise Busy("the process that answers was killed twice: is there enough memory?")

    def close(self) -> None:
        """End the process, whatever it does; a thread runs on to its end."""
        self._executor.shutdown(wait=False, cancel_futures=True)
        for child in self._children:
            child.terminate()


class Lane:
    """Processes for questions of one kind; the first that asked is served first."""

    def __init__(self, make: Callable[[], Executor], count: int) -> None:
        self._workers = [Worker(make) for _ in range(count)]
        self._free: asyncio.Queue[Worker] = asyncio.Queue()
        self._waiting = 0
        for worker in self._workers:
            self._free.put_nowait(worker)
        self.count, self._closed = count, False

    async def run(self, task: Callable[..., Any], *arguments: Any) -> Any:
        """Return what a function returns in the next process that is free.  Who is cancelled while it runs gives it
        some seconds to end, then the process is begun anew.

        Raises
        ------
        Busy
            If too many wait already, or it takes longer than `LIMIT`.
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
        """End all processes."""
        self._closed = True
        for worker in self._workers:
            worker.close()


class Desk:
    """Takes questions, keeps answers."""

    def __init__(self, begin: Begin, make: Callable[[Begin, int], Executor] = process) -> None:
        count = max(2, min(4, os.cpu_count() or 1))
        self.quick = Lane(lambda: make(begin, 0), count)
        self.thorough = Lane(lambda: make(begin, PATIENCE), count)
        self._kept: OrderedDict[Hashable, asyncio.Task[Any]] = OrderedDict()
        self._waiting: dict[Hashable, int] = {}

    async def ask(self, key: Hashable, lane: Lane, gone: Gone, task: Callable[..., Any], *arguments: Any) -> Any:
        """Return an answer, of the same question at once if it was asked before.

        Raises
        ------
        NobodyWaits
            If who asked has gone; the question is dropped unless somebody else waits for it.
        CatalogueError
            As the task does.
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
        """Return whether a question has been answered."""
        found = self._kept.get(key)
        return found is not None and found.done() and not found.cancelled() and found.exception() is None

    async def close(self) -> None:
        """End all processes; nobody is answered any more."""
        self.quick.close()
        self.thorough.close()
        asked = [one for one in self._kept.values() if not one.done()]
        for one in asked:
            one.cancel()
        await asyncio.gather(*asked, return_exceptions=True)
