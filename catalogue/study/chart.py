"""The map of a study as a page of HTML that stands alone.

Cells over two axes, shaded by a value of their best answer, one chart for each combination of the
other axes; contours of the value, heavy lines where the series or the family changes; below, a
card for each cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..draw.svg import pair, ticks
from ..errors import InvalidRequest
from ..find.answers import candidate_of
from ..markup import NOTHING, Markup, element
from ..units import decimal
from .contours import contours
from .page import VALUES, answer_head, card, label, plain_words, standing_alone

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Layout:
    """Bounds and sizes of a page."""

    drawn: int = 100  #: maximum number of cells with a drawing: a page of some megabytes
    charts: int = 24  #: maximum number of charts
    shades: int = 8
    levels: int = 8  #: maximum number of contours
    cell: tuple[int, int] = (64, 38)  #: width and height of a cell [px]
    labels: tuple[int, int] = (150, 46)  #: room for the labels of rows and of columns [px]


LAYOUT = Layout()


def page(table: pd.DataFrame, records: dict[int, str], value: str, x: str = "", y: str = "") -> str:
    """Draw the map of a study.

    Parameters
    ----------
    table : DataFrame
        As `Study.to_pandas` returns it.
    records : dict of int to str
        Records of the best answers by number.
    value : str
        One of `VALUES`.
    x, y : str
        Names of the axes; default: the two with the most values.

    Raises
    ------
    InvalidRequest
        If a value or an axis is unknown, or there are too many charts.
    """
    if value not in VALUES:
        raise InvalidRequest(f"a map shows one of {', '.join(VALUES)}, not {value!r}")
    axes = _axes(table)
    names = sorted(axes, key=lambda name: -len(axes[name]))
    if wrong := [name for name in (x, y) if name and name not in axes]:
        raise InvalidRequest(f"{wrong[0]} does not vary in this study: its axes are {', '.join(names) or 'none'}")
    x = x or next((name for name in names if name != y), "")
    y = y or next((name for name in names if name != x), "")
    if not x:
        raise InvalidRequest("a map needs an axis: all requests of this study are alike")
    others = [name for name in axes if name not in (x, y)]
    rows: list[dict[str, Any]] = [{str(k): v for k, v in row.items()} for row in table.to_dict("records")]
    charts: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for row in rows:
        charts.setdefault(tuple(_text(row[name]) for name in others), []).append(row)
    if len(charts) > LAYOUT.charts:
        raise InvalidRequest(
            f"this map has {len(charts)} charts, {LAYOUT.charts} at most: {', '.join(others)} vary too"
        )
    known = [row[f"best_{value}"] for row in rows if _is_number(row, value)]
    span = (min(known), max(known)) if known else (0.0, 1.0)
    drawn = [
        element("section", _heading(others, key), _chart(part, value, span, (x, axes[x]), (y, axes.get(y, [""]))))
        for key, part in charts.items()
    ]
    cards = [_card(row, records.get(row["number"]) if len(rows) <= LAYOUT.drawn else None) for row in rows]
    title = f"{VALUES[value]} over {plain_words(x)}" + (f" and {plain_words(y)}" if y else "")
    levels = ticks(span[0], span[1], LAYOUT.levels)
    told = (
        f"From {span[0]:.4g} (pale) to {span[1]:.4g} (full colour)"
        + (f", with a contour every {levels[1] - levels[0]:.3g}" if len(levels) > 1 and y else "")
        + ". Heavy lines: the series or the family changes. Grey: no answer; its card says what to change. "
        "A cell leads to its card."
    )
    return standing_alone(title, told, drawn, cards)


def _axes(table: pd.DataFrame) -> dict[str, list[str]]:
    """Return the values, as text, of the names that vary."""
    names = [str(name) for name in table.columns]
    asked = names[1 : names.index("status")]
    found = {name: sorted({one for one in table[name].tolist() if one == one}, key=_sorting) for name in asked}
    every = {name: [_text(one) for one in values] for name, values in found.items()}
    gaps = {name: [""] * bool(table[name].isna().any()) for name in asked}
    return {name: values + gaps[name] for name, values in every.items() if len(values) + len(gaps[name]) > 1}


def _sorting(value: Any) -> tuple[int, float, str]:
    if isinstance(value, str):
        parts = value.split()
        try:
            x0, y0, x1, y1 = map(float, parts)
        except ValueError:
            return 1, 0.0, value
        return 1, (x1 - x0) * (y1 - y0), value
    return 0, float(value), ""


def _text(value: Any) -> str:
    if value is None or value != value:
        return ""
    words = str(value).split()
    return " ".join(word if decimal(word) is None else f"{float(word):.6g}" for word in words)


def _heading(names: Sequence[str], values: Sequence[str]) -> Markup:
    told = ", ".join(f"{plain_words(name)} {value or 'none'}" for name, value in zip(names, values, strict=True))
    return element("h2", told) if told else NOTHING


def _chart(
    rows: Sequence[dict[str, Any]],
    value: str,
    span: tuple[float, float],
    x: tuple[str, list[str]],
    y: tuple[str, list[str]],
) -> Markup:
    """Draw the cells of one chart, y upwards, with steps between different series and families."""
    wide, high = LAYOUT.cell
    columns, levels = x[1], y[1][::-1]
    at = {(_text(row[x[0]]), _text(row[y[0]]) if y[0] else ""): row for row in rows}
    parts: list[Markup] = []
    words: list[Markup] = []
    for i, column in enumerate(columns):
        for k, level in enumerate(levels):
            if row := at.get((column, level)):
                cell, texts = _cell(row, value, span, LAYOUT.labels[0] + i * wide, k * high)
                parts.append(cell)
                words += texts
    places = {(i, k): at.get((column, level)) for i, column in enumerate(columns) for k, level in enumerate(levels)}
    for (i, k), row in places.items():
        left, top = LAYOUT.labels[0] + i * wide, k * high
        if _is_step(row, places.get((i + 1, k))):
            parts.append(_line(left + wide, top, left + wide, top + high))
        if _is_step(row, places.get((i, k + 1))):
            parts.append(_line(left, top + high, left + wide, top + high))
    parts += [*_levels(places, value, span), *words]
    bottom = len(levels) * high
    for i, column in enumerate(columns):
        parts.append(label(column, LAYOUT.labels[0] + (i + 0.5) * wide, bottom + 16, "middle"))
    for k, level in enumerate(levels):
        parts.append(label(level, LAYOUT.labels[0] - 8, (k + 0.6) * high, "end"))
    parts.append(label(plain_words(x[0]), LAYOUT.labels[0] + 0.5 * len(columns) * wide, bottom + 36, "middle", "axis"))
    if y[0]:
        parts.append(label(plain_words(y[0]), 4, bottom + 16, "start", "axis"))
    size = (LAYOUT.labels[0] + len(columns) * wide + 8, bottom + LAYOUT.labels[1])
    return element("svg", *parts, width=size[0], height=size[1], viewBox=f"0 0 {size[0]} {size[1]}", role="img")


def _levels(
    places: dict[tuple[int, int], dict[str, Any] | None], value: str, span: tuple[float, float]
) -> list[Markup]:
    """Draw the contours through the centres of the cells of a kind."""
    found = {place: row for place, row in places.items() if row is not None and _is_number(row, value)}
    values = {place: float(row[f"best_{value}"]) for place, row in found.items()}
    kinds = {place: _kind(row) for place, row in found.items()}
    wide, high = LAYOUT.cell
    drawn = []
    for level in ticks(span[0], span[1], LAYOUT.levels):
        ends = contours(values, kinds, level)
        placed = [
            [complex(LAYOUT.labels[0] + (z.real + 0.5) * wide, (z.imag + 0.5) * high) for z in each] for each in ends
        ]
        data = "".join(f"M{pair(one)}L{pair(other)}" for one, other in placed)
        if data:
            drawn.append(element("path", element("title", f"{level:.4g}"), d=data, class_="level"))
    return drawn


def _cell(
    row: dict[str, Any], value: str, span: tuple[float, float], left: float, top: float
) -> tuple[Markup, list[Markup]]:
    """Draw a cell that leads to its card; return its texts apart, to stand above the contours."""
    best = row[f"best_{value}"] if _is_number(row, value) else None
    shade = 0.0 if best is None or span[1] == span[0] else (best - span[0]) / (span[1] - span[0])
    step = min(int(shade * LAYOUT.shades), LAYOUT.shades - 1) / (LAYOUT.shades - 1)
    told = f"request {row['number']}: " + (
        f"{row['best_series']} {row['best_family']}, {VALUES[value].lower()} {best:.4g}, {row['code']}"
        if best is not None
        else f"{row['reason']} {row['advice']}"
    )
    face = {"class_": "cell none" if best is None else "cell"}
    if best is not None:
        face["fill-opacity"] = f"{0.12 + 0.88 * step:.2f}"
    box = element("rect", element("title", told), x=left, y=top, width=LAYOUT.cell[0], height=LAYOUT.cell[1], **face)
    dark, middle = " dark" if step > 0.5 else "", left + 0.5 * LAYOUT.cell[0]
    words = [] if best is None else [(f"{best:.4g}", 0.45, "value"), (row["best_series"], 0.8, "kind")]
    texts = [label(text, middle, top + at * LAYOUT.cell[1], "middle", kind + dark) for text, at, kind in words]
    return element("a", box, href=f"#cell-{row['number']}"), texts


def _is_step(one: dict[str, Any] | None, other: dict[str, Any] | None) -> bool:
    if one is None or other is None or "answers" not in (one["status"], other["status"]):
        return False
    return _kind(one) != _kind(other)


def _kind(row: dict[str, Any]) -> tuple[Any, Any]:
    return row["best_series"], row["best_family"]


def _line(x1: float, y1: float, x2: float, y2: float) -> Markup:
    return element("line", x1=x1, y1=y1, x2=x2, y2=y2, class_="step")


def _card(row: dict[str, Any], record: str | None) -> Markup:
    """Make the card of a cell: request, drawing, code and numbers of the best answer, or advice."""
    name = f"cell-{row['number']}"
    asked = list(row)[1 : list(row).index("status")]
    values = ((plain_words(one), _text(row[one])) for one in asked)
    request = element("p", ", ".join(f"{word} {value}" for word, value in values if value), class_="grey")
    if row["status"] != "answers":
        advice = [f": {row['advice']}"] * bool(row["advice"])
        return card(name, [row["reason"], *advice], [request])
    guide = None if record is None else candidate_of(record)
    numbers = ", ".join(f"{VALUES[one].lower()} {row[f'best_{one}']:.4g}" for one in VALUES if _is_number(row, one))
    head = answer_head(row["best_series"], row["best_family"], row["code"])
    return card(name, head, [element("p", numbers), request], guide)


def _is_number(row: dict[str, Any], name: str) -> bool:
    value = row[f"best_{name}"]
    return value is not None and value == value
