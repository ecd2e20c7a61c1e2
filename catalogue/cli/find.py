"""``catalogue find``: from a wish to ranked, verified guides."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ..errors import InvalidRequest
from ..progress import busy
from .find_options import DEVIATION, OPTIONS, PLACE, RADIUS, STROKE
from .tables import codes, contact, links, print_results, print_table

if TYPE_CHECKING:
    from ..find.candidate import Candidate
    from ..find.results import Found
    from ..problem.request import Request


@click.command(params=[DEVIATION, STROKE, *PLACE, *OPTIONS])
def straight_line(deviation: float, **options: Any) -> None:
    """Guide a point along a straight line.

    \b
    catalogue find straight-line --stroke 150 --deviation 0.05 --pins-only --min-transmission 40
    """
    from ..problem.request import StraightLine

    _find(StraightLine(deviation=deviation, **place(options)), options)


@click.command(params=[DEVIATION, STROKE, RADIUS, *PLACE, *OPTIONS])
def circular_arc(deviation: float, radius: float | None, **options: Any) -> None:
    """Guide a point along a circular arc.

    \b
    catalogue find circular-arc --stroke 100 --radius 100 --deviation 0.05
    """
    from ..problem.request import CircularArc

    _find(CircularArc(deviation=deviation, radius=radius, **place(options)), options)


def place(options: dict[str, Any]) -> dict[str, Any]:
    """Return stroke, start and direction of a path from the options that say where it lies, and take these out."""
    from ..problem.request import ends

    stroke, start, end, along = (options.pop(name) for name in ("stroke", "from", "to", "along"))
    if end is None:
        if stroke is None:
            raise InvalidRequest("say how long the path is, --stroke L, or where it runs, --from X Y --to X Y")
        return {"stroke": stroke, "start": start or (0.0, 0.0), "along": along}
    if stroke is not None or along:
        raise InvalidRequest("--to says how long the path is and where it leads: leave out --stroke and --along")
    return ends(start or (0.0, 0.0), end)


def _find(request: Request, options: dict[str, Any]) -> None:
    if options["collection"] is not None:
        from .find_collection import find_in

        find_in(request, options)
        return
    del options["collection"]
    if options.pop("where"):
        raise InvalidRequest("--where bounds a metric of a collection: name it with --collection")
    from ..api import open
    from ..problem.constraints import PRESCRIBED

    settled(options)
    if pareto := options.pop("pareto"):
        options["rank_by"] = [name.strip() for name in pareto.split(",")]
    output, explain, plot, save = (options.pop(name) for name in ("format", "explain", "plot", "save"))
    given = any(options[name] for name in PRESCRIBED)  # such guides are made, not looked up
    with open(options.pop("db"), plugins=options.pop("plugins"), build=not given) as catalogue:
        with busy("searching"):
            found = catalogue.find(request, **options)
        print_results(found, print_candidates, output, explain=explain, plot=plot, save=save)


def settled(options: dict[str, Any]) -> None:
    """Turn options into the keywords of the library, as far as they differ."""
    from ..find.names import SINGULAR

    options |= {name: options.pop(option) for name, option in SINGULAR.items() if option in options}
    options["keep_out"] = [_zone(text) for text in options["keep_out"]]
    if "desires" in options:
        options["desires"] = dict(_desire(text) for text in options["desires"])


def _zone(text: str) -> list[float] | list[tuple[float, float]]:
    """Return a box as four numbers or a polygon as points, from numbers with commas or spaces between."""
    try:
        numbers = [float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        raise InvalidRequest(f"--keep-out takes numbers such as 0,0,10,20, not {text!r}") from None
    if len(numbers) == 4:
        return numbers
    if len(numbers) < 6 or len(numbers) % 2:
        raise InvalidRequest(f"--keep-out takes x0,y0,x1,y1 or x and y of three or more points, not {text!r}")
    return list(zip(numbers[::2], numbers[1::2], strict=True))


def _desire(text: str) -> tuple[str, list[float]]:
    """Return the name of a desire and its numbers, from NAME=BEST:WORST or NAME=BEST:WORST:WEIGHT."""
    name, _, numbers = text.partition("=")
    try:
        return name.strip(), [float(part) for part in numbers.split(":")]
    except ValueError:
        raise InvalidRequest(f"--desire takes NAME=BEST:WORST or NAME=BEST:WORST:WEIGHT, not {text!r}") from None


def print_candidates(found: Found) -> None:
    """Print the answers of a `find` as a table."""
    first = found[0]
    arc = first.radius is not None
    radii = [c.radius or 0.0 for c in found]
    same = max(radii) <= 1.004 * min(radii)
    what = f"an arc of chord {first.stroke:g}" if arc else f"a straight line of {first.stroke:g}"
    what += f" and radius {first.radius:.4g}" if arc and same else ""
    columns = ["code", ">id", "series", "family", "conf.", ">order", ">deviation", ">allowance", ">size", ">links",
               ">transmission", "turns", ">score"]  # fmt: skip
    turning = any(c.min_transmission_turn for c in found)
    rows = [[code, *_row(c, turning)] for code, c in zip(codes(found), found, strict=True)]
    if not same:
        columns.append(">radius")
        rows = [[*row, f"{radius:.4g}"] for row, radius in zip(rows, radii, strict=True)]
    caption = "allowance: scatter of the pivots that the path forgives; transmission: over the stroke (over the turn)\n"
    caption += "`catalogue show CODE` gives all numbers of one, --plot FILE draws it; so do `measure` and `improve`"
    print_table(f"Guides for {what}", columns, rows, caption)


def _row(c: Candidate, turning: bool) -> list[Any]:
    transmission = f"{c.min_transmission:.0f}\u00b0"
    if turning and c.min_transmission_turn is not None:
        transmission += f" ({c.min_transmission_turn:.0f}\u00b0)"
    return [
        c.id, c.series, c.family, c.configuration, contact(c.order), f"{c.deviation:.3g}",
        None if c.allowance is None else f"{c.allowance:.3g}",
        f"{c.size:.4g}",
        links(c),
        transmission,
        " ".join(f"crank {k}" for k in c.rotates) or None,
        None if c.score is None else f"{c.score:.0f}",
    ]  # fmt: skip
