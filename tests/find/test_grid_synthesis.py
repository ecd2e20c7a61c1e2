"""Four-bars completed along the whole path, of which one crank or two pivots are given."""

from __future__ import annotations

import numpy as np

from catalogue.find.grid_synthesis import circles, complete_pairs, reaches, turns
from catalogue.guidance.fixed_nominal import Nominal
from catalogue.problem.path import StraightLine


def test_completed_linkages_carry_the_point_along_the_path() -> None:
    """The point stands on the nominal at all stations, the crank keeps its length, and the other one nearly does."""
    nominal = Nominal(1.0, 1.5)
    path = nominal.at(np.linspace(0, 1, 9))[0]
    fixed, moving = np.array([0.2 - 0.9j]), np.array([0.1 - 0.1j])
    turn = turns(fixed, moving, path)
    np.testing.assert_allclose(np.abs(turn), 1, rtol=1e-12)
    np.testing.assert_allclose(turn[4], 1, rtol=1e-12)
    crank = np.abs(path[:, None] + turn * (moving - path[4]) - fixed)
    np.testing.assert_allclose(crank, np.abs(moving - fixed)[0], rtol=1e-12)
    pivots, of = complete_pairs("crank", np.array([[fixed[0], moving[0]]]), nominal)
    assert len(of) > 3
    z = pivots[..., 0] + 1j * pivots[..., 1]
    np.testing.assert_array_equal(z[:, 0], [[fixed[0], moving[0]]] * len(of))
    ends = path[[0, -1], None] + turn[[0, -1]] * (z[:, 1, 1] - path[4])
    np.testing.assert_allclose(np.abs(ends - z[:, 1, 0]), np.abs(z[:, 1, 1] - z[:, 1, 0])[None].repeat(2, 0), atol=0.3)


def test_given_fixed_pivots_are_completed_in_the_inverse_motion() -> None:
    """A linkage whose point follows the path, taken apart to its fixed pivots, is among the starts."""
    nominal = Nominal(1.0)
    path = nominal.at(0.5 * (1 - np.cos(np.pi * np.arange(17) / 16)))[0]
    pair = np.array([-0.3 + 0.5j, 1.1 - 0.8j])
    pivots, of = complete_pairs("fixed", pair[None], nominal)
    assert len(of) > 3
    z = pivots[..., 0] + 1j * pivots[..., 1]
    np.testing.assert_array_equal(z[:, :, 0], [pair] * len(of))
    turn = turns(z[:, 0, 0], z[:, 0, 1], path)
    off = np.abs(path[:, None] + turn * (z[:, 1, 1] - path[8]) - z[:, 1, 0])
    assert (off.max(0) - off.min(0)).min() < 0.01
    np.testing.assert_allclose(off[8], np.abs(z[:, 1, 1] - z[:, 1, 0]), rtol=1e-12)


def test_circles_are_recovered() -> None:
    rng = np.random.default_rng(3)
    centre, radius = rng.normal(size=(2, 20)).T @ [1, 1j], rng.uniform(0.5, 3, 20)
    z = centre + radius * np.exp(1j * np.linspace(0.2, 1.4, 17))[:, None]
    found, off = circles(z)
    np.testing.assert_allclose(found, centre, atol=1e-10)
    assert off.max() < 1e-12


def test_a_crank_reaches_if_a_triangle_of_crank_and_arm_spans_every_place_of_the_path() -> None:
    """By the triangle inequality, at places so many that none is missed."""
    draw = np.random.default_rng(11)
    path, seen = np.linspace(0, 1, 2001), set()
    for a, a_ in draw.normal(size=(200, 2, 2)) @ np.array([1, 1j]):
        crank, arm, span = abs(a_ - a), abs(a_ - 0.5), np.abs(path - a)
        expected = bool(((span < crank + arm) & (span > abs(crank - arm))).all())
        margin = min((crank + arm - span).min(), (span - abs(crank - arm)).min())
        if abs(margin) > 1e-2:
            pair = ((a.real, a.imag), (a_.real, a_.imag))
            assert reaches(pair, StraightLine(1.0, 0.01)) == expected
            seen.add(expected)
    assert seen == {True, False}
