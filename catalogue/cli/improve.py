"""``catalogue improve``: refine a given linkage, and compare it with the best of the catalogue."""

from __future__ import annotations

from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InvalidRequest
from ..progress import busy
from .completion import references
from .find import COLUMNS, request_from, to_keywords
from .find_options import ANGLE, IMPROVE, PLACE, RADIUS, STROKE
from .measure import print_chains
from .options import EFFORT, Argument, is_given, option, several, switch
from .references import HELP, REFERENCE, resolve
from .tables import FORCE, OUTPUT, Tabled, codes, print_results, print_table, row
from .units import in_output_unit, length, with_unit

if TYPE_CHECKING:
    from ..guides.results import ChainImprovement, Improvement


#: Columns of the table in order.
TABLE = (
    *("which", "code", "series", "family", "deviation", "expected", "allowance", "size", "links"),
    *("min_transmission", "score"),
)
#: Columns to omit on a narrow terminal, the first one first.
SPARE = ("family", "series", "links")


@click.command(
    cls=Tabled,
    table=TABLE,
    columns=COLUMNS,
    params=[
        Argument("reference", REFERENCE, HELP, shell_complete=references),
        STROKE,
        length(
            "--deviation",
            "D",
            "Tolerance: largest deviation.",
            show_default="minimise it, from a tenth of the stroke down",
        ),
        switch("--arc", "Fit an arc of any radius instead of a straight line."),
        RADIUS,
        ANGLE,
        *PLACE,
        length("--point", "X Y", "Guided point, in the position of the pivots.", nargs=2),
        several(
            "--hold",
            "WHAT",
            "Keep fixed-pivots, a length (crank1, frame, ...), or a joint of many bars; may be repeated.",
        ),
        switch("--in-place", "Keep the path where --from and --to put it."),
        length("--within", "L", "With --in-place: largest movement of held fixed pivots.", default=0.0),
        switch("--catalogue/--no-catalogue", "Also search the catalogue under the same constraints.", default=True),
        option("--save", "FILE", "Save the answers to a file for later commands.", OUTPUT),
        FORCE,
        *IMPROVE,
        EFFORT,
    ],
)
def improve(
    reference: str,
    arc: bool,
    point: tuple[float, float] | None,
    hold: tuple[str, ...],
    in_place: bool,
    within: float,
    catalogue: bool,
    save: Path | None,
    **options: Any,
) -> None:
    """Optimise a given linkage from where it is, under the constraints of `find`.

    --hold keeps what must stay. Of a mechanism of many bars the joints are moved: --hold names
    joints, --rank-by a measure such as size, and regions are in its own frame.

    \b
    catalogue improve mine.json --stroke 120 --deviation 0.2 --hold fixed-pivots
    catalogue improve leg.json --stroke 30 --hold fixed-pivots,B --max-size 120
    """
    from ..api import open
    from ..find.improve import improve as improved
    from ..guides.own_chain import OwnChain

    every = in_output_unit(resolve(reference, point, options["db"], options["plugins"], chains=True))
    tolerance = options["deviation"]
    if options["deviation"] is None:
        options["rank_by"] = options["rank_by"] or "deviation"
    request = request_from(
        options, curved=arc or options["radius"] is not None or options["angle"] is not None, share=0.1
    )
    to_keywords(options)
    output, plot, db, plugins = (options.pop(name) for name in ("format", "plot", "db", "plugins"))
    names = [part for text in hold for part in text.split(",")]
    if len(every) != 1:
        raise InvalidRequest(f"{reference} holds {len(every)} mechanisms: one can be improved at a time")
    if isinstance(every[0], OwnChain):
        _refuse({"--in-place": in_place, "--within": within, "--catalogue": catalogue and is_given("catalogue")})
        with busy("improving"):
            bars = every[0].improve(request, hold=names, **options)
        print_results(bars, partial(_chain_table, tolerance=tolerance), output, plot=plot, save=save)
        return
    with open(db, plugins=plugins) if catalogue else nullcontext() as opened, busy("improving"):
        found = improved(every[0], request, hold=names, in_place=in_place, within=within, catalogue=opened, **options)
    print_results(found, _table, output, plot=plot, save=save)


def _refuse(options: dict[str, Any]) -> None:
    """Refuse options of linkages of two dyads."""
    if wrong := [name for name, value in options.items() if value]:
        raise InvalidRequest(f"{wrong[0]} is for a linkage of two dyads, not for a mechanism of many bars")


def _chain_table(found: ChainImprovement, tolerance: float | None) -> None:
    print_chains(found, f"Over a stroke of {with_unit(f'{found[0].stroke:g}')}", which=found.which)
    if found.improved is None:
        print(found.explain())
    elif tolerance is not None and found.improved.deviation > tolerance:
        print(f"the deviation of {with_unit(f'{tolerance:g}')} is not reached: hold less, relax a bound, --effort")


def _table(found: Improvement) -> None:
    played = any(c.expected != c.deviation for c in found if c.expected is not None)
    names = [name for name in TABLE if played or name != "expected"]
    rows = [
        row(c, names, which=which, code=code) for which, code, c in zip(found.which, codes(found), found, strict=True)
    ]
    arc = "" if found[0].radius is None else f", radius {with_unit(f'{found[0].radius:.5g}')}"
    title = f"Over a stroke of {with_unit(f'{found[0].stroke:g}')}{arc}"
    print_table(title, names, rows, "`catalogue show CODE` gives all numbers", meanings=COLUMNS, spare=SPARE)
    if found.improved is None:
        print(found.explain())
