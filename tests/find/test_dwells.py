"""Dwells, against loops closed by plain circle intersections over the full turn."""

from __future__ import annotations

import json
import re
import sqlite3
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue.chains.chain import chain_of
from catalogue.chains.poses import poses
from catalogue.errors import InvalidRequest
from catalogue.find import dwells as dwells_module
from catalogue.find.dwells import _turning, diameter
from catalogue.guidance.dwell import _standing, dwells
from catalogue.guidance.metrics import transmission_turn
from catalogue.guides.dwell import DwellCandidate
from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.types import Array
from catalogue.problem.constraints import Constraints


@pytest.fixture(scope="module")
def found(small: catalogue.Catalogue) -> list[DwellCandidate]:
    listed = small.find_dwells(catalogue.StandStill(40, 1.0, 20), pins_only=True, limit=6)
    assert len(listed) == 6
    return list(listed)


def meet(a: Array, r: Any, b: Any, s: Any, near: complex) -> Array:
    """Return, from position to position, the intersection of two circles that goes on from `near`."""
    out = []
    for p, q in zip(a, np.broadcast_to(b, a.shape), strict=True):
        gap = q - p
        x = (r * r - s * s + abs(gap) ** 2) / (2 * abs(gap))
        root = np.sqrt(complex(r * r - x * x)).real
        both = [p + gap / abs(gap) * (x + 1j * sign * root) for sign in (1, -1)]
        near = min(both, key=lambda z: abs(z - near))
        out.append(near)
    return np.array(out)


def guided_path(d: DwellCandidate, count: int) -> Array:
    """Return the guided point over a turn of the crank."""
    z = np.array(d.pivots)[..., 0] + 1j * np.array(d.pivots)[..., 1]
    i = d.driver - 1
    turn = np.exp(2j * np.pi * np.arange(count) / count)
    pin = z[i, 0] + turn * (z[i, 1] - z[i, 0])
    other = meet(pin, abs(z[1 - i, 1] - z[i, 1]), z[1 - i, 0], abs(z[1 - i, 1] - z[1 - i, 0]), z[1 - i, 1])
    share = (complex(*d.guided) - z[i, 1]) / (z[1 - i, 1] - z[i, 1])
    path: Array = pin + share * (other - pin)
    return path


def rocker_angles(d: DwellCandidate, count: int) -> tuple[Array, Array]:
    """Return the angle of the rocker and the sine of the transmission angle at its joint, over a turn of the crank."""
    point = guided_path(d, count)
    joint, pivot = complex(*d.joint), complex(*d.pivot)
    at = meet(point, abs(complex(*d.guided) - joint), pivot, abs(joint - pivot), joint)
    rod, rocker = at - point, at - pivot
    sine = np.abs((rod.conj() * rocker).imag) / (np.abs(rod) * np.abs(rocker))
    return np.degrees(np.unwrap(np.angle(rocker / (joint - pivot)))), sine


def machines(d: DwellCandidate, scatter: float, draws: int, seed: int = 3) -> Array:
    """Return the range of the rocker's angles [deg] of four-bars whose every coordinate is off by a standard deviation,
    while the crank turns through the middle of the dwell by the angle asked; loops closed by circles."""
    z = np.array(d.pivots)[..., 0] + 1j * np.array(d.pivots)[..., 1]
    off = scatter * np.random.default_rng(seed).normal(size=(2, 7, draws))
    (a1, b1, a2, b2), point, joint, pivot = (
        (z.ravel()[:, None] + off[0, :4] + 1j * off[1, :4]),
        *(complex(*place) + off[0, k] + 1j * off[1, k] for k, place in enumerate((d.guided, d.joint, d.pivot), 4)),
    )
    if d.driver == 2:
        a1, b1, a2, b2 = a2, b2, a1, b1
    assert d.drive_from is not None
    assert d.asked_angle is not None
    middle, first = np.radians(d.drive_from + 0.5 * d.angle), np.angle(z[d.driver - 1, 1] - z[d.driver - 1, 0])
    half = 0.5 * np.radians(d.asked_angle)
    share, angles, other, at = (point - b1) / (b2 - b1), [], b2, joint
    way = np.sign(middle - first) or 1.0
    dwell = np.linspace(middle - half, middle + half, 81)[:: int(way)]
    for turn in [*np.arange(first, dwell[0], 0.01 * way), *dwell]:
        pin = a1 + np.abs(b1 - a1) * np.exp(1j * turn)
        other = crossing(pin, np.abs(b2 - b1), a2, np.abs(b2 - a2), other)
        led = pin + share * (other - pin)
        at = crossing(led, np.abs(point - joint), pivot, np.abs(joint - pivot), at)
        angles.append(np.angle((at - pivot) / (joint - pivot)))
    ranges: Array = np.degrees(np.ptp(np.unwrap(np.array(angles[-81:]), axis=0), axis=0))
    return ranges


