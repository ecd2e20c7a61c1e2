"""Guides with given pivots."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue.errors import InvalidRequest

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
