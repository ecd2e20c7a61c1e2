"""Cards of guides: drawing and numbers, each with unit and meaning."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from secrets import token_hex
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from ..curvature_theory.leading_error import EXACT
from ..draw import moving_svg
from ..draw.words import family
from ..guides.chain_stretch import ChainStretch
from ..markup import Markup
from ..quantities import LINKS

if TYPE_CHECKING:
    from ..guides.candidate import Candidate
    from ..guides.own_chain import OwnChain

T = TypeVar("T")


class CardSize(NamedTuple):
    """Size of the drawing of a card [px]."""

    width: int = 360  #: width: three cards fill a page
    height: int = 270  #: height


CARD_SIZE = CardSize()

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Number:
    """A number to show; `unit` is ``length``, ``°`` or empty."""

    label: str
    text: str
    unit: str = ""
    help: str = ""
    value: float | None = None  #: value for comparison: the least is best, for `RISING` the greatest


@dataclass(frozen=True)
class Card:
    """One answer; without a code it is not stored."""

    code: str
    name: str  #: name of the mechanism
    series: str
    kind: str  #: the series in words
    family: str
    configuration: str
    title: str
    drawing: Markup
    numbers: tuple[Number, ...]
    score: float | None


#: Labels of numbers to maximise.
RISING = ("Transmission", "Allowance", "Score", "Uniformity", "Advantage", "Min transmission turn")


def figure(value: float | None, digits: int = 3) -> str:
    """Format a number to some digits, small and large ones with a power of ten."""
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
    """Format a coordinate to a millionth of a size."""
    text = f"{value:.{max(0, 6 - math.floor(math.log10(size)))}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text == "-0" else text.replace("-", "−")


def contact(order: int) -> str:
    """Format an order of contact in words."""
    return "exact" if order == EXACT else f"order {order}"


def words(name: str) -> str:
    """Format the name of a field as a heading."""
    return name.replace("_", " ").capitalize()


def drawing(one: Any) -> Markup:
    """Return the animated drawing of a card, without a style sheet, which the page has."""
    return moving_svg(one, width=CARD_SIZE.width, height=CARD_SIZE.height, style=False, prefix=f"g{token_hex(4)}-")


def numbers(one: Candidate) -> tuple[Number, ...]:
    """List the numbers of a card."""
    turning = "" if not one.rotates else ", crank " + " and ".join(map(str, one.rotates)) + " turns fully"
    ends = [getattr(one, name) for name in LINKS]
    links = "–" if None in ends else " – ".join(map(figure, ends))
    shown = [
        Number(
            "Deviation",
            figure(one.deviation),
            "length",
            "Half the width of the narrowest strip, or annulus, that "
            "contains the path; largest distance from an arc of given radius.",
            one.deviation,
        ),
        Number("Size", figure(one.size, 4), "length", "Overall size: diameter of pivots and path.", one.size),
        Number("Links", links, "length", "Shortest and longest crank or coupler."),
        Number(
            "Transmission",
            figure(one.min_transmission, 2),
            "°",
            f"Minimum transmission angle over the stroke; the better crank drives{turning}.",
            one.min_transmission,
        ),
    ]
    if one.allowance is not None:
        help = "Standard deviation of pivot position at which 95 % of machines stay within the tolerance."
        shown.append(Number("Allowance", figure(one.allowance), "length", help, one.allowance))
    if one.radius is not None:
        shown.append(Number("Radius", figure(one.radius, 4), "length", "Radius of the path."))
    if one.is_wide:
        shown.append(Number("Angle", figure(one.arc_angle, 4), "°", "Central angle of the path."))
    return tuple(shown)


def mechanism(one: Candidate) -> str:
    """Return the common name of a mechanism."""
    name = family(one)
    return name[:1].upper() + name[1:]


def card(one: Candidate, code: str, drawn: Markup, kind: str = "") -> Card:
    """Make the card of an answer from its drawing and the words for its series."""
    title = " · ".join(part for part in (one.configuration, contact(one.order) if one.order else "") if part)
    name, series = mechanism(one), one.series or "own"
    return Card(code, name, series, kind, one.family, one.configuration, title, drawn, numbers(one), one.score)


def chain_card(one: OwnChain, code: str) -> Card:
    """Make the card of a mechanism of many bars; without a stroke it has no numbers."""
    named: Any = one
    shown = list[Number]()
    if isinstance(one, ChainStretch):
        help = "Half the width of the narrowest strip, or annulus, that contains the path."
        shown = [
            Number("Deviation", figure(one.deviation), "length", help, one.deviation),
            Number("Size", figure(one.size, 4), "length", "Diameter of all joints over the stroke.", one.size),
            Number(
                "Transmission",
                figure(one.min_transmission, 2),
                "\u00b0",
                "Minimum transmission angle of any dyad over the stroke.",
                one.min_transmission,
            ),
        ]
        shown += [Number("Radius", figure(one.radius, 4), "length", "Radius of the path.")] * (one.radius is not None)
    kind = family(named)
    return Card(code, one.name or kind, kind, "", kind, "", "", drawing(one), tuple(shown), None)


def variety(answers: Sequence[T], kinds: Iterable[tuple[str, str]]) -> tuple[list[T], list[T]]:
    """Split answers into the first of each kind and the others, keeping their order."""
    seen: set[tuple[str, str]] = set()
    first: list[T] = []
    others: list[T] = []
    for one, kind in zip(answers, kinds, strict=True):
        (others if kind in seen else first).append(one)
        seen.add(kind)
    return first, others
