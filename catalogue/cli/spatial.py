"""``catalogue spatial``: mechanisms in space from a file of hard points."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InvalidRequest, quoted
from ..folders import folder
from ..progress import busy
from ..units import decimal
from .options import Argument, number, option, several, switch
from .tables import FORCE, OUTPUT, print_table

if TYPE_CHECKING:
    import pandas as pd

    from ..spatial.jointed.job import Job
    from ..spatial.jointed.motion import Motion

#: Folder of templates: files that lack only hard points.
TEMPLATES = folder("data") / "spatial" / "templates"
#: Value over the largest one of its column below which it is shown as 0.
ROUNDING = 1e-12
#: Largest number of values of a drive.
MOST_STEPS = 1_000_000

FILE = Argument(
    "file",
    "FILE",
    "The mechanism in TOML or JSON: hard points, joints, links, drives; a file of answers "
    "of the collection spatial-guidance (`find --save`); or a template: "
    f"{', '.join(sorted(file.stem for file in TEMPLATES.glob('*.toml')))}.",
)
POINTS = option(
    "--points",
    "FILE",
    "Hard points by name from CSV: a name and x, y, z in each row; rows such as axes,SAE and "
    "wheelbase,2700 say the axes, the side and the vehicle.",
)
ANSWER = option("--answer", "N", "Which of the guided bodies in a file of answers.", click.IntRange(1), default=1)
BOTH = switch("--both", "Mirror the wheel at the middle plane: both wheels of the axle.")
DRIVE = option("--drive", "NAME", "What drives, by its name in the file.", required=True)
DRIVES = several(
    "--drive",
    "NAME[=VALUES]",
    "What drives, by its name in the file; with values FROM:TO:STEPS or V,V,... "
    "[unit of the file, or degrees] it may be repeated: all combinations are printed.",
    required=True,
)
HOLD = several("--hold", "NAME", "What keeps its value, if there is more than one freedom; may be repeated.")
HELD = several(
    "--hold", "NAME[=VALUE]", "What keeps its value, that of the design pose or the one given; may be repeated."
)
FORMAT = option("--format", None, "How to print.", click.Choice(["table", "csv", "json"]), default="table")


class _WithColumns(click.Command):
    """A command with the columns of a wheel in its help."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002  # click's
        from ..spatial.jointed.columns import GROUPS, REMARK, heading

        for title, group in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(heading(k, "length", group), m) for k, (_, m) in group.items()])
        formatter.write_paragraph()
        formatter.write_text(REMARK)


@click.command(
    cls=_WithColumns,
    params=[
        FILE,
        POINTS,
        BOTH,
        ANSWER,
        DRIVES,
        number("--from", "VALUE", "Where the drive begins, from the design pose [unit of the file, or degrees]."),
        number("--to", "VALUE", "Where it ends; without both the whole circuit."),
        option("--steps", "N", "Positions.", click.IntRange(2), default=21),
        switch("--path", "Let all drives go along one path together, with as many values each."),
        HELD,
        option("--sensitivity", "COLUMN", "Print what a unit of each coordinate of each hard point does to a column."),
        option("--plot", "FILE", "Draw the mechanism with its paths: PNG, SVG or PDF.", OUTPUT),
        option("--plot-curves", "FILE", "Plot the columns over the drive.", OUTPUT),
        option("--report", "FILE", "Write a page with picture, curves and table: HTML.", OUTPUT),
        option(
            "--columns",
            "NAMES",
            "Print and plot only these columns, by their names or parts of their headings, with commas.",
        ),
        FORMAT,
        FORCE,
    ],
)
def sweep(
    drive: Sequence[str],
    steps: int,
    path: bool,
    hold: Sequence[str],
    format: str,
    to: float | None,
    columns: str | None,
    sensitivity: str | None,
    plot: Path | None,
    plot_curves: Path | None,
    report: Path | None,
    **more: Any,
) -> int:
    """Print points, joints, wheel angles or transmission of a driven mechanism in space.

    \b
    catalogue spatial sweep axle.toml --drive travel --from -80 --to 80
    catalogue spatial sweep axle.toml --drive travel=-80:80:33 --drive rack=-10:10:5
    """
    from ..spatial import load

    with busy("moving it"):
        job = load(more["file"], more["points"], more["both"], more["answer"])
        motion, told = _moved(job, [split_drive(one) for one in drive], hold, (more["from"], to, steps), path)
        whole = job.table(motion) if sensitivity is None else job.sensitivities(motion, sensitivity)
        unknown, keys = nan_columns(whole), len(motion.drives)
        whole = select_columns(
            whole.reset_index() if motion.others or sensitivity is not None else whole, columns, keys
        )
        table = whole[motion.success]
    if plot:
        job.plot(motion, plot)
    if plot_curves:
        motion.plot_curves(
            whole.drop(columns=[n for n in whole if str(n).startswith("screw axis") and not columns]), plot_curves
        )
    lines = [told, *job.remarks(), *(line for named, line in unknown if named & set(whole))]
    lines = [line for line in lines if line]
    if report:
        from ..spatial.jointed.report import report as write_report

        write_report(job, motion, whole, report, lines)
    _print(table, format, keys)
    for line in lines:
        print(f"catalogue: {line}", file=sys.stderr, flush=True)
    return 0 if len(table) else 1


