"""``catalogue export``: write one guide for CAD, or the whole database as a table."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InvalidRequest, MissingExtra
from ..export.formats import BINARY, FORMATS, SUFFIXES, UNIT_FORMATS, Options, choose_format
from ..export.write import check
from ..folders import is_folder, replacing
from .options import DB, FAMILY, ORDER, PINS_ONLY, PLUGINS, SERIES, SHARE, Argument, option, several, switch
from .references import HELP, REFERENCE, keep, resolve
from .tables import FORCE, OUTPUT
from .units import UNIT, length, unit, warn_of_unit

if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import BinaryIO

    import pandas as pd

#: Formats of the whole database, and suffixes of files.
STORE = ("csv", "parquet", "sqlite")
STORE_SUFFIXES = {".parquet": "parquet", ".db": "sqlite", ".sqlite": "sqlite"}

#: Options for one guide.
OF_GUIDE = [
    length("--stroke", "L", "Scale a stored guide or named design to this stroke."),
    length("--point", "X Y", "Guided point of a linkage from a file, in the position of its pivots.", nargs=2),
    length(
        "--bar-width",
        "W",
        "Width of the parts (dxf, svg, freecad, step, parameters).",
        show_default="a round one, from the size",
    ),
    length("--hole", "D", "Diameter of the holes, without tool compensation.", show_default="at most half the width"),
    option(
        "--positions",
        "N",
        "Rows of the motion table (csv, xlsx, parquet), as `trace --samples`.",
        int,
        show_default="73",
    ),
    several(
        "--columns",
        "NAME,...",
        "Only these columns of the motion table, by the start of their headings; may be repeated.",
    ),
    option(
        "--over",
        None,
        "Range of the motion: the stroke of an answer, or the whole circuit.",
        click.Choice(["stroke", "circuit"]),
        show_default="the stroke, if there is one",
    ),
]
#: Options for the whole database.
OF_STORE = [
    switch("--reaches", "Whole database: one row per reach instead of one per guide; sqlite has both."),
    SERIES,
    FAMILY,
    several("--kind", "NAME", "Only line, circle, slot, arc, return-line or return-circle; may be repeated."),
    ORDER,
    PINS_ONLY,
]
_FLAGS = {str(one.name): one.opts[0] for one in (*OF_GUIDE, UNIT, *OF_STORE)}


@click.command(
    params=[
        Argument("reference", f"[{REFERENCE}]", f"{HELP} Without it: the whole database as a table.", required=False),
        option(
            "--format",
            None,
            "Format; for the whole database csv, parquet or sqlite.",
            click.Choice([*FORMATS, "sqlite"]),
            show_default="by the suffix of --out",
        ),
        option("--out", "FILE", "File to write; without it, or with -, text goes to standard output.", OUTPUT),
        FORCE,
        *OF_GUIDE,
        UNIT,
        *OF_STORE,
        DB,
        SHARE,
        PLUGINS,
    ]
)
def export(reference: str | None, format: str | None, out: Path | None, **options: Any) -> None:
    """Write a guide for CAD and other programs; without CODE, the whole database as a table.

    dxf: the linkage as a block per link, path and dimensions; its parts to cut on a separate layer.
    svg: linkage, path and parts in true size. Mechanisms of many bars have all formats but
    pylinkage, in the pose of their file.
    step: the parts as solids in place. freecad: a macro that builds them, with a spreadsheet of
    parameters. solidworks, fusion: named parameters to import. pylinkage: a script that moves the
    guide and asserts its deviation. json: the guide with lengths, limits and provenance, for
    `measure`, `improve`, `trace`, `show`. csv, xlsx, parquet: the motion.

    Lengths are in the unit of the guide, or converted to --unit. An unknown unit is taken as
    millimetres, with a warning, by dxf, svg, step, freecad, solidworks and fusion; the others name
    none.

    The suffix of --out selects the format: .dxf, .svg, .step, .FCMacro, .txt (solidworks), .py
    (pylinkage), .json, .csv, .xlsx, .parquet.

    Slots are as long as the travel of their sliding blocks over the stroke. A guide by a slot
    (`find --slots`) is written as traced: with its coupler fixed.

    The table of the whole database holds pivots, parameters and curvature in canonical lengths;
    `catalogue schema` explains its columns.

    \b
    catalogue export CODE --out guide.dxf --bar-width 20 --hole 6
    catalogue export watt --stroke 150 --format fusion --out watt.csv
    catalogue export mine.json --out motion.xlsx --positions 37 --columns drive,guided,transmission
    catalogue export --series II.xy --format parquet --out evans.parquet
    """
    if out is not None and str(out) == "-":
        out = None
    db, plugins = options.pop("db"), options.pop("plugins")
    of_store = {str(one.name): options.pop(str(one.name)) for one in OF_STORE}
    misplaced = of_store if reference is not None else options
    misplaced |= {"unit": unit()} if reference is None else {}
    if wrong := [_FLAGS[name] for name, value in misplaced.items() if value not in (None, False, 0, ())]:
        where = "is for all that is stored: leave out CODE" if reference is not None else "is for one guide: name it"
        raise InvalidRequest(f"{wrong[0]} {where}")
    if out is not None:
        if is_folder(out):
            raise InvalidRequest(f"{out} is a folder: name a file with --out")
        check(out)
    if reference is None:
        _store(_of_store(format, out), out, db, plugins, of_store)
        return
    if format == "sqlite":
        raise InvalidRequest("sqlite holds all that is stored: leave out CODE")
    kind = choose_format(format, out)
    if out is None and kind in BINARY:
        raise InvalidRequest(f"{kind} cannot be printed: name a file with --out")
    point, stroke = options.pop("point"), options.pop("stroke")
    options["columns"] = [name for text in options["columns"] for name in text.split(",")]
    how = {name: value for name, value in options.items() if value is not None} | {"unit": unit()}
    Options(**how)
    every = resolve(reference, point, db, plugins, stroke, chains=True)
    if len(every) != 1:
        raise InvalidRequest(f"{reference} holds {len(every)} mechanisms: one can be exported at a time")
    made = every[0].export(out, kind, **how)
    keep(every[0])
    if out is None:
        sys.stdout.write(str(made))
    else:
        print(f"written: {out}, {kind}", file=sys.stderr)
    if kind in UNIT_FORMATS:
        warn_of_unit(every[0])


def _of_store(format: str | None, out: Path | None) -> str:
    """Return the format of a table of the whole database."""
    if format is None and out is not None:
        suffix = out.suffix.lower()
        format = STORE_SUFFIXES.get(suffix) or SUFFIXES.get(suffix)
    format = format or "csv"
    if format not in STORE:
        raise InvalidRequest(f"{format} is of one guide: name it; all that is stored can be {', '.join(STORE)}")
    if out is None and format != "csv":
        raise InvalidRequest(f"{format} cannot be printed: name a file with --out")
    return format


def _store(format: str, out: Path | None, db: Path | None, plugins: Any, which: dict[str, Any]) -> None:
    from ..api import open
    from ..find.frame import GuideFrames
    from ..problem.constraints import Constraints
    from ..store.extract import write_extract

    constraints = Constraints(which.pop("family"), which.pop("series"), (), which.pop("pins_only"), which.pop("order"))
    with open(db, plugins=plugins) as catalogue:
        guides = GuideFrames(catalogue.database, constraints, which["kind"], which["reaches"] and format != "sqlite")
        frames = guides.parts()
        if out is None:
            _write_csv(frames, sys.stdout)
            return
        try:
            with replacing(out) as part:
                if format == "sqlite":
                    numbers = guides.numbers()
                    write_extract(catalogue.database, numbers.tolist(), part)
                    count = len(numbers)
                else:
                    count = (_write_parquet if format == "parquet" else _write_csv)(frames, part)
        except OSError as error:
            raise InvalidRequest(f"cannot write {out}: {error.strerror}") from error
    print(f"written: {out}, {count} rows", file=sys.stderr)


def _write_csv(frames: Iterable[pd.DataFrame], file: Any) -> int:
    """Write frames one after the other, and return the number of rows."""
    count = 0
    for number, frame in enumerate(frames):
        frame.to_csv(file, index=False, header=number == 0)
        count += len(frame)
    return count


def _write_parquet(frames: Iterable[pd.DataFrame], file: BinaryIO) -> int:
    """Write frames as groups of rows, and return the number of rows."""
    try:
        import pyarrow as pa
        from pyarrow.parquet import ParquetWriter
    except ImportError as error:
        raise MissingExtra('parquet needs pyarrow: pip install "mechanism-catalogue[parquet]"') from error
    kinds = {"f": pa.float64(), "i": pa.int64(), "b": pa.bool_()}
    writer, count = None, 0
    for frame in frames:
        if writer is None:
            schema = pa.schema([(str(name), kinds.get(kind.kind, pa.string())) for name, kind in frame.dtypes.items()])
            writer = ParquetWriter(file, schema)
        writer.write_table(pa.Table.from_pandas(frame, schema=schema, preserve_index=False))
        count += len(frame)
    if writer is not None:
        writer.close()
    return count
