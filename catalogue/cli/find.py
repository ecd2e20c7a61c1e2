"""``catalogue find``: from a wish to ranked, verified guides."""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Callable
from inspect import Signature, signature
from json import dumps
from typing import TYPE_CHECKING, Any

import typer

from ..errors import InvalidRequest
from ..progress import busy
from ..query.constraints import GIVEN
from ..query.request import CircularArc, Request, StraightLine
from .options import Format
from .wishes import Deviation, Radius, Stroke, wishes

if TYPE_CHECKING:
    from ..query.found import Found

app = typer.Typer(
    help="Find guides: the point runs from (0, 0) to (stroke, 0) and every position is in that frame and unit.",
    no_args_is_help=True,
)


def _command(name: str) -> Callable[[Callable[..., Request]], Callable[..., Request]]:
    """Make a command of a function that makes a request: its options, then those of `wishes`."""

    def register(request: Callable[..., Request]) -> Callable[..., Request]:
        own = signature(request, eval_str=True).parameters

        def command(**options: Any) -> None:
            _find(request(**{key: options.pop(key) for key in own}), options)

        command.__doc__ = request.__doc__
        options = [*own.values(), *signature(wishes, eval_str=True).parameters.values()]
        command.__annotations__ = {one.name: one.annotation for one in options} | {"return": None}
        command.__signature__ = Signature(options)  # type: ignore[attr-defined]  # mypy knows none
        app.command(name)(command)
        return request

    return register


@_command("straight-line")
def straight_line(stroke: Stroke, deviation: Deviation) -> Request:
    """Guide a point along a straight line.

    catalogue find straight-line --stroke 150 --deviation 0.05 --pins-only --min-transmission 40
    """
    return StraightLine(stroke, deviation)


@_command("circular-arc")
def circular_arc(stroke: Stroke, deviation: Deviation, radius: Radius = None) -> Request:
    """Guide a point along a circular arc.

    catalogue find circular-arc --stroke 100 --radius 100 --deviation 0.05
    """
    return CircularArc(stroke, radius, deviation)


def _find(request: Request, options: dict[str, Any]) -> None:
    if options["collection"] is not None:
        from .collected import find_in

        find_in(request, options, {name: p.default for name, p in signature(wishes).parameters.items()})
        return
    if options["where"]:
        raise InvalidRequest("--where bounds a metric of a collection: name it with --collection")
    options = {name: value for name, value in options.items() if name not in ("collection", "where")}
    from ..opening import open

    plural = {"families": "family", "series": "series", "configurations": "configuration"}
    options |= {name: options.pop(option) or () for name, option in plural.items()}
    options["keep_out"] = [_zone(text) for text in options["keep_out"] or ()]
    if pareto := options.pop("pareto"):
        options["rank_by"] = [name.strip() for name in pareto.split(",")]
    output, explain, plot = options.pop("format"), options.pop("explain"), options.pop("plot")
    given = any(options[name] for name in GIVEN)  # such guides are made, not looked up
    with open(options.pop("db"), plugins=options.pop("plugins") or (), build=not given) as catalogue:
        with busy("searching"):
            found = catalogue.find(request, **options)
        if explain or not found:
            told = found.explain()
            print(told if explain else _advice(told), file=sys.stderr)
        if output is Format.json:
            print(found.to_json())
        elif output is Format.csv:
            print(_csv(found), end="")
        elif found:
            from .tables import print_candidates

            print_candidates(found)
    if plot is not None and found:
        found[0].plot(plot)
        print(f"drawn: {plot}", file=sys.stderr)
    if not found:
        raise typer.Exit(1)


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


def _advice(told: str) -> str:
    return "catalogue: " + next(line for line in told.splitlines() if line.startswith("no guide found"))


def _csv(found: Found) -> str:
    from ..query.candidate import COLUMNS

    out = io.StringIO()
    writer = csv.DictWriter(out, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for c in found:
        writer.writerow({k: dumps(v) if isinstance(v, list | dict) else v for k, v in c.to_dict().items()})
    return out.getvalue()
