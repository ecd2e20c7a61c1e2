"""Chains that cannot move, circuits that cross, cranks that both turn: told as they are."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

from catalogue import classify
from catalogue.errors import InvalidRequest
from catalogue.find.measure import measure
from catalogue.guides.own_guide import OwnGuide, guide
from catalogue.guides.results import Measured
from catalogue.kinematics.circuits import circuits
from catalogue.kinematics.from_lengths import from_lengths
from catalogue.plugin.registry import Registry
from catalogue.problem.path import StraightLine

POINT = {"along": 0.5, "across": 0.7}
#: Lengths of which each is, in turn, the sum of the others.
STRETCHED = [(10, 2, 4, 4), (2, 10, 4, 4), (2, 4, 10, 4), (4, 2, 4, 10)]
#: Chains of other families that close in one position.
SHORT = [
    {"crank": 1, "coupler": 2, "offset": 3},
    {"crank": 1, "coupler": 2, "offset": -3},
    {"ground": 1, "crank": 2, "offset": 3},
]
CROSSED = {
    "kite": {"ground": 2, "crank": 1, "coupler": 1, "rocker": 2},
    "parallelogram": {"ground": 3, "crank": 1, "coupler": 3, "rocker": 1},
    "rhombus": {"ground": 2, "crank": 2, "coupler": 2, "rocker": 2},
}


def both_questions(guides: OwnGuide | list[OwnGuide], series: Any = None) -> list[Measured]:
    return [measure(guides, stroke=0.5, series=series), measure(guides, deviation=0.01, series=series)]


def four_bar(ground: float, crank: float, coupler: float, rocker: float) -> dict[str, float]:
    return {"ground": ground, "crank": crank, "coupler": coupler, "rocker": rocker}


@pytest.mark.slow
@pytest.mark.parametrize("links", [*(four_bar(*lengths) for lengths in STRETCHED), *SHORT])
def test_chain_that_just_closes_is_told_to_be_immobile(links: dict[str, float]) -> None:
    one = guide({**links, **POINT})
    assert one.is_immobile
    assert {c.motion for c in one.circuits} == {"stands"}
    for found in both_questions(one):
        assert not found
        assert "cannot move" in str(found.explanation)
    for found in both_questions([one, guide({**CROSSED["kite"], **POINT})]):
        assert "cannot move" in (found.failed or {})[1]
    with pytest.raises(InvalidRequest, match="cannot move"):
        one.motion(10)
    with pytest.raises(InvalidRequest, match="cannot move"):
        one.improve(StraightLine(0.5, 0.01))


@pytest.mark.parametrize("links", [*(four_bar(*lengths) for lengths in STRETCHED), *SHORT])
def test_chain_a_little_longer_moves(links: dict[str, float]) -> None:
    longer = {**links, "crank": links["crank"] * (0.999 if links["crank"] == 10 else 1.001)}
    if "coupler" not in links:
        longer["offset"] = 2.999
    if links.get("coupler") == 10:
        longer = {**links, "coupler": 9.999}
    if links.get("rocker") == 10:
        longer = {**links, "rocker": 9.999}
    assert not guide({**longer, **POINT}).is_immobile


@pytest.mark.slow
def test_point_that_rests_on_one_circuit_is_guided_on_the_other_only() -> None:
    """On one circuit of a kite the rocker stands still, and its pin with it."""
    rests = guide({**CROSSED["kite"], "along": 1, "across": 0})
    for rows in both_questions(rests):
        assert rows
        assert len({row.circuit for row in rows}) == 1
        assert min(row.stroke for row in rows) > 0.09


@pytest.mark.parametrize("name", CROSSED)
def test_circuits_that_cross_are_told_to_be_joined(name: str) -> None:
    one = guide({**CROSSED[name], **POINT})
    assert [c.joined for c in one.circuits] == [True, True]
    # they do cross: at each change point the two have one pose
    found = circuits(one.linkage)
    s = np.array([[0.0], [np.pi]]) * np.ones(2)
    z = found.pose(s + 1e-9).point(np.array([complex(*one.guided)]))
    assert np.abs(z[:, 0] - z[:, 1]).max() < 1e-6 or name != "kite"
    rows = measure(one, stroke=0.3, limit=4)
    assert all(row.joined for row in rows)
    assert not any(c.joined for c in guide({**four_bar(2.2, 1, 2.5, 2.5), **POINT}).circuits)


@pytest.mark.parametrize("name", CROSSED)
def test_change_points_are_told_once(name: str) -> None:
    for angles in guide({**CROSSED[name], **POINT}).change_points.values():
        apart = np.diff(np.sort(angles))
        assert len(angles) <= 2
        assert (apart > 1).all()


def test_a_motion_says_where_branches_cross() -> None:
    moved = guide({**CROSSED["parallelogram"], **POINT, "angle": 90}).motion(5)
    assert moved.reason[1].startswith("change point")
    assert not moved.reason[0]


@pytest.mark.parametrize("name", ["kite", "parallelogram", "drag"])
def test_the_angle_at_the_end_says_which_way_round_the_crank_turns(name: str) -> None:
    links = CROSSED.get(name, four_bar(1, 2, 2, 2))
    rows = measure(guide({**links, **POINT}), stroke=1.5, limit=4)
    assert rows
    for row in rows:
        angles = row.motion(2001, driver=row.driver).drive
        assert row.drive_to is not None
        assert row.drive_from is not None
        assert row.drive_to - row.drive_from == pytest.approx(angles[-1] - angles[0], abs=1e-3)


@pytest.mark.slow
def test_no_warning_reaches_who_measures_or_classifies_crossed_chains() -> None:
    series = Registry().series
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for links in CROSSED.values():
            both_questions(guide({**links, **POINT}), lambda: series)
            for angle in (0.0, 45.0, 90.0, 180.0):
                try:
                    linkage = from_lengths({**links, "angle": angle})
                except InvalidRequest:
                    continue
                except ValueError:
                    continue
                classify(linkage)


@pytest.mark.slow
@pytest.mark.parametrize("arc", [False, True])
def test_a_stroke_that_is_too_long_names_one_that_is_not(arc: bool) -> None:
    own: list[OwnGuide] = [guide({**four_bar(220, 100, 250, 250), "along": 125, "across": 80})]
    own += [guide({"crank": 1, "coupler": 3, "offset": 0.3, "along": 1, "across": 0.5})]
    for one in own:
        told = str(measure(one, stroke=1e4, arc=arc).explanation)
        stroke = float(told.split("ask for ")[1].split(" or less")[0])
        assert measure(one, stroke=stroke, arc=arc)
        assert not measure(one, stroke=1.2 * stroke, arc=arc)
