"""What a guide can be exported as, and how a format is chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from ..errors import InvalidRequest, quoted
from ..units import ASSUMED, ASSUMPTION, unit_or_none

#: Formats of a guide, each with what it is.
FORMATS = {
    "dxf": "drawing with a block per link, and parts to cut",
    "json": "the guide with lengths, limits and provenance, which other commands read",
    "csv": "table of the motion",
    "xlsx": "the same as a workbook",
    "parquet": "the same for programs",
    "solidworks": "equations: parameters by name",
    "fusion": "user parameters as CSV",
    "freecad": "macro that makes parameters and parts",
    "step": "parts as solids where they stand",
    "pylinkage": "script that moves it and checks its deviation",
}
#: Formats by the suffix of a file, where none is named.
SUFFIXES = {
    ".dxf": "dxf", ".json": "json", ".csv": "csv", ".xlsx": "xlsx", ".parquet": "parquet", ".txt": "solidworks",
    ".fcmacro": "freecad", ".py": "pylinkage", ".step": "step", ".stp": "step",
}  # fmt: skip
#: Formats that are no text, and cannot be printed.
BINARY = ("xlsx", "parquet")
#: Formats that must have a unit.
ASSUMING = ("dxf", "step", "freecad", "solidworks", "fusion")


@dataclass(frozen=True)
class Options:
    """How a guide is exported; `InvalidRequest` unless the unit is one of `catalogue.units`.

    Parameters
    ----------
    unit : str, optional
        To which the guide is converted; of a guide without a unit, that of its lengths.  That of the guide if not
        given.
    bar_width, hole : float, optional
        Of the parts to cut [the unit]; round ones if not given.
    positions : int
        Rows of a table of the motion.
    columns : sequence of str
        Columns of that table: headings, or their beginnings, without units; all if empty.
    over : str, optional
        ``stroke`` or ``circuit``; the stroke if there is one.
    """

    unit: str | None = None
    bar_width: float | None = None
    hole: float | None = None
    positions: int = 73
    columns: Sequence[str] = ()
    over: str | None = None

    @property
    def written(self) -> str:
        """The unit of a file that must have one."""
        return self.unit or ASSUMED

    @property
    def assumption(self) -> str:
        """What such a file says where no unit is known; else empty."""
        return "" if self.unit else ASSUMPTION

    def __post_init__(self) -> None:
        unit_or_none(self.unit)
        if self.over is not None and not (isinstance(self.over, str) and self.over in ("stroke", "circuit")):
            raise InvalidRequest(f"over must be stroke or circuit, not {quoted(self.over)}")
        if isinstance(self.columns, str):
            object.__setattr__(self, "columns", (self.columns,))
        if not isinstance(self.columns, Sequence) or not all(isinstance(name, str) for name in self.columns):
            raise InvalidRequest(f"columns must be names, not {quoted(self.columns)}")


def chosen(format: str | None, file: Path | None) -> str:
    """Return the format that is named, or that of the suffix of a file.

    Raises
    ------
    InvalidRequest
        If there is no such format, or neither says which.
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
