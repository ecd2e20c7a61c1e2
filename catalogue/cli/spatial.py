"""``catalogue spatial``: mechanisms in space from a file of hard points."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from .options import Argument, number, option, several
from .tables import print_table

if TYPE_CHECKING:
    import pandas as pd

#: Part of the largest number of a column below which one is shown as 0.
ROUNDING = 1e-12

FILE = Argument("file", "FILE", "The mechanism in TOML or JSON: hard points, joints, links, drives.")
DRIVE = option("--drive", "NAME", "What drives, by its name in the file.", required=True)
HOLD = several("--hold", "NAME", "What keeps its value, if there is more than one freedom; may be repeated.")
FORMAT = option("--format", None, "How to print.", click.Choice(["table", "csv", "json"]), default="table")


@click.command(
    params=[
        FILE,
        DRIVE,
        number("--from", "VALUE", "Where the drive begins, from the design pose [unit of the file, or degrees]."),
        number("--to", "VALUE", "Where it ends; without both the whole circuit."),
        option("--steps", "N", "Positions.", click.IntRange(2), default=21),
        HOLD,
        FORMAT,
    ]
)
def sweep(
    file: str, drive: str, steps: int, hold: Sequence[str], format: str, to: float | None, **more: Any
) -> int:  # fmt: skip
    """Print points, joints, wheel angles or transmission of a mechanism in space while it is driven.

    \b
    catalogue spatial sweep axle.toml --drive travel --from -80 --to 80
    """
    import numpy as np

    from ..errors import InvalidRequest
    from ..spatial import load

    job, begin = load(file), more["from"]
    held = [job.drive(name) for name in hold]
    scalar = job.drive(drive)
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
        told += "" if circuit.closed else f"; the circuit is open: {circuit.reason}"
    else:
        system = job.mechanism.system(*held, scalar)
        angular = system.scalars[-1].angular
        values = np.linspace(begin, to, steps)
        motion = job.mechanism.sweep(scalar, np.radians(values) if angular else values, held)
        ends = [end for end in motion.ends[0] if end]
        told = "; ".join(
            f"{drive} ends at {np.degrees(v) if angular else v:.6g} {motion.drive_unit}: {reason}" for v, reason in ends
        )
    table = job.table(motion)[motion.success]
    _print(table, format)
    if told:
        print(f"catalogue: {told}", file=sys.stderr)
    return 0 if len(table) else 1


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

    job = load(file)
    held, scalar = [job.drive(name) for name in hold], job.drive(drive)
    angular = job.mechanism.system(*held, scalar).scalars[-1].angular
    found = job.mechanism.assemblies(scalar, float(np.radians(at)) if angular else at, held)
    table = job.table(found.motion)
    table.insert(0, "hits", found.hits)
    _print(table, format)
    return 0 if len(table) else 1


def _print(table: pd.DataFrame, format: str) -> None:
    if format == "csv":
        table.to_csv(sys.stdout, index=False)
    elif format == "json":
        print(json.dumps(json.loads(table.to_json(orient="records", double_precision=15)), indent=1))
    else:
        shown = table.mask(table.abs() < ROUNDING * table.abs().max(), 0.0)
        rows = ([f"{v:.6g}" for v in row] for row in shown.itertuples(index=False))
        print_table("", [f">{name}" for name in table.columns], rows)
