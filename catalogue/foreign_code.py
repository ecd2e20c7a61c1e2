"""Run code of plugins in this process: contain its errors, output and changes of global state."""

from __future__ import annotations

import os
import re
import signal
import sys
import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from typing import ClassVar

from .errors import PluginError, one_line, printable, quoted

#: Longest run of plugin code in this process [s]: the slowest built-in series takes a few percent.
LIMIT = 120.0
#: Time from one interrupt of plugin code to the next [s]: a handler that cleans up has this long.
PAUSE = 1.0
#: Permitted name of a series, a family or a parameter.
NAME = re.compile(r"[^\W_][\w.*+'-]{0,39}", re.ASCII)


def checked_name(what: str, text: object) -> str:
    """Check a name from a plugin: up to 40 letters, digits and . * + ' - _.

    Else raise `PluginError`.
    """
    if not isinstance(text, str) or not NAME.fullmatch(text):
        raise PluginError(
            f"{what}: a name has up to 40 of the characters A-Z a-z 0-9 . * + ' - _, unlike {quoted(text)}"
        )
    return text


def checked_text(what: str, text: object, longest: int = 200) -> str:
    """Check a text from a plugin: one printable line up to `longest`; else raise `PluginError`."""
    if not isinstance(text, str) or not text.strip() or not text.isprintable() or len(text) > longest:
        raise PluginError(f"{what} must be one line of printable text, up to {longest} characters, not {quoted(text)}")
    return text


@contextmanager
def foreign(where: str) -> Iterator[None]:
    """Run plugin code and convert any error to a `PluginError` of one line.

    Output goes to standard error.  Changes to NumPy's error state, Python's warnings, the current
    folder and the handler of Ctrl-C are undone at the end.  A process that the code forks ends
    here. In the main thread the code is interrupted after `LIMIT` seconds, then every `PAUSE`
    seconds; if it still runs after another `LIMIT` seconds, this process ends.  Ctrl-C passes with
    `where` as its text.

    Parameters
    ----------
    where : str
        Name of the plugin and hook, for the message.
    """
    import numpy as np

    alarm, process, folder = _Alarm(LIMIT, where), os.getpid(), _folder()
    try:
        with alarm, redirect_stdout(sys.stderr), np.errstate(), warnings.catch_warnings():
            try:
                yield
            finally:
                if os.getpid() != process:
                    os._exit(0)  # at once: unwritten output belongs to the parent process
                if folder and _folder() != folder:
                    os.chdir(folder)
    except BaseException as error:
        if alarm.rang:
            raise PluginError(f"it takes longer than {LIMIT:g} s") from None
        if isinstance(error, KeyboardInterrupt):
            raise KeyboardInterrupt(where) from None
        raise PluginError(one_line(error)) from error


def _folder() -> str:
    """Return the current folder, or an empty text if it was deleted."""
    with suppress(OSError):
        return os.getcwd()  # noqa: PTH109  # as text: what `Path` makes of it is of no use here
    return ""


@contextmanager
def uncounted() -> Iterator[None]:
    """Exempt work of this program inside plugin code, such as compiling, from the time limit."""
    start, alarms = time.monotonic(), [*_Alarm.running]
    for alarm in alarms:
        alarm.held += 1
    try:
        yield
    finally:
        for alarm in alarms:
            alarm.end += time.monotonic() - start
            alarm.held -= 1


def press_ctrl_c() -> None:
    """Interrupt the main thread from another one; on POSIX even while it sleeps."""
    import _thread

    if hasattr(signal, "pthread_kill") and callable(signal.getsignal(signal.SIGINT)):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        _thread.interrupt_main()


class _Alarm:
    """Watchdog of the main thread: interrupts it after a limit, then every `PAUSE` seconds.

    It also interrupts a process that ignores Ctrl-C (a background job of a shell), where interrupts
    of the user have no effect.
    """

    running: ClassVar[list[_Alarm]] = []

    def __init__(self, limit: float, where: str) -> None:
        self.limit, self.where, self.rang = limit, where, False
        self.end, self.held = time.monotonic() + limit, 0  # above 0 the alarm is suspended
        self.over = threading.Event()
        main = threading.current_thread() is threading.main_thread()
        self.thread = threading.Thread(target=self.ring, daemon=True) if main else None

    def ring(self) -> None:
        """Interrupt the main thread after the limit.

        End the process if interrupts have no effect.
        """
        while self.held or self.end > time.monotonic():
            if self.over.wait(max(self.end - time.monotonic(), PAUSE if self.held else 0.0)):
                return
        self.rang, last = True, time.monotonic() + self.limit
        while time.monotonic() < last:
            press_ctrl_c()
            if self.over.wait(PAUSE):
                return
        told = f"{self.where}: it goes on although it was interrupted after {self.limit:g} s; remove the plugin"
        with suppress(OSError):  # nobody reads the message
            os.write(2, f"catalogue: {printable(told)}\n".encode())
        os._exit(PluginError.exit_code)

    def __enter__(self) -> _Alarm:
        if self.thread is not None:
            try:
                self.thread.start()
            except RuntimeError:  # full process table, or Python in a browser: the code runs without watchdog
                self.thread = None
                return self
            self.handler = signal.getsignal(signal.SIGINT)
            self.running.append(self)
            if self.handler is signal.SIG_IGN:
                signal.signal(signal.SIGINT, self.heard)
        return self

    def heard(self, *_: object) -> None:
        if any(alarm.rang for alarm in self.running):
            raise KeyboardInterrupt

    def __exit__(self, *_: object) -> None:
        while self.thread is not None:
            try:
                self.over.set()
                self.thread.join()
                if self.rang:
                    time.sleep(0.01)  # for a pending Ctrl-C
                if self.handler is not None:  # None: the handler was installed by a C library
                    signal.signal(signal.SIGINT, self.handler)
                self.running[:] = [alarm for alarm in self.running if alarm is not self]
                return
            except KeyboardInterrupt:
                if not self.rang:
                    raise
