"""Circuits: every position closes the chain, none is of another circuit, and there are as many as there ought to be."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue.kinematics.circuits import OPEN, circuits
from catalogue.kinematics.linkage import FAMILIES, Linkage
from catalogue.kinematics.types import Array

Maker = Callable[..., Linkage]
#: Linkages of each family and order of the dyads: 2,004 in all.
EACH = 167
every_family = pytest.mark.parametrize("family", FAMILIES)
every_order = pytest.mark.parametrize("swapped", [False, True], ids=["", "swapped"])


def four_bar(ground: float, crank: float, coupler: float, rocker: float, angle: float = 50.0) -> Array:
    """Return the pivots of a four-bar, closed to the left of the line from the crank pin to the rocker's pivot."""
    pin = crank * np.exp(1j * np.radians(angle))
    base = ground - pin
    along = (abs(base) ** 2 + coupler**2 - rocker**2) / (2 * abs(base))
    end = pin + (along + 1j * np.sqrt(coupler**2 - along**2)) * base / abs(base)
    return np.array([[[0, 0, 1], [pin.real, pin.imag, 1]], [[ground, 0, 1], [end.real, end.imag, 1]]])


def on_a_slider(crank: float, coupler: float, offset: float, angle: float = 50.0) -> Array:
    """Return the pivots of a slider-crank."""
    pin = crank * np.exp(1j * np.radians(angle))
    x = pin.real + np.sqrt(coupler**2 - (offset - pin.imag) ** 2)
    return np.array([[[0, 0, 1], [pin.real, pin.imag, 1]], [[0, 1, 0], [x, offset, 1]]])


def on_a_slide(ground: float, crank: float, angle: float = 50.0) -> Array:
    """Return the pivots of an inverted slider-crank without offset."""
    pin = crank * np.exp(1j * np.radians(angle))
    normal = 1j * (ground - pin) / abs(ground - pin)
    return np.array([[[0, 0, 1], [pin.real, pin.imag, 1]], [[ground, 0, 1], [normal.real, normal.imag, 0]]])


#: Linkages with change points, and how many smooth motions they have.
SPECIAL: dict[str, tuple[Array, int]] = {
    "parallelogram": (four_bar(3, 1, 3, 1), 2),
    "antiparallelogram": (np.array([[[0, 0, 1], [0, 1, 1]], [[3, 0, 1], [2.4, -0.8, 1]]]), 2),
    "rhombus-like kite": (four_bar(2, 1, 1, 2), 2),
    "deltoid": (four_bar(2, 2, 1, 1), 2),
    "Grashof limit, crank shortest": (four_bar(4, 1, 3, 2), 1),
    "Grashof limit, ground shortest": (four_bar(1, 2, 3, 4), 1),
    "Grashof limit, coupler shortest": (four_bar(3, 2, 1, 4, 130), 1),
    "isosceles slider-crank": (on_a_slider(1, 1, 0), 2),
    "slider-crank at its limit": (on_a_slider(1, 1.5, 0.5), 1),
    "isosceles inverted slider-crank": (on_a_slide(1, 1), 1),
}


def reordered(linkage: Linkage, swapped: bool) -> Linkage:
    return Linkage(linkage.pivots[:, ::-1]) if swapped else linkage


def chains(naive: SimpleNamespace, linkage: Linkage, lead: Array) -> list[tuple[Array, Any]]:
    """Return which linkages of one family are led by what, with their chains."""
    parts = [(np.flatnonzero(lead == k), k) for k in np.unique(lead)]
    return [(some, naive.Chain(linkage.pivots[some], int(k))) for some, k in parts]


def placed(linkage: Linkage, s: Array) -> tuple[Array, Array]:
    """Return the poses of all circuits at phases (m, k), as d and turn of z -> d + turn z."""
    pose = circuits(linkage).pose(s)
    turn = 1 + pose.x
    return pose.d + pose.origin * (1 - turn), turn


@every_family
@every_order
def test_every_position_closes_the_chain(
    random_linkages: Maker, naive: SimpleNamespace, family: str, swapped: bool
) -> None:
    linkage = reordered(random_linkages(family, EACH, 71), swapped)
    found = circuits(linkage)
    d, turn = placed(linkage, np.linspace(0, 1, 97)[:, None] * found.period)
    gap = naive.Chain(found.linkage.pivots, 2).gaps(d, turn)
    far = np.abs(d) + np.abs(found.linkage.points).max((1, 2))  # a swinging block runs to infinity
    assert (gap / far).max() < 1e-12
    assert np.abs(np.abs(turn) - 1).max() < 1e-14


@every_family
@every_order
def test_the_given_position_is_on_the_first_circuit_at_its_phase(
    random_linkages: Maker, family: str, swapped: bool
) -> None:
    linkage = reordered(random_linkages(family, EACH, 72), swapped)
    found = circuits(linkage)
    first = np.unique(found.of, return_index=True)[1]
    assert np.isfinite(found.phase[first]).all()
    assert np.isnan(np.delete(found.phase, first)).all()
    pose = found[first].pose(found.phase[first][None])
    assert np.abs(pose.x).max() < 1e-7  # within 1e-14 of a dead point no more digits are known
    assert np.median(np.abs(pose.x)) < 1e-15
    assert np.abs(pose.d).max() < 1e-7


@every_family
def test_the_phase_of_a_pose_is_the_one_at_which_it_is_taken(random_linkages: Maker, family: str) -> None:
    found = circuits(random_linkages(family, 12, 74))
    for one in (found[k : k + 1] for k in np.flatnonzero(np.isfinite(found.phase))):
        s = one.phase + np.linspace(-0.45, 0.45, 7) * one.period
        if one.kind[0] == OPEN:  # it does not go round
            s = np.clip(s, 0.01, 2 * np.pi - 0.01)
        np.testing.assert_allclose(one.phases(one.pose(s[:, None])), s, atol=1e-6)


