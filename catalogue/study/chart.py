"""The map of a study as a page of HTML that stands alone.

Cells over two axes, shaded by a value of their best answer, one chart for each combination of the
other axes; heavy lines where the series or the family changes; below, a card for each cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..draw import moving_svg
from ..draw.moving_style import DARK, LIGHT, STYLE, properties
from ..errors import InvalidRequest
from ..find.answers import candidate_of
from ..markup import NOTHING, Markup, element, fill, join
from ..units import decimal

if TYPE_CHECKING:
    import pandas as pd

#: Values that may shade a cell, with their titles.
VALUES = {
    "score": "Score",
    "size": "Size",
    "deviation": "Deviation",
    "min_transmission": "Minimum transmission angle",
    "allowance": "Allowance",
}


@dataclass(frozen=True)
class Layout:
    """Bounds and sizes of a page."""

    drawn: int = 100  #: maximum number of cells with a drawing: a page of some megabytes
    charts: int = 24  #: maximum number of charts
    shades: int = 8
    cell: tuple[int, int] = (64, 34)  #: width and height of a cell [px]
    labels: tuple[int, int] = (150, 46)  #: room for the labels of rows and of columns [px]


LAYOUT = Layout()

_PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>$title</title>
<link rel="icon" href="data:,">
<style>
:root { $light color-scheme: light dark }
@media (prefers-color-scheme: dark) { :root { $dark } }
body { margin: 2rem auto; max-width: 76rem; padding: 0 1rem; background: var(--guide-paper);
  color: var(--guide-ink); font: 15px/1.5 system-ui, sans-serif }
h1 { font: bold 1.6rem/1.2 Georgia, serif } h2 { font-size: 1rem } p { max-width: 46rem }
.charts { display: flex; flex-wrap: wrap; gap: 1rem 2rem } .charts svg { display: block; max-width: 100% }
.charts text { font-size: 11px; fill: var(--guide-ink) } .charts .axis { fill: var(--guide-grey) }
.cell { fill: var(--guide-coupler); stroke: var(--guide-paper) } .none { fill: var(--guide-faint); fill-opacity: .5 }
.step { stroke: var(--guide-ink); stroke-width: 2.5 } a:hover .cell, a:focus .cell { stroke: var(--guide-path);
  stroke-width: 3 } .charts text.dark { fill: var(--guide-paper) }
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(16rem, 1fr)); gap: 1rem }
.cards article { border: 1px solid var(--guide-faint); border-radius: .4rem; padding: .6rem .8rem }
.cards article:target { border-color: var(--guide-path) } .cards svg { width: 100%; height: auto }
.cards h2, .cards p { margin: 0 } .grey { color: var(--guide-grey) } code { font-size: 1rem }
$drawings
</style>
$body
"""


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
    known = [row[f"best_{value}"] for row in rows if row["status"] == "answers" and row[f"best_{value}"] is not None]
    span = (min(known), max(known)) if known else (0.0, 1.0)
    drawn = [
        element("section", _heading(others, key), _chart(part, value, span, (x, axes[x]), (y, axes.get(y, [""]))))
        for key, part in charts.items()
    ]
    cards = [_card(row, records.get(row["number"]) if len(rows) <= LAYOUT.drawn else None) for row in rows]
    title = f"{VALUES[value]} over {_words(x)}" + (f" and {_words(y)}" if y else "")
    told = (
        f"From {span[0]:.4g} (pale) to {span[1]:.4g} (full colour). Heavy lines: the series or the family changes. "
        "Grey: no answer; its card says what to change. A cell leads to its card."
    )
    head = [element("h1", title), element("p", told, class_="grey")]
    charted, carded = element("div", *drawn, class_="charts"), element("div", *cards, class_="cards")
    body = join([*head, charted, element("h2", "Cells"), carded])
    colours = {"light": properties(LIGHT), "dark": properties(DARK)}
    return str(fill(_PAGE, title=title, drawings=STYLE, body=body, **colours))


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


def _words(name: str) -> str:
    return name.replace("_", " ")


