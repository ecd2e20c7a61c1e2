"""Print answers as tables, CSV and JSON with explained columns; check output files."""

from __future__ import annotations

import csv
import json
import os
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.exceptions import Exit

from ..errors import InvalidRequest, printable
from ..folders import answers_file, default_database, is_folder, make_folder
from ..quantities import LINKS, QUANTITIES

if TYPE_CHECKING:
    from ..guides.columns import Column
    from ..guides.results import Results

T = TypeVar("T", bound="Results[Any]")
#: Characters of a spreadsheet formula: a cell that begins with a sign and has none of them is a
#: plain number.
FORMULA = frozenset("(|!=\"'")


class _Output(click.Path):
    """A file to write: an existing one only with --force.

    Never a link, a database in use or another output.
    """

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        file = Path(os.fsdecode(super().convert(value, param, ctx)))
        flag = param.opts[0] if param else "the option"
        db = ctx.params.get("db") if ctx else None
        for used in (db if isinstance(db, Path) else default_database(), answers_file()):
            if file.exists() and used.exists() and file.samefile(used):
                raise InvalidRequest(f"{file} is a database in use: name another file with {flag}")
        refuse_existing(file, flag, force=ctx is not None and ctx.meta.get(FORCE_KEY, False))
        if ctx and (other := ctx.meta.setdefault(WRITTEN_KEY, {}).setdefault(_normalised_name(file), flag)) != flag:
            raise InvalidRequest(f"{other} and {flag} name the same file, {file}")
        return file


def _normalised_name(file: Path) -> str:
    """Normalise a file name, so that equal files have equal names."""
    return os.path.normcase(os.path.abspath(file))  # noqa: PTH100  # resolves `..` but follows no link


def refuse_existing(file: Path, flag: str, *, force: bool) -> None:
    """Refuse an existing file before work is done for it; a folder is permitted."""
    if file.is_symlink():
        raise InvalidRequest(f"{file} is a link, and what it leads to is left alone: name a file with {flag}")
    if not force and file.exists() and not file.is_dir():
        raise InvalidRequest(f"{file} is there already: name another with {flag}, or overwrite it with --force")


class _Picture(_Output):
    """A file or folder to draw to; an undrawable format is refused before the search."""

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        from ..draw.picture import check

        file: Path = super().convert(value, param, ctx)
        if file.suffix and not is_folder(file):
            check(file)
        return file


# Keys in the context of click: whether to overwrite files, and the files written so far.
FORCE_KEY = "catalogue.force"
WRITTEN_KEY = "catalogue.written"
OUTPUT: Any = _Output(path_type=Path)
PICTURE: Any = _Picture(path_type=Path)
FORCE = click.Option(
    ["--force"],
    is_flag=True,
    is_eager=True,
    expose_value=False,
    help="Overwrite an existing file.",
    callback=lambda ctx, _, given: ctx.meta.update({FORCE_KEY: given}),
)


def print_table(
    title: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[Any]],
    caption: str = "",
    *,
    meanings: Mapping[str, Column] | None = None,
    spare: Sequence[str] = (),
    keys: int = 0,
) -> None:
    """Print a table fitted to the width of the terminal; see `layout`.

    Parameters
    ----------
    title : str
    columns : sequence of str
        Names of `meanings`, or headings: ``>`` aligns to the right, ``~`` permits wrapping.
    rows : iterable of sequence
        Cells; None is a dash.
    caption : str
    meanings : mapping of str to Column, optional
    spare : sequence of str
        Columns that may be omitted, the first one first.
    keys : int
        Number of first columns repeated in every band of a wide table.
    """
    from .layout import Heading, cell, console, write, write_table

    known = meanings or {}
    headings = [Heading(known[c].title, known[c].right) if c in known else Heading.of(c) for c in columns]
    names = [c.lstrip(">~") for c in columns]
    on = console()
    if title:
        write(on, title, "bold")
        print()
    may_go = [names.index(name) for name in spare if name in names]
    left_out = write_table(on, headings, [[cell(v) for v in row] for row in rows], spare=may_go, keys=keys)
    if left_out:
        caption += f"\nleft out for want of room: {', '.join(headings[k].plain for k in left_out)}"
    if caption.strip():
        write(on, caption.strip())
        print()


def tell(text: str) -> None:
    """Print text wrapped between words."""
    from .layout import console, write

    write(console(), text)


def print_json(given: object) -> None:
    """Print JSON, with null for NaN."""
    print(json.dumps(given, indent=1, allow_nan=False))


def print_csv(columns: Sequence[str], rows: Iterable[Iterable[Any]]) -> None:
    """Print CSV; lists and mappings are JSON within a cell."""
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow([heading.lstrip(">~") for heading in columns])
    writer.writerows(
        [
            json.dumps(v, allow_nan=False) if isinstance(v, list | dict) else _cell(v) if isinstance(v, str) else v
            for v in row
        ]
        for row in rows
    )


def _cell(text: str) -> str:
    """Escape a text that a spreadsheet would evaluate as a formula."""
    formula = text[:1] in "=@\t\r" or (text[:1] in "+-" and not FORMULA.isdisjoint(text))
    return "'" * (formula and text != "") + printable(text)


def print_records(
    output: str, records: Any, title: str, columns: Sequence[str], rows: Sequence[Sequence[Any]], **more: Any
) -> None:
    """Print records as JSON, CSV or a table; further arguments are those of `print_table`."""
    meanings: Mapping[str, Column] = more.get("meanings") or {}
    if output == "json":
        print_json(records)
    elif output == "csv":
        print_csv([meanings[c].plain if c in meanings else c for c in columns], rows)
    else:
        print_table(title, columns, rows, **more)


