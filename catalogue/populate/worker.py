"""What a worker process runs: read a task, answer with its block, until the pipe closes (see `workers`)."""

from __future__ import annotations

import os
import pickle  # nosec B403  # of what the process that started this one sends
import sys
import warnings
from contextlib import suppress
from pathlib import Path

from ..errors import one_line
from ..plugin.registry import Registry
from .block import Block, block


def main() -> None:
    """Answer tasks on standard input, moved out of the way of what a plugin reads and prints: with a `Block`, or with
    one line that says what went wrong."""
    source, sink = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb", buffering=0)
    with Path(os.devnull).open("rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    os.dup2(2, 1)
    warnings.simplefilter("ignore")  # the calling process has said it already
    registry = Registry(sys.argv[1:])
    with suppress(EOFError, BrokenPipeError):  # the calling process is done, or has been killed
        while True:
            code, *rest = pickle.load(source)  # nosec B301
            answer: Block | str
            try:
                answer = block(registry.get(code), *rest)
            except (Exception, SystemExit) as error:
                answer = one_line(error)
            view = memoryview(pickle.dumps(answer))
            while view:  # an unbuffered pipe may take a part only
                view = view[sink.write(view) :]


if __name__ == "__main__":
    main()