def nan_columns(table: pd.DataFrame) -> list[tuple[set[str], str]]:
    """Return the columns that are NaN, grouped by the reason."""
    reasons: dict[str, list[str]] = {}
    for column, reason in table.attrs.get("reasons", {}).items():
        reasons.setdefault(reason, []).append(column)
    return [(set(columns), f"not known: {', '.join(columns)}: {reason}") for reason, columns in reasons.items()]


def split_drive(given: str) -> tuple[str, str]:
    """Split ``NAME=VALUES``; the values are empty without them."""
    name, _, values = given.partition("=")
    if given.endswith("="):
        raise InvalidRequest(f"{quoted(given)} says no values: write {name}=FROM:TO:STEPS, or {name}=V,V,...")
    return name, values


def parse_values(name: str, given: str) -> list[float]:
    """Read ``FROM:TO:STEPS`` or ``V,V,...``."""
    import numpy as np

    parts = given.split(":")
    numbers = [decimal(part) for part in (parts if len(parts) == 3 else given.split(","))]
    steps = numbers[-1] if len(parts) == 3 else 1.0
    if None in numbers or steps is None or not 1 <= steps <= MOST_STEPS or steps != int(steps):
        raise InvalidRequest(f"values of {name} must be FROM:TO:STEPS or V,V,..., not {quoted(given)}")
    if len(parts) == 3:
        return [float(v) for v in np.linspace(numbers[0] or 0.0, numbers[1] or 0.0, int(steps))]
    return [float(v or 0.0) for v in numbers]


def parse_held_value(name: str, given: str) -> float:
    """Read the value at which a scalar is held."""
    value = decimal(given)
    if value is None:
        raise InvalidRequest(f"{name} is held at one value, not at {quoted(given)}")
    return value


def _moved(
    job: Job,
    drives: Sequence[tuple[str, str]],
    hold: Sequence[str],
    way: tuple[float | None, float | None, int],
    path: bool,
) -> tuple[Motion, str]:
    """Sweep the drives, or follow the circuit of one; return the motion and a text on its ends."""
    import numpy as np

    held = {name: parse_held_value(name, value) if value else None for name, value in map(split_drive, hold)}
    begin, to, steps = way
    if (begin is None) != (to is None):
        raise InvalidRequest("give both --from and --to, or neither for the whole circuit")
    drive, said = drives[0]
    scalar, scalars = job.driven([name for name, _ in drives], list(held))
    if begin is None and not said and len(drives) == 1:
        if any(value is not None for value in held.values()):
            raise InvalidRequest(f"a circuit holds design values: say values of the drive, {drive}=FROM:TO:STEPS")
        return follow_circuit(job, drive, scalar, scalars, steps)
    if begin is not None and to is not None:
        if said or len(drives) > 1:
            raise InvalidRequest(f"--from and --to are those of one drive: say {drive}=FROM:TO:STEPS instead of them")
        values = {drive: np.linspace(begin, to, steps).tolist()}
    else:
        missing = next((name for name, value in drives if not value), None)
        if missing:
            raise InvalidRequest(f"say values of each drive: {missing}=FROM:TO:STEPS, or {missing}=V,V,...")
        values = {name: parse_values(name, value) for name, value in drives}
    if len(values) < len(drives):
        raise InvalidRequest("a drive is named twice: give all its values once")
    motion = job.sweep(values, held, grid=len(drives) > 1 and not path)
    ends = [end for end in motion.ends[0] if end]
    shown = np.degrees if motion.drive_unit == "deg" else float
    told = [f"{drive} ends at {float(shown(v)):.6g} {motion.drive_unit}: {reason}" for v, reason in ends]
    return motion, "; ".join([*told, *(line for stops in motion.stops for line in stops)])


def follow_circuit(job: Job, drive: str, scalar: Any, held: Sequence[Any], steps: int) -> tuple[Motion, str]:
    """Return the motion over the whole circuit of a drive, and its limits and dead points."""
    import numpy as np

    circuit = job.mechanism.circuit(scalar, held)
    motion = circuit.motion(steps)
    shown = np.degrees if motion.drive_unit == "deg" else float
    low, high = (float(shown(v)) for v in circuit.limits)
    what = "turns fully" if circuit.crank else f"runs from {low:.6g} to {high:.6g} {motion.drive_unit}"
    dead = ", ".join(f"{float(shown(v)):.6g}" for v in circuit.dead_points)
    told = f"{drive} {what}" + (f", dead points at {dead}" if dead else "")
    return motion, told + ("" if circuit.closed else f"; the circuit is open: {circuit.reason}")