def crossing(p: Array, r: Array, q: Array, s: Array, near: Array) -> Array:
    """Return those intersections of circles, arrays of one shape, that are nearer to a place."""
    gap = q - p
    x = (r * r - s * s + np.abs(gap) ** 2) / (2 * np.abs(gap))
    root = np.sqrt(np.maximum(r * r - x * x, 0.0))
    one, two = (p + gap / np.abs(gap) * (x + 1j * side * root) for side in (1, -1))
    return np.asarray(np.where(np.abs(one - near) < np.abs(two - near), one, two))


@pytest.mark.slow
def test_rockers_keep_the_residual_in_95_of_100_machines_drawn_at_the_allowance(found: list[DwellCandidate]) -> None:
    draws = 4000
    for d in found:
        assert d.allowance is not None
        assert d.allowance > 0
        kept = (machines(d, d.allowance, draws) <= 1.0).mean()
        capped = d.allowance > 0.0099 * min(value for value in d.lengths.values() if value > 0)
        assert kept > 0.935 if capped else 0.935 < kept < 0.965
        assert d.kept_share == pytest.approx(kept, abs=0.03)


@pytest.mark.slow
def test_the_allowance_of_a_dwell_has_the_unit_of_its_crank(small: catalogue.Catalogue) -> None:
    one, other = (
        small.find_dwells(catalogue.StandStill(40, 1.0, 20, crank, unit), limit=1)[0]
        for crank, unit in ((1.0, None), (30.0, "mm"))
    )
    assert one.allowance is not None
    assert other.allowance == pytest.approx(30 * one.allowance)
    assert other.in_unit("cm").allowance == pytest.approx(3 * one.allowance)


@pytest.mark.slow
def test_no_crank_of_a_dwell_passes_a_change_point(small: catalogue.Catalogue) -> None:
    """There its transmission angle is 0, and rounding decides how it goes on."""
    for d in small.find_dwells(catalogue.StandStill(60, 1.0, 20), limit=20, effort=4):
        assert transmission_turn(d.linkage)[0, d.driver - 1] > 0
        assert d.min_transmission <= transmission_turn(d.linkage)[0, d.driver - 1] * (1 + 1e-9)


