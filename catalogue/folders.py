"""Locate the project's folders and the user's files."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from errno import ENAMETOOLONG, ENOENT
from pathlib import Path
from secrets import token_hex
from stat import S_IMODE
from typing import BinaryIO

_PACKAGE = Path(__file__).resolve().parent


def folder(name: str) -> Path:
    """Return the project folder `name` (``plugins``, ``migrations`` or ``data``).

    In a wheel it lies inside the package as ``_name``; in a checkout it is the top-level folder
    beside the package.
    """
    packed = _PACKAGE / f"_{name}"
    return packed if packed.is_dir() else _PACKAGE.parent / name


def default_database() -> Path:
    """Return the default database file: ``CATALOGUE_DB``, else one in the user's data directory."""
    named = os.environ.get("CATALOGUE_DB")
    return Path(named) if named else user_folder() / "catalogue.db"


def answers_file() -> Path:
    """Return the file of answers: ``CATALOGUE_ANSWERS``, else one of the user."""
    named = os.environ.get("CATALOGUE_ANSWERS")
    return expanded(named) if named else user_folder() / "answers.db"


def user_folder() -> Path:
    """Return the user's data directory."""
    from platformdirs import user_data_path

    return user_data_path("mechanism-catalogue", appauthor=False)


def expanded(path: str | os.PathLike[str]) -> Path:
    """Expand ``~`` in a path; `OSError` if that user has no home."""
    try:
        return Path(path).expanduser()
    except RuntimeError:
        raise FileNotFoundError(ENOENT, "nobody of that name has a home", str(path)) from None


def is_folder(path: Path) -> bool:
    """Tell whether a folder exists; False for an impossible name."""
    with suppress(OSError):
        return path.is_dir()
    return False


def make_folder(path: Path) -> None:
    """Create a folder and its missing parents; `OSError` on failure."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except RecursionError:  # Python recurses once per missing parent
        raise OSError(ENAMETOOLONG, "it lies in too many folders", str(path)) from None


@contextmanager
def replacing(file: Path) -> Iterator[BinaryIO]:
    """Replace a file atomically: yield a temporary one, open for bytes, and rename it at the end.

    The temporary file lies in the same folder, with the mode of the replaced file or that of the
    umask.

    Raises
    ------
    OSError
        If the file cannot be written, or is a folder, a device or a link.
    """
    if file.is_symlink():
        raise OSError(0, "a link is there", str(file))
    if file.exists() and not file.is_file():
        raise OSError(0, "a folder or a device is there", str(file))
    part = unused_name(file)
    with part.open("xb") as content:  # exclusive: never opens an existing file or the target of a link
        try:
            if file.exists():
                part.chmod(S_IMODE(file.stat().st_mode))
            yield content
            content.close()
            part.replace(file)
        except BaseException:
            content.close()
            with suppress(OSError):
                part.unlink()
            raise


def unused_name(file: Path, beginning: str = ".catalogue-") -> Path:
    """Return an unguessable temporary name beside a file."""
    return file.with_name(f"{beginning}{token_hex(8)}.part")


def plugin_folders(extra: tuple[str, ...] = ()) -> list[Path]:
    """List the plugin folders: the built-in one, those of ``CATALOGUE_PLUGINS``, then `extra`."""
    named = [part for part in os.environ.get("CATALOGUE_PLUGINS", "").split(os.pathsep) if part]
    return [folder("plugins"), *(expanded(part).absolute() for part in (*named, *extra))]
