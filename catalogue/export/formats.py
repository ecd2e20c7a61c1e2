"""Formats of an export, and their selection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from ..errors import InvalidRequest, quoted
from ..units import ASSUMED, ASSUMPTION, unit_or_none

#: Description of each format.
FORMATS = {
    "dxf": "drawing with a block per link, and parts to cut",
    "json": "the guide with lengths, limits and provenance, for other commands",
    "csv": "motion table",
    "xlsx": "motion table as a workbook",
    "parquet": "motion table as Parquet",
    "svg": "drawing and parts to cut in true size",
    "solidworks": "equations: named parameters",
    "fusion": "user parameters as CSV",
    "freecad": "macro that builds parameters and parts",
    "step": "parts as solids in place",
    "pylinkage": "script that moves the guide and checks its deviation",
}
#: Default formats by suffix.
SUFFIXES = {
    ".dxf": "dxf",
    ".svg": "svg",
    ".json": "json",
    ".csv": "csv",
    ".xlsx": "xlsx",
    ".parquet": "parquet",
    ".txt": "solidworks",
    ".fcmacro": "freecad",
    ".py": "pylinkage",
    ".step": "step",
    ".stp": "step",
}
#: Binary formats, which cannot be printed.
BINARY = ("xlsx", "parquet")
#: Formats that need a unit.
UNIT_FORMATS = ("dxf", "svg", "step", "freecad", "solidworks", "fusion")


@dataclass(frozen=True)
class Options:
    """Options of an export.

    Parameters
    ----------
    unit : str, optional
        Unit to convert to; lengths of unknown unit are taken to be in it.  Default: that of the
        guide.
    bar_width, hole : float, optional
        Width of the bars and diameter of the holes; round ones by default [length].
    positions : int
        Rows of the motion table.
    columns : sequence of str
        Columns of the motion table: headings, or their beginnings, without units; all if empty.
    over : str, optional
        ``stroke`` or ``circuit``; default: the stroke, if there is one.
    """

    unit: str | None = None
    bar_width: float | None = None
    hole: float | None = None
    positions: int = 73
    columns: Sequence[str] = ()
    over: str | None = None

    @property
    def written(self) -> str:
        """Unit of a file that needs one."""
        return self.unit or ASSUMED

    @property
    def assumption(self) -> str:
        """Note of such a file on an unknown unit; else empty."""
        return "" if self.unit else ASSUMPTION

    def __post_init__(self) -> None:
        unit_or_none(self.unit)
        if self.over is not None and not (isinstance(self.over, str) and self.over in ("stroke", "circuit")):
            raise InvalidRequest(f"over must be stroke or circuit, not {quoted(self.over)}")
        if isinstance(self.columns, str):
            object.__setattr__(self, "columns", (self.columns,))
        if not isinstance(self.columns, Sequence) or not all(isinstance(name, str) for name in self.columns):
            raise InvalidRequest(f"columns must be names, not {quoted(self.columns)}")


def choose_format(format: str | None, file: Path | None) -> str:
    """Return the named format, or that of the suffix of a file.

    Raises
    ------
    InvalidRequest
        If the format is unknown or missing.
    """
    if format is None and file is None:
        raise InvalidRequest(f"name a format ({', '.join(FORMATS)}), or a file by whose suffix it is known")
    if format is None and file is not None:
        format = SUFFIXES.get(file.suffix.lower())
        if format is None:
            known = ", ".join(sorted(SUFFIXES))
            raise InvalidRequest(f"the suffix of {file} names no format; choose one of {known}, or name the format")
    if not isinstance(format, str) or format not in FORMATS:
        near = get_close_matches(str(format), FORMATS, 1)
        hint = f"did you mean {near[0]!r}?" if near else f"choose {', '.join(FORMATS)}"
        raise InvalidRequest(f"there is no format {quoted(format)}; {hint}")
    return format
