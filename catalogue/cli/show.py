"""``catalogue show``: one stored guide, in numbers and as a drawing."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from ..series import EXACT
from .options import Db, Format, Output, Plugins


def show(
    name: Annotated[str, typer.Argument(metavar="ID|NAME", help="Number of a guide, or name of a design.")],
    stroke: Annotated[float, typer.Option(help="Lay the guide along a path of this stroke.")] = 1.0,
    level: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Split it for a deviation of 10^N of the stroke.",
            show_default="the middle one of those it holds",
        ),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw it there: PNG, SVG or PDF by the suffix.")
    ] = None,
    format: Output = Format.table,
    db: Db = None,
    plugins: Plugins = None,
) -> None:
    """Show a stored guide: parameters, pivots, how far it holds which deviation; draw it with --plot."""
    from ..facade import open

    with open(db, plugins=plugins or ()) as catalogue:
        guide = catalogue.guide(name)
    laid = guide.at(stroke, level)
    if plot is not None:
        laid.plot(plot)
        print(f"drawn: {plot}", file=sys.stderr)
    if format is not Format.table:
        print(json.dumps(laid.to_dict(), indent=1, allow_nan=False))
        return
    from .tables import print_table

    order = "exact" if guide.order == EXACT else f"order {guide.order}"
    what = "straight line" if guide.kind == "line" else f"circle of radius {1 / abs(guide.curvature):.4g}"
    print(f"guide {guide.id}: {guide.series} {guide.family} {guide.configuration}, {guide.member}, point {guide.label}")
    print(f"{what}, {order}; parameters " + ", ".join(f"{k} = {v:.6g}" for k, v in guide.parameters.items()))
    if guide.kappa is not None:
        print(f"rho0 = {guide.rho0:.6g}, kappa = {guide.kappa:.6g}, kappa* = {guide.kappa_star:.6g}, s = {guide.s:.6g}")
    else:
        print("pole at infinity: parallel cranks")
    p = guide.provenance
    if p:
        print(f"plugin {p['plugin']} {p['plugin_version']}, plan {p['plan']}, seed {p['seed']}, block {p['number']}")
    r = guide.reaches
    columns = [("deviation/stroke", "right"), ("longest stroke", "right"), ("size/stroke", "right"),
               ("transmission", "right")]  # fmt: skip
    rows = [
        [f"1e{int(k)}", f"{a:.4g}", f"{b:.4g}", f"{c:.1f}\u00b0"]
        for k, a, b, c in zip(r["level"], r["stroke"], r["size"], r["min_transmission"], strict=True)
    ]
    print_table("Reach, in units of rho0 or of the height of crank 1", columns, rows[::-1])
    lines = [
        [f"{i + 1}", kind, *(f"{v:.6g}" for v in pivot[:2]), "at infinity" if pivot[2] == 0 else ""]
        for i, dyad in enumerate(laid.pivots)
        for kind, pivot in zip(("fixed", "moving"), dyad, strict=True)
    ]
    lines.append(["", "guided", *(f"{v:.6g}" for v in laid.guided), ""])
    columns = [("dyad", "right"), ("point", "left"), ("x", "right"), ("y", "right"), ("", "left")]
    print_table(f"Laid from (0, 0) to ({stroke:g}, 0), in mid-stroke; deviation {laid.deviation:.3g}", columns, lines)
