"""Guides in a notebook: one animated drawing, or cards and a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from ..errors import CatalogueError, MissingExtra
from ..html_table import html_table
from ..markup import NOTHING, Markup, element, join
from .datasheet import EXACT_ORDER
from .moving import moving_svg
from .words import describe_guide, family

if TYPE_CHECKING:
    from ..guides.kinds import Guide


class Cards(NamedTuple):
    """Layout of drawings in a notebook."""

    width: float = 520.0  #: width of a single drawing [px]
    card: float = 250.0  #: width of a card [px]
    most: int = 6  #: largest number of cards: two rows of a notebook


CARDS = Cards()

#: Columns of the table with the format of their numbers.
COLUMNS = {
    "series": "",
    "family": "",
    "configuration": "",
    "order": ">",
    "stroke": "g",
    "deviation": ".3g",
    "radius": ".4g",
    "arc_angle": ".4g",
    "angle": ".4g",
    "residual": ".3g",
    "swing": ".4g",
    "allowance": ".3g",
    "size": ".4g",
    "min_transmission": ".0f",
    "score": ".0f",
    "unit": "",
}


def guide_html(guide: Guide) -> Markup:
    """Return an animated guide with one line of description."""
    return element("div", moving_svg(guide, width=CARDS.width, layers=("names",)), element("p", describe_guide(guide)))


def guide_png(guide: Guide) -> bytes | None:
    """Return a still of a guide as PNG, for viewers without HTML; None if it cannot be drawn."""
    from .sheet import sheet

    try:
        return bytes(sheet(guide)._repr_png_())  # type: ignore[attr-defined]  # see `paper.blank`
    except MissingExtra:
        return None


def cards_html(answers: Sequence[object], title: str) -> Markup:
    """Return the first answers as animated cards, and all as a folded table."""
    cards = [_card(k, one) for k, one in enumerate(answers[: CARDS.most])]
    shown = element("div", *cards, style="display:flex;flex-wrap:wrap;gap:8px") if any(cards) else NOTHING
    told = f"{len(answers)} answers" if len(answers) != 1 else "1 answer"
    table = _table([_details(one) for one in answers])
    folded = element("details", element("summary", f"{told} as a table"), table)
    return join((element("p", title), shown, folded))


def _drawable(one: Any) -> Guide | None:
    """Return the guide to draw of an answer; None for a mechanism in space."""
    if not hasattr(one, "collection"):
        return cast("Guide", one)
    from ..guides.own_chain import mechanism

    return None if one.collection.mechanism is None else mechanism(one)


def _card(number: int, one: Any) -> Markup:
    """Return one card; empty for a mechanism in space, which has no such drawing."""
    try:
        if (guide := _drawable(one)) is None:
            return NOTHING
        svg = moving_svg(guide, width=CARDS.card, height=0.75 * CARDS.card, style=number == 0)
    except CatalogueError as error:
        svg = element("p", str(error))
    kind = one.family if hasattr(one, "collection") else family(one)
    said = " ".join(part for part in (f"{number}:", getattr(one, "series", ""), kind) if part)
    values = _numbers(one)
    numbers = [
        f"{name} {values[field]:{format}}{unit}".rstrip()
        for field, name, format, unit in (
            ("deviation", "deviation", ".3g", f" {one.unit or ''}"),
            ("size", "size", ".4g", f" {one.unit or ''}"),
            ("min_transmission", "transmission", ".0f", "°"),
        )
        if values.get(field) is not None
    ]
    words = element("div", element("b", said), element("br"), ", ".join(numbers), style="font-size:smaller")
    return element("div", svg, words, style=f"width:{CARDS.card:.0f}px")


def _numbers(one: object) -> dict[str, Any]:
    """Return the numbers of an answer by name, the metrics of a collection among them."""
    return {name: getattr(one, name) for name in COLUMNS if hasattr(one, name)} | getattr(one, "metrics", {})


def _details(one: object) -> Mapping[str, Any]:
    told = _numbers(one)
    return told | ({"order": "exact"} if told.get("order") == EXACT_ORDER else {})


def _table(rows: Sequence[Mapping[str, object]]) -> Markup:
    names = [name for name in COLUMNS if any(row.get(name) is not None for row in rows)]
    heads = ["", *((">" if COLUMNS[name] else "") + name.replace("_", " ") for name in names)]
    lines = [
        [k, *(None if row.get(name) is None else f"{row[name]:{COLUMNS[name]}}" for name in names)]
        for k, row in enumerate(rows)
    ]
    return html_table(heads, lines)
