"""What a worker process runs: read a task, answer with its block, until the pipe closes (see `workers`)."""

from __future__ import annotations

import os
import pickle
import sys
import warnings
from collections.abc import Sequence
from typing import BinaryIO

from ..plugins import PluginWarning, Registry, one_line
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
        except Exception as error:
            answer = one_line(error)
        pickle.dump(answer, sink)
        sink.flush()


if __name__ == "__main__":
    # what a plugin prints must not mix with the answers
    channel = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    serve(sys.stdin.buffer, channel, sys.argv[1:])
