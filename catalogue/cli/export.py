"""``catalogue export``: the stored guides as a file for other programs."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import InvalidRequest, MissingExtra
from ..folders import is_folder, replacing
from .options import DB, FAMILY, ORDER, PINS_ONLY, PLUGINS, SERIES, option, several, switch
from .tables import FORCE, OUTPUT

if TYPE_CHECKING:
    import pandas as pd


@click.command(
    params=[
        option("--format", None, "What to write; sqlite: a database with guides, pivots, reaches and what they mean.",
               click.Choice(["csv", "parquet", "sqlite"]), default="csv"),
        option("--out", "FILE", "Where to; without it csv goes to standard output.", OUTPUT),
        FORCE,
        switch("--reaches", "One row per reach instead of one per guide; sqlite has both in any case."),
        SERIES,
        FAMILY,
        several("--kind", "NAME", "Only line, circle, slot, arc, return-line or return-circle; may be repeated."),
        ORDER,
        PINS_ONLY,
        DB,
        PLUGINS,
    ]
)  # fmt: skip
def export(
    format: str, out: Path | None, reaches: bool, series: Sequence[str], family: Sequence[str],
    kind: Sequence[str], order: int, pins_only: bool, db: Path | None, plugins: Sequence[str],
) -> None:  # fmt: skip
    """Write the stored guides with their pivots, parameters and curvature as a table for other programs.

    Lengths are canonical; `catalogue schema` says what each column means.

    \b
    catalogue export --series II.xy --format parquet --out evans.parquet
    """
    from ..api import open
    from ..store.extract import write_extract

    if out is None and format != "csv":
        raise InvalidRequest(f"{format} cannot be printed: name a file with --out")
    if out is not None:
        _check(out)
    with open(db, plugins=plugins) as catalogue:
        guides = catalogue.guides(
            series=series, families=family, kind=kind, order=order, pins_only=pins_only,
            reaches=reaches and format != "sqlite",
        )  # fmt: skip
        if out is None:
            guides.to_csv(sys.stdout, index=False)
            return
        try:
            with replacing(out) as part:
                if format == "sqlite":
                    write_extract(catalogue.database, guides["id"].tolist(), part)
                elif format == "parquet":
                    _write_parquet(guides, part)
                else:
                    guides.to_csv(part, index=False)
        except OSError as error:
            raise InvalidRequest(f"cannot write {out}: {error.strerror}") from error
    print(f"written: {out}, {len(guides)} rows", file=sys.stderr)


def _check(out: Path) -> None:
    """Say that a file cannot be written before work is done for it."""
    if not is_folder(out.parent):
        raise InvalidRequest(f"cannot write {out}: there is no folder {out.parent}")
    if is_folder(out):
        raise InvalidRequest(f"{out} is a folder: name a file with --out")


def _write_parquet(guides: pd.DataFrame, file: Path) -> None:
    try:
        guides.to_parquet(file, engine="pyarrow", index=False)
    except ImportError as error:
        raise MissingExtra('parquet needs pyarrow: pip install "mechanism-catalogue[parquet]"') from error
