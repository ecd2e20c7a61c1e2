"""How exact every kernel is on linkages that are stiff or extreme, against 50 digits, and how long it takes.

    python tests/attacks/stability.py [--count 4] [--only pose] [--write]

Each row is a kernel under one stress.  `--write`: the table goes to ``data/reports/stability.md``.  It ends with an
error if any answer is worse than its bound.  Kernels are in `stability_planar.py`, `stability_instant.py`,
`stability_paths.py` and `stability_space.py`, stresses in `stability_linkages.py`, references in
`stability_reference.py`.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"
ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402  # after the number of threads

from tests.attacks import stability_paths, stability_planar, stability_space  # noqa: E402  # where the path is set
from tests.attacks.stability_reference import Outcome, Row, tried  # noqa: E402
from tests.benchmarks.measuring import arguments, table, title  # noqa: E402

EXPLAINED = """\
Reference: chains closed by circles and lines in 50 digits (function generators by an equation in cosine and sine, axles
and guided bodies by quaternions and Newton's method), derivatives as differences over 1e-24, strips from hulls: no
formula of the catalogue; minimum zones of waves whose width is known.  Errors are relative to the largest component of
the result, those of deviations to the stroke, of c2 and c3 to the larger of them and 1/size or 1/size^2, of principal
pairs on a sphere of the linkage's size, of function generators to 1 rad.

Inherent: what other roundings of the numbers that are given, by a unit in the last place, do to the exact result, the
largest.  Over: error / (inherent + 2.2e-16), after what the method leaves by its own documents (1e-4 of a deviation) is
taken off; of poses over the conditioning of the chart too, which `motion` reports, of principal pairs over size /
shortest link, through which they come.  Bound: how large that may be.  Cases whose inherent error is above 1e-3 are not
compared: any answer is as good as another.  Not known: NaN or a documented error though the numbers determine the
result / because they do not.  Time: per case in batches of 256; of one search, sweep or solve where marked by *.
"""


def every(count: int) -> Iterator[Row]:
    """Yield all rows."""
    yield from stability_planar.rows(count)
    yield from stability_paths.rows(count)
    yield from stability_space.rows(min(count, 2))


def cells(found: Outcome) -> list[str]:
    """Return what stands in the table of an outcome."""
    row, there = found.row, np.isfinite(found.error) & np.isfinite(found.factor)

    def worst(values: np.ndarray) -> str:
        return f"{values[there].max():.0e}" if there.any() else "–"

    unknown = f"{found.refused} / {found.unknown}" if found.refused or found.unknown else ""
    middle = f"{np.median(found.error[there]):.0e}" if there.any() else "–"
    over = np.nanmax(found.factor, initial=0.0)
    took = f"{found.time:.3g}{'' if row.timed else ' *'}" if found.time > 1 else "–"
    return [row.kernel, row.stress, str(len(row.inputs)), worst(found.inherent), middle, worst(found.error),
            f"{over:.2g}", f"{row.bound:g}", unknown, took]  # fmt: skip


def main() -> None:
    parser = arguments()
    parser.add_argument("--count", type=int, default=4)
    parser.add_argument("--only", default="")
    parser.add_argument("--write", action="store_true")
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    rows, fallen = [], []
    for row in every(asked.count):
        if asked.only not in row.kernel:
            continue
        found = tried(row, timed=True)
        rows.append(cells(found))
        print(*rows[-1], "" if found.good else "WORSE THAN ITS BOUND", sep=" | ", file=sys.stderr, flush=True)
        fallen += [] if found.good else [f"{row.kernel}, {row.stress}"]
    told = report(rows, fallen)
    print(told)
    if asked.write:
        (ROOT / "data" / "reports" / "stability.md").write_text(told, "utf-8")
    sys.exit(bool(fallen))


def report(rows: list[list[str]], fallen: list[str]) -> str:
    """Return the table of all rows, with what is worse than its bound."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        title("Stability")
        print(EXPLAINED)
        print(f"Worse than its bound: {'; '.join(fallen) or 'nothing'}.\n")
        head = ["kernel", "stress", "cases", "inherent", "median", "worst", "over", "bound", "not known", "µs"]
        table(head, sorted(rows, key=lambda row: row[0]))
        print("Digits near each degeneration: [degenerations.md](degenerations.md), of spatially guided bodies\n"
              "[spatial_stability.md](spatial_stability.md); work and precision: [deviation_accuracy.md]"
              "(deviation_accuracy.md), [spatial_work_precision.md](spatial_work_precision.md).")  # fmt: skip
    return out.getvalue()


if __name__ == "__main__":
    main()
