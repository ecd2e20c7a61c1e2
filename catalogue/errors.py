"""Exceptions of the catalogue.

Every error that a user can cause or must act on is a `CatalogueError`; its text is one line that says
what is wrong and what to do.  The shell prints that line and exits with `exit_code`.
"""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout

#: How long code of a plugin may take that runs in this process [s].
LIMIT = 120.0
#: What a series, a family or a parameter may be called.
_NAME = re.compile(r"[^\W_][\w.*+'-]{0,39}", re.ASCII)


class CatalogueError(Exception):
    """Base of every error raised on purpose by the catalogue."""

    exit_code = 1

    def __str__(self) -> str:
        """Return the text on one line, also where it quotes a name of several."""
        return " ".join(super().__str__().splitlines())


class InvalidLinkage(CatalogueError, ValueError):
    """Pivots that do not form a linkage: NaN, coincident pivots, a dyad with both pivots at infinity."""

    exit_code = 3


class InvalidDesign(CatalogueError, ValueError):
    """A named guide that contradicts itself: no source, an impossible linkage, a stroke that cannot be traced."""


class InvalidRequest(CatalogueError, ValueError):
    """A request that cannot be meant: negative stroke, empty box, unknown family or series."""

    exit_code = 2


class CannotDrive(InvalidRequest):
    """A drive that does not determine the motion: its scalar stands still, or other freedoms are left."""


class NotMovable(InvalidLinkage):
    """A mechanism without a freedom, or in a pose in which its freedoms are undetermined."""


class DatabaseError(CatalogueError):
    """The database file cannot be used: corrupt, locked, unreadable, on a full disk."""

    exit_code = 4


class DatabaseTooNew(DatabaseError):
    """The database was written by a newer version of the catalogue."""


class PluginError(CatalogueError):
    """A plugin breaks the contract in a way that cannot be isolated, or the one asked for is missing."""

    exit_code = 5


class WorkerKilled(PluginError):
    """The system killed the process that made a block, each time it was tried: for want of memory, most likely."""


class DuplicateSeries(PluginError):
    """Two plugins claim one series or family."""


class MissingExtra(CatalogueError, ImportError):
    """An optional package that this request needs is not installed."""

    exit_code = 6


class PluginWarning(UserWarning):
    """A plugin was left out; the text names it and says why."""


def one_line(error: BaseException) -> str:
    """Return the name of an error and the first line of its text, whatever its class does."""
    try:
        name, lines = type(error).__name__, str(error).strip().splitlines()
    except BaseException as other:
        _pass_on(other)
        return "an error that cannot say what it is"
    return shortened(f"{name}: {lines[0]}" if lines else name, 300)


def quoted(value: object) -> str:
    """Return a value as an error quotes it: its repr, on one short line."""
    try:
        text = repr(value)
    except BaseException as error:  # of a number with thousands of digits, or of anybody's class
        _pass_on(error)
        text = f"a {type(value).__name__}"
    return shortened(text, 60)


def printable(text: str) -> str:
    """Return text that does nothing to a terminal: control characters and half characters are written as escapes."""
    return text if text.isprintable() else "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def shortened(text: str, longest: int) -> str:
    """Return printable text on one line of so many characters at most: of a longer one its middle is left out."""
    half = (longest - 3) // 2
    line = printable(" ".join(text.split()))
    return line if len(line) <= longest else f"{line[:half]}...{line[-half:]}"


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
    import warnings

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
    import signal
    import threading

    if hasattr(signal, "pthread_kill") and callable(signal.getsignal(signal.SIGINT)):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        _thread.interrupt_main()


class _Alarm:
    """Ctrl-C after some seconds, if in the main thread."""

    def __init__(self, limit: float) -> None:
        import threading

        self.rang = False
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
            self.timer.daemon = True
            self.timer.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self.timer is not None:
            self.timer.cancel()


def _pass_on(error: BaseException) -> None:
    if isinstance(error, KeyboardInterrupt):
        raise error
