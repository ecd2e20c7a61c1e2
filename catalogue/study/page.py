"""A self-contained page of HTML: a head, charts, and a card for each answer."""

from __future__ import annotations

from collections.abc import Sequence

from ..draw import moving_svg
from ..draw.moving_style import DARK, LIGHT, STYLE, properties
from ..guides.candidate import Candidate
from ..markup import NOTHING, Markup, element, fill, join

#: Values of an answer that charts and cards show, with their titles.
VALUES = {
    "score": "Score",
    "size": "Size",
    "deviation": "Deviation",
    "min_transmission": "Minimum transmission angle",
    "allowance": "Allowance",
}

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
.charts { display: flex; flex-wrap: wrap; gap: 1rem 2rem } .charts svg { display: block; max-width: 100%; height: auto }
.charts text { font-size: 11px; fill: var(--guide-ink) } .charts .axis { fill: var(--guide-grey) }
.charts .value, .charts .kind { pointer-events: none } .charts .kind { font-size: 8px }
.cell { fill: var(--guide-coupler); stroke: var(--guide-paper) } .none { fill: var(--guide-faint); fill-opacity: .5 }
.step { fill: none; stroke: var(--guide-ink); stroke-width: 2.5; stroke-linecap: round }
.charts .tint { stroke: none } .tint ~ .step, .tint ~ .level { stroke-width: .8 }
.level { fill: none; stroke: var(--guide-path); stroke-width: 1.2; pointer-events: none }
.scale { stroke: var(--guide-faint) } .front { fill: none; stroke: var(--guide-coupler); stroke-width: 2 }
.point { fill: var(--guide-coupler); stroke: var(--guide-paper) } .later { fill: var(--guide-grey); opacity: .6 }
a:hover .cell, a:focus .cell, a:hover .point, a:focus .point { stroke: var(--guide-path); stroke-width: 3 }
.charts text.dark { fill: var(--guide-paper) }
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(16rem, 1fr)); gap: 1rem }
.cards article { border: 1px solid var(--guide-faint); border-radius: .4rem; padding: .6rem .8rem }
.cards article:target { border-color: var(--guide-path) } .cards svg { width: 100%; height: auto }
.cards h2, .cards p { margin: 0 } .grey { color: var(--guide-grey) } code { font-size: 1rem }
$drawings
</style>
$body
"""


def standing_alone(title: str, told: str, charts: Sequence[Markup], cards: Sequence[Markup]) -> str:
    """Return a page of charts with their cards, which needs no other file."""
    head = [element("h1", title), element("p", told, class_="grey")]
    below = [element("h2", "Cards"), element("div", *cards, class_="cards")] if cards else []
    body = join([*head, element("div", *charts, class_="charts"), *below])
    colours = {"light": properties(LIGHT), "dark": properties(DARK)}
    return str(fill(_PAGE, title=title, drawings=STYLE, body=body, **colours))


def card(name: str, head: Sequence[str], lines: Sequence[Markup], guide: Candidate | None = None) -> Markup:
    """Return a card: a name as link target, drawing, head, lines."""
    drawing = NOTHING if guide is None else moving_svg(guide, width=260, height=150, style=False)
    return element("article", drawing, element("h2", *head), *lines, id=name)


def answer_head(series: str, family: str, code: str) -> list[str]:
    """Return the head of the card of an answer."""
    return [f"{series} {family} ", element("code", code)]


def label(words: str, x: float, y: float, anchor: str, kind: str | None = None) -> Markup:
    """Return a line of text of a chart."""
    return element("text", words, x=f"{x:g}", y=f"{y:g}", text_anchor=anchor, class_=kind)


def plain_words(name: str) -> str:
    """Return a name of code as words."""
    return name.replace("_", " ")
