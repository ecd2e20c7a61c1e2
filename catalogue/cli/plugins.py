"""``catalogue plugins``: what was loaded, and what was left out and why."""

from __future__ import annotations

import json
import warnings

import typer

from .options import Format, Output, Plugins


def plugins(plugins: Plugins = None, format: Output = Format.table) -> None:
    """List the plugins with what they add, and those that were left out with the reason."""
    from dataclasses import asdict

    from ..plugins import PluginWarning, Registry

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PluginWarning)  # the table says it
        registry = Registry(plugins or ())
    if format is Format.json:
        print(json.dumps([asdict(r) for r in registry.records], indent=1))
    else:
        columns = [("plugin", "left"), ("version", "left"), ("adds", "left"), ("from", "left")]
        rows = [
            [r.name, r.version, f"left out: {r.error}" if r.error else ", ".join(r.families + r.series), r.origin]
            for r in registry.records
        ]
        if format is Format.csv:
            import csv
            import sys

            csv.writer(sys.stdout, lineterminator="\n").writerows([[c for c, _ in columns], *rows])
        else:
            from .tables import print_table

            print_table("Plugins", columns, rows)
    if any(r.error for r in registry.records):
        raise typer.Exit(5)
