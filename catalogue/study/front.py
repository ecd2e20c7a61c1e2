"""The Pareto front of a request as a page of HTML: a curve, and a card per point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..draw.svg import pair, ticks
from ..errors import InvalidRequest
from ..guides.candidate import Candidate
from ..guides.codes import code_of
from ..markup import NOTHING, Markup, element
from ..quantities import DEGREES, QUANTITIES, RANKED
from ..units import LENGTH
from .page import VALUES, answer_head, card, label, plain_words, standing_alone

#: Columns of criteria whose column has another name.
COLUMNS = {row.criterion: row.measure for row in RANKED if not row.scores_only and row.criterion != row.measure}
#: Units of columns that are not lengths.
_UNITS = {"score": ""} | {row.name: "°" if row.unit == DEGREES else "" for row in QUANTITIES if row.unit != LENGTH}


@dataclass(frozen=True)
class Frame:
    """Sizes of a chart [px]."""

    width: int = 640
    height: int = 400
    left: int = 70
    below: int = 46
    margin: int = 24
    radius: int = 7


FRAME = Frame()


def page(criteria: Sequence[str], answers: Sequence[tuple[str, Candidate]], x: str = "", y: str = "") -> str:
    """Draw the front of a request.

    Parameters
    ----------
    criteria : sequence of str
        Criteria by which the request ranks.
    answers : sequence of (str, Candidate)
        Records and guides, best first.
    x, y : str
        Criteria of the axes; default: the first two.

    Raises
    ------
    InvalidRequest
        If the request has no front or no answers, or an axis is none of its criteria.
    """
    if len(criteria) < 2 or not answers:
        raise InvalidRequest("a front needs answers ranked by two criteria or more, rank_by = [...]")
    if wrong := [name for name in (x, y) if name and name not in criteria]:
        raise InvalidRequest(f"{wrong[0]} is none of the criteria of this front: {', '.join(criteria)}")
    x = x or next(name for name in criteria if name != y)
    y = y or next(name for name in criteria if name != x)
    points = [(_value(one, x), _value(one, y)) for _, one in answers]
    first = [k for k, (_, one) in enumerate(answers) if one.front == 1]
    unit = answers[0][1].unit or ""
    chart = _chart(points, first, [one.series for _, one in answers], (_title(x, unit), _title(y, unit)))
    cards = [
        card(
            f"answer-{k}",
            [f"{k} ", *answer_head(one.series, one.family, code_of(text))],
            [_numbers(one, criteria)],
            one,
        )
        for k, (text, one) in enumerate(answers, 1)
    ]
    title = f"{_title(y)} over {_title(x).lower()}"
    told = (
        "Each point is an answer and leads to its card. On the line no answer is better in one criterion without "
        "being worse in another; grey ones are, though unlike those."
    )
    return standing_alone(title, told, [chart], cards)


def _value(one: Candidate, name: str) -> float:
    value = getattr(one, COLUMNS.get(name, name), None)
    if not isinstance(value, (int, float)):
        raise InvalidRequest(f"{name} is no column of an answer: name other axes")
    return float(value)


def _title(name: str, unit: str = "") -> str:
    column = COLUMNS.get(name, name)
    named = VALUES.get(column, plain_words(column).capitalize())
    told = _UNITS.get(column, unit)
    return f"{named} [{told}]" if unit and told else named


def _numbers(one: Candidate, criteria: Sequence[str]) -> Markup:
    names = dict.fromkeys([*(COLUMNS.get(name, name) for name in criteria), *VALUES])
    values = ((name, getattr(one, name, None)) for name in names)
    told = (f"{_title(name).lower()} {value:.4g}" for name, value in values if isinstance(value, (int, float)))
    return element("p", ", ".join(told))


def _chart(
    points: Sequence[tuple[float, float]], first: Sequence[int], series: Sequence[str], titles: tuple[str, str]
) -> Markup:
    """Draw points over two axes with scales, and a line through those of the first front."""
    scales = [_axis_scale([one[axis] for one in points]) for axis in (0, 1)]
    (low_x, high_x, ticks_x), (low_y, high_y, ticks_y) = scales
    right, foot = FRAME.width - FRAME.margin, FRAME.height - FRAME.below

    def at(x: float, y: float) -> complex:
        across, up = (x - low_x) / (high_x - low_x), (y - low_y) / (high_y - low_y)
        return complex(FRAME.left + across * (right - FRAME.left), foot - up * (foot - FRAME.margin))

    parts: list[Markup] = []
    for value in ticks_x:
        z = at(value, low_y)
        parts.append(element("line", x1=f"{z.real:.1f}", y1=foot, x2=f"{z.real:.1f}", y2=FRAME.margin, class_="scale"))
        parts.append(label(f"{value:.4g}", round(z.real, 1), foot + 16, "middle"))
    for value in ticks_y:
        z = at(low_x, value)
        parts.append(element("line", x1=FRAME.left, y1=f"{z.imag:.1f}", x2=right, y2=f"{z.imag:.1f}", class_="scale"))
        parts.append(label(f"{value:.4g}", FRAME.left - 8, round(z.imag + 4, 1), "end"))
    parts.append(label(titles[0], right, FRAME.height - 8, "end", "axis"))
    parts.append(label(titles[1], 4, 14, "start", "axis"))
    line = [at(*points[k]) for k in sorted(first, key=lambda k: points[k])]
    parts.append(element("path", d="M" + "L".join(pair(z) for z in line), class_="front") if line else NOTHING)
    for k, place in enumerate(points):
        z, is_first = at(*place), k in first
        told = f"answer {k + 1}: {series[k]}, {titles[0].lower()} {place[0]:.4g}, {titles[1].lower()} {place[1]:.4g}"
        face = "point" if is_first else "point later"
        disc = element(
            "circle", element("title", told), cx=f"{z.real:.1f}", cy=f"{z.imag:.1f}", r=FRAME.radius, class_=face
        )
        name = label(f"{k + 1} {series[k]}" if is_first else f"{k + 1}", z.real + 10, z.imag - 8, "start")
        parts.append(element("a", disc, name, href=f"#answer-{k + 1}"))
    size = (FRAME.width, FRAME.height)
    return element("svg", *parts, width=size[0], height=size[1], viewBox=f"0 0 {size[0]} {size[1]}", role="img")


def _axis_scale(values: Sequence[float]) -> tuple[float, float, list[float]]:
    """Return the ends of an axis, a little beyond its values, and round values in between."""
    low, high = min(values), max(values)
    margin = 0.06 * (high - low) or 0.05 * abs(high) or 1.0
    return low - margin, high + margin, ticks(low - margin, high + margin, 6)
