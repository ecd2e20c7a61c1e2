"""The map of a study as a self-contained page of HTML.

Cells over two axes are shaded by a value of their best answer, in one chart for each combination of
the other axes. Contours show the value, heavy lines a change of series or family. Below the charts
each cell has a card, unless there are thousands.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from ..draw.svg import segments, ticks
from ..errors import InvalidRequest
from ..find.answers import candidate_of
from ..markup import NOTHING, Markup, element
from ..units import decimal
from .contours import contours
from .page import VALUES, answer_head, card, label, plain_words, standing_alone


@dataclass(frozen=True)
class Layout:
    """Bounds and sizes of a page."""

    drawn: int = 100  #: maximum number of cells with a drawing: a page of some megabytes
    charts: int = 24  #: maximum number of charts
    shades: int = 8
    levels: int = 8  #: maximum number of contours
    cell: tuple[int, int] = (64, 38)  #: width and height of a cell [px]
    single: int = 3000  #: maximum number of cells with links and cards: a page of two megabytes
    small: tuple[int, int] = (8, 6)  #: width and height of a cell on a map of more cells [px]
    between: int = 72  #: least horizontal distance of labels of small cells [px]
    labels: tuple[int, int] = (176, 46)  #: width and height of the space for the labels of rows and of columns [px]


LAYOUT = Layout()


def page(columns: Mapping[str, list[Any]], records: dict[int, str], value: str, x: str = "", y: str = "") -> str:
    """Draw the map of a study.

    Parameters
    ----------
    columns : mapping of str to list
        Those of `Study.to_pandas`.
    records : dict of int to str
        Records of the best answers to draw, by number.
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
    axes = _possible_axes(columns)
    names = sorted(axes, key=lambda name: -len(axes[name]))
    if wrong := [name for name in (x, y) if name and name not in axes]:
        raise InvalidRequest(f"{wrong[0]} does not vary in this study: its axes are {', '.join(names) or 'none'}")
    x = x or next((name for name in names if name != y), "")
    y = y or next((name for name in names if name != x), "")
    if not x:
        raise InvalidRequest("a map needs an axis: all requests of this study are alike")
    others = [name for name in axes if name not in (x, y)]
    rows = [dict(zip(columns, cells, strict=True)) for cells in zip(*columns.values(), strict=True)]
    charts: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for row in rows:
        charts.setdefault(tuple(_text(row[name]) for name in others), []).append(row)
    if len(charts) > LAYOUT.charts:
        raise InvalidRequest(
            f"this map has {len(charts)} charts, {LAYOUT.charts} at most: {', '.join(others)} vary too"
        )
    known = [row[f"best_{value}"] for row in rows if _is_number(row, value)]
    span = (min(known), max(known)) if known else (0.0, 1.0)
    dense, sides = len(rows) > LAYOUT.single, ((x, axes[x]), (y, axes.get(y, [""])))
    drawn = [
        element("section", _heading(others, key), _chart(part, value, span, *sides, dense=dense))
        for key, part in charts.items()
    ]
    cards = [] if dense else [_card(row, records.get(row["number"])) for row in rows]
    title = f"{VALUES[value]} over {plain_words(x)}" + (f" and {plain_words(y)}" if y else "")
    levels = ticks(span[0], span[1], LAYOUT.levels)
    told = (
        f"From {span[0]:.4g} (pale) to {span[1]:.4g} (full colour)"
        + (f", with a contour every {levels[1] - levels[0]:.3g}" if len(levels) > 1 and y else "")
        + ". Heavy lines: the series or the family changes. Grey: no answer"
        + ("." if dense else "; its card says what to change. A cell leads to its card.")
    )
    return standing_alone(title, told, drawn, cards)


def _possible_axes(columns: Mapping[str, list[Any]]) -> dict[str, list[str]]:
    """Return the possible axes: columns with more than one value, with their values as text."""
    names = [*columns]
    found = {}
    for name in names[1 : names.index("status")]:
        values = {one for one in columns[name] if one == one}
        gap = any(one != one for one in columns[name])
        every = [_text(one) for one in sorted(values, key=_sort_key)] + [""] * gap
        if len(every) > 1:
            found[name] = every
    return found


def _sort_key(value: Any) -> tuple[int, float, str]:
    if isinstance(value, str):
        parts = value.split()
        try:
            x0, y0, x1, y1 = map(float, parts)
        except ValueError:
            return 1, 0.0, value
        return 1, (x1 - x0) * (y1 - y0), value
    return 0, float(value), ""


