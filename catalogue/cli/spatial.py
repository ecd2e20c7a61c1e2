"""``catalogue spatial``: mechanisms in space from a file of hard points."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InvalidRequest, quoted
from ..progress import busy
from .options import Argument, number, option, several
from .tables import FORCE, OUTPUT, print_table

if TYPE_CHECKING:
    import pandas as pd

    from ..spatial.jointed.motion import Motion
    from ..spatial.jointed.reading import Job

#: Part of the largest number of a column below which one is shown as 0.
ROUNDING = 1e-12

FILE = Argument("file", "FILE", "The mechanism in TOML or JSON: hard points, joints, links, drives.")
DRIVE = option("--drive", "NAME", "What drives, by its name in the file.", required=True)
HOLD = several("--hold", "NAME", "What keeps its value, if there is more than one freedom; may be repeated.")
FORMAT = option("--format", None, "How to print.", click.Choice(["table", "csv", "json"]), default="table")


class _WithColumns(click.Command):
    """A command with the columns of a wheel in its help."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002  # click's
        from ..spatial.jointed.columns import WHEEL, heading

        with formatter.section("Columns of a wheel"):
            formatter.write_dl([(heading(name, "length"), meaning) for name, (_, meaning) in WHEEL.items()])


@click.command(
    cls=_WithColumns,
    params=[
        FILE,
        DRIVE,
        number("--from", "VALUE", "Where the drive begins, from the design pose [unit of the file, or degrees]."),
        number("--to", "VALUE", "Where it ends; without both the whole circuit."),
        option("--steps", "N", "Positions.", click.IntRange(2), default=21),
        HOLD,
        option("--plot", "FILE", "Draw the mechanism with its paths: PNG, SVG or PDF.", OUTPUT),
        option("--plot-curves", "FILE", "Plot the columns over the drive.", OUTPUT),
        option("--columns", "NAMES", "Print and plot only these columns, by parts of their headings, with commas."),
        FORMAT,
        FORCE,
    ],
)
def sweep(
    file: str,
    drive: str,
    steps: int,
    hold: Sequence[str],
    format: str,
    to: float | None,
    columns: str | None,
    plot: Path | None,
    plot_curves: Path | None,
    **more: Any,
) -> int:
    """Print points, joints, wheel angles or transmission of a mechanism in space while it is driven.

    \b
    catalogue spatial sweep axle.toml --drive travel --from -80 --to 80
    """
    from ..spatial import load

    with busy("moving it"):
        job = load(file)
        motion, told = _moved(job, drive, hold, more["from"], to, steps)
        whole = _chosen(job.table(motion), columns)
        table = whole[motion.success]
    if plot:
        job.plot(motion, plot)
    if plot_curves:
        motion.plot_curves(
            whole.drop(columns=[n for n in whole if str(n).startswith("screw axis") and not columns]), plot_curves
        )
    _print(table, format)
    for line in [told, *_unknown(whole)]:
        if line:
            print(f"catalogue: {line}", file=sys.stderr, flush=True)
    return 0 if len(table) else 1


def _unknown(table: pd.DataFrame) -> list[str]:
    """Return why columns of a table are NaN, one line for each reason."""
    reasons: dict[str, list[str]] = {}
    for column, reason in table.attrs.get("reasons", {}).items():
        if column in table:
            reasons.setdefault(reason, []).append(column)
    return [f"not known: {', '.join(columns)}: {reason}" for reason, columns in reasons.items()]


def _moved(
    job: Job, drive: str, hold: Sequence[str], begin: float | None, to: float | None, steps: int
) -> tuple[Motion, str]:
    """Return the motion over a way of the drive, or over its whole circuit, and what is to be told of its ends."""
    import numpy as np

    scalar, held = job.driven(drive, hold)
    if (begin is None) != (to is None):
        raise InvalidRequest("give both --from and --to, or neither for the whole circuit")
    if begin is None or to is None:
        circuit = job.mechanism.circuit(scalar, held)
        motion = circuit.motion(steps)
        shown = np.degrees if motion.drive_unit == "deg" else float
        low, high = (float(shown(v)) for v in circuit.limits)
        what = "turns fully" if circuit.crank else f"runs from {low:.6g} to {high:.6g} {motion.drive_unit}"
        dead = ", ".join(f"{float(shown(v)):.6g}" for v in circuit.dead_points)
        told = f"{drive} {what}" + (f", dead points at {dead}" if dead else "")
        return motion, told + ("" if circuit.closed else f"; the circuit is open: {circuit.reason}")
    angular = job.mechanism.system(*held, scalar).scalars[-1].angular
    values = np.linspace(begin, to, steps)
    motion = job.mechanism.sweep(scalar, np.radians(values) if angular else values, held)
    ends = [end for end in motion.ends[0] if end]
    return motion, "; ".join(
        f"{drive} ends at {np.degrees(v) if angular else v:.6g} {motion.drive_unit}: {reason}" for v, reason in ends
    )


