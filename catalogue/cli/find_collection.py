"""``catalogue find ... --collection NAME``: from a wish to verified mechanisms of another kind."""

from __future__ import annotations

import csv
import io
import json
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import typer

from ..errors import InvalidRequest
from ..problem.request import Request
from .options import Format

if TYPE_CHECKING:
    from ..find.specimens import CollectionResults

#: Options of `find` that go with a collection.
KNOWN = (
    "collection", "where", "family", "series", "rank_by", "limit", "explain", "plot", "format", "db", "plugins"
)  # fmt: skip


def find_in(request: Request, options: Mapping[str, Any], defaults: Mapping[str, Any]) -> None:
    """Answer a request from the collection that the options name."""
    from ..api import open

    for name, value in options.items():
        if name not in KNOWN and value != defaults[name]:
            known = ", ".join(f"--{k.replace('_', '-')}" for k in KNOWN[1:6])
            raise InvalidRequest(f"--{name.replace('_', '-')} does not go with --collection, which knows {known}")
    from ..collections.bounds import parsed

    where = parsed(options["where"] or ())
    rank_by = "deviation" if options["rank_by"] == defaults["rank_by"] else options["rank_by"]
    with open(options["db"], plugins=options["plugins"] or (), build=False) as catalogue:
        found = catalogue.find_in(
            options["collection"], request, limit=options["limit"], rank_by=rank_by,
            families=options["family"] or (), series=options["series"] or (), where=where,
        )  # fmt: skip
        if options["explain"] or not found:
            told = found.explain()
            advice = next((line for line in told.splitlines() if line.startswith("no piece found")), "")
            print(told if options["explain"] else f"catalogue: {advice}", file=sys.stderr)
    if options["plot"] is not None and found:
        found[0].plot(options["plot"])
        print(f"drawn: {options['plot']}", file=sys.stderr)
    if options["format"] is Format.json:
        print(found.to_json())
    elif options["format"] is Format.csv:
        print(_csv(found), end="")
    elif found:
        _table(found, request)
    if not found:
        raise typer.Exit(1)


def _csv(found: CollectionResults) -> str:
    out = io.StringIO()
    writer = csv.DictWriter(out, found.columns, lineterminator="\n")
    writer.writeheader()
    for piece in found:
        row = piece.to_dict()
        writer.writerow({k: json.dumps(v) if isinstance(v, list | dict) else v for k, v in row.items()})
    return out.getvalue()


def _table(found: CollectionResults, request: Request) -> None:
    from .tables import print_table

    metrics = found.collection.metrics
    columns = [("id", "right"), ("family", "left"), ("series", "left"), ("configuration", "left"), ("special", "left"),
               ("deviation", "right")]  # fmt: skip
    columns += [("radius", "right")] * (request.kind == "circle")
    columns += [(name + {"deg": "\u00b0"}.get(m.unit, ""), "right") for name, m in metrics.items()]
    rows = []
    for p in found:
        radius = [f"{p.radius:.4g}"] if p.radius is not None else []
        values = [f"{p.metrics[name]:.4g}" for name in metrics]
        special = ", ".join(p.special)
        row = [str(p.id), p.family, p.series, p.configuration, special, f"{p.deviation:.3g}", *radius, *values]
        rows.append(row)
    what = "a straight line" if request.kind == "line" else "an arc of chord"
    caption = "; ".join(f"{name}: {m.meaning}" for name, m in metrics.items())
    print_table(f"{found.collection.title}, {what} of {request.stroke:g}", columns, rows, caption)
