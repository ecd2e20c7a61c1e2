"""``catalogue classify``: to which series given linkages belong."""

from __future__ import annotations

import csv
import io
import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import InvalidLinkage, InvalidRequest
from .options import Format, Output, Plugins


def classify(
    file: Annotated[str, typer.Argument(metavar="FILE|-", help="Pivots in JSON or CSV; - reads standard input.")],
    format: Output = Format.table,
    plugins: Plugins = None,
) -> None:
    """Classify linkages given by their pivots in one position.

    JSON: one linkage [[A1, A1*], [A2, A2*]], each pivot [x, y] or [x, y, w] with w = 0 at infinity; or a list of them;
    or objects with a key "pivots", such as `find` prints. CSV: 8 numbers a line (x, y of A1, A1*, A2, A2*) or 12 (x, y,
    w of each); a heading line is skipped.
    """
    from ..facade import classify as run

    text = sys.stdin.read() if file == "-" else _text(Path(file))
    found = run(_pivots(text, file), plugins=plugins or ())
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
    if format is Format.json:
        print(json.dumps(rows, indent=1, allow_nan=False))
    elif format is Format.csv:
        writer = csv.DictWriter(sys.stdout, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows({**row, "series": " ".join(one.series)} for row, one in zip(rows, found, strict=True))
    else:
        from .tables import print_table

        columns = [("", "right"), ("family", "left"), ("conf.", "left"), ("series", "left"), ("nearest", "left"),
                   ("residual", "right"), ("margin", "right"), ("remark", "left")]  # fmt: skip
        print_table("Classification", columns, [_row(i, row) for i, row in enumerate(rows)])


def _row(i: int, row: dict[str, Any]) -> list[str]:
    number = ["-" if row[k] is None else f"{row[k]:.3g}" for k in ("residual", "margin")]
    return [str(i), row["family"], row["configuration"], ", ".join(row["series"]) or "none", row["nearest"] or "-",
            *number, row["remark"]]  # fmt: skip


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidRequest(f"cannot read {path}: {error}") from None


def _pivots(text: str, name: str) -> list[Any]:
    """Return pivots (n, 2, 2, 3) as nested lists from JSON or CSV text."""
    if text.lstrip()[:1] in ("[", "{"):
        try:
            given = json.loads(text)
        except json.JSONDecodeError as error:
            raise InvalidRequest(f"{name} is no valid JSON: {error}") from None
        if isinstance(given, dict):
            given = [given]
        if given and isinstance(given[0], dict):
            missing = [i for i, one in enumerate(given) if not isinstance(one, dict) or "pivots" not in one]
            if missing:
                raise InvalidRequest(f"{name}: object {missing[0]} has no key `pivots`")
            given = [one["pivots"] for one in given]
        elif _depth(given) == 3:
            given = [given]
    else:
        given = [_line(row, name, i) for i, row in enumerate(csv.reader(io.StringIO(text))) if _numbers(row, i)]
    if not given:
        raise InvalidRequest(f"{name} holds no linkage")
    try:
        return [[[[*p, 1.0] if len(p) == 2 else list(p) for p in dyad] for dyad in one] for one in given]
    except TypeError:
        raise InvalidLinkage(f"{name}: a linkage is [[A1, A1*], [A2, A2*]], each pivot [x, y] or [x, y, w]") from None


def _depth(given: Any) -> int:
    return 1 + _depth(given[0]) if isinstance(given, list) and given else 0


def _numbers(row: list[str], line: int) -> bool:
    """Return whether a line holds a linkage; the first line may be a heading, and lines may be empty."""
    if not any(cell.strip() for cell in row):
        return False
    try:
        [float(cell) for cell in row]
    except ValueError:
        return line > 0
    return True


def _line(row: list[str], name: str, line: int) -> list[Any]:
    try:
        values = [float(cell) for cell in row]
    except ValueError:
        raise InvalidRequest(f"{name}, line {line + 1}: {','.join(row)!r} is not all numbers") from None
    if len(values) not in (8, 12):
        raise InvalidRequest(f"{name}, line {line + 1}: {len(values)} numbers; 8 (x, y) or 12 (x, y, w) are wanted")
    k = len(values) // 4
    p = [values[i * k : (i + 1) * k] for i in range(4)]
    return [[p[0], p[1]], [p[2], p[3]]]