@click.command(
    params=[
        FILE,
        POINTS,
        BOTH,
        DRIVE,
        number("--at", "VALUE", "Value of the drive [unit of the file, or degrees].", default=0.0),
        HOLD,
        option("--hits", "N", "Make random starts until each was found so often.", click.IntRange(1), default=5),
        option("--most", "N", "Random starts at most.", click.IntRange(1), default=4096),
        option("--seed", "N", "Of the starts.", click.IntRange(0), default=1),
        FORMAT,
    ]
)
def assemblies(
    file: str,
    points: str | None,
    both: bool,
    drive: str,
    at: float,
    hold: Sequence[str],
    hits: int,
    most: int,
    seed: int,
    format: str,
) -> int:
    """Print the assemblies of a mechanism at a value of its drive, by random starts.

    \b
    catalogue spatial assemblies axle.toml --drive travel
    """
    import numpy as np

    from ..spatial import load

    with busy("putting it together"):
        job = load(file, points, both)
        scalar, held = job.driven(drive, hold)
        angular = job.mechanism.system(*held, scalar).scalars[-1].angular
        value = float(np.radians(at)) if angular else at
        found = job.mechanism.assemblies(scalar, value, held, hits, most, seed)
        table = job.table(found.motion)
    table.insert(0, "hits", found.hits)
    _print(table, format)
    for line in [*found.remarks(), *job.remarks()]:
        print(f"catalogue: {line}", file=sys.stderr, flush=True)
    return 0 if len(table) else 1


@click.command(
    params=[
        FILE,
        POINTS,
        option("--out", "FILE", "Write the file with hard points moved, TOML or JSON, which `sweep` reads.", OUTPUT),
        option("--starts", "N", "Points in the boxes from which a search may begin.", click.IntRange(1), default=16),
        option("--steps", "N", "Trials in one search at most.", click.IntRange(1), default=50),
        option("--seed", "N", "Of the starts.", click.IntRange(0), default=1),
        option("--format", None, "How to print.", click.Choice(["table", "json"]), default="table"),
        FORCE,
    ]
)
def fit(file: str, points: str | None, out: Path | None, starts: int, steps: int, seed: int, format: str) -> int:
    """Fit hard points inside boxes to curves of a file; print before and after.

    \b
    catalogue spatial fit axle.toml --out fitted.toml
    """
    from ..spatial import load
    from ..spatial.fitting.files import fit_file, fitted_tables, write

    job = load(file, points)
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
    for line in [*found.remarks(), *job.remarks()]:
        print(f"catalogue: {line}", file=sys.stderr, flush=True)
    if out:
        write(fitted_tables(job, found), out)
    return 0 if found.success else 1


def select_columns(table: pd.DataFrame, columns: str | None, keys: int) -> pd.DataFrame:
    """Select the drives, and columns by names or parts of headings; by default all columns."""
    if columns is None:
        return table
    wanted: set[str] = set()
    headings = list(map(str, table.columns))
    for name in filter(None, map(str.strip, columns.split(","))):
        exact = [heading for heading in headings if heading.partition(" [")[0] == name]
        found = exact or [heading for heading in headings if name in heading]
        if not found:
            raise InvalidRequest(f"no column is headed {quoted(name)}: {', '.join(headings)}")
        wanted.update(found)
    return table[[c for k, c in enumerate(table.columns) if k < keys or str(c) in wanted]]


def _print(table: pd.DataFrame, format: str, keys: int = 1) -> None:
    if format == "csv":
        table.to_csv(sys.stdout, index=False)
    elif format == "json":
        print(json.dumps(json.loads(_records(table)), indent=1))
    else:
        _show(table.mask(table.abs() < ROUNDING * table.abs().max(), 0.0), keys=keys)


def _records(table: pd.DataFrame) -> str:
    return str(table.to_json(orient="records", double_precision=15))


def _show(table: pd.DataFrame, title: str = "", keys: int = 0) -> None:
    """Print a table to six digits, if too wide in bands, each with the first columns."""
    words = [name for name in table.columns if table[name].dtype in (object, str, bool)]
    rows = (
        [f"{v:.6g}" if isinstance(v, float) else {True: "yes", False: "no"}.get(v, v) for v in row]
        for row in table.itertuples(index=False)
    )
    print_table(title, [name if name in words else f">{name}" for name in table.columns], rows, keys=keys)
