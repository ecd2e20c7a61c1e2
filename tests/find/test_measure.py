"""Linkages of one's own, measured: named guides from their lengths alone, arcs, bad input."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import combinations
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue.errors import InvalidRequest
from catalogue.find.measure import measure
from catalogue.guides.own_guide import OwnGuide, guide
from catalogue.kinematics.link_lengths import in_coupler, link_lengths
from catalogue.kinematics.linkage import PR, RP, Linkage
from catalogue.series.named_guides import NamedGuide, named_guides

HOEKEN = {"ground": 2, "crank": 1, "coupler": 2.5, "rocker": 2.5, "along": 5, "across": 0}


def from_lengths_alone(design: NamedGuide) -> OwnGuide:
    """Return a named guide made again from the lengths of its links and the place of its point."""
    linkage = design.linkage
    told = {name: float(value[0]) for name, value in link_lengths(linkage, np.array([complex(*design.guided)])).items()}
    place = {"along": told["point along"], "across": told["point across"]}
    kinds = tuple(linkage.dyads[0])
    z = linkage.points[0]
    if kinds == (0, 0):
        names = {"ground": "frame", "crank": "crank 1", "coupler": "coupler", "rocker": "crank 2"}
        links = {name: told[of] for name, of in names.items()}
        left = ((z[1, 0] - z[0, 1]).conjugate() * (z[1, 1] - z[0, 1])).imag > 0
        links["branch"] = 1 if left else -1
    elif PR in kinds and RP not in kinds and kinds[0] == 0:
        # the slider's line as y = offset, seen from crank 1's pivot
        links = {"crank": told["crank 1"], "coupler": told["coupler"], "offset": told["offset of slider 2"]}
        way = ((z[1, 1] - z[0, 1]) * (-1j * z[1, 0]).conjugate()).real
        links["branch"] = 1 if way > 0 else -1
    elif kinds == (0, RP):
        links = {"ground": told["frame"], "crank": told["crank 1"], "offset": -told["offset of slide 2"]}
        run = -1j * z[1, 1]
        links["branch"] = 1 if ((z[1, 0] - z[0, 1]) * run.conjugate()).real > 0 else -1
    elif kinds == (PR, PR):
        between = np.degrees(np.angle(z[1, 0] / z[0, 0]))
        links = {"coupler": told["coupler"], "between": between}
    else:
        between = np.degrees(np.angle(z[1, 1] / z[0, 1]))
        links = {"ground": told["frame"], "between": between}
    return guide(links | place)


@pytest.mark.parametrize("name", named_guides())
def test_a_named_guide_is_found_from_its_lengths_alone(name: str) -> None:
    design = named_guides()[name]
    own = from_lengths_alone(design)
    found = measure(own, stroke=design.stroke, arc=design.circle)
    assert len(found) > 0
    best = found[0]
    assert best.stroke == pytest.approx(design.stroke, rel=1e-9)
    # the published stretch, or one that is as straight
    assert best.deviation <= design.deviation * 1.001 + 1e-12 * design.stroke


def test_hoekens_straight_part_is_where_he_has_it() -> None:
    design = named_guides()["hoeken"]
    found = measure(from_lengths_alone(design), stroke=design.stroke, limit=1)
    assert found[0].deviation == pytest.approx(design.deviation, rel=1e-3)
    # seen from crank 1's pivot the straight part is at the height 4; its middle is about that of the whole curve
    middle = complex(*found[0].guided) - found[0].linkage.points[0, 0, 0]
    z = design.linkage.points[0]
    along = middle / ((z[1, 0] - z[0, 0]) / abs(z[1, 0] - z[0, 0]))
    assert abs(abs(along) - math.hypot(4, 2)) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("arc", [{}, {"arc": True}, {"radius": 3.0}], ids=["line", "any arc", "arc"])
def test_a_stretch_is_as_off_as_its_row_says(naive: SimpleNamespace, arc: dict[str, Any]) -> None:
    for found in (measure(guide(HOEKEN), stroke=1.5, **arc), measure(guide(HOEKEN), deviation=0.02, **arc)):
        assert len(found) > 1
        for row in found:
            z = row.path(801) @ np.array([1, 1j])
            assert abs(row.motion(401).deviation).max() == pytest.approx(row.deviation, rel=1e-3, abs=1e-12)
            if not arc:
                assert naive.strip_of(z) == pytest.approx(row.deviation, rel=1e-3)
            if "arc" in arc:
                assert naive.narrowest_annulus(z[::8])[0] == pytest.approx(row.deviation, rel=5e-3)


@pytest.mark.parametrize("cranks", [(250, 100), (100, 250)])
def test_the_drive_is_that_crank_and_turns_from_where_the_path_begins_to_where_it_ends(cranks: tuple[int, int]) -> None:
    links = {"ground": 220, "crank": cranks[0], "coupler": 250, "rocker": cranks[1], "along": 125, "across": 80}
    drivers = set()
    for one in guide(links).measure(stroke=60, limit=4):
        moved = one.motion(2)
        for told, k in ((one.drive_from, 0), (one.drive_to, 1)):
            assert one.driver
            pivot, pin = complex(*one.pivots[one.driver - 1][0][:2]), moved.points[f"A{one.driver}*"][k]
            assert told == pytest.approx(np.degrees(np.angle(pin - pivot)), abs=1e-6)
        drivers.add(one.driver)
    assert drivers == {1, 2}


@pytest.mark.slow
def test_of_the_two_ways_of_asking_one_is_the_inverse_of_the_other() -> None:
    within = measure(guide(HOEKEN), deviation=0.01)[0]
    assert within.deviation <= 0.01 * (1 + 1e-9)
    over = measure(guide(HOEKEN), stroke=within.stroke)[0]
    assert over.deviation == pytest.approx(within.deviation, rel=2e-3)


@pytest.mark.slow
def test_stretches_of_many_linkages_are_told_by_their_numbers() -> None:
    every = [
        guide(HOEKEN),
        guide({"ground": 4, "crank": 2.4, "coupler": 2, "rocker": 2.4, "along": 1, "across": -2.18}),
    ]
    together = measure(every, stroke=2.0, limit=2)
    assert {row.number for row in together} == {1, 2}
    for number, one in enumerate(every, start=1):
        alone = measure(one, stroke=2.0, limit=2)
        ours = [row.deviation for row in together if row.number == number]
        assert ours == pytest.approx([row.deviation for row in alone], rel=1e-2, abs=1e-12)
        assert ours == sorted(ours)


@pytest.mark.slow
def test_a_linkage_without_such_a_stretch_is_told_why() -> None:
    found = measure(guide(HOEKEN), stroke=50.0)
    assert len(found) == 0
    assert found.failed is not None
    assert "50" in found.failed[1]
    assert "or less" in found.explain()


@pytest.mark.slow
@pytest.mark.parametrize("kind", [{}, {"arc": True}, {"radius": 3.0}, {"radius": 1e9}])
def test_a_deviation_too_small_is_told_with_one_that_is_not(kind: dict[str, Any]) -> None:
    found = measure(guide(HOEKEN), deviation=1e-16, **kind)
    assert len(found) == 0
    assert found.failed is not None
    told = found.failed[1].rpartition("allow ")[2]
    assert len(measure(guide(HOEKEN), deviation=float(told), **kind)) > 0


@pytest.mark.parametrize(
    "ask",
    [
        lambda one: measure(one),
        lambda _: measure([], stroke=1),
        lambda one: measure(one, stroke=-1),
        lambda one: measure(one, stroke=float("nan")),
        lambda one: measure(one, deviation=0),
        lambda one: measure(one, stroke=1, radius=0.4),
        lambda one: measure(one, stroke=1, radius=-3),
        lambda one: measure(one, deviation=0.1, radius=0),
        lambda one: measure(one, stroke=1, limit=0),
        lambda one: measure(one, stroke="long"),  # type: ignore[arg-type]
    ],
)
def test_what_cannot_be_meant_is_refused_in_one_line(ask: Callable[[OwnGuide], object]) -> None:
    with pytest.raises(InvalidRequest) as caught:
        ask(guide(HOEKEN))
    assert "\n" not in str(caught.value)


def test_a_place_in_the_coupler_is_that_which_lengths_tell(random_linkages: Callable[..., Linkage]) -> None:
    for family in ("four-bar", "slider-crank", "inverted-slider-crank", "swinging-block", "elliptic-trammel", "oldham"):
        linkage = random_linkages(family, 20, 101)
        point = (np.linspace(-1, 1, 20) + 0.3j).astype(complex)
        told = link_lengths(linkage, point)
        again = in_coupler(linkage, told["point along"] + 1j * told["point across"])
        np.testing.assert_allclose(again, point, atol=1e-12 * np.abs(linkage.points).max() * 100)


@pytest.mark.slow
@pytest.mark.parametrize(("stroke", "deviation"), [(1.5, None), (None, 0.02)], ids=["stroke", "deviation"])
def test_stretches_of_one_circuit_do_not_cover_one_another(stroke: float | None, deviation: float | None) -> None:
    found = measure(guide(HOEKEN), stroke=stroke, deviation=deviation, limit=8)
    pairs = [(a, b) for a, b in combinations(found, 2) if a.circuit == b.circuit]
    assert len(pairs) > 1
    for a, b in pairs:
        shorter, longer = sorted((one.path(401) @ np.array([1, 1j]) for one in (a, b)), key=np.ptp)
        covered = np.abs(shorter[:, None] - longer).min(1) < 0.01 * a.stroke
        assert covered.mean() < 0.6, (a.drive_from, b.drive_from)


@pytest.mark.slow
@pytest.mark.parametrize("unit", [1e-4, 1e4])
@pytest.mark.parametrize("arc", [False, True], ids=["line", "arc"])
def test_a_stretch_is_the_same_in_any_unit(unit: float, arc: bool) -> None:
    small = {name: unit * value for name, value in HOEKEN.items()}
    for stroke, deviation in ((3.5, None), (None, 0.1)):
        some, others = (
            measure(guide(links), stroke=stroke and scale * stroke, deviation=deviation and scale * deviation, arc=arc)
            for links, scale in ((HOEKEN, 1.0), (small, unit))
        )
        assert len(some) > 1
        for one, other in zip(some, others, strict=True):
            assert other.stroke == pytest.approx(unit * one.stroke, rel=1e-8)
            assert other.deviation == pytest.approx(unit * one.deviation, rel=1e-6)
