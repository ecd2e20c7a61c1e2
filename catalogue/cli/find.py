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
from ..problem.constraints import PRESCRIBED
from ..problem.request import CircularArc, Request, StraightLine, ends
from ..progress import busy
from .find_options import Along, Deviation, From, Point, Radius, Stroke, To, find_options
from .options import Format

if TYPE_CHECKING:
    from ..find.results import Found

app = typer.Typer(
    help="Find guides: the point runs from (0, 0) to (stroke, 0) and every position is in that frame and unit.",
    no_args_is_help=True,
)


def _command(name: str) -> Callable[[Callable[..., Request]], Callable[..., Request]]:
    """Make a command of a function that makes a request: its options, then those of `find_options`."""

    def register(request: Callable[..., Request]) -> Callable[..., Request]:
        own = signature(request, eval_str=True).parameters

        def command(**options: Any) -> None:
            _find(request(**{key: options.pop(key) for key in own}), options)

        command.__doc__ = request.__doc__
        options = [*own.values(), *signature(find_options, eval_str=True).parameters.values()]
        command.__annotations__ = {one.name: one.annotation for one in options} | {"return": None}
        command.__signature__ = Signature(options)  # type: ignore[attr-defined]  # mypy knows none
        app.command(name)(command)
        return request

    return register


@_command("straight-line")
def straight_line(
    deviation: Deviation, stroke: Stroke = None, from_: From = None, to: To = None, along: Along = 0.0
) -> Request:
    """Guide a point along a straight line.

    catalogue find straight-line --stroke 150 --deviation 0.05 --pins-only --min-transmission 40
    """
    return StraightLine(deviation=deviation, **_where(stroke, from_, to, along))


@_command("circular-arc")
def circular_arc(
    deviation: Deviation, stroke: Stroke = None, radius: Radius = None, from_: From = None, to: To = None,
    along: Along = 0.0,
) -> Request:  # fmt: skip
    """Guide a point along a circular arc.

    catalogue find circular-arc --stroke 100 --radius 100 --deviation 0.05
    """
    return CircularArc(radius=radius, deviation=deviation, **_where(stroke, from_, to, along))


def _where(stroke: float | None, start: Point | None, end: Point | None, along: float) -> dict[str, Any]:
    """Return stroke, start and direction of a path from the options that say where it lies."""
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

        find_in(request, options, {name: p.default for name, p in signature(find_options).parameters.items()})
        return
    if options["where"]:
        raise InvalidRequest("--where bounds a metric of a collection: name it with --collection")
    options = {name: value for name, value in options.items() if name not in ("collection", "where")}
    from ..api import open

    plural = {"families": "family", "series": "series", "configurations": "configuration"}
    options |= {name: options.pop(option) or () for name, option in plural.items()}
    options["keep_out"] = [_zone(text) for text in options["keep_out"] or ()]
    options["desires"] = dict(_desire(text) for text in options["desires"] or ())
    if pareto := options.pop("pareto"):
        options["rank_by"] = [name.strip() for name in pareto.split(",")]
    output, explain, plot = options.pop("format"), options.pop("explain"), options.pop("plot")
    given = any(options[name] for name in PRESCRIBED)  # such guides are made, not looked up
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


def _desire(text: str) -> tuple[str, list[float]]:
    """Return the name of a desire and its numbers, from NAME=BEST:WORST or NAME=BEST:WORST:WEIGHT."""
    name, _, numbers = text.partition("=")
    try:
        return name.strip(), [float(part) for part in numbers.split(":")]
    except ValueError:
        raise InvalidRequest(f"--desire takes NAME=BEST:WORST or NAME=BEST:WORST:WEIGHT, not {text!r}") from None


def _advice(told: str) -> str:
    return "catalogue: " + next(line for line in told.splitlines() if line.startswith("no guide found"))


def _csv(found: Found) -> str:
    from ..find.results import COLUMNS

    out = io.StringIO()
    writer = csv.DictWriter(out, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for c in found:
        writer.writerow({k: dumps(v) if isinstance(v, list | dict) else v for k, v in c.to_dict().items()})
    return out.getvalue()