@click.command(
    params=[
        FILE,
        DRIVE,
        number("--at", "VALUE", "Value of the drive [unit of the file, or degrees].", default=0.0),
        HOLD,
        FORMAT,
    ]
)
def assemblies(file: str, drive: str, at: float, hold: Sequence[str], format: str) -> int:
    """Print the ways to put a mechanism together at a value of its drive, as far as random starts find them.

    \b
    catalogue spatial assemblies axle.toml --drive travel
    """
    import numpy as np

    from ..spatial import load

    with busy("putting it together"):
        job = load(file)
        scalar, held = job.driven(drive, hold)
        angular = job.mechanism.system(*held, scalar).scalars[-1].angular
        found = job.mechanism.assemblies(scalar, float(np.radians(at)) if angular else at, held)
        table = job.table(found.motion)
    table.insert(0, "hits", found.hits)
    _print(table, format)
    return 0 if len(table) else 1


@click.command(
    params=[
        FILE,
        option("--out", "FILE", "Write the file with hard points moved, TOML or JSON, which `sweep` reads.", OUTPUT),
        option("--starts", "N", "Points in the boxes from which a search may begin.", click.IntRange(1), default=16),
        option("--steps", "N", "Trials in one search at most.", click.IntRange(1), default=50),
        option("--seed", "N", "Of the starts.", click.IntRange(0), default=1),
        option("--format", None, "How to print.", click.Choice(["table", "json"]), default="table"),
        FORCE,
    ]
)
def fit(file: str, out: Path | None, starts: int, steps: int, seed: int, format: str) -> int:
    """Move hard points inside boxes so that the curves that a file asks for are met best, and print before and after.

    \b
    catalogue spatial fit axle.toml --out fitted.toml
    """
    from ..spatial import load
    from ..spatial.fitting.files import fit_file, rewritten, write

    job = load(file)
    found = fit_file(job, starts, steps, seed)
    tables = {"targets": found.targets, "bounds": found.bounds, "points": found.points, "held back": found.held_back}
    if format == "json":
        told = {name.replace(" ", "_"): json.loads(_records(table)) for name, table in tables.items()}
        more = {"success": found.success, "missed": found.missed, "undetermined": found.undetermined}
        print(json.dumps({**told, **more, "refused": found.refused, "trials": found.trials}, indent=1))
    else:
        for name, table in tables.items():
            if len(table):
                _show(table, name)
    for line in found.remarks():
        print(f"catalogue: {line}", file=sys.stderr, flush=True)
    if out:
        write(rewritten(job, found), out)
    return 0 if found.success else 1


def _chosen(table: pd.DataFrame, columns: str | None) -> pd.DataFrame:
    """Return the drive and the columns in whose headings any of the names is, all if none are named."""
    if columns is None:
        return table
    names = [name.strip() for name in columns.split(",") if name.strip()]
    for name in names:
        if not any(name in str(heading) for heading in table.columns):
            raise InvalidRequest(f"no column is headed {quoted(name)}: {', '.join(map(str, table.columns))}")
    return table[[c for k, c in enumerate(table.columns) if k == 0 or any(name in str(c) for name in names)]]


def _print(table: pd.DataFrame, format: str) -> None:
    if format == "csv":
        table.to_csv(sys.stdout, index=False)
    elif format == "json":
        print(json.dumps(json.loads(_records(table)), indent=1))
    else:
        _show(table.mask(table.abs() < ROUNDING * table.abs().max(), 0.0), keys=1)


def _records(table: pd.DataFrame) -> str:
    return str(table.to_json(orient="records", double_precision=15))


def _show(table: pd.DataFrame, title: str = "", keys: int = 0) -> None:
    """Print a table; numbers to the right, to six digits; if too wide in bands, each with the first columns."""
    words = [name for name in table.columns if table[name].dtype in (object, str, bool)]
    rows = (
        [f"{v:.6g}" if isinstance(v, float) else {True: "yes", False: "no"}.get(v, v) for v in row]
        for row in table.itertuples(index=False)
    )
    print_table(title, [name if name in words else f">{name}" for name in table.columns], rows, keys=keys)