@pytest.mark.slow
def test_the_rocker_stands_still_and_swings_as_it_is_said(found: list[DwellCandidate]) -> None:
    for d in found:
        count = 1440
        angle, sine = rocker_angles(d, count)
        assert np.ptp(angle) == pytest.approx(d.swing, abs=0.02)
        assert abs(angle[-1] - angle[0]) < 10  # closed
        assert d.residual <= 1.0 + 1e-9
        # the longest run about the reference position within a band of 1 degree
        around = np.concatenate([angle[count // 2 :], angle[: count // 2]])
        longest = 0
        for low in np.linspace(-1.0, 0.0, 41):
            inside = (around >= low - 1e-9) & (around <= low + 1.0 + 1e-9)
            breaks = np.flatnonzero(~inside)
            before, after = breaks[breaks < count // 2], breaks[breaks >= count // 2]
            if inside[count // 2] and len(before) and len(after):
                longest = max(longest, after[0] - before[-1] - 2)
        assert longest * 360 / count == pytest.approx(d.angle, abs=1.5)
        assert d.angle >= 40
        assert np.degrees(np.arcsin(sine.min())) >= d.min_transmission - 0.1


@pytest.mark.slow
def test_the_rocker_stands_still_between_the_angles_of_the_crank_that_are_told(found: list[DwellCandidate]) -> None:
    count = 2880
    for d in found:
        assert d.drive_from is not None
        assert d.drive_to == pytest.approx(d.drive_from + d.angle)
        pin = complex(*d.pivots[d.driver - 1][1][:2])  # from the origin; the rocker's pivot is on the x axis
        turned = np.degrees(np.angle(pin)) + 360 * np.arange(count) / count
        angle, _ = rocker_angles(d, count)
        for wider, least, most in ((0, d.residual - 0.01, d.residual + 0.01), (3, 1.0, 3.0)):
            during = (turned - d.drive_from + wider) % 360 <= d.angle + 2 * wider
            assert least <= np.ptp(angle[during]) <= most


@pytest.mark.slow
def test_size_is_the_diameter_of_all_pivots_and_the_path(found: list[DwellCandidate]) -> None:
    for d in found:
        inner = [complex(x, y) for pair in d.pivots for x, y, _ in pair] + guided_path(d, 540).tolist()
        every = [*inner, complex(*d.joint), complex(*d.pivot)]
        assert d.size == pytest.approx(max(abs(p - q) for p in every for q in every), rel=1e-4)


@pytest.mark.parametrize("count", [7, 360, 2880, 2881])
def test_no_pivot_is_left_out_of_the_size(count: int) -> None:
    path = np.exp(2j * np.pi * np.arange(count) / count)
    for place in range(6):
        pivots = np.zeros(6, complex)
        pivots[place] = 9j
        assert diameter(pivots, path) == pytest.approx(10, abs=0.15)


def test_the_crank_has_length_one_and_the_best_comes_first(found: list[DwellCandidate]) -> None:
    for d in found:
        (x0, y0, _), (x1, y1, _) = d.pivots[d.driver - 1]
        assert np.hypot(x1 - x0, y1 - y0) == pytest.approx(1)
        assert (x0, y0) == pytest.approx((0, 0))
        assert d.pivot[1] == pytest.approx(0, abs=1e-9)
    least = [d.min_transmission for d in found]
    assert least == sorted(least, reverse=True)


def test_the_pivot_of_the_rocker_is_as_far_from_the_driving_crank_as_is_told(found: list[DwellCandidate]) -> None:
    for d in found:
        far = abs(complex(*d.pivot) - complex(*d.pivots[d.driver - 1][0][:2]))
        for one in (d, replace(d, driver=3 - d.driver, pivots=d.pivots[::-1])):
            assert one.lengths["rocker pivot"] == pytest.approx(far)


@pytest.mark.slow
def test_asking_for_less_finds_no_fewer(small: catalogue.Catalogue) -> None:
    more = small.find_dwells(catalogue.StandStill(60, 0.5, 25), limit=20)
    less = small.find_dwells(catalogue.StandStill(40, 1.0, 20), limit=20)
    assert len(less) >= len(more) > 0


@pytest.mark.slow
def test_constraints_hold(small: catalogue.Catalogue) -> None:
    found = small.find_dwells(catalogue.StandStill(40, 1.0, 20), series="IV*.l", min_transmission=20, limit=5)
    assert len(found)
    assert {d.series for d in found} == {"IV*.l"}
    assert min(d.min_transmission for d in found) >= 20
    assert json.loads(found.to_json()) == [d.to_dict() for d in found]
    assert found.to_pandas()["id"].tolist() == [d.id for d in found]


@pytest.mark.slow
@pytest.mark.parametrize("order", [4, 5])
def test_arcs_of_less_contact_than_asked_are_no_starts(small: catalogue.Catalogue, order: int) -> None:
    every, asked = (_turning(small.database, Constraints(order=k), 1) for k in (0, order))
    with closing(sqlite3.connect(small.database.path)) as connection:
        orders = dict(connection.execute("SELECT id, contact_order FROM guide"))
    assert every
    assert asked
    assert min(orders[int(one)] for one in every.rows["id"]) < 5
    assert min(orders[int(one)] for one in asked.rows["id"]) == order


@pytest.mark.slow
def test_an_impossible_dwell_is_empty_and_says_so(small: catalogue.Catalogue) -> None:
    found = small.find_dwells(catalogue.StandStill(290, 1e-6, 100))
    assert not len(found)
    assert "no dwell found" in found.explain()


@pytest.mark.slow
@pytest.mark.parametrize("least", [0.0, 70.0])
def test_who_asks_for_less_of_a_dwell_as_advised_has_one(small: catalogue.Catalogue, least: float) -> None:
    wish = catalogue.StandStill(90.0, 0.5, 120.0) if least else catalogue.StandStill(240.0, 0.1, 90.0)
    found = small.find_dwells(wish, min_transmission=least)
    assert not len(found)
    offers = found.explain().partition("tested remedies: ")[2].split(", or ")
    assert any(offers)
    for offer in offers:
        eased: dict[str, Any] = {
            name.replace("-", "_"): float(value) for name, value in re.findall(r"--([a-z-]+) ([\d.]+) \(asked", offer)
        }
        smaller = eased.pop("min_transmission", least)
        assert small.find_dwells(replace(wish, **eased), min_transmission=smaller, limit=1), offer


@pytest.mark.parametrize(
    ("wish", "says"),
    [((0, 1, 20), "above zero"), ((300, 1, 20), "300"), ((90, 5, 20), "standstill"), ((90, 1, np.inf), "finite")],
)
def test_bad_wishes_are_refused(wish: tuple[float, float, float], says: str) -> None:
    with pytest.raises(InvalidRequest, match=says):
        catalogue.StandStill(*wish)


def test_constraints_that_do_not_go_with_a_dwell_are_refused(small: catalogue.Catalogue) -> None:
    with pytest.raises(InvalidRequest, match="max_arm does not go"):
        small.find_dwells(catalogue.StandStill(40, 1, 20), max_arm=3)  # type: ignore[call-arg]  # wrong on purpose


def test_a_point_on_an_exact_arc_leaves_the_rocker_at_rest() -> None:
    phi = (np.arange(720) + 0.5) / 360 * np.pi - np.pi
    # the path: an arc about the origin while |phi| < 60 degrees, then out along a smooth loop
    path = np.exp(1j * (np.pi / 2 + 0.3 * np.sin(phi)))
    away = np.maximum(np.abs(phi) - np.pi / 3, 0) ** 2
    path = path * (1 - 0.1 * away)
    found = dwells(path[:, None], np.array([0j]), np.array([[1.0 + 0.2j]]), 0.01)
    assert found.angle[0, 0] == pytest.approx(120, abs=8)
    assert found.residual[0, 0] < 0.01
    assert found.swing[0, 0] > 10


def test_a_rocker_swings_as_far_as_its_triangles_say_and_has_no_swing_if_it_turns() -> None:
    """On a crank of length 1: of a crank-rocker between its dead positions, and of drag links with ground 0.2."""
    phi = (np.arange(720) + 0.5) / 360 * np.pi - np.pi
    path, link = np.exp(1j * phi)[:, None], np.sqrt(5)  # of rod and rocker
    found = dwells(path, np.array([2 + 2j]), np.array([[3.0 + 0j]]), 0.01)
    ends = [np.degrees(np.arccos((9 + 5 - reach**2) / (2 * 3 * link))) for reach in (link - 1, link + 1)]
    assert found.swing[0, 0] == pytest.approx(ends[1] - ends[0], abs=0.01)
    pivot = 0.2 * np.exp(2j * np.pi * np.arange(12) / 12)
    joint = 0.5 * (1 + pivot) + 1j * (1 - pivot)  # as far from the pivot as from the path
    found = dwells(np.concatenate([path, path.conj()], axis=1).repeat(12, 1), np.tile(joint, 2),
                   np.tile(pivot, 2)[:, None], 0.01)  # fmt: skip
    assert np.isnan(found.swing).all()


def test_the_band_is_the_best_placed_one() -> None:
    angle = np.concatenate([np.linspace(-3, 0, 50), np.linspace(0, 0.9, 100), np.linspace(0.9, 4, 50)])[:, None]
    run, begin, spread = _standing(angle - angle[100], 1.0)
    assert begin[0] == pytest.approx(-50 * 360 / 200, abs=6)
    assert spread[0] <= 1.0
    assert run[0] == pytest.approx((100 + 2) * 360 / 200, abs=6)


@pytest.mark.slow
def test_refined_dwells_transmit_better_within_the_size(
    small: catalogue.Catalogue, monkeypatch: pytest.MonkeyPatch
) -> None:
    wished = catalogue.StandStill(60, 0.5, 20)
    refined = list(small.find_dwells(wished, max_size=5, limit=6))
    monkeypatch.setattr(dwells_module, "SEARCH", dwells_module.SEARCH._replace(first=0, rounds=0))
    tried = list(small.find_dwells(wished, max_size=5, limit=6))
    assert refined[0].min_transmission > 10 + max((d.min_transmission for d in tried), default=0.0)
    assert all(d.size <= 5 and d.angle >= 60 and d.residual <= 0.5 + 1e-9 and d.swing >= 20 for d in refined)


@pytest.mark.slow
def test_a_dwell_that_no_stored_arc_gives_is_found_by_refinement(
    small: catalogue.Catalogue, monkeypatch: pytest.MonkeyPatch
) -> None:
    wished = catalogue.StandStill(60, 0.1, 40, 30, "mm")
    assert small.find_dwells(wished, max_size=120, min_transmission=30)
    monkeypatch.setattr(dwells_module, "SEARCH", dwells_module.SEARCH._replace(first=0, rounds=0))
    assert not small.find_dwells(wished, max_size=120, min_transmission=30)


@pytest.fixture(scope="module")
def sliding(once: Callable[..., Path]) -> Iterator[catalogue.Catalogue]:
    """Return a catalogue of slider-cranks and inverted slider-cranks with cranks that turn."""

    def build(path: Path) -> None:
        with catalogue.open(path, build=False) as opened:
            opened.build(count=600, series=("II*.y0", "IV*.x"), processes=1)

    with catalogue.open(once("sliding.db", build), build=False) as opened:
        yield opened


@pytest.mark.slow
@pytest.mark.parametrize("family", ["slider-crank", "inverted-slider-crank"])
def test_rockers_of_sliding_linkages_stand_still_in_the_motion_of_chains(
    sliding: catalogue.Catalogue, family: str
) -> None:
    """Chains close slides by formulas of their own; rod and rocker are closed by plain circles."""
    found = sliding.find_dwells(catalogue.StandStill(60, 0.5, 20), families=[family], limit=3)
    assert found
    count = 2880
    for d in found:
        linkage = d.linkage if d.driver == 1 else Linkage(d.linkage.pivots[:, ::-1])
        chain = chain_of(linkage, np.array([complex(*d.guided)]))
        turn = 2 * np.pi * np.arange(count) / count
        at = poses(chain, turn[:, None], chain.branch)
        path = at.joint(chain.structure.joints.index("P"))[:, 0]
        joint, pivot = complex(*d.joint), complex(*d.pivot)
        place = meet(path, abs(complex(*d.guided) - joint), pivot, abs(joint - pivot), joint)
        angle = np.degrees(np.unwrap(np.angle((place - pivot) / (joint - pivot))))
        assert np.ptp(angle) == pytest.approx(d.swing, abs=0.02)
        assert d.drive_from is not None
        crank = linkage.points[0, 0, 1] - linkage.points[0, 0, 0]
        during = (np.degrees(np.angle(crank) + turn) - d.drive_from) % 360 <= d.angle
        assert np.ptp(angle[during]) == pytest.approx(d.residual, abs=0.01)
        rod = np.degrees(np.angle((place - path) / (place - pivot)))
        least = min((90 - abs(90 - abs(rod))).min(), at.transmission.min())
        assert least == pytest.approx(d.min_transmission, abs=0.1)


@pytest.mark.slow
def test_no_series_crowds_out_the_others(small: catalogue.Catalogue) -> None:
    every = list(small.find_dwells(catalogue.StandStill(60, 0.5, 20), limit=9))
    counted = Counter(d.series for d in every)
    assert len(counted) >= 3
    assert max(counted.values()) == 3
    assert [d.min_transmission for d in every] == sorted((d.min_transmission for d in every), reverse=True)
    of_one = list(small.find_dwells(catalogue.StandStill(60, 0.5, 20), limit=9, series=[every[0].series]))
    assert len(of_one) > 3
    assert of_one[0].min_transmission >= every[0].min_transmission - 0.5
