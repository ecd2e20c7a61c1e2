"""Samples of a curve: nothing sudden is missed, whatever asks for them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue.kinematics.sampling import IN_LINE, POLYLINE, Samples, lowest, resolved
from catalogue.kinematics.splines import SPLINE, cubic, place_points
from tests.curves import nearest, off_spline

Array = Any


def sudden(width: float) -> Samples:
    """Return a point that runs round a circle within a sliver of the phase, and steadily along a line besides."""

    def curve(s: Array) -> Array:
        turn = np.pi + 2 * np.arctan((s - IN_LINE) / width)
        return np.stack([s / 10 + np.exp(1j * turn), np.exp(1j * turn)], axis=1)

    return resolved(curve, 0.0, 6.0, np.array([np.nan, 1.0]), 1e-3)


@pytest.mark.parametrize("width", [1.0, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
def test_a_turn_there_and_back_is_seen_however_sudden_it_is(width: float) -> None:
    samples = sudden(width)
    assert np.abs(np.diff(samples.values[:, 1])).max() < 0.2
    turned = np.unwrap(np.angle(samples.values[:, 1]))
    exact = 2 * np.arctan((6 - IN_LINE) / width) + 2 * np.arctan(IN_LINE / width)
    assert turned[-1] - turned[0] == pytest.approx(exact, abs=1e-6)


@pytest.mark.parametrize("width", [1.0, 1e-2, 1e-4, 1e-6])
def test_polyline_and_spline_keep_their_errors(width: float) -> None:
    samples = sudden(width)
    turn = np.linspace(0, 2 * np.pi, 4001)[1:-1]
    s = IN_LINE + width * np.tan(0.5 * (turn - np.pi))
    true = samples.curve(s[(s > 0) & (s < 6)])[:, 0]
    scale = samples.scale[0]
    assert nearest(true, samples.curve(samples.polyline([0]))[:, 0]).max() < POLYLINE.error * scale
    at, knots = place_points(samples, 0)
    spline = cubic(knots, samples.curve(at)[:, 0])
    assert off_spline(3, spline.t, spline.c @ [1, 1j], true) < 1.5 * SPLINE.error * scale


@pytest.mark.parametrize("width", [1.0, 1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("count", [9, 73, 1001])
def test_rows_keep_their_share(width: float, count: int) -> None:
    samples = sudden(width)
    at = samples.rows(np.linspace(0, 1, count))
    assert at[0] == 0
    assert at[-1] == 6
    turned = 2 * np.arctan((at - IN_LINE) / width)
    assert np.diff(turned).max() <= 1.02 * 6 / (count - 1) * (turned[-1] - turned[0])
    np.testing.assert_allclose(samples.share(at), np.linspace(0, 1, count), atol=1e-9)


def test_rows_of_a_crank_that_turns_steadily_are_even_in_its_angle() -> None:
    guide = catalogue.guide({"ground": 4, "crank": 1, "coupler": 3.5, "rocker": 3, "along": 2, "across": 1})
    np.testing.assert_allclose(np.diff(guide.motion(73).drive), 5, rtol=1e-9)


def test_rows_run_from_the_greater_parameter_to_the_smaller_one_as_well() -> None:
    there = sudden(1e-4)
    back = resolved(there.curve, 6.0, 0.0, np.array([np.nan, 1.0]), 1e-3)
    share = np.linspace(0, 1, 33)
    np.testing.assert_allclose(back.rows(share), there.rows(share)[::-1], atol=1e-3)
    np.testing.assert_allclose(back.share(back.rows(share)), share, atol=1e-9)


def test_the_least_value_is_found_between_samples() -> None:
    s = np.linspace(0, 2, 9)

    def function(s: Array) -> Array:
        return (s - 0.817) ** 2 * (1 + s) - 3

    assert lowest(function, s, function(s)) == pytest.approx(-3, abs=1e-12)
