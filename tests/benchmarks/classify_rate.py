"""Rate of classification: 1e5 linkages of all series at once, against the same one by one.

``python tests/benchmarks/classify_rate.py``
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as the command does

import numpy as np
from measuring import arguments, seconds, table, title

from catalogue.curvature_theory.instant import Instant
from catalogue.kinematics.linkage import Linkage
from catalogue.plugin.registry import Registry
from catalogue.series.classification import classify
from catalogue.testing.sample import even

COUNT, ONE_BY_ONE = 100_000, 200


def main() -> None:
    """Print the report."""
    arguments().parse_args()
    title("Rate of classification")
    registry = Registry()
    members = [(series, member) for series in registry.series.values() for member in series.members]
    size = -(-COUNT // len(members)) + 50
    pivots = np.concatenate([even(series, member, size).valid.linkage.pivots for series, member in members])
    pivots = pivots[np.random.default_rng(0).permutation(len(pivots))[:COUNT]]
    few = [Linkage(one) for one in pivots[:ONE_BY_ONE]]
    table(
        ["what", "linkages", "s", "us per linkage"],
        [
            (name, count, f"{taken:.3f}", f"{1e6 * taken / count:.1f}")
            for name, count, taken in (
                ("all residuals and margins", COUNT,
                 seconds(lambda: classify(Linkage(pivots), registry.series), 3)),
                ("the same with configurations, as a table with the nearest series", COUNT,
                 seconds(lambda: classify(Linkage(pivots), registry.series).to_pandas(), 3)),
                ("what they guide, with its order", COUNT,
                 seconds(lambda: classify(Linkage(pivots), {}).guided(), 3)),
                ("pole, cubics and principal pairs alone", COUNT,
                 seconds(lambda: Instant(Linkage(pivots)).curvature, 3)),
                ("residuals and margins, one linkage after the other", ONE_BY_ONE,
                 seconds(lambda: [classify(one, registry.series) for one in few], 1)),
            )
        ],
    )  # fmt: skip
    print(f"{len(registry.series)} series; linkages drawn evenly from their {len(members)} members.")


if __name__ == "__main__":
    main()
