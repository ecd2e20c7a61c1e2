"""Guides with given pivots."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue.errors import InvalidRequest
from catalogue.guide.in_place import Nominal
from catalogue.query.complete import circles, completed, turns

LINE = catalogue.StraightLine(1.0, 0.01)
ARC = catalogue.CircularArc(1.0, 1.0, 0.01)
FIXED = ((-0.3, 0.5), (1.1, -0.8))


def strays(c: catalogue.Candidate, naive: SimpleNamespace, request: Any) -> float:
    """Return the largest distance from the nominal, from a naive loop."""
    path = naive.Loop(c.pivots, complex(*c.guided)).over(1.0, 1501)
    assert path is not None
    if request.kind == "line":
        return float(np.abs(path.imag).max())
    centre = complex(0.5, -np.sqrt(request.radius**2 - 0.25))
    return float(np.abs(np.abs(path - centre) - request.radius).max())


@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
def test_the_fixed_pivots_stand_exactly_where_they_were_given(
    small: catalogue.Catalogue, naive: SimpleNamespace, request_: Any
) -> None:
    found = small.find(request_, fixed_pivots=FIXED, rank_by="deviation", limit=8)
    assert len(found) >= 3
    for c in found:
        assert (c.pivots[0][0][:2], c.pivots[1][0][:2]) == (list(FIXED[0]), list(FIXED[1]))
        assert c.guided[0] == pytest.approx(0.5, abs=1e-6)
        assert c.id is None
        assert c.unrefined is not None
        assert c.deviation <= min(c.unrefined, request_.deviation)
        assert c.gap is None or c.gap < 0.5
        # the naive path ends at x = 0 and 1, not where its feet on the arc do
        assert strays(c, naive, request_) == pytest.approx(
            c.deviation, rel=1e-3 if request_ is LINE else 5e-3, abs=1e-13
        )
    assert [c.deviation for c in found] == sorted(c.deviation for c in found)
    assert len({c.series for c in found}) > 1


def test_the_moving_pivots_stand_in_mid_stroke_where_they_were_given(
    small: catalogue.Catalogue, naive: SimpleNamespace
) -> None:
    found = small.find(LINE, moving_pivots=((0.2, 0.6), (0.9, 0.7)))
    assert len(found)
    for c in found:
        np.testing.assert_allclose(c.linkage.points[0, :, 1], [0.2 + 0.6j, 0.9 + 0.7j], atol=1e-9)
        assert c.guided[0] == pytest.approx(0.5, abs=1e-9)
        assert strays(c, naive, LINE) == pytest.approx(c.deviation, rel=1e-3)


def test_a_crank_stays_what_it_was(small: catalogue.Catalogue, naive: SimpleNamespace) -> None:
    # the crank of a guide that was found for its fixed pivots
    known = small.find(LINE, fixed_pivots=FIXED, rank_by="deviation", min_transmission=20)[0]
    crank = known.pivots[0][0][:2], known.pivots[0][1][:2]
    found = small.find(LINE, crank=crank)
    assert len(found)
    for c in found:
        np.testing.assert_allclose(c.pivots[0], [[*crank[0], 1], [*crank[1], 1]], atol=1e-9)
        assert strays(c, naive, LINE) == pytest.approx(c.deviation, rel=1e-3)


@pytest.mark.parametrize("request_", [LINE, catalogue.CircularArc(1.0, 1.2, 0.01)], ids=["line", "arc"])
@pytest.mark.parametrize("given", ["crank", "moving", "fixed"])
def test_what_is_given_of_a_good_guide_leads_to_one_as_good(
    small: catalogue.Catalogue, given: str, request_: Any
) -> None:
    """The best four-bars of the catalogue, of which a crank, the moving or the fixed pivots are kept."""
    wish: dict[str, Any] = {"series": ["II.xy", "II*.xy"], "max_link": 2.0, "max_ground": 2.0, "min_transmission": 25}
    for known in small.find(request_, families=["four-bar"], limit=4, **wish):
        (a, a_), (b, b_) = ((tuple(p[:2]) for p in dyad) for dyad in known.pivots)
        kept = {"crank": {"crank": (a, a_)}, "moving": {"moving_pivots": (a_, b_)}, "fixed": {"fixed_pivots": (a, b)}}
        found = small.find(request_, rank_by="deviation", **kept[given])
        assert found[0].deviation <= max(1.5 * known.deviation, 1e-4)
        assert all(c.deviation <= request_.deviation for c in found)
        assert "completed along the path" in found.explain()


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
    pivots, of = completed("crank", np.array([[fixed[0], moving[0]]]), nominal)
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
    pivots, of = completed("fixed", pair[None], nominal)
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


def test_a_crank_that_cannot_follow_is_said_so(small: catalogue.Catalogue) -> None:
    found = small.find(LINE, crank=((-0.2, 0.6), (0.4, 0.2)))
    assert not len(found)
    assert "too short for the path" in found.explain()
    in_line = small.find(LINE, crank=((0.5, -0.4), (0.5, 0.4)))
    assert not len(in_line)
    assert "in line with the arm" in in_line.explain()


def test_pivots_so_far_that_rounding_decides_are_refused(small: catalogue.Catalogue) -> None:
    with pytest.raises(InvalidRequest, match=r"\(1e\+09, 0\) is more than 10000 strokes from the path"):
        small.find(LINE, moving_pivots=((1e9, 0), (0.8, 0.4)))
    for given in ({"moving_pivots": ((900.0, 0.1), (0.8, 0.4))}, {"fixed_pivots": ((0.2, 3e3), (0.8, 3e3))}):
        for c in small.find(LINE, **given):
            assert np.abs(c.linkage.points[c.linkage.finite]).max() <= 1.0001e4


def test_an_arc_for_a_crank_needs_a_radius(small: catalogue.Catalogue) -> None:
    with pytest.raises(InvalidRequest, match="give the radius of the arc too, where a crank is given"):
        small.find(catalogue.CircularArc(1.0, None, 0.01), crank=((0, 0), (0, 1)))


def test_a_tolerance_gives_guides_at_least_as_straight(small: catalogue.Catalogue) -> None:
    exact = small.find(LINE, fixed_pivots=FIXED, rank_by="deviation", limit=1)[0]
    near = small.find(LINE, fixed_pivots=FIXED, within=0.1, rank_by="deviation", limit=5)
    assert near[0].deviation <= exact.deviation
    for c in near:
        off = np.abs(c.linkage.points[0, :, 0] - np.array([complex(*p) for p in FIXED]))
        assert off.max() <= 0.1


def test_other_constraints_hold_too(small: catalogue.Catalogue) -> None:
    found = small.find(LINE, fixed_pivots=FIXED, min_transmission=35, max_link=1.6, series="II.xy")
    assert len(found)
    assert all(c.min_transmission >= 35 and c.max_link is not None and c.max_link <= 1.6 for c in found)
    assert {c.series for c in found} == {"II.xy"}


def test_a_wish_without_answer_says_how_near_it_comes(small: catalogue.Catalogue) -> None:
    found = small.find(catalogue.StraightLine(1.0, 1e-12), fixed_pivots=FIXED)
    assert not len(found)
    assert "relax deviation" in found.explain()
    assert "the nearest holds" in found.explain()


def test_impossible_pivots_say_so(small: catalogue.Catalogue) -> None:
    found = small.find(LINE, fixed_pivots=((500.0, 500.0), (501.0, 500.0)))
    assert not len(found)
    assert "no guide found" in found.explain()


@pytest.mark.parametrize(
    ("wish", "says"),
    [
        ({"fixed_pivots": ((0, 0), (0, 0))}, "coincide"),
        ({"fixed_pivots": ((0, 0), (0, np.nan))}, "not finite"),
        ({"fixed_pivots": (0, 1, 2)}, "two points"),
        ({"crank": "here"}, "two points"),
        ({"fixed_pivots": FIXED, "moving_pivots": FIXED}, "exclude one another"),
        ({"within": 1.0}, "within says"),
        ({"fixed_pivots": FIXED, "within": -1.0}, "above zero"),
        ({"fixed_pivots": FIXED, "slots": True}, "slots"),
    ],
)
def test_bad_givens_are_refused_in_one_line(small: catalogue.Catalogue, wish: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidRequest, match=says) as error:
        small.find(LINE, **wish)
    assert "\n" not in str(error.value)
