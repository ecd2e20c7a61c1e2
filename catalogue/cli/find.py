"""``catalogue find``: search guides by options, or by a file of options."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import click

from ..errors import InvalidRequest
from ..guides.columns import CANDIDATE
from ..guides.columns import TABLE as MADE
from ..progress import busy
from .find_options import ANGLE, DEVIATION, OPTIONS, PLACE, RADIUS, STROKE
from .options import option
from .tables import Tabled, codes, print_results, print_table, row
from .units import unit, with_unit

if TYPE_CHECKING:
    from ..guides.results import Found
    from ..problem.path import PathRequest
    from ..problem.problem import Request

#: Columns of the table in order.
TABLE = (
    *("code", "id", "series", "family", "configuration", "order", "deviation", "expected", "allowance"),
    *("size", "travel", "links", "transmission", "rotates", "radius", "score", "front"),
)
#: Title, unit and meaning of each column.
COLUMNS = {**MADE, **CANDIDATE}
#: Columns to omit on a narrow terminal, the first one first.
SPARE = ("id", "configuration", "order", "rotates", "travel", "family", "allowance", "links")


def _configured(ctx: click.Context, param: click.Parameter, file: str | None) -> None:  # noqa: ARG001  # click gives it
    if file is not None and not ctx.resilient_parsing:
        from .config import options_from_file

        ctx.default_map = {**(ctx.default_map or {}), **options_from_file(file, ctx.command)}


CONFIG = option(
    "--config",
    "FILE",
    'Read options from a TOML file (stroke = "6in"). Command-line options override it; it overrides CATALOGUE_DB.',
    is_eager=True,
    expose_value=False,
    callback=_configured,
)


@click.command(cls=Tabled, table=TABLE, columns=COLUMNS, params=[DEVIATION, STROKE, *PLACE, *OPTIONS, CONFIG])
def straight_line(**options: Any) -> None:
    """Guide a point along a straight line.

    \b
    catalogue find straight-line --stroke 150 --deviation 0.05 --pins-only --min-transmission 40
    """
    _find(options, curved=False)


@click.command(
    cls=Tabled, table=TABLE, columns=COLUMNS, params=[DEVIATION, STROKE, RADIUS, ANGLE, *PLACE, *OPTIONS, CONFIG]
)
def circular_arc(**options: Any) -> None:
    """Guide a point along a circular arc.

    \b
    catalogue find circular-arc --stroke 100 --radius 100 --deviation 0.05
    """
    _find(options, curved=True)


def request_from(options: dict[str, Any], *, curved: bool, share: float | None = None) -> PathRequest:
    """Build a request from the options of a path, and remove them.

    Parameters
    ----------
    options : dict
        Options of the command by parameter name; modified.
    curved : bool
        Whether the path is an arc.
    share : float, optional
        Deviation as a fraction of the stroke where none is given.

    Raises
    ------
    InvalidRequest
        If the options contradict one another or define no path.
    """
    from ..problem.path import CircularArc, StraightLine

    deviation, arc = options.pop("deviation"), {name: options.pop(name, None) for name in ("radius", "angle")}
    path = _path(options, **arc)
    if deviation is None and share is not None:
        deviation = share * path["stroke"]
    if curved:
        return CircularArc(deviation=deviation, unit=unit(), **arc, **path)
    return StraightLine(deviation=deviation, unit=unit(), **path)


def _path(options: dict[str, Any], radius: float | None = None, angle: float | None = None) -> dict[str, Any]:
    """Return stroke, start and direction of a path from its options, and remove them."""
    from ..problem.path import consistent_arc, ends

    stroke, start, end, along = (options.pop(name) for name in ("stroke", "from", "to", "along"))
    if end is None:
        if stroke is None and radius is not None and angle is not None:
            stroke = consistent_arc(None, radius, angle)[0]
        if stroke is None:
            arc = " (of an arc also --radius R --angle DEG)" if radius is not None or angle is not None else ""
            raise InvalidRequest(f"say how long the path is, --stroke L{arc}, or where it runs, --from X Y --to X Y")
        return {"stroke": stroke, "start": start or (0.0, 0.0), "along": along}
    if stroke is not None or along:
        raise InvalidRequest("--to says how long the path is and where it leads: leave out --stroke and --along")
    return ends(start or (0.0, 0.0), end)


def _find(options: dict[str, Any], *, curved: bool) -> None:
    if options["collection"] is not None:
        from .find_collection import find_in

        find_in(request_from(options, curved=curved), options)
        return
    del options["collection"]
    for name, what in (("where", "bounds a metric"), ("special", "names mechanisms")):
        if options.pop(name):
            raise InvalidRequest(f"--{name} {what} of a collection: name it with --collection")
    from ..api import open

    names = ("format", "explain", "plot", "save", "db", "plugins", "starts")
    output, explain, plot, save, db, plugins, starts = (options.pop(name) for name in names)
    request = whole_request(options, curved=curved)
    given = request.constraints.given is not None  # such guides are synthesised, not retrieved
    with open(db, plugins=plugins, build=not given) as catalogue:
        guides: Any = ()
        if starts:
            from . import references

            guides = [one for name in starts for one in references.guides(name, None, lambda: catalogue)]
        with busy("searching"):
            found = catalogue.find(request, starts=guides)
        level = request.constraints.max_rotation is not None
        print_results(found, partial(print_candidates, level=level), output, explain=explain, plot=plot, save=save)


def whole_request(options: dict[str, Any], *, curved: bool) -> Request:
    """Build a request from options of its path, constraints and ranking; modify `options`.

    Raises
    ------
    InvalidRequest
        If a value is invalid.
    """
    from ..problem.problem import Request

    path = request_from(options, curved=curved)
    to_keywords(options)
    return Request.of(path, **options)


def to_keywords(options: dict[str, Any]) -> None:
    """Rename options to the keywords of `Catalogue.find`, in place."""
    from ..find.names import SINGULAR

    options |= {name: options.pop(option) for name, option in SINGULAR.items() if option in options}
    rank_by, pareto = options.pop("rank_by", None), options.pop("pareto", None)
    if rank_by and pareto:
        raise InvalidRequest("--pareto weighs no criterion: leave out --rank-by")
    if rank_by or pareto:
        options["rank_by"] = rank_by or [name.strip() for name in pareto.split(",")]
    if "desires" in options:
        options["desires"] = dict(options["desires"])


def print_candidates(found: Found, *, level: bool = False) -> None:
    """Print the answers of a search as a table.

    With `level`, for a body that hardly turns, the rotation is a column.
    """
    first = found[0]
    radii = [c.radius or 0.0 for c in found]
    same = max(radii) <= 1.004 * min(radii)
    what = f"a straight line of {with_unit(f'{first.stroke:g}')}"
    if first.radius is not None:
        what = f"an arc of chord {with_unit(f'{first.stroke:g}')}"
        what += f" and radius {with_unit(f'{first.radius:.4g}')}" * same
        what += f", {first.arc_angle:.4g}\u00b0" if first.is_wide else ""
    asked = {
        "radius": not same,
        "expected": any(c.expected != c.deviation for c in found if c.expected is not None),
        "front": first.front is not None,
        "travel": any(c.travel is not None for c in found),
    }
    names = [name for name in TABLE if asked.get(name, True)]
    caption = "`catalogue show CODE` gives all numbers of one and --plot FILE draws it; --legend explains the columns"
    if any(c.score == 0 for c in found):
        caption += (
            "\nscore 0: one desirability is zero (size, transmission angle, allowance, shortest link, ground or "
            "slider travel); see --desire"
        )
    if level:
        caption += "\nplatforms of six bars, which do not turn at all: --collection translating-platforms"
    rows = [row(c, names, code=code) for code, c in zip(codes(found), found, strict=True)]
    print_table(f"Guides for {what}", names, rows, caption, meanings=COLUMNS, spare=SPARE)
