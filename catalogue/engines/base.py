"""The contract of an engine."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

#: Attempts at a task that kills its worker.
TRIES = 2


@dataclass(frozen=True)
class Begin:
    """A function that prepares a worker before its first task, with its arguments.

    It must be importable: a worker process on another machine calls it by its name.
    """

    function: Callable[..., Any]
    arguments: tuple[Any, ...] = ()

    def __call__(self) -> None:
        self.function(*self.arguments)


class Engine(Executor):
    """An executor with a number of workers; leave it as a context manager, or `kill` it.

    `submit` takes functions that can be imported, with arguments and results that can be pickled.
    Its futures raise what the function raised, or `WorkerKilled` if the task killed its worker at
    every attempt.

    Attributes
    ----------
    count : int
        Number of tasks that run at a time.
    """

    count: int = 1

    def kill(self) -> None:
        """End all workers at once; pending tasks are cancelled, running ones fail."""
        self.shutdown(wait=False, cancel_futures=True)

    def spread(self, holds: Callable[[], bool], receive: Callable[[bytes], None], content: Callable[[], bytes]) -> None:
        """Send content to workers that do not hold it; workers of this machine share its disk.

        Parameters
        ----------
        holds : callable
            Tells on a worker whether the content is there.
        receive : callable
            Stores the content on a worker.
        content : callable
            Returns the content; called only if a worker needs it.
        """
