"""What is shown of a guide: its drawing and its numbers, each with its unit and what it means."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from secrets import token_hex
from typing import TYPE_CHECKING, TypeVar

from ..curvature_theory.leading_error import EXACT
from ..draw import moving_svg
from ..draw.words import family
from ..markup import Markup

if TYPE_CHECKING:
    from ..find.candidate import Candidate
    from ..find.placed import PlacedGuide

T = TypeVar("T")
#: Size of the drawing of a card [px].
WIDTH, HEIGHT = 360, 270
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Number:
    """A number as it is shown; `unit` is ``length``, ``°`` or none."""

    label: str
    text: str
    unit: str = ""
    help: str = ""
    value: float | None = None  #: what is best of several: the least, of `RISING` the greatest


@dataclass(frozen=True)
class Card:
    """One answer; without a code it is not kept."""

    code: str
    name: str  #: of the mechanism
    series: str
    kind: str  #: the series in words
    family: str
    configuration: str
    title: str
    drawing: Markup
    numbers: tuple[Number, ...]
    score: float | None


#: Numbers of which the greatest is best.
RISING = ("Transmission", "Allowance", "Score", "Uniformity", "Advantage", "Min transmission turn")


def figure(value: float | None, digits: int = 3) -> str:
    """Return a number as people write it: so many digits, small and large ones as a multiple of a power of ten."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    text = f"{value:.{digits - 1}e}"
    mantissa, power = text.split("e")
    if -3 <= int(power) < 6:
        plain = f"{float(text):.{max(digits - 1 - int(power), 0)}f}"
        return (plain.rstrip("0").rstrip(".") if "." in plain else plain).replace("-", "−")
    return f"{mantissa.replace('-', '−')} × 10{str(int(power)).translate(_RAISED)}"


def coordinate(value: float, size: float) -> str:
    """Return a coordinate to seven digits of the size of what it is of."""
    text = f"{value:.{max(0, 6 - math.floor(math.log10(size)))}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text == "-0" else text.replace("-", "−")


def contact(order: int) -> str:
    """Return an order of contact in words."""
    return "exact" if order == EXACT else f"order {order}"


def words(name: str) -> str:
    """Return the name of a field as a heading."""
    return name.replace("_", " ").capitalize()


def drawing(one: PlacedGuide) -> Markup:
    """Return the moving drawing of a card; the page has its style sheet."""
    return moving_svg(one, width=WIDTH, height=HEIGHT, style=False, prefix=f"g{token_hex(4)}-")


def numbers(one: Candidate) -> tuple[Number, ...]:
    """Return the numbers of a card."""
    turning = "" if not one.rotates else ", crank " + " and ".join(map(str, one.rotates)) + " turns fully"
    links = "–" if one.max_link is None else f"{figure(one.min_link)} – {figure(one.max_link)}"
    shown = [
        Number("Deviation", figure(one.deviation), "length", "Half the width of the narrowest strip, or annulus, that "
               "holds the path; of an arc of a given radius the largest distance from it.", one.deviation),
        Number("Size", figure(one.size, 4), "length", "Diameter of the pivots and the path together.", one.size),
        Number("Links", links, "length", "Shortest and longest crank or coupler."),
        Number("Transmission", figure(one.min_transmission, 2), "°",
               f"Least transmission angle over the stroke, the better crank driving{turning}.", one.min_transmission),
    ]  # fmt: skip
    if one.allowance is not None:
        help = "Standard deviation of every pivot coordinate at which the path still stays within the deviation asked."
        shown.append(Number("Allowance", figure(one.allowance), "length", help, one.allowance))
    if one.radius is not None:
        shown.append(Number("Radius", figure(one.radius, 4), "length", "Of the arc that the point follows."))
    if one.is_wide:
        shown.append(Number("Angle", figure(one.arc_angle, 4), "°", "Of the arc, as seen from its centre."))
    return tuple(shown)


def mechanism(one: Candidate) -> str:
    """Return what people call a mechanism."""
    name = family(one)
    return name[:1].upper() + name[1:]


def card(one: Candidate, code: str, drawn: Markup, kind: str = "") -> Card:
    """Return the card of an answer with its drawing, and its series in words."""
    title = " · ".join(part for part in (one.configuration, contact(one.order) if one.order else "") if part)
    name, series = mechanism(one), one.series or "own"
    return Card(code, name, series, kind, one.family, one.configuration, title, drawn, numbers(one), one.score)


def variety(answers: Sequence[T], kinds: Iterable[tuple[str, str]]) -> tuple[list[T], list[T]]:
    """Return the first of each kind, and all others, both in the order they came in."""
    seen: set[tuple[str, str]] = set()
    first: list[T] = []
    others: list[T] = []
    for one, kind in zip(answers, kinds, strict=True):
        (others if kind in seen else first).append(one)
        seen.add(kind)
    return first, others