@lru_cache(maxsize=4096, typed=True)
def _text(value: object) -> str:
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
    *,
    dense: bool,
) -> Markup:
    """Draw the cells of one chart, y upwards, with steps between different series and families."""
    wide, high = size = LAYOUT.small if dense else LAYOUT.cell
    columns, levels = x[1], y[1][::-1]
    at = {(_text(row[x[0]]), _text(row[y[0]]) if y[0] else ""): row for row in rows}
    places = {(i, k): at.get((column, level)) for i, column in enumerate(columns) for k, level in enumerate(levels)}
    shown = {place: row for place, row in places.items() if row is not None}
    parts, words = _small_cells(shown, value, span) if dense else _cells(shown, value, span)
    parts += [*_steps(places, size), *_contours(places, value, span, size), *words]
    bottom = len(levels) * high
    for i, column in list(enumerate(columns))[:: -(-LAYOUT.between // wide) if dense else 1]:
        parts.append(label(column, LAYOUT.labels[0] + (i + 0.5) * wide, bottom + 16, "middle"))
    for k, level in list(enumerate(levels))[:: -(-LAYOUT.between // (3 * high)) if dense else 1]:
        parts.append(label(level, LAYOUT.labels[0] - 8, max((k + 0.6) * high, 9), "end"))
    parts.append(label(plain_words(x[0]), LAYOUT.labels[0] + 0.5 * len(columns) * wide, bottom + 36, "middle", "axis"))
    if y[0]:
        parts.append(label(plain_words(y[0]), 4, bottom + 16, "start", "axis"))
    right, low = LAYOUT.labels[0] + len(columns) * wide + 8, bottom + LAYOUT.labels[1]
    return element("svg", *parts, width=right, height=low, viewBox=f"0 0 {right} {low}", role="img")


def _cells(
    shown: dict[tuple[int, int], dict[str, Any]], value: str, span: tuple[float, float]
) -> tuple[list[Markup], list[Markup]]:
    """Draw each cell with a link to its card; return the texts separately."""
    wide, high = LAYOUT.cell
    drawn = [_cell(row, value, span, LAYOUT.labels[0] + i * wide, k * high) for (i, k), row in shown.items()]
    return [cell for cell, _ in drawn], [text for _, texts in drawn for text in texts]


def _small_cells(
    shown: dict[tuple[int, int], dict[str, Any]], value: str, span: tuple[float, float]
) -> tuple[list[Markup], list[Markup]]:
    """Draw small cells: all cells of one shade as one path."""
    wide, high = LAYOUT.small
    data: dict[float | None, list[str]] = {}
    for (i, k), row in shown.items():
        square = f"M{LAYOUT.labels[0] + i * wide} {k * high}h{wide}v{high}h{-wide}z"
        data.setdefault(_shade(row, value, span), []).append(square)
    return [
        element("path", d="".join(squares), **_cell_attributes(shade, "tint cell")) for shade, squares in data.items()
    ], []


def _steps(places: dict[tuple[int, int], dict[str, Any] | None], size: tuple[int, int]) -> list[Markup]:
    """Draw the sides between cells of different series or families."""
    wide, high = size
    data = []
    for (i, k), row in places.items():
        left, top = LAYOUT.labels[0] + i * wide, k * high
        if _is_step(row, places.get((i + 1, k))):
            data.append(f"M{left + wide} {top}v{high}")
        if _is_step(row, places.get((i, k + 1))):
            data.append(f"M{left} {top + high}h{wide}")
    return [element("path", d="".join(data), class_="step")] if data else []


def _shade(row: dict[str, Any], value: str, span: tuple[float, float]) -> float | None:
    """Return the shade of a cell, 0 to 1; None without an answer."""
    if not _is_number(row, value):
        return None
    part = 0.0 if span[1] == span[0] else (row[f"best_{value}"] - span[0]) / (span[1] - span[0])
    return min(int(part * LAYOUT.shades), LAYOUT.shades - 1) / (LAYOUT.shades - 1)


def _cell_attributes(shade: float | None, kind: str = "cell") -> dict[str, str]:
    """Return the attributes of a cell with a given shade."""
    if shade is None:
        return {"class_": f"{kind} none"}
    return {"class_": kind, "fill-opacity": f"{0.12 + 0.88 * shade:.2f}"}


def _contours(
    places: dict[tuple[int, int], dict[str, Any] | None],
    value: str,
    span: tuple[float, float],
    size: tuple[int, int],
) -> list[Markup]:
    """Draw the contours between the centres of cells of one kind."""
    found = {place: row for place, row in places.items() if row is not None and _is_number(row, value)}
    values = {place: float(row[f"best_{value}"]) for place, row in found.items()}
    kinds = {place: _series_and_family(row) for place, row in found.items()}
    wide, high = size
    levels = ticks(span[0], span[1], LAYOUT.levels)
    drawn = []
    for level, ends in zip(levels, contours(values, kinds, levels), strict=True):
        x, y = LAYOUT.labels[0] + (ends.real + 0.5) * wide, (ends.imag + 0.5) * high
        if data := segments(x + 1j * y):
            drawn.append(element("path", element("title", f"{level:.4g}"), d=data, class_="level"))
    return drawn


def _cell(
    row: dict[str, Any], value: str, span: tuple[float, float], left: float, top: float
) -> tuple[Markup, list[Markup]]:
    """Draw a cell that links to its card; return its texts separately, for above the contours."""
    best = row[f"best_{value}"] if _is_number(row, value) else None
    shade = _shade(row, value, span)
    told = f"request {row['number']}: " + (
        f"{row['best_series']} {row['best_family']}, {VALUES[value].lower()} {best:.4g}, {row['code']}"
        if best is not None
        else f"{row['reason']} {row['advice']}"
    )
    face = _cell_attributes(shade)
    box = element("rect", element("title", told), x=left, y=top, width=LAYOUT.cell[0], height=LAYOUT.cell[1], **face)
    dark, middle = " dark" if shade is not None and shade > 0.5 else "", left + 0.5 * LAYOUT.cell[0]
    words = [] if best is None else [(f"{best:.4g}", 0.45, "value"), (row["best_series"], 0.8, "kind")]
    texts = [label(text, middle, top + at * LAYOUT.cell[1], "middle", kind + dark) for text, at, kind in words]
    return element("a", box, href=f"#cell-{row['number']}"), texts


def _is_step(one: dict[str, Any] | None, other: dict[str, Any] | None) -> bool:
    if one is None or other is None or "answers" not in (one["status"], other["status"]):
        return False
    return _series_and_family(one) != _series_and_family(other)


def _series_and_family(row: dict[str, Any]) -> tuple[Any, Any]:
    return row["best_series"], row["best_family"]


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
