"""What a worker process runs: read a task, answer with its block, until the pipe closes (see `workers`)."""

from __future__ import annotations

import os
import pickle
import sys
import warnings
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from ..errors import PluginWarning, one_line
from ..plugin.registry import Registry
from .block import Block, block


def serve(source: BinaryIO, sink: BinaryIO, folders: Sequence[str]) -> None:
    """Answer tasks until the source ends: a `Block`, or one line that says what went wrong."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PluginWarning)  # the calling process has said it already
        registry = Registry(folders)
    while True:
        try:
            code, *rest = pickle.load(source)
        except EOFError:
            return
        answer: Block | str
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                answer = block(registry.get(code), *rest)
        except (Exception, SystemExit) as error:
            answer = one_line(error)
        _send(answer, sink)


def _send(answer: Block | str, sink: BinaryIO) -> None:
    view = memoryview(pickle.dumps(answer))
    while view:  # an unbuffered pipe may take a part only
        view = view[sink.write(view) :]


def main() -> None:
    """Serve on standard input and output, moved out of the way of what a plugin reads and prints."""
    source, sink = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb", buffering=0)
    with Path(os.devnull).open("rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    os.dup2(2, 1)
    with suppress(BrokenPipeError):  # the calling process has been killed
        serve(source, sink, sys.argv[1:])


if __name__ == "__main__":
    main()
