"""Digits near the degenerations, on a small sample of what `tests/benchmarks/degenerations.py` tabulates."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue.curvature_theory.analysis import PARALLEL, curvature
from tests.precision import EXTENDED

BENCHMARK = runpy.run_path(str(Path(__file__).parents[1] / "benchmarks" / "degenerations.py"))
KINDS = list(BENCHMARK["KINDS"])
POLE_FAR = "angle of the cranks (pole far)"
#: Digits: how much worse than another rounding of the pivots.
ALLOWED = 1.0 if EXTENDED else 1.5  # principal pairs are polished in extended precision where there is any


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("near", [1e-2, 1e-7, 1e-12, 1e-14])
def test_no_more_digits_are_lost_than_the_pivots_lack(kind: str, near: float) -> None:
    measured: dict[str, Any] = BENCHMARK["measure"](kind, near, 8)
    summaries = {q: BENCHMARK["summary"](two) for q, two in measured.items()}
    assert summaries["residuals"] is not None
    assert {q: s for q, s in summaries.items() if BENCHMARK["excess"](s) > ALLOWED} == {}


@pytest.mark.slow
@pytest.mark.parametrize("near", [1e-3, 1e-6, 1e-9, 1e-12])
def test_principal_pairs_of_a_far_pole_keep_all_digits(near: float) -> None:
    ours = BENCHMARK["measure"](POLE_FAR, near, 10, seed=5)["principal pairs"]["ours"]
    assert np.isfinite(ours).sum() >= 8
    assert np.nanmax(ours) < (1.5 if EXTENDED else 2.5)  # polished in extended precision where there is any


def test_nearly_parallel_rays_are_taken_for_parallel_up_to_their_angle() -> None:
    linkage = BENCHMARK["linkages"](POLE_FAR, 1e-10, 10, 3)
    at = curvature(linkage)
    assert (at.state == PARALLEL).all()
    for i in range(10):
        exact = BENCHMARK["Exact"](linkage.pivots[i])
        sine = abs((complex(exact.x).conjugate() * complex(*at.axes[i, 0])).imag)
        assert sine < 1e-9
        assert abs(exact.pole - exact.centre) > 1e8 * exact.size