def print_results(
    found: T,
    table: Callable[[T], None],
    output: str,
    *,
    explain: bool = False,
    plot: Path | None = None,
    save: Path | None = None,
) -> None:
    """Print answers with their codes, draw and save them.

    Explain an empty result and exit with code 1.
    """
    if explain or not found:
        told = found.explain()
        advice = re.search(r"^no \w+ found.*", told, re.MULTILINE)
        print(told if explain or advice is None else f"catalogue: {advice[0]}", file=sys.stderr)
    if output == "json":
        print_json([{"code": code, **c.to_dict()} for code, c in zip(codes(found), found, strict=True)])
    elif output == "csv":
        rows = ([code, *c.to_dict().values()] for code, c in zip(codes(found), found, strict=True))
        print_csv(["code", *found.columns], rows)
    elif found:
        table(found)
    if not found:
        raise Exit(1)
    if save is not None:
        found.save(save)
        print(f"saved: {save}, {len(found)} answers", file=sys.stderr)
    if plot is None:
        return
    if is_folder(plot) or not plot.suffix:
        make_folder(plot)
        for code, one in zip(codes(found), found, strict=True):
            one.plot(plot / f"{code}.svg")
        print(f"drawn: {len(found)} files in {plot}", file=sys.stderr)
    else:
        found[0].plot(plot)
        print(f"drawn: {plot}", file=sys.stderr)


def codes(found: Sequence[Any]) -> list[str]:
    """Store answers and return their codes.

    Dashes and a warning if the answers file is not writable.
    """
    from ..guides.codes import remember

    try:
        return remember(found)
    except InvalidRequest as error:
        print(f"catalogue: answers have no codes: {error}", file=sys.stderr)
        return ["-"] * len(found)


#: Formats of numbers by column.
_NUMBERS: Mapping[str, str] = {
    **{row.name: row.format for row in QUANTITIES if row.format},
    "deviation": "{:.3g}",
    "expected": "{:.3g}",
    "radius": "{:.5g}",
    "stroke": "{:.6g}",
    "score": "{:.0f}",
    "angle": "{:.1f}\u00b0",
    "residual": "{:.3g}\u00b0",
    "swing": "{:.1f}\u00b0",
}


def row(one: Any, names: Sequence[str], **given: object) -> list[Any]:
    """Format the cells of an answer; `given` cells replace its own."""
    made = {
        name: given[name] if name in given else _MADE[name](one) if name in _MADE else _plain(one, name)
        for name in names
    }
    return list(made.values())


def _plain(one: Any, name: str) -> Any:
    value = getattr(one, name)
    return value if value is None or name not in _NUMBERS else _NUMBERS[name].format(value)


def links(one: Any) -> str | None:
    """Format the shortest and the longest link of a candidate."""
    ends = [getattr(one, name) for name in LINKS]
    return None if None in ends else "\u2013".join(f"{length:.3g}" for length in ends)


def contact(order: int) -> str:
    """Format an order of contact."""
    from ..curvature_theory.leading_error import EXACT

    return "exact" if order == EXACT else str(order)


def _transmission(one: Any) -> str:
    """Format the transmission angle over the stroke, with that over the turn in brackets."""
    turn = getattr(one, "min_transmission_turn", None)
    return str(_plain(one, "min_transmission")) + ("" if turn is None else f" ({turn:.0f}\u00b0)")


def _crank(one: Any) -> str | None:
    if one.drive_from is None:
        return None
    return f"{one.driver}: {one.drive_from:.1f}\u00b0 \u2192 {one.drive_to:.1f}\u00b0"


def _nearest_series(one: Any) -> str | None:
    return None if one.nearest_series is None else f"{one.nearest_series} ({one.residual:.1g})"


_MADE = {
    "links": links,
    "order": lambda one: contact(one.order),
    "transmission": _transmission,
    "rotates": lambda one: " ".join(f"crank {k}" for k in one.rotates) or None,
    "circuit": lambda one: f"{one.circuit}{'' if one.given else chr(0x2020) if one.joined else '*'}",
    "crank": _crank,
    "nearest_series": _nearest_series,
}


class Tabled(click.Command):
    """A command with a table: `table` lists its columns, `columns` explains them."""

    def __init__(self, *args: Any, table: Sequence[str], columns: Mapping[str, Column], **more: Any) -> None:
        super().__init__(*args, **more)
        self.table, self.columns = table, columns
        self.params.append(_legend())

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the meanings of the columns."""
        with formatter.section("Columns of the table"):
            formatter.write_dl([(one.plain, one.told) for one in map(self.columns.__getitem__, self.table)])
        super().format_epilog(ctx, formatter)


def print_legend(table: Sequence[str], columns: Mapping[str, Column]) -> None:
    """Print the meaning of each column, those of the table first."""
    from ..guides.columns import TABLE

    names = [*table, *(name for name in columns if name not in {*table, *TABLE})]
    rows = [
        [
            columns[name].plain if name in table else "",
            "" if name in TABLE and name != "code" else name,
            columns[name].unit,
            columns[name].meaning,
        ]
        for name in names
    ]
    print_table("Columns", ["column", "in CSV and JSON", "unit", "~meaning"], rows, "length: in the unit of the output")


def _legend() -> click.Option:
    def told(ctx: click.Context, param: click.Parameter, given: bool) -> None:  # noqa: ARG001  # click gives it
        if given and not ctx.resilient_parsing and isinstance(ctx.command, Tabled):
            print_legend(ctx.command.table, ctx.command.columns)
            ctx.exit()

    return click.Option(
        ["--legend"],
        is_flag=True,
        is_eager=True,
        expose_value=False,
        callback=told,
        help="Explain the columns and exit.",
    )
