"""Exceptions of the catalogue.

Every error that a user can cause or must act on is a `CatalogueError`; its text is one line that says
what is wrong and what to do.  The shell prints that line and exits with `exit_code`.
"""

from __future__ import annotations


class CatalogueError(Exception):
    """Base of every error raised on purpose by the catalogue."""

    exit_code = 1


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


class DuplicateSeries(PluginError):
    """Two plugins claim one series or family."""


class MissingExtra(CatalogueError, ImportError):
    """An optional package that this request needs is not installed."""

    exit_code = 6


class PluginWarning(UserWarning):
    """A plugin was left out; the text names it and says why."""


def one_line(error: BaseException) -> str:
    text = str(error).strip().splitlines()
    return f"{type(error).__name__}: {text[0]}" if text else type(error).__name__


def quoted(value: object) -> str:
    """Return a value as an error quotes it: its repr, on one short line."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # of a number with thousands of digits, or of anybody's class
        text = f"a {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."
