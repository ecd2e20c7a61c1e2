"""Where the project's own folders and the user's files are."""

from __future__ import annotations

import os
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def folder(name: str) -> Path:
    """Return the project folder `name` (``plugins``, ``migrations`` or ``data``).

    In a wheel it lies inside the package as ``_name``; in a checkout it is the top-level folder beside the package.
    """
    packed = _PACKAGE / f"_{name}"
    return packed if packed.is_dir() else _PACKAGE.parent / name


def default_database() -> Path:
    """Return the database file used when none is named: ``CATALOGUE_DB``, else one in the user's data directory."""
    named = os.environ.get("CATALOGUE_DB")
    if named:
        return Path(named).expanduser()
    return user_folder() / "catalogue.db"


def answers_file() -> Path:
    """Return the file in which answers are kept by their codes: ``CATALOGUE_ANSWERS``, else one in the user's data
    directory."""
    named = os.environ.get("CATALOGUE_ANSWERS")
    return Path(named).expanduser() if named else user_folder() / "answers.db"


def user_folder() -> Path:
    """Return the user's data directory."""
    from platformdirs import user_data_path

    return user_data_path("mechanism-catalogue", appauthor=False)


def write_file(file: Path, data: bytes) -> None:
    """Write a file, all of it or nothing of it; a link of that name is replaced, what it leads to is left alone."""
    part = file.with_name(f"{file.name}.part")
    part.unlink(missing_ok=True)
    try:
        with part.open("xb") as out:
            out.write(data)
        part.replace(file)
    finally:
        part.unlink(missing_ok=True)


def plugin_folders(extra: tuple[str, ...] = ()) -> list[Path]:
    """Return the folders searched for plugins: the built-in one, those of ``CATALOGUE_PLUGINS``, then `extra`."""
    named = [part for part in os.environ.get("CATALOGUE_PLUGINS", "").split(os.pathsep) if part]
    return [folder("plugins"), *(Path(part).expanduser() for part in (*named, *extra))]