def _heading(names: Sequence[str], values: Sequence[str]) -> Markup:
    told = ", ".join(f"{_words(name)} {value or 'none'}" for name, value in zip(names, values, strict=True))
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
    for i, column in enumerate(columns):
        for k, level in enumerate(levels):
            if row := at.get((column, level)):
                parts.append(_cell(row, value, span, LAYOUT.labels[0] + i * wide, k * high))
    places = {(i, k): at.get((column, level)) for i, column in enumerate(columns) for k, level in enumerate(levels)}
    for (i, k), row in places.items():
        left, top = LAYOUT.labels[0] + i * wide, k * high
        if _is_step(row, places.get((i + 1, k))):
            parts.append(_line(left + wide, top, left + wide, top + high))
        if _is_step(row, places.get((i, k + 1))):
            parts.append(_line(left, top + high, left + wide, top + high))
    bottom = len(levels) * high
    for i, column in enumerate(columns):
        parts.append(_label(column, LAYOUT.labels[0] + (i + 0.5) * wide, bottom + 16, "middle"))
    for k, level in enumerate(levels):
        parts.append(_label(level, LAYOUT.labels[0] - 8, (k + 0.6) * high, "end"))
    parts.append(_label(_words(x[0]), LAYOUT.labels[0] + 0.5 * len(columns) * wide, bottom + 36, "middle", "axis"))
    if y[0]:
        parts.append(_label(_words(y[0]), 4, bottom + 16, "start", "axis"))
    size = (LAYOUT.labels[0] + len(columns) * wide + 8, bottom + LAYOUT.labels[1])
    return element("svg", *parts, width=size[0], height=size[1], viewBox=f"0 0 {size[0]} {size[1]}", role="img")


def _cell(row: dict[str, Any], value: str, span: tuple[float, float], left: float, top: float) -> Markup:
    best = row[f"best_{value}"] if row["status"] == "answers" else None
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
    words = "" if best is None else f"{best:.4g}"
    text = _label(
        words, left + 0.5 * LAYOUT.cell[0], top + 0.6 * LAYOUT.cell[1], "middle", "dark" if step > 0.5 else None
    )
    return element("a", box, text, href=f"#cell-{row['number']}")


def _is_step(one: dict[str, Any] | None, other: dict[str, Any] | None) -> bool:
    if one is None or other is None or "answers" not in (one["status"], other["status"]):
        return False
    return [one["best_series"], one["best_family"]] != [other["best_series"], other["best_family"]]


def _line(x1: float, y1: float, x2: float, y2: float) -> Markup:
    return element("line", x1=x1, y1=y1, x2=x2, y2=y2, class_="step")


def _label(words: str, x: float, y: float, anchor: str, kind: str | None = None) -> Markup:
    return element("text", words, x=f"{x:g}", y=f"{y:g}", text_anchor=anchor, class_=kind)


def _card(row: dict[str, Any], record: str | None) -> Markup:
    """Make the card of a cell: request, drawing, code and numbers of the best answer, or advice."""
    name = f"cell-{row['number']}"
    asked = list(row)[1 : list(row).index("status")]
    values = ((_words(one), _text(row[one])) for one in asked)
    request = element("p", ", ".join(f"{word} {value}" for word, value in values if value), class_="grey")
    if row["status"] != "answers":
        advice = [f": {row['advice']}"] * bool(row["advice"])
        return element("article", element("h2", row["reason"], *advice), request, id=name)
    drawing = NOTHING
    if record is not None:
        drawing = moving_svg(candidate_of(record), width=260, height=150, style=False)
    numbers = ", ".join(f"{VALUES[one].lower()} {row[f'best_{one}']:.4g}" for one in VALUES if _is_number(row, one))
    head = element("h2", f"{row['best_series']} {row['best_family']} ", element("code", row["code"]))
    return element("article", drawing, head, element("p", numbers), request, id=name)


def _is_number(row: dict[str, Any], name: str) -> bool:
    value = row[f"best_{name}"]
    return value is not None and value == value
