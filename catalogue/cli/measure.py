"""``catalogue measure``: find and measure the straightest stretches of linkages."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..guides.columns import CHAIN, STRETCH, Column
from ..guides.columns import TABLE as MADE
from ..progress import busy
from .completion import references
from .options import DB, FORMAT, PLUGINS, SHARE, Argument, option, switch
from .references import HELP, REFERENCE, resolve
from .tables import FORCE, OUTPUT, PICTURE, Tabled, codes, print_results, print_table, row, tell
from .units import UNIT, angle, in_output_unit, length, unit, with_unit

if TYPE_CHECKING:
    from ..guides.own_chain import OwnChain
    from ..guides.placed import PlacedGuide
    from ..guides.results import Measured


#: Columns of the table in order; some are shown only where they hold a value.
TABLE = (
    *("number", "code", "circuit", "crank", "stroke", "deviation", "radius", "allowance", "size", "links"),
    *("min_transmission", "nearest_series"),
)
#: Title, unit and meaning of each column.
COLUMNS = {**MADE, **STRETCH}
#: Column of the drive of a mechanism of many bars.
DRIVE = Column("drive", "", "drive at both ends of the path, from its given pose", right=False)
#: Note on circuits that cross at change points.
JOINED = "joined at the change points, where only a guard keeps the linkage from flipping from one into the other"
#: Note on a stretch on the other one of two circuits that cross.
JOINED_CIRCUIT = "another circuit, joined to that given at a change point: lead the linkage over there, with a guard"
#: Columns of the table of mechanisms of many bars.
CHAIN_TABLE = ("number", "code", "drive", "stroke", "deviation", "radius", "size", "min_transmission")
#: Columns to omit on a narrow terminal, the first one first.
SPARE = ("nearest_series", "links", "crank", "size")


@click.command(
    cls=Tabled,
    table=TABLE,
    columns=COLUMNS,
    params=[
        Argument("reference", REFERENCE, HELP, shell_complete=references),
        length("--stroke", "L", "Find the stretches of this length with the least deviation."),
        length(
            "--deviation",
            "D",
            "Find the longest stretches within this deviation; with --stroke: the tolerance for the allowance.",
        ),
        switch("--arc", "Fit an arc of any radius instead of a straight line."),
        length("--radius", "R", "Fit an arc of exactly this radius."),
        angle("--angle", "DEG", "Angle of the arc, up to 350, instead of --stroke."),
        length("--point", "X Y", "Guided point, in the position of the pivots.", nargs=2),
        option(
            "--limit", "N", "Maximum number of stretches per linkage.", int, show_default="4, of several linkages 1"
        ),
        option("--save", "FILE", "Save the stretches to a file for later commands.", OUTPUT),
        option("--plot", "FILE|DIR", "Draw the best stretch, or all into a folder, named by their codes.", PICTURE),
        FORCE,
        UNIT,
        FORMAT,
        DB,
        SHARE,
        PLUGINS,
    ],
)
def measure(
    reference: str,
    stroke: float | None,
    deviation: float | None,
    arc: bool,
    radius: float | None,
    angle: float | None,
    point: tuple[float, float] | None,
    limit: int | None,
    save: Path | None,
    plot: Path | None,
    format: str,
    db: Path | None,
    plugins: Sequence[str],
) -> None:
    """Measure your own linkages, or answers, on all their circuits.

    JSON and CSV are those of `classify`, with the guided point: `x` and `y` in the position of the
    pivots, or `along` and `across`, measured from crank 1's moving pivot along and across the
    coupler. Link lengths need no angle here. A CSV line without headings holds 8 or 12 numbers for
    the pivots and 2 for the point.

    A mechanism of many bars is JSON with `joints` (positions, or distances from joints before),
    `bars` (the joints on each, one the frame), `drive` and `point`; with `slides`, `gears` and
    `parallel` bars if it has any. It is measured on the circuit on which it is given.

    \b
    catalogue measure mine.json --stroke 120
    """
    from ..find.measure import measure as measured
    from ..guides.own_chain import OwnChain
    from ..plugin.registry import Registry

    every = in_output_unit(resolve(reference, point, db, plugins, chains=True))
    count = (4 if len(every) == 1 else 1) if limit is None else limit
    with busy("measuring"):
        found = measured(
            every,
            stroke=stroke,
            deviation=deviation,
            radius=radius,
            angle=angle,
            arc=arc,
            limit=count,
            series=cache(lambda: Registry(plugins).series),
        )
    one = every[0] if len(every) == 1 else None

    def table(found: Measured) -> None:
        if isinstance(one, OwnChain):
            describe_chain(one)
        elif one is not None:
            describe(one)
        _table(found, many=one is None)

    print_results(found, table, format, plot=plot, save=save)


def describe(guide: PlacedGuide) -> None:
    """Print the kind of a linkage, its link lengths and its circuits."""
    from ..guides.placed import IMMOBILE

    lengths = ", ".join(f"{name} {with_unit(f'{value:.6g}')}" for name, value in guide.lengths.items())
    tell(f"{guide.linkage.family[0]}: {lengths}")
    if guide.is_immobile:
        tell(IMMOBILE)
        return
    circuits = guide.circuits
    turning = [crank for crank, angles in guide.dead_points.items() if not angles]
    if not guide.dead_points and any(c.motion == "turns" for c in circuits):
        turning = ["the coupler"]
    moves = [f"{' and '.join(turning)} {'turns' if len(turning) == 1 else 'turn'} fully"] * bool(turning)
    moves += [f"{c.lead} swings from {c.low:.2f}\u00b0 to {c.high:.2f}\u00b0" for c in circuits if c.motion == "swings"]
    moves += ["the coupler runs from infinity to infinity"] * any(c.motion == "open" for c in circuits)
    moves += [JOINED] * any(c.joined for c in circuits)
    tell(f"{len(circuits)} circuit{'s' * (len(circuits) != 1)}: {'; '.join(moves)}")
    for what, stops in (("dead points", guide.dead_points), ("change points", guide.change_points)):
        places = [
            f"{crank} at {', '.join(f'{a:.2f}' for a in angles)}\u00b0" for crank, angles in stops.items() if angles
        ]
        tell(f"{what}: {'; '.join(places) or 'none'}")


def describe_chain(one: OwnChain) -> None:
    """Print bars, drive and range of a mechanism of many bars."""
    structure = one.chain.structure
    tell(f"{one.name or 'mechanism'}: {len(structure.bars)} bars, {one.drive} drives, {one.point} is guided")
    if one.drive_range is None:
        tell(f"{one.drive} turns fully")
        return
    low, high = one.drive_range
    if structure.is_pushed:
        tell(f"{one.drive} runs from {with_unit(f'{low:.6g}')} to {with_unit(f'{high:.6g}')}, from its given pose")
    else:
        tell(f"{one.drive} swings from {low:.2f}\u00b0 to {high:.2f}\u00b0, from its given pose")


def _table(found: Measured, *, many: bool) -> None:
    from ..guides.own_chain import OwnChain

    first = found[0]
    if isinstance(first, OwnChain):
        _chain_table(found, many=many)
        return
    asked = {"number": many, "radius": first.radius is not None, "allowance": first.allowance is not None}
    names = [name for name in TABLE if asked.get(name, True)]
    rows = [row(c, names, code=code) for code, c in zip(codes(found), found, strict=True)]
    what = "straight lines" if first.radius is None else "arcs"
    what += f" of {first.arc_angle:.4g}\u00b0" if first.is_wide else ""
    apart = "* another circuit than that given: take the linkage apart to reach it\n" * any(
        not c.given and not c.joined for c in found
    )
    apart += f"\u2020 {JOINED_CIRCUIT}\n" * any(not c.given and c.joined for c in found)
    caption = f"{apart}`catalogue show CODE` gives all numbers; --legend explains the columns"
    title = f"Stretches along {what}" + f", lengths in {unit()}" * bool(unit())
    print_table(title, names, rows, caption, meanings=COLUMNS, spare=SPARE)
    for number_, reason in (found.failed or {}).items():
        tell(f"{number_}: {reason}")


def _chain_table(found: Measured, *, many: bool) -> None:
    title = f"Stretches along {'straight lines' if found[0].radius is None else 'arcs'}"
    print_chains(found, title + f", lengths in {unit()}" * bool(unit()), many=many)
    for number_, reason in (found.failed or {}).items():
        tell(f"{number_}: {reason}")


def print_chains(found: Measured, title: str, *, many: bool = False, which: Sequence[str] = ()) -> None:
    """Print stretches of mechanisms of many bars; `which`: a role of each."""
    first = found[0]
    asked = {"number": many, "radius": first.radius is not None}
    names = ["which"] * bool(which) + [name for name in CHAIN_TABLE if asked.get(name, True)]
    mark = "" if first.chain.structure.is_pushed else "\u00b0"
    rows = [
        row(one, names, code=code, which=role, drive=f"{one.drive_from:.4g}{mark} \u2192 {one.drive_to:.4g}{mark}")
        for code, role, one in zip(codes(found), which or [""] * len(found), found, strict=True)
    ]
    meanings = {**CHAIN, "code": MADE["code"], "drive": DRIVE}
    print_table(title, names, rows, "`catalogue show CODE` gives all numbers", meanings=meanings, spare=("size",))
