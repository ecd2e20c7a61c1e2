"""A sample of what `stability.py` tabulates: no kernel is worse than its bound, none answers what is not there."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice
from typing import Any

import numpy as np
import pytest

from tests.attacks import stability_paths, stability_planar, stability_space
from tests.attacks.stability_linkages import STRESSES
from tests.attacks.stability_reference import Row, tried
from tests.benchmarks import spatial_stability
from tests.precision import EXTENDED

pytestmark = pytest.mark.skipif(not EXTENDED, reason="principal pairs and small deviations need extended precision")


def check(rows: Iterator[Row]) -> int:
    """Try rows, and return how many cases had an answer."""
    answered = 0
    for row in rows:
        found = tried(row)
        assert found.good, (row.kernel, row.stress, found.error, found.factor)
        answered += int(np.isfinite(found.error).sum())
    return answered


@pytest.mark.parametrize("stress", ["random slider-crank", "dead point, 1e-09 rad", "coordinates 1e-150"])
def test_kernels_of_the_plane_lose_no_more_than_their_bounds(stress: str) -> None:
    kernels: list[Callable[..., Any]] = [stability_planar.circuit, partial(stability_planar.pose, 1, 0.3),
                                         partial(stability_planar.rate, 1, 2), stability_planar.lengths]  # fmt: skip
    stressed = STRESSES[stress](2)
    assert check(filter(None, (kernel(stress, stressed) for kernel in kernels))) > 5


@pytest.mark.slow
@pytest.mark.parametrize("stress", [*STRESSES][::3])
def test_all_kernels_of_the_plane_keep_their_bounds(stress: str) -> None:
    assert check(stability_planar.rows(2, {stress: STRESSES[stress]})) > 10


@pytest.mark.slow
def test_strips_and_arcs_of_known_width_are_measured() -> None:
    assert check(islice(stability_paths.zones(), 7)) > 30


@pytest.mark.slow
@pytest.mark.parametrize("stress", ["coordinates 1e+150", "offset 1e+08 sizes", "crank shorter, 1e-06"])
def test_guides_are_measured_on_the_exact_motion(stress: str) -> None:
    stressed = STRESSES[stress](2)
    jacobian = stability_paths.jacobian(stress, stressed)
    assert jacobian is not None
    assert check(iter([jacobian])) == 2
    assert check(stability_paths.stretches(2, stressed, stress)) > 2


@pytest.mark.slow
def test_function_generators_keep_their_bounds() -> None:
    assert check(stability_space.generators(2)) > 30


@pytest.mark.slow
@pytest.mark.parametrize("near", [1e-2, 1e-8])
@pytest.mark.parametrize("way", ["swept", "compiled sweep"])
def test_a_point_where_a_torus_nearly_closes_is_led_away_and_back(near: float, way: str) -> None:
    """Its meridian is bent so much that a step of the square root of rounding leaves more than rounding."""
    batch, at = spatial_stability.closing(near, 4)
    assert at.success.all()
    assert check(iter([stability_space.swept(way, str(near), batch, at, near)])) == len(batch)
