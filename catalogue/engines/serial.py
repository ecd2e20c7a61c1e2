"""The engine without workers."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from .base import Begin, Engine


class Serial(Engine):
    """Run each task in this process when it is submitted."""

    def __init__(self, begin: Begin | None = None) -> None:
        self._begin = begin

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **keywords: Any) -> Future[Any]:
        """Run a task at once, and return its completed future."""
        future: Future[Any] = Future()
        future.set_running_or_notify_cancel()
        try:
            if self._begin is not None:
                self._begin()
                self._begin = None
            future.set_result(function(*arguments, **keywords))
        except Exception as error:
            future.set_exception(error)
        return future