@pytest.mark.slow
@every_family
@every_order
def test_a_circuit_is_what_is_reached_step_by_step(
    random_linkages: Maker, naive: SimpleNamespace, family: str, swapped: bool
) -> None:
    linkage = reordered(random_linkages(family, EACH, 73), swapped)
    found = circuits(linkage)
    s = (np.arange(1001) + 0.37)[:, None] / 1000 * found.period  # exactly in a dead point circles may miss each other
    assert off_the_way(naive, linkage, s) < 1e-9


def off_the_way(naive: SimpleNamespace, linkage: Linkage, s: Array) -> float:
    """Return by how much circuits differ at most from a naive way that takes the nearest position in each step."""
    found = circuits(linkage)
    d, turn = placed(linkage, s)
    worst = 0.0
    for some, chain in chains(naive, found.linkage, found.lead):
        at = d[:, some], turn[:, some]
        with np.errstate(all="ignore"):
            again = chain.followed(chain.angle(*at), (at[0][:2], at[1][:2]))
        far = np.abs(at[0]) + np.abs(found.linkage.points[some]).max((1, 2))
        worst = max(worst, float((np.abs(again[1] - at[1]) + np.abs(again[0] - at[0]) / far).max()))
    return worst


@every_family
@every_order
def test_there_are_as_many_circuits_as_ranges_of_the_crank(
    random_linkages: Maker, naive: SimpleNamespace, family: str, swapped: bool
) -> None:
    linkage = reordered(random_linkages(family, EACH, 74), swapped)
    found = circuits(linkage)
    lead = found.lead[np.unique(found.of, return_index=True)[1]]
    number = np.bincount(found.of)
    for some, chain in chains(naive, linkage, lead):
        np.testing.assert_array_equal(number[some], chain.count())


def test_four_bars_have_two_circuits_by_the_rule_of_grashof(random_linkages: Maker) -> None:
    linkage = random_linkages("four-bar", 2000, 75)
    z = linkage.points
    bars = [z[:, 1, 0] - z[:, 0, 0], z[:, 0, 1] - z[:, 0, 0], z[:, 1, 1] - z[:, 0, 1], z[:, 1, 1] - z[:, 1, 0]]
    lengths = np.sort(np.abs(bars), axis=0)
    two = lengths[0] + lengths[3] < lengths[1] + lengths[2]
    np.testing.assert_array_equal(np.bincount(circuits(linkage).of), np.where(two, 2, 1))


@pytest.mark.slow
@pytest.mark.parametrize("name", SPECIAL)
@every_order
def test_special_linkages_go_straight_through_their_change_points(
    naive: SimpleNamespace, name: str, swapped: bool
) -> None:
    pivots, number = SPECIAL[name]
    linkage = reordered(Linkage(pivots), swapped)
    found = circuits(linkage)
    assert len(found) == number
    # no position is exactly a change point, where the naive circles touch
    s = 0.00123 + np.linspace(0, 1, 3001)[:, None] * found.period
    d, turn = placed(linkage, s)
    assert (naive.Chain(found.linkage.pivots, 2).gaps(d, turn) / (1 + np.abs(d))).max() < 1e-12
    assert off_the_way(naive, linkage, s) < 1e-8
    np.testing.assert_allclose(d[-1], d[0], atol=1e-12)  # closed after its period
    np.testing.assert_allclose(turn[-1], turn[0], atol=1e-12)
    pose = found[:1].pose(found.phase[None, :1])
    assert np.abs(pose.x).max() < 1e-7


@every_family
def test_finely_sampled_positions_are_near_each_other_and_the_last_is_the_first(
    random_linkages: Maker, family: str
) -> None:
    linkage = random_linkages(family, EACH, 76)
    found = circuits(linkage)
    steps = []
    for m in (1000, 2000):
        d, turn = placed(linkage, np.linspace(0, 1, m + 1)[:, None] * found.period)
        steps.append(np.abs(np.diff(turn, axis=0)).max(0))
        closed = found.kind != OPEN
        assert np.abs(d[-1] - d[0])[closed].max(initial=0) < 1e-7
        assert np.abs(turn[-1] - turn[0])[closed].max(initial=0) < 1e-7
    # a leap would be as large at any step
    assert (steps[1] < 0.75 * steps[0]).mean() > 0.99
    assert steps[1].max() < 0.5


@pytest.mark.parametrize("off", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("name", SPECIAL)
def test_beside_a_change_point_the_links_keep_their_lengths(name: str, off: float) -> None:
    pivots = SPECIAL[name][0].copy()
    pivots[..., :2] += off * np.random.default_rng(3).normal(size=(2, 2, 2)) * pivots[..., 2:]
    linkage = Linkage(pivots)
    found = circuits(linkage)
    s = np.linspace(0, 1, 501)[:, None] * found.period
    pose = found.pose(s)
    for i in (0, 1):
        (fixed, moving), finite = linkage.points[0, i], linkage.finite[0, i]
        if finite.all():
            strayed = np.abs(pose.point(np.array([moving])) - fixed) - abs(moving - fixed)
        elif finite[1]:
            strayed = (np.conj(fixed) * (pose.point(np.array([moving])) - moving)).real
        else:
            seen = (fixed - pose.point(np.zeros(1))) / (1 + pose.x)  # the fixed pivot from the coupler
            strayed = (np.conj(moving) * (seen - fixed)).real
        assert np.nanmax(np.abs(strayed)) < 1e-8
