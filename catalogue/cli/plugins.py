"""``catalogue plugins``: list loaded and rejected plugins."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path

import click
from click.exceptions import Exit

from ..folders import default_database
from .options import DB, FORMAT, PLUGINS
from .tables import print_records


@click.command(params=[PLUGINS, FORMAT, DB])
def plugins(plugins: Sequence[str], format: str, db: Path | None) -> None:
    """List the plugins with the series and families they add; rejected plugins with the reason.

    Collections are listed with the number of their stored mechanisms.
    """
    from dataclasses import asdict

    from ..errors import PluginWarning
    from ..plugin.registry import Registry

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PluginWarning)  # the table shows them
        registry = Registry(plugins)
        held = _stored(db or default_database(), list(registry.collections))
    records = [{**asdict(r), "specimens": {c: held[c] for c in r.collections}} for r in registry.records]
    rows = []
    for r in registry.records:
        adds = [*r.families, *r.series, *(f"{name} ({held[name]} specimens)" for name in r.collections)]
        rows.append([r.name, r.version, f"left out: {r.error}" if r.error else ", ".join(adds), r.origin])
    print_records(format, records, "Plugins", ["plugin", "version", "~adds", "~from"], rows)
    if any(r.error for r in registry.records):
        raise Exit(5)


def _stored(file: Path, names: list[str]) -> dict[str, int]:
    """Count the stored specimens of each collection; none if the file is missing."""
    if not names or not file.exists():
        return dict.fromkeys(names, 0)
    from ..populate.collect import stored
    from ..store import Database

    with Database.open(file, create=False) as database:
        return {name: sum(number for number, _ in stored(database, name).values()) for name in names}
