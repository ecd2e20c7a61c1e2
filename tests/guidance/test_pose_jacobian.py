"""Derivatives of the path by the pivots against differences of moved linkages, at the same places of the stroke."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.guidance.sensitivity import COUNT, displaced, pose_jacobian
from catalogue.kinematics.linkage import FAMILIES, Linkage
from catalogue.kinematics.motion import motion
from catalogue.kinematics.types import Array

Maker = Callable[..., Linkage]
N, STEP = 20, 1e-6


@pytest.mark.parametrize("family", FAMILIES)
def test_derivatives_are_those_of_moved_linkages(family: str, random_linkages: Maker) -> None:
    linkage = random_linkages(family, N, 3)
    draw = np.random.default_rng(4)
    point = draw.normal(size=N) + 1j * draw.normal(size=N)
    guides = coupler_curve(linkage, point)
    half = 0.3 * np.minimum(guides.extent.min(0), 1)
    low, high = guides.window(-half, half)
    t = low + (high - low) * np.linspace(0, 1, 9)[:, None]
    u, _ = guides.path(t)
    found = pose_jacobian(guides.motion, point, t, guides.tangent).across

    def across(step: Array) -> Array:
        moved, where, good = displaced(linkage, point, step)
        assert good.all()
        moving, at = motion(moved, guides.motion.chart), t.copy()

        def place(at: Array) -> Array:
            d, x, _ = moving.pose(at)
            return np.asarray((where + d + x * (where - moving.origin) - point) * guides.tangent.conj())

        for _ in range(6):  # to the same place along the tangent
            slope = (place(at + 1e-7) - place(at)).real / 1e-7
            at = at - (place(at).real - u) / slope
        return place(at).imag

    for k in range(COUNT):
        step = np.zeros((N, COUNT))
        step[:, k] = STEP
        want = (across(step) - across(-step)) / (2 * STEP)
        np.testing.assert_allclose(found[..., k], want, atol=1e-7 * (1 + np.abs(want).max()))


def test_a_point_moves_with_the_coupler_and_a_direction_only_turns(random_linkages: Maker) -> None:
    linkage = random_linkages("slider-crank", N, 5)
    guides = coupler_curve(linkage, np.full(N, 0.3 + 0.2j))
    found = pose_jacobian(guides.motion, guides.point, np.zeros((1, N)), guides.tangent).across
    normal = 1j * guides.tangent
    np.testing.assert_allclose(found[0, :, 8], normal.real, atol=1e-12)
    np.testing.assert_allclose(found[0, :, 9], normal.imag, atol=1e-12)
    slider = np.flatnonzero(linkage.dyads[0] == 1)[0]
    along = np.einsum("nk,nk->n", found[0, :, 4 * slider : 4 * slider + 2], linkage.pivots[:, slider, 0, :2])
    np.testing.assert_allclose(along, 0, atol=1e-12)


def test_impossible_moves_are_told() -> None:
    linkage = Linkage([[[[0, 0, 1], [1, 0, 1]], [[3, 0, 1], [2, 2, 1]]]] * 2)
    step = np.zeros((2, COUNT))
    step[1, 2] = -1.0  # the moving pivot onto the fixed one
    moved, point, good = displaced(linkage, np.zeros(2, complex), step)
    assert good.tolist() == [True, False]
    assert len(moved) == len(point) == 1
