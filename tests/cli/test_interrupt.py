"""Ctrl-C at any moment after the first module of ours is imported: one line and exit code 130, never a traceback."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

#: The command as its console script runs it; it says when Ctrl-C is first guarded against.
SCRIPT = """
import os, sys
sys.addaudithook(lambda event, what: event == "import" and what[0] == "catalogue.installed" and os.write(1, b"."))
sys.argv[0] = "/somewhere/bin/catalogue"
from catalogue.cli import main
sys.exit(main())
"""


def _interruptible() -> None:
    """Hear Ctrl-C, which a shell lets those ignore that it runs in the background."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def interrupted(words: list[str], delay: float) -> tuple[int, str]:
    """Return exit code and messages of a command that is interrupted so many seconds after it has begun."""
    with subprocess.Popen(
        [sys.executable, "-c", SCRIPT, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=_interruptible,
    ) as process:  # fmt: skip
        assert process.stdout is not None  # a pipe
        process.stdout.read(1)
        time.sleep(delay)
        process.send_signal(signal.SIGINT)
        _, messages = process.communicate(timeout=60)
    return process.returncode, messages


def test_a_command_that_is_interrupted_ends_in_one_line_and_exit_code_130() -> None:
    command = [sys.executable, "-c", "from catalogue.interrupt import end; end()"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr == "catalogue: interrupted; what was finished is kept\n"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("command", ["--help", "plugins", "build"])
def test_ctrl_c_at_any_moment_is_one_line(command: str, tmp_path: Path) -> None:
    words = [command]
    if command == "build":
        words += ["--db", str(tmp_path / "some.db"), "--count", "100000"]
    for delay in np.linspace(0, 1.5 if command == "build" else 0.4, 25).tolist():
        code, messages = interrupted(words, delay)
        if command == "build" or code:
            assert code == 130, f"{delay} {messages}"
            *progress, last = messages.splitlines()
            assert last.startswith("catalogue: interrupted"), f"{delay} {messages}"
            assert last.endswith("; what was finished is kept"), f"{delay} {messages}"
            assert all(line.startswith("building") for line in progress), f"{delay} {messages}"
        else:  # it was quicker
            assert not messages
