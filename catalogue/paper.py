"""Figures, colours and reproducible files of drawings: one drawing always gives the same bytes."""

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

# Colours, distinct to colour-blind eyes and in grey (Okabe and Ito).
PAPER = "#fdfcf9"
INK = "#26323d"
GREY = "#75808a"
FAINT = "#c9ced2"
COUPLER = "#0072b2"
PATH = "#d55e00"
CRANK = "#4d5a66"
DRIVER = "#00795a"
#: Writable formats by suffix, with the metadata to omit, which would hold the time of day.
FORMATS: dict[str, dict[str, Any]] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
#: Message where matplotlib is not installed.
MISSING = 'drawing needs matplotlib: pip install "mechanism-catalogue[plot]"'
#: Resolution of a PNG [dots per inch]: hairlines of half a point are more than one dot.
DPI = 200
# Fonts; both come with matplotlib.
SANS = "DejaVu Sans"
SERIF = "STIXGeneral"


def kind_of(file: str | PathLike[str], kinds: Sequence[str] = tuple(FORMATS)) -> str:
    """Return the format of a file from its suffix; refuse unknown suffixes and missing folders."""
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
    """Create an empty figure of a size in inches, outside pyplot; a notebook shows it."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingExtra(MISSING) from error
    figure = Figure(figsize=(width, height), dpi=100, facecolor=PAPER)
    FigureCanvasAgg(figure)
    setattr(figure, "_repr_png_", partial(rendered, figure, "png"))  # noqa: B010, mypy knows no such attribute
    return figure


def literal(figure: Figure) -> None:
    """Show all texts of a figure literally: a dollar sign in a name begins no formula."""
    from matplotlib.text import Text

    for one in figure.findobj(Text):
        one.set_parse_math(False)


def write(figure: Figure, file: Path, kind: str) -> None:
    """Write a figure to a file, replacing an existing one."""
    write_bytes(rendered(figure, kind), file)


def write_bytes(content: bytes, file: Path) -> None:
    """Write bytes to a file, replacing an existing one."""
    try:
        with replacing(file) as part:
            part.write(content)
    except OSError as error:
        raise InvalidRequest(f"cannot write {file}: {error.strerror}") from error


def rendered(figure: Figure, kind: str) -> bytes:
    """Render the figure as the bytes of a file."""
    out = io.BytesIO()
    figure.savefig(out, format=kind, dpi=DPI, facecolor=PAPER, metadata=FORMATS[kind])
    if kind != "svg":
        return out.getvalue()
    # matplotlib salts the names of shared elements with a random number unless a global setting is
    # changed
    names: dict[str, str] = {}
    return re.sub(
        r"\b[hmp][0-9a-f]{10}\b", lambda m: names.setdefault(m[0], f"{m[0][0]}{len(names)}"), out.getvalue().decode()
    ).encode()
