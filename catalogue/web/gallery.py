"""The gallery: named guides as published, and an example of every series."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from ..errors import CatalogueError
from ..find.stored import as_published
from ..guides.candidate import Candidate
from ..markup import NOTHING, Markup
from ..series.named_guides import named_guides
from .asked import opened
from .cards import drawing


class Example(NamedTuple):
    """Limits of the example of a series."""

    level: int = -3  #: decimal exponent of deviation over stroke: large enough to be visible in the drawing
    transmission: int = 35  #: minimum transmission angle, if there is such a guide [deg]


EXAMPLE = Example()


@dataclass(frozen=True)
class Plate:
    """A named guide, or a series with an example."""

    name: str  #: name of the guide in addresses
    title: str
    line: str  #: proportions of a guide; families of a series
    text: str  #: place in the theory
    source: str
    drawing: Markup
    series: str


def gallery() -> tuple[tuple[Plate, ...], tuple[Plate, ...]]:
    """Collect the named guides and the series."""
    catalogue = opened()
    guides = []
    for design in named_guides().values():
        try:
            one = as_published(design, catalogue.guide(design.name), design.stroke)
        except CatalogueError:  # a database built without named guides
            continue
        guides.append(
            Plate(design.name, design.title, design.proportions, design.place, design.source, _draw(one), one.series)
        )
    best = _examples()
    series = []
    for one_series in catalogue.registry.series.values():
        code = one_series.code
        number = best.get(code)
        drawn = NOTHING if number is None else _draw(catalogue.guide(number).at(1.0))
        inverse = "its own inverse" if one_series.inverse == code else f"inverse of {one_series.inverse}"
        line = f"{', '.join(one_series.families)}; {inverse}"
        name = "" if number is None else str(number)
        series.append(Plate(name, one_series.title, line, "", one_series.source, drawn, code))
    return tuple(guides), tuple(series)


def _draw(one: Candidate) -> Markup:
    try:
        return drawing(one)
    except CatalogueError:
        return NOTHING


def _examples() -> dict[str, int]:
    """Find the most compact straight-line guide of each series, with good transmission if any."""
    rows = opened().guides(reaches=True)
    rows = rows[rows["kind"].isin(["line", "circle"]) & (rows["level"] == EXAMPLE.level)]
    weak = rows["min_transmission"] < EXAMPLE.transmission
    bent = rows["kind"] == "circle"
    rows = rows.assign(weak=weak, bent=bent).sort_values(["weak", "bent", "size"], kind="stable")
    first = rows.drop_duplicates("series")
    return {str(code): int(number) for code, number in zip(first["series"], first["id"], strict=True)}
