"""The page of one guide: drawing, theory, lengths, pivots, charts and files."""

from __future__ import annotations

import json
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..collections.results import CollectionCandidate
from ..curvature_theory.analysis import DEAD_POINT, PARALLEL, curvature
from ..draw import moving_svg
from ..draw.datasheet_html import sheet_html
from ..draw.moving import LAYERS
from ..draw.moving_file import moving_file
from ..draw.moving_layers import layers_of
from ..errors import InvalidRequest, quoted
from ..export import export
from ..export.formats import FORMATS, SUFFIXES
from ..export.write import TWO_DYADS
from ..find.answers import recall
from ..find.specimens import stretch_of
from ..guides.candidate import Candidate
from ..guides.chain_stretch import ChainStretch
from ..guides.codes import is_code
from ..guides.own_chain import OwnChain
from ..guides.own_guide import OwnGuide
from ..markup import NOTHING, Markup
from ..quantities import DEGREES, QUANTITIES, RATIO
from ..series.named_guides import named_guide
from ..units import ASSUMED, LENGTH
from .asked import in_words, opened
from .cards import RISING, Card, Number, card, chain_card, contact, coordinate, figure, mechanism, words
from .charts import charts

if TYPE_CHECKING:
    from ..series.named_guides import NamedGuide

#: Width and height of the large drawing [px].
LARGE = (960, 600)


class PageLimits(NamedTuple):
    """Limits of the page of a guide."""

    seconds: int = 6  #: period of the large drawing [s]: slow enough to follow by eye
    longest: int = 15  #: largest number of digits of a guide's number: within the integers of SQLite


GUIDE_PAGE = PageLimits()

#: Layers of the large drawing, in words.
SHOWN = {
    "names": "Names of the joints",
    "turn": "Path over the whole circuit",
    "pole": "Pole",
    "circle": "Inflection circle",
    "cubics": "Cubics of stationary curvature",
    "centrodes": "Centrodes",
    "velocity": "Velocity",
}


@dataclass(frozen=True)
class GuidePage:
    """Contents of the page of a guide."""

    name: str
    heading: str
    words: tuple[str, ...]  #: proportions, place in the theory and source of a named guide
    card: Card
    drawing: Markup
    numbers: tuple[Number, ...]
    lengths: tuple[Number, ...]
    pivots: tuple[tuple[str, str, str, str], ...]  #: name, x, y, remark
    theory: tuple[Number, ...]
    remarks: tuple[str, ...]
    charts: tuple[Markup, ...]
    own: tuple[tuple[str, str], ...]  #: query of the page of own linkages for this guide
    unit: str  #: unit of its lengths
    layers: Mapping[str, str]  #: layers of the drawing, in words
    missing: Container[str] = ()  #: kinds of files that it cannot have


def pick(name: str) -> tuple[Candidate | OwnGuide | OwnChain, NamedGuide | None]:
    """Find a guide by code, number or name.

    Raises
    ------
    InvalidRequest
        If there is none, or it is not planar.
    """
    design = named_guide(name)
    if design is not None:
        from ..find.stored import as_published

        return as_published(design, opened().guide(name), design.stroke), design
    if is_code(name):
        found = recall(name, opened().registry.collection)
        if isinstance(found, CollectionCandidate) and found.collection.mechanism is not None:
            found = stretch_of(found)
        if not isinstance(found, Candidate | OwnGuide | OwnChain):
            raise InvalidRequest(f"{name} is no planar guide: `catalogue show {name}` prints it")
        return found, None
    if not name.isascii() or not name.isdigit() or len(name) > GUIDE_PAGE.longest:
        raise InvalidRequest(f"{quoted(name)} is no code, number or name of a guide")
    return opened().guide(int(name)).at(1.0), None


def placed(name: str) -> Candidate | OwnChain:
    """Find a guide with a stroke, or a mechanism of many bars; see `pick`."""
    found, _ = pick(name)
    if not isinstance(found, Candidate | OwnChain):
        raise InvalidRequest(f"{name} has no stroke: measure it on the page of own linkages")
    return found


def address(one: Candidate | OwnGuide) -> tuple[tuple[str, str], ...]:
    """Return the query of the page of own linkages for a guide."""
    pivots = json.dumps([[[float(f"{v:.12g}") for v in pivot] for pivot in dyad] for dyad in one.pivots])
    point = [("x", f"{one.guided[0]:.12g}"), ("y", f"{one.guided[1]:.12g}")]
    stroke = [("stroke", f"{one.stroke:.12g}")] if isinstance(one, Candidate) else []
    return (("linkage", pivots), *point, *stroke, ("unit", one.unit or ASSUMED))


