"""Every candidate is what it says and satisfies what was asked, measured again by a loop closed another way."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from catalogue import Candidate, Catalogue, CircularArc, Found, Linkage, StraightLine
from catalogue.query.candidate import COLUMNS

Again = Callable[[Candidate], Any]
#: The least that the second measurement resolves, in units of size: its loops are closed in extended precision.
RESOLVED = 1e-16
LINE = StraightLine(150, 0.05)
ARC = CircularArc(100, 100, 0.05)


def check(c: Candidate, request: StraightLine | CircularArc, again: Again, **wanted: Any) -> None:
    """Compare all that a candidate says with the second measurement, and with what was wanted."""
    a = again(c)
    clear = max(1e-2 * a.deviation, RESOLVED * a.size)
    assert abs(c.deviation - a.deviation) <= clear, (c.id, c.deviation, a.deviation)
    assert a.deviation <= request.deviation * (1 + 1e-3)
    assert c.stroke == request.stroke
    if isinstance(request, CircularArc):
        assert c.radius is not None
        assert a.radius == pytest.approx(c.radius, rel=1e-3 + 3 * a.deviation / c.radius)
        assert request.radius is None or c.radius == pytest.approx(request.radius, rel=2e-3)
        # the arc bulges to +y
        assert float(a.path[len(a.path) // 2].imag) > 0
    else:
        assert c.radius is None
        assert np.abs(a.path.imag.astype(float)).max() <= 2.01 * request.deviation
    assert np.all(np.diff(a.path.real.astype(float)) > 0), "the point runs forward"
    assert abs(complex(a.path[0]) - 0) < 3 * request.deviation
    assert abs(complex(a.path[-1]) - c.stroke) < 3 * request.deviation
    assert c.guided[0] == pytest.approx(c.stroke / 2, abs=1e-3 * c.stroke)

    for name, rel in (("max_link", 1e-9), ("max_ground", 1e-9), ("max_arm", 1e-9), ("size", 3e-3)):
        value = getattr(c, name)
        assert getattr(a, name) == pytest.approx(np.nan if value is None else value, rel=rel, nan_ok=True), name
        bound = wanted.get(name if name.startswith("max") else f"max_{name}")
        assert bound is None or value is None or value <= bound
    assert "min_link" not in wanted or not a.min_link < wanted["min_link"] * (1 - 1e-9)
    if not np.isnan(a.min_transmission):
        assert c.min_transmission == pytest.approx(a.min_transmission, abs=1.5)
    assert c.min_transmission >= wanted.get("min_transmission", 0)
    assert c.family == Linkage(c.pivots).family[0]
    assert not wanted.get("pins_only") or c.family == "four-bar"
    assert not wanted.get("full_rotation") or c.rotates
    assert c.order >= wanted.get("order", 0)
    for name, values in (("family", "families"), ("series", "series"), ("configuration", "configurations")):
        assert values not in wanted or getattr(c, name) in wanted[values]


LENGTHS = ("max_size", "max_link", "min_link", "max_ground", "max_arm")
WISHES: list[dict[str, Any]] = [
    {},
    {"families": ["four-bar"], "min_transmission": 45},
    {"families": ["slider-crank"]},
    {"families": ["inverted-slider-crank", "elliptic-trammel"]},
    {"series": ["II.xy", "IV*.l"], "max_size": 700},
    {"pins_only": True, "order": 4, "rank_by": "deviation"},
    {"full_rotation": True},
    {"min_link": 40, "max_link": 400, "rank_by": "max_link"},
    {"max_ground": 200, "max_arm": 150, "rank_by": "transmission"},
    {"rank_by": "size", "max_size": 600},
]


@pytest.mark.parametrize("request_", [LINE, StraightLine(2.0, 0.015), StraightLine(1e6, 0.02)], ids=repr)
@pytest.mark.parametrize("wish", WISHES, ids=str)
def test_straight_guides_are_what_they_say(
    small: Catalogue, again: Again, wish: dict[str, Any], request_: StraightLine
) -> None:
    scaled = {k: v * request_.stroke / 150 if k in LENGTHS else v for k, v in wish.items()}
    found = small.find(request_, limit=4, **scaled)
    assert found or request_.stroke != 150
    for c in found:
        check(c, request_, again, **scaled)


@pytest.mark.parametrize("request_", [ARC, CircularArc(10, 300, 1e-3), CircularArc(190, 100, 1.0)], ids=str)
@pytest.mark.parametrize("wish", WISHES[:6], ids=str)
def test_circular_guides_are_what_they_say(
    small: Catalogue, again: Again, wish: dict[str, Any], request_: CircularArc
) -> None:
    wish = {k: v for k, v in wish.items() if k != "max_size"}
    found = small.find(request_, limit=3, **wish)
    for c in found:
        check(c, request_, again, **wish)


@pytest.mark.parametrize(
    "request_", [StraightLine(150, 0.05), CircularArc(150, 200, 0.05)], ids=["straight slot", "circular slot"]
)
def test_slots_run_over_a_fixed_point(small: Catalogue, again: Again, request_: Any) -> None:
    """Seen from the coupler; the linkage itself is the inverse of what is shown, and of the family that is named."""
    found = small.find(request_, slots=True, limit=8)
    assert len(found) >= 4
    for c in found:
        m = again(c)
        assert m.deviation <= request_.deviation * 1.01
        assert m.deviation == pytest.approx(c.deviation, rel=1e-2, abs=1e-12 * c.stroke)
        assert m.min_transmission == pytest.approx(c.min_transmission, abs=0.2)
        assert c.linkage.inverted().family[0] == c.family
    points = {c.id for c in small.find(request_, limit=50)}
    assert not points & {c.id for c in found}


def test_no_guided_point_is_a_pivot(small: Catalogue) -> None:
    """The pin of a slider runs straight without being guided."""
    for c in small.find(StraightLine(150, 0.05), limit=100, per_series=0, rank_by="deviation"):
        assert c.max_arm is None or c.max_arm >= 0.05 * 150 * (1 - 1e-9)


def test_requests_find_what_there_is(small: Catalogue) -> None:
    """The checks above are of something: many answers of many series and families."""
    found = [c for wish in WISHES[:5] for c in small.find(LINE, limit=8, **wish)]
    assert len(found) > 35
    found += small.find(LINE, series="II*.xy", limit=3)
    assert {"four-bar", "slider-crank", "inverted-slider-crank", "elliptic-trammel"} <= {c.family for c in found}
    assert {"I.GG", "II.ooo", "II.xy", "II*.xy", "IV*.l"} <= {c.series for c in found}
    arcs = small.find(ARC, limit=12)
    assert len(arcs) == 12
    assert len({c.series for c in arcs}) >= 3


BOXES: list[tuple[dict[str, Any], Callable[[complex], bool]]] = [
    ({"fixed_pivots_in": (-200, -200, 350, 300)}, lambda z: -200 <= z.real <= 350 and -200 <= z.imag <= 300),
    ({"fixed_pivots_in": (-100, 30, 250, 800)}, lambda z: -100 <= z.real <= 250 and 30 <= z.imag <= 800),
    ({"fixed_pivots_in": (-900, -900, 0, 20)}, lambda z: -900 <= z.real <= 0 and -900 <= z.imag <= 20),
    (
        {"fixed_pivots_in": [(-400, 0), (500, 0), (50, 800)]},
        lambda z: z.imag > -1e-9 and 16 * abs(z.real - 50) < 9 * (800 - z.imag),
    ),
]


@pytest.mark.parametrize(("wish", "inside"), BOXES, ids=lambda v: str(v) if isinstance(v, dict) else "")
@pytest.mark.parametrize("planes", ["fixed", "all"])
@pytest.mark.parametrize("request_", [StraightLine(150, 0.2), CircularArc(150, 200, 0.2)], ids=["line", "arc"])
def test_pivots_stand_inside_the_region(
    small: Catalogue, again: Again, planes: str, wish: dict[str, Any], inside: Callable[[complex], bool], request_: Any
) -> None:
    if planes == "all":
        wish = {"pivots_in": wish["fixed_pivots_in"]}
    found = small.find(request_, limit=3, rank_by="size", effort=2, **wish)
    assert len(found) > 0 or planes == "all" or "(50" in str(wish) or request_.kind == "circle"
    for c in found:
        check(c, request_, again)
        a = again(c)
        stand = a.fixed if planes == "fixed" else a.fixed + a.moving
        assert all(inside(z) for z in stand), (c.id, stand)


def test_a_region_on_either_side_of_the_path_serves_as_well(small: Catalogue) -> None:
    """A straight guide may be laid four ways; its answer above the path is the mirror image of that below."""
    first = small.find(LINE, fixed_pivots_in=(-300, 10, 450, 900), rank_by="size", limit=5)
    assert len(first) == 5
    for box in ((-300, -900, 450, -10), (450, 10, -300, 900), (-300, -10, 450, -900)):
        other = small.find(LINE, fixed_pivots_in=box, rank_by="size", limit=5)
        assert [c.id for c in other] == [c.id for c in first]
        np.testing.assert_allclose([c.size for c in other], [c.size for c in first], rtol=2e-3)


def test_answers_do_not_depend_on_the_unit(small: Catalogue) -> None:
    """1 m and 1000 mm find the same guides."""
    one, other = (
        small.find(StraightLine(0.15 * k, 5e-5 * k), fixed_pivots_in=(-0.3 * k, -0.1 * k, 0.4 * k, 0.5 * k),
                   max_link=0.4 * k, min_transmission=35, limit=8)
        for k in (1.0, 1000.0)
    )  # fmt: skip
    assert len(one) > 3
    assert [c.id for c in one] == [c.id for c in other]
    np.testing.assert_allclose([1000 * c.size for c in one], [c.size for c in other], rtol=2e-3)


PRICE: dict[str, Callable[[Candidate], float]] = {
    "balance": lambda c: c.size / c.stroke - c.min_transmission / 90,
    "size": lambda c: c.size,
    "deviation": lambda c: c.deviation,
    "transmission": lambda c: -c.min_transmission,
    "max_link": lambda c: c.max_link or 0.0,
    "max_ground": lambda c: c.max_ground or 0.0,
    "max_arm": lambda c: c.max_arm or 0.0,
}


@pytest.mark.parametrize("criterion", PRICE)
@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
def test_answers_come_in_the_order_asked_for(small: Catalogue, request_: Any, criterion: str) -> None:
    found = small.find(request_, rank_by=criterion, limit=20, per_series=0, distinct=0)
    price = np.array([PRICE[criterion](c) for c in found])
    assert len(price) == 20
    slack = 1e-12 * request_.stroke if criterion == "deviation" else 1e-9 * np.abs(price).max()
    assert np.all(np.diff(price) >= -slack)


def test_a_mix_weighs_its_criteria(small: Catalogue) -> None:
    mix = small.find(LINE, rank_by="size=1,transmission=4", limit=20, per_series=0)
    price = [c.size / 150 + 4 * (1 - c.min_transmission / 90) for c in mix]
    assert price == sorted(price)
    assert mix[0].id != small.find(LINE, rank_by="size", limit=1)[0].id
    same = small.find(LINE, rank_by={"size": 2, "transmission": 8}, limit=20, per_series=0)
    assert [c.id for c in same] == [c.id for c in mix]


@pytest.mark.parametrize("criterion", PRICE)
def test_more_effort_never_makes_the_best_worse(small: Catalogue, criterion: str) -> None:
    best = [PRICE[criterion](small.find(LINE, rank_by=criterion, limit=1, effort=e)[0]) for e in (1, 2, 4)]
    slack = 1e-9 * abs(best[0]) + (1e-13 if criterion == "deviation" else 0)  # exact but for rounding
    assert best[1] <= best[0] + slack
    assert best[2] <= best[1] + slack


def test_limit_and_variety(small: Catalogue) -> None:
    plain = small.find(LINE, limit=12, per_series=0)
    varied = small.find(LINE, limit=12)
    two = small.find(LINE, limit=10, per_series=2)
    assert len(plain) == len(varied) == 12
    assert [c.id for c in small.find(LINE, limit=5, per_series=0)] == [c.id for c in plain][:5]
    assert max(Counter(c.series for c in varied).values()) <= 4
    assert set(Counter(c.series for c in two).values()) == {2}
    # where there is one series only, the bound gives way
    assert len(small.find(LINE, limit=12, per_series=2, series="II.xy")) == 12
    assert varied[0].id == plain[0].id


def test_same_question_same_answer(small: Catalogue) -> None:
    one, other = (small.find(LINE, limit=30, min_transmission=30).to_json() for _ in range(2))
    assert one == other
    ids = [c.id for c in small.find(LINE, limit=30)]
    assert len(set(ids)) == len(ids)


def test_tightening_a_constraint_only_takes_answers_away(small: Catalogue) -> None:
    """The best under a tighter constraint is not better than the best under a looser one."""
    for name, values in (("max_size", (900, 500, 300)), ("min_transmission", (10, 40, 70)), ("max_link", (500, 200))):
        prices = [[PRICE["balance"](c) for c in small.find(LINE, limit=1, effort=2, **{name: v})] for v in values]
        for looser, tighter in pairwise(prices):
            assert not tighter or tighter[0] >= looser[0] - 1e-9


def test_empty_answers_are_empty(small: Catalogue) -> None:
    found = small.find(LINE, max_size=10)
    assert isinstance(found, Found)
    assert len(found) == 0
    assert not found
    assert found.to_json() == "[]"
    assert found.to_pandas().empty
    assert list(found.to_pandas().columns) == list(COLUMNS)
