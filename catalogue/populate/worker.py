"""What a worker process runs: read a task, answer with its block, until the pipe closes (see `workers`).

A thread waits at the pipe: when the calling process is done, or has been killed, this one ends at
once, whatever a plugin is doing.  Should a plugin let no thread run, a watchdog that needs none
ends it after `LIMIT`.
"""

from __future__ import annotations

import faulthandler
import os
import pickle  # nosec B403  # of what the process that started this one sends
import signal
import sys
import threading
import warnings
from contextlib import suppress
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from typing import Any, BinaryIO

from ..errors import PluginError, WorkerKilled, one_line
from ..plugin.registry import Registry
from .block import LIMIT, Block, block

#: How much longer than the calling process the watchdog waits [s].
GRACE = 10.0


def main() -> None:
    """Answer tasks from standard input with a `Block` or an error.

    The streams are moved away from those that a plugin reads and prints to.
    """
    source, sink = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb", buffering=0)
    with Path(os.devnull).open("rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    os.dup2(2, 1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the calling process, which then closes the pipe
    warnings.simplefilter("ignore")  # the calling process has said it already
    tasks: SimpleQueue[Any] = SimpleQueue()
    following = tasks.get
    try:
        threading.Thread(target=_listen, args=(source, tasks), daemon=True).start()
    except RuntimeError:  # a full process table: a pipe that closes is seen after the block
        following = partial(_read, source)
    registry, process = Registry(sys.argv[1:]), os.getpid()
    with Path(os.devnull).open("w") as nowhere:
        while True:
            code, *rest = following()
            with suppress(RuntimeError):
                faulthandler.dump_traceback_later(LIMIT + GRACE, exit=True, file=nowhere)
            answer = _answer(registry, code, *rest)
            if os.getpid() != process:  # a plugin has forked it
                os._exit(0)
            view = memoryview(pickle.dumps(answer))
            while view:  # an unbuffered pipe may take a part only
                view = view[sink.write(view) :]
            faulthandler.cancel_dump_traceback_later()


def _answer(registry: Registry, code: str, *rest: Any) -> Block | PluginError:
    try:
        return block(registry.get(code), *rest)
    except MemoryError as error:
        return WorkerKilled(one_line(error))
    except BaseException as error:
        return PluginError(one_line(error))


def _read(source: BinaryIO) -> Any:
    """Read the next task; end this process where there is none."""
    try:
        return pickle.load(source)  # nosec B301  # what the process that started this one sends
    except (EOFError, OSError, pickle.UnpicklingError):
        os._exit(0)


def _listen(source: BinaryIO, tasks: SimpleQueue[Any]) -> None:
    try:
        while True:
            tasks.put(pickle.load(source))  # nosec B301  # what the process that started this one sends
    finally:
        os._exit(0)


if __name__ == "__main__":
    main()