def guide_page(name: str, unit: str | None) -> GuidePage | tuple[tuple[str, str], ...]:
    """Make the page of a guide; for a linkage without a stroke return its query among own linkages.

    Lengths are converted to `unit`; if None, to the unit of the guide, or `ASSUMED` if it has none.
    """
    found, design = pick(name)
    found = found.in_unit(unit or found.unit or ASSUMED)
    if isinstance(found, OwnChain):
        return _chain_page(name, found)
    if not isinstance(found, Candidate):
        return address(found)
    if not is_code(name) or design is not None:  # no tolerance was requested, so there is no allowance
        found = replace(found, allowance=None, asked_deviation=None, score=None, expected=None)
    theory, remarks = _theory(found)
    words = () if design is None else (design.proportions, design.place, f"Source: {design.source}")
    series = opened().registry.series.get(found.series)
    if series is not None:
        remarks = (f"Series {series.code}: {series.title}. {series.source}.", *remarks)
    return GuidePage(
        name,
        design.title if design is not None else mechanism(found),
        words,
        card(found, name, NOTHING, in_words(found.series)),
        moving_svg(
            found,
            width=LARGE[0],
            height=LARGE[1],
            layers=LAYERS,
            hidden=LAYERS,
            seconds=GUIDE_PAGE.seconds,
            style=False,
        ),
        _all_numbers(found),
        tuple(_lengths(found)),
        tuple(_pivots(found)),
        theory,
        remarks,
        charts(found),
        address(found),
        str(found.unit),
        SHOWN,
    )


def _chain_page(name: str, one: OwnChain) -> GuidePage:
    """Make the page of a mechanism of many bars: no theory, nothing to edit."""
    told = [Number("Stroke", figure(one.stroke, 6), "length")] if isinstance(one, ChainStretch) else []
    told.append(Number("Bars", str(len(one.bars)), "", f"{one.drive} drives, {one.point} is guided."))
    size = float(one.chain.size[0])
    lengths = tuple(Number(words(what), coordinate(value, size), "length") for what, value in one.lengths.items())
    frame = one.bars["frame"]
    places = [
        (
            joint,
            coordinate(x, size),
            coordinate(y, size),
            "fixed" if joint in frame else "guided" * (joint == one.point),
        )
        for joint, (x, y) in one.joints.items()
    ]
    drawn: Any = one
    layers = layers_of(drawn)
    return GuidePage(
        name,
        one.name or "Mechanism",
        (),
        chain_card(one, name),
        moving_svg(
            drawn,
            width=LARGE[0],
            height=LARGE[1],
            layers=layers,
            hidden=layers,
            seconds=GUIDE_PAGE.seconds,
            style=False,
        ),
        tuple(told),
        lengths,
        tuple(places),
        (),
        (),
        charts(one),
        (),
        str(one.unit),
        {layer: SHOWN[layer] for layer in SHOWN if layer in layers},
        TWO_DYADS,
    )


#: Names of lengths that are angles.
ANGLES = ("angle", "between")


#: Labels of numbers to compare, besides those of the card.
COMPARED = (*RISING, "Travel", "Expected", "Sensitivity rms")


def _all_numbers(one: Candidate) -> tuple[Number, ...]:
    """List the measured numbers that the card omits."""
    rows = sorted((row for row in QUANTITIES if row.page), key=lambda row: row.page)
    more = {LENGTH: ("expected",), DEGREES: (), RATIO: ("sensitivity_rms", "drift", "gap", "score")}
    shown = [Number("Stroke", figure(one.stroke, 6), "length")]
    for kind, unit in ((LENGTH, "length"), (DEGREES, "°"), (RATIO, "")):
        names = [*(row.name for row in rows if row.unit == kind), *more[kind]]
        values = ((name, getattr(one, name)) for name in names)
        shown += [
            Number(words(name), figure(value), unit, value=value if words(name) in COMPARED else None)
            for name, value in values
            if value is not None
        ]
    return tuple(shown)


def _lengths(one: Candidate) -> Iterator[Number]:
    for name, value in one.lengths.items():
        angle = name in ANGLES
        yield Number(words(name), coordinate(value, 360 if angle else one.size), "°" if angle else "length")


def _pivots(one: Candidate) -> list[tuple[str, str, str, str]]:
    rows = []
    for i, dyad in enumerate(one.pivots):
        for star, (x, y, w) in zip(("", "*"), dyad, strict=True):
            what = ("moving" if star else "fixed") + ("" if w else ", at infinity in this direction")
            size = one.size if w else 1.0
            rows.append((f"A{i + 1}{star}", coordinate(x, size), coordinate(y, size), what))
    rows.append(("P", coordinate(one.guided[0], one.size), coordinate(one.guided[1], one.size), "guided point"))
    return rows


