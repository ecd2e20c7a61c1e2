"""Code of plugins run in this process: whatever it raises, prints or is called stays on this side of one door."""

from __future__ import annotations

import re
import signal
import sys
import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from typing import ClassVar

from .errors import PluginError, one_line, quoted

#: How long code of a plugin may take that runs in this process [s].
LIMIT = 120.0
#: What a series, a family or a parameter may be called.
_NAME = re.compile(r"[^\W_][\w.*+'-]{0,39}", re.ASCII)


def checked_name(what: str, text: object) -> str:
    """Return what a plugin calls something: up to 40 letters, digits and . * + ' - _, or raise `PluginError`."""
    if not isinstance(text, str) or not _NAME.fullmatch(text):
        raise PluginError(
            f"{what}: a name has up to 40 of the characters A-Z a-z 0-9 . * + ' - _, unlike {quoted(text)}"
        )
    return text


def checked_text(what: str, text: object, longest: int = 200) -> str:
    """Return a text of a plugin if it is printable, not blank and not longer than that, or raise `PluginError`."""
    if not isinstance(text, str) or not text.strip() or not text.isprintable() or len(text) > longest:
        raise PluginError(f"{what} must be one line of printable text, up to {longest} characters, not {quoted(text)}")
    return text


@contextmanager
def foreign(where: str = "") -> Iterator[None]:
    """Run code of a plugin: whatever it raises becomes a `PluginError` of one line.

    What it prints goes to standard error, what it changes of NumPy's and Python's warnings ends with it.  In the main
    thread it is interrupted after `LIMIT` seconds; Ctrl-C passes, and says where it was.
    """
    import numpy as np

    with _Alarm(LIMIT) as alarm, redirect_stdout(sys.stderr), np.errstate(), warnings.catch_warnings():
        try:
            yield
            alarm.settle()
        except BaseException as error:
            if alarm.rang:
                raise PluginError(f"it takes longer than {LIMIT:g} s") from None
            if isinstance(error, KeyboardInterrupt):
                raise KeyboardInterrupt(where) from None
            raise PluginError(one_line(error)) from error


def press_ctrl_c() -> None:
    """Interrupt the main thread, from another one; where the system can, also while it sleeps."""
    import _thread

    if hasattr(signal, "pthread_kill") and callable(signal.getsignal(signal.SIGINT)):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        _thread.interrupt_main()


class _Alarm:
    """Ctrl-C after some seconds, if in the main thread; also in a process that ignores Ctrl-C, as shells let those do
    that they run in the background, but there no other one is heard."""

    running: ClassVar[list[_Alarm]] = []

    def __init__(self, limit: float) -> None:
        self.rang = self.ignored = False
        main = threading.current_thread() is threading.main_thread()
        self.timer = threading.Timer(limit, self.ring) if main else None

    def ring(self) -> None:
        self.rang = True
        press_ctrl_c()

    def settle(self) -> None:
        """Wait for a Ctrl-C that is on its way."""
        if self.rang:
            time.sleep(1)

    def __enter__(self) -> _Alarm:
        if self.timer is not None:
            self.running.append(self)
            self.ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
            if self.ignored:
                signal.signal(signal.SIGINT, self.heard)
            self.timer.daemon = True
            self.timer.start()
        return self

    def heard(self, *_: object) -> None:
        if any(alarm.rang for alarm in self.running):
            raise KeyboardInterrupt

    def __exit__(self, *_: object) -> None:
        if self.timer is not None:
            self.timer.cancel()
            if self.ignored:
                signal.signal(signal.SIGINT, signal.SIG_IGN)
            self.running.remove(self)
