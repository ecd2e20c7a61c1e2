"""``catalogue find ... --collection NAME``: search mechanisms of another kind."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

import click

from ..errors import InvalidRequest
from ..guides.columns import CANDIDATE, Column
from ..guides.columns import TABLE as MADE
from ..problem.constraints import REGIONS
from ..problem.path import PathRequest
from ..quantities import BOUNDS
from .find_options import OPTIONS
from .options import is_given
from .tables import codes, print_results, print_table, row
from .units import with_unit

if TYPE_CHECKING:
    from ..find.specimens import CollectionResults

#: Options of `find` permitted with a collection, besides bounds and output.
KNOWN = (
    *("where", "family", "series", "special", "pins_only", "full_rotation"),
    *("fixed_pivots_in", "pivots_in", "swept_in", "keep_out"),
    *("rank_by", "limit", "effort", "refine"),
)
#: Options of any search.
COMMON = ("collection", "explain", "plot", "save", "format", "db", "plugins")


def find_in(request: PathRequest, options: Mapping[str, Any]) -> None:
    """Answer a request from the collection that the options name."""
    from ..api import open
    from ..collections.bounds import parsed

    default = click.Command("find", params=[*OPTIONS]).make_context("find", []).params
    spelled = {one.name: one.opts[0] for one in OPTIONS}
    asked = {name: value for name, value in options.items() if value != default[name]}
    for name in asked:
        if name not in (*KNOWN, *COMMON, *BOUNDS):
            known = ", ".join(spelled[one] for one in KNOWN)
            raise InvalidRequest(f"{spelled[name]} does not go with --collection, which knows {known} and bounds")
    held = {*BOUNDS, *REGIONS, "pins_only", "full_rotation", "keep_out"}
    with open(options["db"], plugins=options["plugins"], build=False) as catalogue:
        found = catalogue.find_in(
            options["collection"],
            request,
            limit=options["limit"],
            rank_by=options["rank_by"] or "deviation",
            families=options["family"],
            series=options["series"],
            where=parsed(options["where"]),
            special=options["special"],
            refine=options["refine"] if is_given("refine") else None,
            effort=options["effort"],
            **{name: value for name, value in asked.items() if name in held},
        )
        shown = {*(name for name in asked if name in held), *parsed(options["where"]), options["rank_by"]}
        print_results(
            found,
            lambda found: _table(found, request, shown),
            options["format"],
            explain=options["explain"],
            plot=options["plot"],
            save=options["save"],
        )


def _table(found: CollectionResults, request: PathRequest, asked: Collection[str]) -> None:
    """Print answers; of minor metrics only those that are bounded or ranked by."""
    wanted = {*asked, *(BOUNDS[name].measure for name in asked if name in BOUNDS)}
    metrics = {name: m for name, m in found.collection.metrics.items() if not m.minor or name in wanted}
    own = {name: Column(name, m.unit, m.meaning) for name, m in metrics.items()}
    meanings = {
        **MADE,
        **CANDIDATE,
        **own,
        "special": Column("special", "", "well-known cases that it is one of", right=False),
    }
    arc = request.kind == "circle"
    names = ["code", "id", "family", "series", "configuration", "special", "deviation", *["radius"] * arc, *own]
    rows = [
        row(
            p,
            names,
            code=code,
            special=", ".join(p.special) or None,
            **{name: f"{p.metrics[name]:.4g}" + "\u00b0" * (m.unit == "deg") for name, m in metrics.items()},
        )
        for code, p in zip(codes(found), found, strict=True)
    ]
    stroke = with_unit(f"{request.stroke:g}")
    title = f"{found.collection.title}, {'an arc of chord' if arc else 'a straight line of'} {stroke}"
    caption = "\n".join(f"{one.plain}: {one.told}" for one in own.values())
    unasked = [name for name in reversed(own) if name not in wanted]
    spare = ["id", "special", "configuration", *unasked, *(name for name in reversed(own) if name in wanted)]
    print_table(title, names, rows, caption, meanings=meanings, spare=spare)
