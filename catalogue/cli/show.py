"""``catalogue show``: print and draw one guide."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InvalidRequest
from ..guides.columns import LENGTH, TABLE, Column
from ..progress import busy
from .completion import references
from .options import COMMON, Argument, option, switch
from .references import is_answer, keep
from .tables import FORCE, PICTURE, codes, contact, print_json, print_table, tell
from .units import UNIT, in_output_unit, length, unit, warn_of_unit, with_unit

if TYPE_CHECKING:
    from ..find.stored import StoredGuide
    from ..guides.candidate import Candidate
    from ..series.membership import Memberships
    from ..series.named_guides import NamedGuide


def _describe_design(
    design: NamedGuide, memberships: Memberships, published: Candidate, best: Candidate | None
) -> list[str]:
    """Describe a named design, line by line: source, classification, comparison with its series."""
    from ..curvature_theory.leading_error import EXACT

    d, p = design, published
    member = "no registered series has its family"
    if memberships.series:
        member = "series " + ", ".join(f"{m.series} (residual {m.residual:.1g})" for m in memberships)
    elif near := memberships.nearest:
        member = f"in no registered series; the nearest is {near.series} (residual {near.residual:.2g})"
    usual = f"over its usual stroke of {d.stroke:.4g}, {d.share:.0%} of what the path offers"
    compared = f"the straightest {p.series} of no more than its size that is held"
    if best is not None:
        times = p.deviation / best.deviation if best.deviation else float("inf")
        compared += f": {best.deviation / p.stroke:.3g} (guide {best.id}), {times:.3g} times as straight"
    else:
        compared = "exact" if d.order == EXACT else f"{compared} is not straighter"
    searched = [f"search for straighter ones: {_search(design, p)}"] * (compared != "exact")
    return [
        f"{d.name}: {d.title}",
        f"source: {d.source}",
        f"proportions: {d.proportions}",
        d.place,
        f"classification: {member}; {p.family}, {p.configuration}",
        f"deviation/stroke {usual}: {p.deviation / p.stroke:.3g}, size/stroke {p.size / p.stroke:.3g}; {compared}",
        *searched,
    ]


def _search(design: NamedGuide, published: Candidate) -> str:
    """Return the command to search the series of a design for straighter guides of its size."""
    path = "circular-arc" if design.circle else "straight-line"
    bounds = {"--stroke": published.stroke, "--deviation": published.deviation, "--max-size": published.size}
    lengths = [word for name, value in bounds.items() for word in (name, f"{value:.6g}{published.unit or ''}")]
    chosen = ["--series", published.series, "--rank-by", "deviation"]
    return shlex.join(["catalogue", "find", path, *lengths, *chosen])


def _kept(name: str, db: Path | None, plugins: Sequence[str]) -> list[Any]:
    """Return the answers of a code or file, or the linkages of a file.

    A catalogue is opened only for answers of a collection.
    """
    from ..api import open
    from .references import answers, guides

    found = answers(name, lambda: open(db, plugins=plugins, build=False))
    if found is None:
        found = guides(name, None, lambda: open(db, plugins=plugins, build=False), chains=True)
    if not found:
        raise InvalidRequest(f"{name} holds no answers: `catalogue measure {name}` measures linkages")
    return found


def _show_answers(found: list[Any], name: str, plot: Path | None, moving: bool, format: str) -> None:
    """Print answers with all their numbers in the unit of output, and draw the first."""
    found = in_output_unit(found)
    if plot is not None:
        _draw(found[0], plot, moving)
    if format != "table":
        records = [{"code": code, **_numbers(one)} for code, one in zip(codes(found), found, strict=True)]
        print_json(records if len(found) > 1 else records[0])
        return
    for one in found:
        _card(one, name)


def _draw(one: Any, file: Path, moving: bool) -> None:
    if hasattr(one, "collection") and (moving or file.suffix.lower() == ".gif"):
        from ..find.specimens import stretch_of

        one = stretch_of(one)
    one.plot(file, **({"moving": True} if moving else {}))
    keep(one)
    print(f"drawn: {file}", file=sys.stderr)
    if moving and file.suffix.lower() == ".svg":
        warn_of_unit(one)


def _card(one: Any, name: str) -> None:
    """Print one answer: kind, numbers with their meaning, links and pivots."""
    from ..guides.placed import IMMOBILE, PlacedGuide

    numbers = _numbers(one)
    pivots, guided, lengths = (numbers.pop(key, None) for key in ("pivots", "guided", "lengths"))
    kind = " ".join(str(numbers.pop(key)) for key in ("series", "family", "configuration") if numbers.get(key))
    tell(f"{name}: {kind}")
    if isinstance(one, PlacedGuide) and one.is_immobile:
        tell(IMMOBILE)
    known = {**getattr(one, "meanings", {}), "kept_share": TABLE["kept_share"]}
    if hasattr(one, "collection"):
        known = {key: Column(key, m.unit, m.meaning) for key, m in one.collection.metrics.items()}
    numbers.pop("parameters", None)  # numbers of a collection that only programs read
    told = {key: (_unit(column), column.meaning) for key, column in known.items()}
    rows = [
        [key.replace("_", " "), contact(value) if key == "order" else _plain(value), *told.get(key, ("", ""))]
        for key, value in numbers.items()
        if value not in (None, "") and (key, value) != ("order", 0)  # a guide that is not stored has no order
    ]
    if rows:
        print_table("", ["", "~value", "unit", "~meaning"], rows, spare=["unit"])
    if lengths:
        _links(lengths)
    if pivots is not None:
        _pivots("Pivots in mid-stroke" if hasattr(one, "stroke") else "Pivots", pivots, guided, "{:.8g}".format)


def _numbers(one: Any) -> dict[str, Any]:
    """Return the numbers of an answer, with the share of simulated machines within tolerance."""
    numbers: dict[str, Any] = {}
    for key, value in one.to_dict().items():
        numbers[key] = value
        if key == "allowance" and (share := getattr(one, "kept_share", None)) is not None:
            numbers["kept_share"] = share
    return numbers


def _unit(column: Column) -> str:
    return column.unit.replace(LENGTH, unit() or LENGTH)


def _links(lengths: Mapping[str, float]) -> None:
    """Print the lengths of the links, and the guided point in the coupler."""
    print_table(
        "Links", ["", _with_output_unit(">length")], [[name, f"{value:.6g}"] for name, value in lengths.items()]
    )


def _pivots(title: str, pivots: Any, guided: Any, digits: Callable[[float], str]) -> None:
    """Print the positions of the pivots and the guided point."""
    lines = [
        [i + 1, kind, *map(digits, pivot[:2]), "at infinity" if pivot[2] == 0 else ""]
        for i, dyad in enumerate(pivots)
        for kind, pivot in zip(("fixed", "moving"), dyad, strict=True)
    ]
    lines.append(["", "guided", *map(digits, guided or ()), ""])
    print_table(title, [">dyad", "point", _with_output_unit(">x"), _with_output_unit(">y"), ""], lines)


def _with_output_unit(heading: str) -> str:
    """Append the unit of output, if any, to a heading of lengths."""
    return f"{heading} [{unit()}]" if unit() else heading


def _plain(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{name} {_plain(v)}" for name, v in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(_plain(v) for v in value) or "none"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


@click.command(
    params=[
        Argument(
            "name",
            "CODE|FILE|ID|NAME",
            "Code or file of answers, file of linkages, number of a guide, or name of a design.",
            shell_complete=references,
        ),
        length("--stroke", "L", "Scale a stored guide or named design to this stroke.", show_default="1"),
        option(
            "--level",
            "N",
            "Design a stored guide or named design for a deviation of 10^N of the stroke.",
            int,
            show_default="the middle one of its levels",
        ),
        option("--plot", "FILE", "Draw it: PNG, SVG, PDF or animated GIF by suffix.", PICTURE),
        switch("--moving", "Animate an SVG, in true millimetres, with check boxes for pole, circles and cubics."),
        FORCE,
        UNIT,
        *COMMON,
    ]
)
def show(
    name: str,
    stroke: float | None,
    level: int | None,
    plot: Path | None,
    moving: bool,
    format: str,
    db: Path | None,
    plugins: Sequence[str],
) -> None:
    """Show an answer, a stored guide or a named design: measured numbers, pivots, links.

    --plot draws it.

    An answer, by its code or from a file of `find --save`, is shown as it was found.

    A stored mechanism of a collection is named COLLECTION:ID, such as spatial-guidance:17.

    A named design is shown as published, over its usual stroke, unless --level is given; beside it
    stands the best guide of its series on the same stroke that is no larger.
    """
    from ..api import open
    from ..draw.picture import check

    if plot is not None:
        check(plot, moving=moving)
    elif moving:
        raise InvalidRequest("--moving goes with --plot FILE.svg")

    if is_answer(name):
        for flag, value in (("--stroke", stroke), ("--level", level)):
            if value is not None:
                raise InvalidRequest(f"{name} is shown as it was found: {flag} is for a stored guide or a named design")
        _show_answers(_kept(name, db, plugins), name, plot, moving, format)
        return
    stroke = 1.0 if stroke is None else stroke
    collection, _, number = name.partition(":")
    if number.isdecimal():
        if level is not None:
            raise InvalidRequest(f"{name} is of a collection: --level is for a stored guide or a named design")
        with open(db, plugins=plugins, build=False) as catalogue:
            one = replace(catalogue.specimen(collection, int(number), stroke), unit=unit())
            _show_answers([one], name, plot, moving, format)
        return
    _show_guide(name, stroke, level, plot, moving, format, db, plugins)


def _show_guide(
    name: str,
    stroke: float,
    level: int | None,
    plot: Path | None,
    moving: bool,
    format: str,
    db: Path | None,
    plugins: Sequence[str],
) -> None:
    """Print and draw a stored guide or a named design at a stroke."""
    from ..api import open
    from ..guides.candidate import digits
    from ..series.named_guides import named_guide

    with open(db, plugins=plugins) as catalogue, busy("looking"):
        guide = catalogue.guide(name)
        design, told, words = named_guide(guide.name), {}, []
        if design is None or level is not None:
            laid = guide.at(stroke, level, unit=unit())
        if design is not None:
            from ..find.stored import as_published, best_of_series

            published = as_published(design, guide, stroke, unit=unit())
            laid = published if level is None else laid
            best = best_of_series(catalogue, published)
            words = _describe_design(design, catalogue.classify(design.linkage)[0], published, best)
            told = {k: getattr(design, k) for k in ("name", "title", "source", "proportions", "place")}
            told["deviation"] = published.deviation
            told["best_of_series"] = None if best is None else {"id": best.id, "deviation": best.deviation}
    if plot is not None:
        _draw(laid, plot, moving)
    if format != "table":
        print_json({"code": codes([laid])[0], **laid.to_dict()} | ({"design": told} if told else {}))
        return
    for line in words:
        tell(line)
    _describe(guide)
    _links(laid.lengths)
    place = f"Laid from (0, 0) to ({stroke:g}, 0), in mid-stroke; deviation {with_unit(digits(laid.deviation))}"
    _pivots(place, laid.pivots, laid.guided, "{:.6g}".format)


def _describe(guide: StoredGuide) -> None:
    """Print the kind, provenance and reach of a stored guide."""
    from ..curvature_theory.leading_error import EXACT

    order = "exact" if guide.order == EXACT else f"contact of order {guide.order}"
    order += f", {guide.inflections} inflections" * bool(guide.inflections)
    what = f"circle of radius {1 / abs(guide.curvature):.4g}" if guide.curvature else "straight line"
    if guide.is_slot:
        what = f"slot in the coupler over a fixed point, {what}; shown with the coupler held fast"
    if guide.returns:
        what += ", to the pole and back; shown with the point at rest there"
    tell(f"guide {guide.id}: {guide.series} {guide.family} {guide.configuration}, {guide.member}, point {guide.label}")
    free = ", ".join(f"{k} = {v:.6g}" for k, v in guide.parameters.items())
    tell(f"{what}, {order}" + f"; parameters {free}" * bool(free))
    if guide.kappa is not None:
        tell(f"rho0 = {guide.rho0:.6g}, kappa = {guide.kappa:.6g}, kappa* = {guide.kappa_star:.6g}, s = {guide.s:.6g}")
    else:
        tell("pole at infinity: parallel cranks")
    p = guide.provenance
    if p:
        tell(f"plugin {p['plugin']} {p['plugin_version']}, plan {p['plan']}, seed {p['seed']}, block {p['number']}")
    r = guide.reaches
    columns = [">deviation/stroke", ">longest stroke", ">size/stroke", ">transmission"]
    rows = [
        [f"1e{int(k)}", f"{a:.4g}", f"{b:.4g}", f"{c:.1f}\u00b0"]
        for k, a, b, c in zip(r["level"], r["stroke"], r["size"], r["min_transmission"], strict=True)
    ]
    print_table("Reach, in units of rho0 or of the height of crank 1", columns, rows[::-1])
