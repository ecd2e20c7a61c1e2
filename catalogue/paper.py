"""Paper to draw on, and the files it is written to; the same drawing gives the same file."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import InvalidRequest, MissingExtra, quoted
from .folders import is_folder, replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Distinct to colour-blind eyes, and in grey (Okabe and Ito).
PAPER, INK, GREY, FAINT = "#fdfcf9", "#26323d", "#75808a", "#c9ced2"
COUPLER, PATH, CRANK, DRIVER = "#0072b2", "#d55e00", "#4d5a66", "#00795a"
#: What can be written, by suffix, with what keeps the time of day out of the file.
FORMATS: dict[str, dict[str, Any]] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
#: What says that matplotlib is missing.
MISSING = 'drawing needs matplotlib: pip install "mechanism-catalogue[plot]"'
#: Resolution of a PNG [dots per inch].
DPI = 200
SANS, SERIF = "DejaVu Sans", "STIXGeneral"  # both come with matplotlib


def kind_of(file: str | PathLike[str], kinds: Sequence[str] = tuple(FORMATS)) -> str:
    """Return the format, one of some kinds, that the suffix of a file names, once it is clear that it can be
    written."""
    if not isinstance(file, str | PathLike):
        raise InvalidRequest(f"a drawing is written to a file, not to {quoted(file)}")
    file = Path(file)
    kind = file.suffix.lower().removeprefix(".")
    if kind not in kinds:
        named = f"the suffix {file.suffix!r}" if kind else "no suffix"
        *most, last = (f".{kind}" for kind in kinds)
        raise InvalidRequest(f"cannot draw to {file} with {named}; choose {', '.join(most)} or {last}")
    if not is_folder(file.parent):
        raise InvalidRequest(f"cannot draw to {file}: there is no folder {file.parent}")
    return kind


def blank(width: float, height: float) -> Figure:
    """Return an empty figure of a size in inches; pyplot does not know it, and a notebook shows it."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingExtra(MISSING) from error
    figure = Figure(figsize=(width, height), dpi=100, facecolor=PAPER)
    FigureCanvasAgg(figure)
    setattr(figure, "_repr_png_", partial(_written, figure, "png"))  # noqa: B010, mypy knows no such attribute
    return figure


def literal(figure: Figure) -> None:
    """Let all texts of a figure be shown as they are written: a dollar in somebody's name begins no formula."""
    from matplotlib.text import Text

    for one in figure.findobj(Text):
        one.set_parse_math(False)


def write(figure: Figure, file: Path, kind: str) -> None:
    """Write a figure to a file of a kind, in place of one that is there."""
    write_bytes(_written(figure, kind), file)


def write_bytes(content: bytes, file: Path) -> None:
    """Write a file, in place of one that is there."""
    try:
        with replacing(file) as part:
            part.write(content)
    except OSError as error:
        raise InvalidRequest(f"cannot write {file}: {error.strerror}") from error


def _written(figure: Figure, kind: str) -> bytes:
    """Return the figure as a file."""
    out = io.BytesIO()
    figure.savefig(out, format=kind, dpi=DPI, facecolor=PAPER, metadata=FORMATS[kind])
    if kind != "svg":
        return out.getvalue()
    # matplotlib salts the names of shared elements with a random number unless a global setting is changed
    names: dict[str, str] = {}
    return re.sub(
        r"\b[hmp][0-9a-f]{10}\b", lambda m: names.setdefault(m[0], f"{m[0][0]}{len(names)}"), out.getvalue().decode()
    ).encode()
