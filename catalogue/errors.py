"""Exceptions of the catalogue.

Every error that a user can cause or must act on is a `CatalogueError`.  Its text is one line: the
fault and the remedy.  The shell prints that line and exits with `exit_code`.
"""

from __future__ import annotations


class CatalogueError(Exception):
    """Base of every error raised on purpose by the catalogue."""

    exit_code = 1

    def __str__(self) -> str:
        """Return the text on one line, even where it quotes a name with line breaks."""
        return " ".join(super().__str__().splitlines())


class InvalidLinkage(CatalogueError, ValueError):
    """Pivots that form no linkage: NaN, coincident, or both of a dyad at infinity."""

    exit_code = 3


class InvalidDesign(CatalogueError, ValueError):
    """An inconsistent named guide: without source, impossible, or out of reach."""


class InvalidRequest(CatalogueError, ValueError):
    """An invalid request: negative stroke, empty box, unknown family or series."""

    exit_code = 2


class CannotDrive(InvalidRequest):
    """A drive that does not determine the motion: its scalar is stationary, or freedoms remain."""


class NotMovable(InvalidLinkage):
    """A mechanism without a freedom, or in a pose in which its freedoms are undetermined."""


class DatabaseError(CatalogueError):
    """The database file cannot be used: corrupt, locked, unreadable, on a full disk."""

    exit_code = 4


class DatabaseBusy(DatabaseError):
    """Another process is filling the database."""


class DatabaseTooNew(DatabaseError):
    """The database was written by a newer version of the catalogue."""


class PluginError(CatalogueError):
    """A plugin breaks its contract and cannot be isolated, or the requested one is missing."""

    exit_code = 5


class WorkerKilled(PluginError):
    """The system killed a worker process at every attempt, most likely for lack of memory."""


class EngineError(CatalogueError):
    """A cluster cannot be reached, or its workers hold another version of the catalogue."""

    exit_code = 5


class DuplicateSeries(PluginError):
    """Two plugins claim one series or family."""


class MissingExtra(CatalogueError, ImportError):
    """An optional package that this request needs is not installed."""

    exit_code = 6


class PluginWarning(UserWarning):
    """A plugin was rejected; the text names it and the reason."""


def one_line(error: BaseException) -> str:
    """Return class and first line of an error, even of an unprintable one."""
    try:
        name, lines = type(error).__name__, str(error).strip().splitlines()
    except BaseException as other:
        _pass_on(other)
        return "an error that cannot say what it is"
    return shortened(f"{name}: {lines[0]}" if lines else name, 300)


def quoted(value: object) -> str:
    """Return the repr of a value on one short line, for an error message."""
    try:
        text = repr(value)
    except BaseException as error:  # an integer of thousands of digits, or a faulty class
        _pass_on(error)
        text = f"a {type(value).__name__}"
    return shortened(text, 60)


def printable(text: str) -> str:
    """Escape control characters and lone surrogates, so that text cannot steer a terminal."""
    return text if text.isprintable() else "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def shortened(text: str, longest: int) -> str:
    """Return printable text on one line; a text above `longest` characters loses its middle."""
    half = (longest - 3) // 2
    line = printable(" ".join(text.split()))
    return line if len(line) <= longest else f"{line[:half]}...{line[-half:]}"


def _pass_on(error: BaseException) -> None:
    if isinstance(error, KeyboardInterrupt):
        raise error
