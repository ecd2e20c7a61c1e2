"""Handle Ctrl-C during import and exit of the command: one line, and the documented exit code.

Importing `cli.main` takes half a second, in which Python would print a traceback.  So this module
is imported before all others, and imports nothing slow.
"""

import sys
from _signal import SIG_IGN, SIGINT, default_int_handler, getsignal, signal  # type: ignore[import-not-found]  # `signal` itself takes time
from atexit import register
from os import _exit, write

#: Exit code after Ctrl-C: 128 + SIGINT, as shells report it.
INTERRUPTED = 130
MESSAGE = "interrupted; what was finished is kept"
_CALLED = (getattr(sys, "argv", None) or [""])[0].replace("\\", "/").rpartition("/")[2]
#: Whether this process is the command ``catalogue``, or ``python -m catalogue``.
IS_COMMAND = _CALLED.removesuffix(".exe") == "catalogue" or (
    _CALLED == "-m" and any(word.endswith("catalogue") for word in sys.orig_argv)
)


def end(*_: object) -> None:
    """End this process at once."""
    try:
        write(2, f"catalogue: {MESSAGE}\n".encode())
    finally:
        _exit(INTERRUPTED)


if IS_COMMAND and getsignal(SIGINT) is default_int_handler:  # not where the parent shell ignores Ctrl-C
    signal(SIGINT, end)
    register(signal, SIGINT, SIG_IGN)  # registered first, so called last: after the answer
