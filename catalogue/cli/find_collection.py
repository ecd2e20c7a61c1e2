"""``catalogue find ... --collection NAME``: search mechanisms of another kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from ..errors import InvalidRequest
from ..find.columns import CANDIDATE, Column
from ..find.columns import TABLE as MADE
from ..problem.bounds import BOUNDS, Bound
from ..problem.path import PathRequest
from .find_options import OPTIONS
from .options import is_given
from .tables import codes, print_results, print_table, row
from .units import with_unit

if TYPE_CHECKING:
    from ..collections.spec import Collection
    from ..find.specimens import CollectionResults

#: Options of `find` permitted with a collection.
KNOWN = (
    "collection",
    "where",
    "family",
    "series",
    "special",
    "pins_only",
    "rank_by",
    "limit",
    "refine",
    "explain",
    "plot",
    "save",
    "format",
    "db",
    "plugins",
)


def find_in(request: PathRequest, options: Mapping[str, Any]) -> None:
    """Answer a request from the collection that the options name."""
    from ..api import open

    default = click.Command("find", params=[*OPTIONS]).make_context("find", []).params
    for name, value in options.items():
        if name not in KNOWN and name not in BOUNDS and value != default[name]:
            known = ", ".join(f"--{k.replace('_', '-')}" for k in KNOWN[1:9])
            raise InvalidRequest(f"--{name.replace('_', '-')} does not go with --collection, which knows {known}")
    from ..collections.bounds import parsed

    where = parsed(options["where"])
    with open(options["db"], plugins=options["plugins"], build=False) as catalogue:
        collection = catalogue.registry.collection(options["collection"])
        for name, row in BOUNDS.items():
            if options[name] != default[name]:
                _bound(where, collection, row, options[name])
        families = options["family"]
        if options["pins_only"]:
            families = _pinned(collection, families)
        found = catalogue.find_in(
            options["collection"],
            request,
            limit=options["limit"],
            rank_by=options["rank_by"] or "deviation",
            families=families,
            series=options["series"],
            where=where,
            special=options["special"],
            refine=options["refine"] and is_given("refine"),
        )
        print_results(
            found,
            lambda found: _table(found, request),
            options["format"],
            explain=options["explain"],
            plot=options["plot"],
            save=options["save"],
        )


def _bound(
    where: dict[str, tuple[float | None, float | None]], collection: Collection, row: Bound, value: float
) -> None:
    """Add the bound of an option to the conditions of --where."""
    if row.measure not in collection.metrics:
        option, known = f"--{row.name.replace('_', '-')}", ", ".join(collection.metrics)
        raise InvalidRequest(f"{option} does not go with {collection.name}, which measures {known}")
    least, most = where.get(row.measure, (None, None))
    if row.upper:
        where[row.measure] = least, value if most is None else min(value, most)
    else:
        where[row.measure] = value if least is None else max(value, least), most


def _pinned(collection: Collection, families: Sequence[str]) -> list[str]:
    """Select the requested families that have pins only."""
    if collection.pinned is None:
        raise InvalidRequest(f"--pins-only does not go with {collection.name}: the kinds of its joints are not known")
    found = [name for name in collection.families if name in collection.pinned and (not families or name in families)]
    if not found:
        which = f"none of {', '.join(families)}" if families else f"no family of {collection.name}"
        raise InvalidRequest(f"{which} has pins only: leave out --pins-only")
    return found


def _table(found: CollectionResults, request: PathRequest) -> None:
    metrics = found.collection.metrics
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
    spare = ["id", "special", "configuration", *reversed(own)]
    print_table(title, names, rows, caption, meanings=meanings, spare=spare)
