"""The motion of a guide as a table: CSV, a workbook, Parquet."""

from __future__ import annotations

import io
import re
from datetime import UTC, datetime
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

from ..errors import InvalidRequest, MissingExtra, quoted

if TYPE_CHECKING:
    import pandas as pd

    from ..guides.kinds import Guide
    from .formats import Options

#: Time of creation in a workbook: fixed, so that the same guide gives the same file.
EPOCH = datetime(2000, 1, 1, tzinfo=UTC)


def motion_table(guide: Guide, options: Options) -> pd.DataFrame:
    """Compute the motion table over the stroke, or over the circuit.

    Raises
    ------
    InvalidRequest
        If there is no stroke but it was requested, or a column is unknown.
    """
    stroke = getattr(guide, "stroke", None)
    if options.over == "stroke" and stroke is None:
        raise InvalidRequest(
            "this linkage has no stroke: export an answer of `measure`, or the motion over the circuit"
        )
    whole: Any = {"whole": True} if stroke is not None and options.over == "circuit" else {}
    table = guide.motion(options.positions, **whole).to_pandas()
    return table[_columns([str(name) for name in table.columns], options.columns)] if options.columns else table


def _columns(headings: list[str], wanted: Any) -> list[str]:
    """Select the headings that begin with the requested names, in their order, each once."""
    plain = {heading: heading.partition(" [")[0] for heading in headings}
    found: dict[str, None] = {}
    for name in wanted:
        named = re.sub(r" *\[.*", "", str(name)).strip()
        some = [heading for heading, text in plain.items() if text == named or text.startswith(f"{named} ")]
        if not some or not named:
            near = get_close_matches(named, plain.values(), 3) or sorted({*plain.values()})
            raise InvalidRequest(f"the motion has no column {quoted(name)}; there are {', '.join(near)}")
        found |= dict.fromkeys(some)
    return list(found)


def written_csv(guide: Guide, options: Options) -> str:
    return motion_table(guide, options).to_csv(index=False, lineterminator="\n")


def written_xlsx(guide: Guide, options: Options) -> bytes:
    """Return a workbook of one sheet with a fixed heading.

    Cells of NaN are empty.
    """
    try:
        import xlsxwriter  # type: ignore[import-untyped]  # it ships no types
    except ImportError as error:
        raise MissingExtra('xlsx needs xlsxwriter: pip install "mechanism-catalogue[cad]"') from error
    table, out = motion_table(guide, options), io.BytesIO()
    book = xlsxwriter.Workbook(out, {"in_memory": True})
    book.set_properties({"created": EPOCH})
    sheet, bold = book.add_worksheet("motion"), book.add_format({"bold": True})
    sheet.freeze_panes(1, 0)
    for k, heading in enumerate(table.columns):
        sheet.write_string(0, k, heading, bold)
        sheet.set_column(k, k, max(12, len(heading)))
        for i, value in enumerate(table[heading].tolist(), 1):
            if value == value and value != "":
                # write texts as such, never as formulas
                (sheet.write_string if isinstance(value, str) else sheet.write)(i, k, value)
    book.close()
    return out.getvalue()


def written_parquet(guide: Guide, options: Options) -> bytes:
    out = io.BytesIO()
    try:
        motion_table(guide, options).to_parquet(out, engine="pyarrow", index=False)
    except ImportError as error:
        raise MissingExtra('parquet needs pyarrow: pip install "mechanism-catalogue[parquet]"') from error
    return out.getvalue()