def _theory(one: Candidate) -> tuple[tuple[Number, ...], tuple[str, ...]]:
    """List the curvature and the series of a guide at mid-stroke."""
    at = curvature(one.linkage)
    place = "at mid-stroke"
    shown = [Number("Contact", contact(one.order), "", "Of the ancestor at its design position.")] * bool(one.order)
    if at.state[0] not in (PARALLEL, DEAD_POINT):
        x, y = at.pole[0]
        shown += [
            Number("Pole x", coordinate(x, one.size), "length", f"Instantaneous centre of the coupler {place}."),
            Number("Pole y", coordinate(y, one.size), "length"),
            Number("Inflection circle", figure(at.rho0[0], 6), "length", "Its diameter ρ0."),
            Number("κ ρ0", coordinate(at.kappa[0] * at.rho0[0], 1), "", "ρ0/R of the centring-point curve."),
            Number("κ* ρ0", coordinate(at.kappa_star[0] * at.rho0[0], 1), "", "ρ0/R* of the circling-point curve."),
            Number("s ρ0", coordinate(at.s[0] * at.rho0[0], 1), "", "ρ0/S of both."),
        ]
        if np.isfinite(at.undulation[0]).all():
            places = ", ".join(coordinate(v, one.size) for v in at.undulation[0])
            shown.append(Number("Ball's point", f"({places})", "", "Point of undulation."))
    remarks = [f"{str(at.reason[0]).capitalize()}."] if at.reason[0] else []
    told = opened().classify(one.linkage)[0]
    if told.series:
        remarks.append("At mid-stroke a member of " + ", ".join(f"{m.series}" for m in told) + ".")
    elif near := told.nearest:
        remarks.append(
            f"At mid-stroke the nearest degenerate series is {near.series}, residual {figure(near.residual)}."
        )
    return tuple(shown), tuple(remarks)


#: Package needed for a file, by kind.
NEEDED = {"dxf": "ezdxf", "step": "build123d", "xlsx": "xlsxwriter", "parquet": "pyarrow"}
#: Suffix and description of the files of a guide, by kind.
FILES: dict[str, tuple[str, str]] = {
    "sheet": ("html", "one-page data sheet"),
    "svg": ("svg", "animated drawing in true millimetres"),
}
FILES |= {
    kind: (next((s[1:] for s, k in SUFFIXES.items() if k == kind), "csv"), told) for kind, told in FORMATS.items()
}


def offered() -> dict[str, tuple[str, str]]:
    """Return the `FILES` whose packages are installed."""
    return {kind: told for kind, told in FILES.items() if kind not in NEEDED or find_spec(NEEDED[kind]) is not None}


def file_of(name: str, kind: str, unit: str | None) -> str | bytes:
    """Make a file of a guide, in a unit if one is given."""
    one: Any = placed(name)
    if kind == "svg":
        return moving_file(one, unit=unit, code=name)
    if kind == "sheet":
        return sheet_html(one, unit=unit)
    return export(one, format=kind, unit=unit)


def compare_pages(names: tuple[str, ...], unit: str) -> list[Any]:
    """Make the pages of the guides that have a stroke, for a comparison."""
    return [page for page in (guide_page(name, unit) for name in names) if isinstance(page, GuidePage)]


#: A row of a comparison: label, help, the number of each guide or None, and the indices of the
#: best.
Row = tuple[str, str, tuple[Number | None, ...], frozenset[int]]


def side_by_side(pages: Sequence[GuidePage]) -> list[tuple[str, list[Row]]]:
    """Arrange the numbers of guides in rows under headings."""
    parts = {
        "Measured": [page.card.numbers + page.numbers for page in pages],
        "Links": [page.lengths for page in pages],
        "Theory": [page.theory for page in pages],
    }
    groups = []
    for heading, columns in parts.items():
        found = [{one.label: one for one in column} for column in columns]
        labels = dict.fromkeys(label for column in found for label in column)
        rows = []
        for label in labels:
            cells = tuple(column.get(label) for column in found)
            rows.append((label, next(cell.help for cell in cells if cell), cells, best(cells)))
        groups.append((heading, rows))
    return groups


def best(cells: Sequence[Number | None]) -> frozenset[int]:
    """Return the indices of the best numbers of a row.

    None if all look alike or none is comparable.
    """
    known = {k: (cell.value, cell.text) for k, cell in enumerate(cells) if cell and cell.value is not None}
    if len({text for _, text in known.values()}) < 2:
        return frozenset()
    label = next(cell.label for cell in cells if cell)
    _, text = (max if label in RISING else min)(known.values())
    return frozenset(k for k, (_, other) in known.items() if other == text)
