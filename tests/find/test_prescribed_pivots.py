"""Guides with given pivots: these stand exactly where they were given, and the path is that which was asked for."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue.errors import InvalidRequest
from catalogue.find.prescribed_pivots import solved
from catalogue.plugin.registry import Registry
from catalogue.problem.constraints import Constraints
from catalogue.series.posed import Posed, unit

pytestmark = pytest.mark.slow

Ask = Callable[..., catalogue.Found]
LINE = catalogue.StraightLine(1.0, 0.01)
ARC = catalogue.CircularArc(1.0, 0.01, 1.0)
FIXED = ((-0.3, 0.5), (1.1, -0.8))


def strays(c: catalogue.Candidate, naive: SimpleNamespace, request: Any) -> float:
    """Return the largest distance from the nominal, from a naive loop."""
    path = naive.Loop(c.pivots, complex(*c.guided)).over(1.0, 1501)
    assert path is not None
    if request.kind == "line":
        return float(np.abs(path.imag).max())
    centre = complex(0.5, -np.sqrt(request.radius**2 - 0.25))
    return float(np.abs(np.abs(path - centre) - request.radius).max())


@pytest.mark.slow
@pytest.mark.parametrize("by", [np.exp(0.4j), 3e5 * np.exp(0.4j), 2e-6 * np.exp(1.3j)])
def test_what_is_rounding_where_equations_are_singular_is_no_answer(naive: SimpleNamespace, by: complex) -> None:
    """As where both pivots stand across from the point: turned, as then nothing that vanishes is exactly 0."""
    point, series = np.array([0.7 * by]), Registry().series
    problem = Posed("fixed", np.array([[1.0j * by, 2.3j * by]]), point, np.zeros(1, complex), unit(point))
    given = [code for code, one in series.items() if np.isfinite(one.answers(problem)).all((2, 3, 4)).any()]
    built = solved(series.values(), problem, Constraints())
    assert set(built.series) == {"IV.l", "parallel"} < set(given)
    for pivots in built.linkage.pivots / np.array([abs(by), abs(by), 1]):
        path = naive.Loop(pivots, complex(point[0] / abs(by))).close("crank", np.array([-2e-3, -1e-3, 0, 1e-3, 2e-3]))
        assert np.abs(np.diff(path)).min() > 1e-4
        assert np.abs(np.abs(path) - 0.7).max() < 1e-9  # of its circle, order 3 or more


@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
def test_the_fixed_pivots_stand_exactly_where_they_were_given(ask: Ask, naive: SimpleNamespace, request_: Any) -> None:
    found = ask(request_, fixed_pivots=FIXED, rank_by="deviation", limit=8)
    assert len(found) >= 3
    for c in found:
        assert (c.pivots[0][0][:2], c.pivots[1][0][:2]) == (list(FIXED[0]), list(FIXED[1]))
        assert c.guided[0] == pytest.approx(0.5, abs=1e-6)
        assert c.id is None
        assert c.deviation <= request_.deviation
        # the naive path ends at x = 0 and 1, not where its feet on the arc do
        assert strays(c, naive, request_) == pytest.approx(
            c.deviation, rel=1e-3 if request_ is LINE else 5e-3, abs=1e-13
        )
    assert [c.deviation for c in found] == sorted(c.deviation for c in found)
    assert len({c.series for c in found}) > 1


def test_the_moving_pivots_stand_in_mid_stroke_where_they_were_given(ask: Ask, naive: SimpleNamespace) -> None:
    found = ask(LINE, moving_pivots=((0.2, 0.6), (0.9, 0.7)))
    assert len(found)
    for c in found:
        np.testing.assert_allclose(c.linkage.points[0, :, 1], [0.2 + 0.6j, 0.9 + 0.7j], atol=1e-9)
        assert c.guided[0] == pytest.approx(0.5, abs=1e-9)
        assert strays(c, naive, LINE) == pytest.approx(c.deviation, rel=1e-3)


def test_a_crank_stays_what_it_was(ask: Ask, naive: SimpleNamespace) -> None:
    # the crank of a guide that was found for its fixed pivots
    known = ask(LINE, fixed_pivots=FIXED, rank_by="deviation", limit=8)[0]
    crank = known.pivots[0][0][:2], known.pivots[0][1][:2]
    found = ask(LINE, crank=crank)
    assert len(found)
    for c in found:
        np.testing.assert_allclose(c.pivots[0], [[*crank[0], 1], [*crank[1], 1]], atol=1e-9)
        assert strays(c, naive, LINE) == pytest.approx(c.deviation, rel=1e-3)


@pytest.mark.parametrize(
    ("given", "request_"),
    [("crank", LINE), ("moving", LINE), ("fixed", LINE), ("crank", catalogue.CircularArc(1.0, 0.01, 1.2))],
    ids=["crank", "moving", "fixed", "crank of an arc"],
)
def test_what_is_given_of_a_good_guide_leads_to_one_as_good(ask: Ask, given: str, request_: Any) -> None:
    """Of a four-bar of the catalogue a crank, the moving or the fixed pivots are kept."""
    wish: dict[str, Any] = {"series": ["II.xy", "II*.xy"], "max_link": 2.0, "max_ground": 2.0, "min_transmission": 25}
    known = ask(request_, families=["four-bar"], limit=1, refine=False, **wish)[0]
    (a, a_), (b, b_) = ((tuple(p[:2]) for p in dyad) for dyad in known.pivots)
    kept = {"crank": {"crank": (a, a_)}, "moving": {"moving_pivots": (a_, b_)}, "fixed": {"fixed_pivots": (a, b)}}
    found = ask(request_, rank_by="deviation", limit=4, **kept[given])
    assert found[0].deviation <= max(1.5 * known.deviation, 1e-4)
    assert all(c.deviation <= request_.deviation for c in found)
    assert "completed along the path" in found.explain()


def test_given_pivots_stand_where_they_were_given_in_any_unit_and_frame(ask: Ask) -> None:
    one = ask(LINE, fixed_pivots=FIXED, rank_by="deviation", limit=8)
    request = catalogue.StraightLine(20.0, 0.2, start=(5.0, -3.0), along=90.0)
    # a quarter turn: x' = 5 - 20 y, y' = -3 + 20 x
    there = tuple((5 - 20 * y, -3 + 20 * x) for x, y in FIXED)
    other = ask(request, fixed_pivots=there, rank_by="deviation", limit=8)
    assert [c.series for c in other] == [c.series for c in one]
    for a, b in zip(one, other, strict=True):
        assert b.deviation == pytest.approx(20 * a.deviation, rel=1e-3, abs=1e-12)
        np.testing.assert_allclose([p[0][:2] for p in b.pivots], there, atol=1e-11)


@pytest.mark.slow
def test_a_crank_that_cannot_follow_is_said_so(ask: Ask) -> None:
    found = ask(LINE, crank=((-0.2, 0.6), (0.4, 0.2)))
    assert not len(found)
    assert "too short for the path" in found.explain()
    in_line = ask(LINE, crank=((0.5, -0.4), (0.5, 0.4)))
    assert not len(in_line)
    assert "in line with the arm" in in_line.explain()


def test_pivots_so_far_that_rounding_decides_are_refused(ask: Ask) -> None:
    with pytest.raises(InvalidRequest, match=r"\(1e\+09, 0\) is more than 10000 strokes from the path"):
        ask(LINE, moving_pivots=((1e9, 0), (0.8, 0.4)))
    for given in ({"moving_pivots": ((900.0, 0.1), (0.8, 0.4))}, {"fixed_pivots": ((0.2, 3e3), (0.8, 3e3))}):
        for c in ask(LINE, **given):
            assert np.abs(c.linkage.points[c.linkage.finite]).max() <= 1.0001e4


def test_an_arc_for_a_crank_needs_a_radius(ask: Ask) -> None:
    with pytest.raises(InvalidRequest, match="give the radius of the arc too, where a crank is given"):
        ask(catalogue.CircularArc(1.0, 0.01), crank=((0, 0), (0, 1)))


def test_a_tolerance_gives_guides_at_least_as_straight(ask: Ask) -> None:
    exact = ask(LINE, fixed_pivots=FIXED, rank_by="deviation", limit=1)[0]
    near = ask(LINE, fixed_pivots=FIXED, within=0.1, rank_by="deviation", limit=5)
    assert near[0].deviation <= exact.deviation
    for c in near:
        off = np.abs(c.linkage.points[0, :, 0] - np.array([complex(*p) for p in FIXED]))
        assert off.max() <= 0.1


def test_other_constraints_hold_too(ask: Ask) -> None:
    found = ask(LINE, fixed_pivots=FIXED, min_transmission=35, max_link=1.6, series="II.xy")
    assert len(found)
    assert all(c.min_transmission >= 35 and c.max_link is not None and c.max_link <= 1.6 for c in found)
    assert {c.series for c in found} == {"II.xy"}


def test_a_wish_without_answer_says_how_near_it_comes(ask: Ask) -> None:
    found = ask(catalogue.StraightLine(1.0, 1e-12), fixed_pivots=FIXED)
    assert not len(found)
    told = found.explain()
    assert "no guide found; tested remedies: --deviation " in told
    reached = float(told.split("--deviation ")[-1].split()[0])
    assert 1e-12 < reached < 0.01
    assert len(ask(catalogue.StraightLine(1.0, reached), fixed_pivots=FIXED))


def test_impossible_pivots_say_so(ask: Ask) -> None:
    found = ask(LINE, fixed_pivots=((500.0, 500.0), (501.0, 500.0)))
    assert not len(found)
    assert "no guide found" in found.explain()
