"""One guide written in one format."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InvalidRequest, quoted
from ..folders import is_folder, replacing
from ..guides.kinds import has_bars
from .formats import Options, choose_format

if TYPE_CHECKING:
    from ..guides.kinds import Guide

#: Module and name of the function of each format.
WRITERS = {
    "dxf": ("dxf", "written_dxf"),
    "json": ("record", "written_json"),
    "csv": ("table", "written_csv"),
    "xlsx": ("table", "written_xlsx"),
    "parquet": ("table", "written_parquet"),
    "solidworks": ("parameters", "solidworks"),
    "fusion": ("parameters", "fusion"),
    "freecad": ("freecad", "macro"),
    "step": ("step", "solids"),
    "svg": ("svg", "written_svg"),
    "pylinkage": ("pylinkage_script", "script"),
}
#: Formats of linkages of two dyads only.
TWO_DYADS = ("pylinkage",)


def export(
    guide: Guide, file: str | PathLike[str] | None = None, format: str | None = None, **options: Any
) -> str | bytes:
    """Export a guide in a format and unit, to a file if named.

    See `catalogue.PlacedGuide.export`.
    """
    if file is not None and not isinstance(file, str | PathLike):
        raise InvalidRequest(f"a guide is exported to a file, not to {quoted(file)}")
    path = None if file is None else Path(file)
    kind = choose_format(format, path)
    how = Options(**options)
    if path is not None:
        check(path)
    if kind in TWO_DYADS and has_bars(guide):
        others = ", ".join(one for one in WRITERS if one not in TWO_DYADS)
        raise InvalidRequest(f"{kind} holds linkages of two dyads: export a mechanism of many bars as {others}")
    module, name = WRITERS[kind]
    write: Callable[[Guide, Options], str | bytes] = getattr(import_module(f".{module}", __package__), name)
    placed = guide.in_unit(how.unit)
    made = write(placed, replace(how, unit=placed.unit))
    if path is not None:
        try:
            with replacing(path) as part:
                part.write(made if isinstance(made, bytes) else made.encode())
        except OSError as error:
            raise InvalidRequest(f"cannot write {path}: {error.strerror}") from error
        except ValueError:  # a name that is not valid for a file
            raise InvalidRequest(f"cannot write to a file of the name {quoted(str(path))}") from None
    return made


def check(file: Path) -> None:
    """Refuse a file that cannot be written, before work is done for it."""
    if not is_folder(file.parent):
        raise InvalidRequest(f"cannot write {file}: there is no folder {file.parent}")
    if is_folder(file):
        raise InvalidRequest(f"{file} is a folder: name a file in it")
