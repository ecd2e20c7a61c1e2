"""Run a worker process: read a task, answer with its result, until the pipe closes.

See `processes`.  A thread waits at the pipe: when the calling process is done, or has been killed,
this one ends at once, whatever a task is doing.  A task that blocks all threads is ended after its
time limit by a watchdog that needs no thread.
"""

from __future__ import annotations

import faulthandler
import os
import pickle  # nosec B403  # only messages of the process that started this one
import signal
import threading
import warnings
from contextlib import suppress
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from typing import IO, Any, BinaryIO

from ..errors import PluginError, WorkerKilled, one_line

#: Extra time of the watchdog over the calling process [s].
GRACE = 10.0


def main() -> None:
    """Answer tasks from standard input with (True, result) or (False, error).

    The first message prepares the worker.  The streams are moved away from those that a plugin
    reads and prints to.
    """
    source, sink = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb", buffering=0)
    with Path(os.devnull).open("rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    os.dup2(2, 1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the calling process, which then closes the pipe
    warnings.simplefilter("ignore")  # the calling process has shown them already
    tasks: SimpleQueue[bytes] = SimpleQueue()
    following = tasks.get
    try:
        threading.Thread(target=_listen, args=(source, tasks), daemon=True).start()
    except RuntimeError:  # the process table is full: a closed pipe is then noticed only after the task
        following = partial(_read, source)
    process = os.getpid()
    failure, limit = None, None
    try:
        begin, limit, niceness = pickle.loads(following())  # nosec B301  # from the calling process
        if niceness and hasattr(os, "nice"):
            os.nice(niceness)
        if begin is not None:
            begin()
    except BaseException as error:
        failure = error
    with Path(os.devnull).open("w") as nowhere:
        while True:
            task = following()
            if limit is not None:
                with suppress(RuntimeError):
                    faulthandler.dump_traceback_later(limit + GRACE, exit=True, file=nowhere)
            answer = (False, failure) if failure is not None else _answer(task)
            if os.getpid() != process:  # a process that a plugin has forked
                os._exit(0)
            send(sink, _pickled(answer))
            faulthandler.cancel_dump_traceback_later()


def _answer(task: bytes) -> tuple[bool, Any]:
    try:
        function, arguments, keywords = pickle.loads(task)  # nosec B301  # from the calling process
    except Exception as error:
        return False, PluginError(f"a worker cannot import a task, or its arguments: {one_line(error)}")
    try:
        return True, function(*arguments, **keywords)
    except MemoryError as error:
        return False, WorkerKilled(one_line(error))
    except BaseException as error:
        return False, error


def _pickled(answer: tuple[bool, Any]) -> bytes:
    """Pickle an answer.

    An error that cannot be pickled and restored is replaced by a `PluginError` of one line.
    """
    try:
        content = pickle.dumps(answer)
        if not answer[0]:
            pickle.loads(content)  # nosec B301  # made in the line above
    except Exception as error:
        return pickle.dumps((False, PluginError(one_line(error if answer[0] else answer[1]))))
    return content


def send(pipe: IO[bytes], content: bytes) -> None:
    """Write a message: its length in 8 bytes, then its content."""
    view = memoryview(len(content).to_bytes(8, "big") + content)
    while view:  # an unbuffered pipe may take only a part
        view = view[pipe.write(view) :]
    pipe.flush()


def receive(pipe: IO[bytes]) -> bytes:
    """Read a message; `EOFError` if the pipe closes before its end."""
    head = pipe.read(8)
    size = int.from_bytes(head, "big")
    content = pipe.read(size) if len(head) == 8 else b""
    if len(head) < 8 or len(content) < size:
        raise EOFError
    return content


def _read(source: BinaryIO) -> bytes:
    """Read the next task; end this process where there is none."""
    try:
        return receive(source)
    except (EOFError, OSError):
        os._exit(0)


def _listen(source: BinaryIO, tasks: SimpleQueue[bytes]) -> None:
    try:
        while True:
            tasks.put(receive(source))
    finally:
        os._exit(0)


if __name__ == "__main__":
    main()
