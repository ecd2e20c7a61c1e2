"""``catalogue find ... --collection NAME``: from a wish to verified mechanisms of another kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from ..errors import InvalidRequest
from ..problem.request import Request
from .find_options import OPTIONS
from .tables import codes, print_results, print_table

if TYPE_CHECKING:
    from ..find.specimens import CollectionResults

#: Options of `find` that go with a collection.
KNOWN = (
    "collection", "where", "family", "series", "rank_by", "limit", "explain", "plot", "save", "format", "db", "plugins"
)  # fmt: skip


def find_in(request: Request, options: Mapping[str, Any]) -> None:
    """Answer a request from the collection that the options name."""
    from ..api import open

    default = click.Command("find", params=[*OPTIONS]).make_context("find", []).params
    for name, value in options.items():
        if name not in KNOWN and value != default[name]:
            known = ", ".join(f"--{k.replace('_', '-')}" for k in KNOWN[1:6])
            raise InvalidRequest(f"--{name.replace('_', '-')} does not go with --collection, which knows {known}")
    from ..collections.bounds import parsed

    where = parsed(options["where"])
    rank_by = "deviation" if options["rank_by"] == default["rank_by"] else options["rank_by"]
    with open(options["db"], plugins=options["plugins"], build=False) as catalogue:
        found = catalogue.find_in(
            options["collection"], request, limit=options["limit"], rank_by=rank_by,
            families=options["family"], series=options["series"], where=where,
        )  # fmt: skip
        print_results(
            found, lambda found: _table(found, request), options["format"], explain=options["explain"],
            plot=options["plot"], save=options["save"],
        )  # fmt: skip


def _table(found: CollectionResults, request: Request) -> None:
    metrics = found.collection.metrics
    arc = request.kind == "circle"
    columns = ["code", ">id", "family", "series", "configuration", "special", ">deviation", *[">radius"] * arc]
    columns += [f">{name}\u00b0" if m.unit == "deg" else f">{name}" for name, m in metrics.items()]
    rows = [
        [code, p.id, p.family, p.series, p.configuration, ", ".join(p.special), f"{p.deviation:.3g}",
         *([] if p.radius is None else [f"{p.radius:.4g}"]), *(f"{p.metrics[name]:.4g}" for name in metrics)]
        for code, p in zip(codes(found), found, strict=True)
    ]  # fmt: skip
    what = "an arc of chord" if arc else "a straight line"
    caption = "; ".join(f"{name}: {m.meaning}" for name, m in metrics.items())
    print_table(f"{found.collection.title}, {what} of {request.stroke:g}", columns, rows, caption)
