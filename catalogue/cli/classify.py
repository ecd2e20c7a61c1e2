"""``catalogue classify``: find the series of given linkages, and their guided points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from ..progress import busy
from .options import FORMAT, PLUGINS, Argument, number, switch
from .tables import contact, print_csv, print_json, print_table
from .units import UNIT, length, unit

if TYPE_CHECKING:
    from ..series.classification import Classification


@click.command(
    params=[
        Argument("file", "FILE|-", "Linkages in JSON or CSV; - reads standard input."),
        switch("--guided", "List the guided points and slots of each linkage, with their order of contact."),
        length("--radius", "R", "Also list points on circles of this radius (four common positions)."),
        length("--point", "X Y", "Report the singularity of this coupler point's path: cusps, inflections.", nargs=2),
        number(
            "--tolerance",
            "T",
            "Largest residual of a member of a series; increase it for rounded proportions.",
            show_default="1e-9",
        ),
        UNIT,
        FORMAT,
        PLUGINS,
    ]
)
def classify(
    file: str,
    guided: bool,
    radius: float | None,
    point: tuple[float, float] | None,
    tolerance: float | None,
    format: str,
    plugins: Sequence[str],
) -> None:
    """Find the series of linkages, each given in one position by pivots or by link lengths.

    JSON: a linkage [[A1, A1*], [A2, A2*]], each pivot [x, y] or [x, y, w] with w = 0 at infinity;
    or a list of linkages; or objects with a key "pivots", as `find` prints, or with link lengths:
    ground, crank, coupler, rocker; or crank, coupler, offset (slider-crank); or ground, crank,
    offset (inverted); each with angle (of the crank, in degrees) and optionally branch (1 or -1).

    CSV: 8 numbers per line (x, y of A1, A1*, A2, A2*) or 12 (x, y, w of each), with or without a
    heading; or columns under a heading of link lengths, or of pivots as JSON. The separator is a
    comma, semicolon, tab, bar or blank, one throughout the file; decimals have a point. Columns
    name, note, code, id hold notes, column unit the unit of the lengths; beside link lengths no
    other columns are permitted.
    """
    from ..api import classify as run
    from .reading import read_linkages

    linkages = read_linkages(file, unit())
    with busy("classifying"):
        found = run(linkages, tolerance=tolerance, plugins=plugins)
        rows = _rows(found)
        if point is not None:
            for row, p, q in zip(rows, *found.singularity(complex(*point)), strict=True):
                row["singularity"] = {"cusps": int(p), "inflections": int(q)} if p >= 0 else None
        if guided or radius is not None:
            for row, elements in zip(rows, _elements(found, radius), strict=True):
                row["guided"] = elements
    if format == "json":
        print_json(rows)
    elif format == "csv":
        print_csv(list(rows[0]), (map(_cell, row.values()) for row in rows))
    else:
        _print(rows)


def _rows(found: Classification) -> list[dict[str, Any]]:
    rows = []
    for one, family, configuration, reason in zip(found, found.family, found.configuration, found.reason, strict=True):
        near = one.nearest
        rows.append(
            {
                "family": str(family),
                "configuration": str(configuration),
                "series": one.series,
                "nearest": near.series if near else None,
                "residual": near.residual if near else None,
                "margin": near.margin if near and near.margin == near.margin else None,
                "remark": str(reason),
            }
        )
    return rows


def _elements(found: Classification, radius: float | None) -> list[list[dict[str, Any]]]:
    """List the guided points and slots of each linkage."""
    all_ = found.guided(radius)
    return [
        [
            {"label": label, "order": int(order), "fixed": pair[0].tolist(), "moving": pair[1].tolist()}
            for label, pair, order in zip(all_.labels, pairs, orders, strict=True)
            if order
        ]
        for pairs, orders in zip(all_.pairs, all_.order, strict=True)
    ]


def _cell(value: object) -> Any:
    """Format a value for CSV: codes of series separated by spaces."""
    return " ".join(value) if isinstance(value, list) and all(isinstance(v, str) for v in value) else value


def _print(rows: list[dict[str, Any]]) -> None:
    columns = [">", "family", "conf.", "series", "nearest", ">residual", ">margin", "~remark"]
    cells: list[list[Any]] = []
    for i, row in enumerate(rows):
        number = [None if row[k] is None else f"{row[k]:.3g}" for k in ("residual", "margin")]
        series = ", ".join(row["series"]) or "none"
        cells.append([i, row["family"], row["configuration"], series, row["nearest"], *number, row["remark"]])
    print_table("Classification", columns, cells)
    for i, row in enumerate(rows):
        if "singularity" in row:
            print(f"{i}: {_singularity(row['singularity'])}")
    if any("guided" in row for row in rows):
        columns = [">", "element", ">order", "fixed point", "moving point"]
        cells = [
            [i, g["label"], contact(g["order"]), _place(g["fixed"]), _place(g["moving"])]
            for i, row in enumerate(rows)
            for g in row["guided"]
        ]
        print_table("What they guide", columns, cells)


def _place(point: list[float]) -> str:
    x, y, w = point
    return f"({x:.6g}, {y:.6g})" if w else f"at infinity, direction ({x:.4g}, {y:.4g})"


def _singularity(at: dict[str, int] | None) -> str:
    """Name the singularity of a path from its numbers of coincident cusps and inflections."""
    from ..curvature_theory.leading_error import EXACT

    if at is None:
        return "the motion has no series here (change point)"
    p, q = at["cusps"], at["inflections"]
    if q == EXACT:
        return "the point runs along a straight line"
    names = {
        (0, 0): "an ordinary point",
        (0, 1): "an inflection",
        (0, 2): "an undulation",
        (0, 3): "a pseudo-undulation",
        (0, 4): "a double undulation",
        (1, 0): "a cusp",
        (1, 1): "a rhamphoid cusp",
        (1, 2): "a hypercusp",
    }
    return f"the path has {names.get((p, q), 'a singular point')} there (p = {p}, q = {q})"
