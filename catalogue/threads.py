"""Run functions in threads, or in the calling one where no thread can be started."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


class Threads(ThreadPoolExecutor):
    """Run functions in threads, serially if none can be started.

    In a browser, or with a full process table, `submit` runs the function at once, and returns when
    it has ended.

    Examples
    --------
    >>> with Threads(2) as threads:
    ...     list(threads.map(abs, [-1, 2]))
    [1, 2]
    """

    def submit(self, function: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Run a function in a thread of the pool, or in this one."""
        try:
            return super().submit(function, *args, **kwargs)
        except RuntimeError:  # an earlier thread may run it too
            done: Future[T] = Future()
            try:
                done.set_result(function(*args, **kwargs))
            except Exception as error:
                done.set_exception(error)
            return done
