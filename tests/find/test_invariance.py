"""What should not matter to a search does not: the same answers, up to the transformation of the request."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from catalogue import CircularArc, Found, StraightLine
from catalogue.problem.path import PathRequest

pytestmark = pytest.mark.slow

LINE, ARC = StraightLine(150, 0.05), CircularArc(100, 0.05, 80)
#: Bounds that several answers reach, so that penalties decide.
BOUNDED = {"min_transmission": 40, "pins_only": True, "limit": 6}


def same(one: Found, other: Found) -> None:
    """Assert that two lists hold the same designs in the same order, to the last digit."""
    assert len(one) > 0
    assert [c.pivots for c in one] == [c.pivots for c in other]
    assert [c.guided for c in one] == [c.guided for c in other]


@pytest.mark.slow
@pytest.mark.parametrize(("request_", "plain"), [(LINE, "size=1,transmission=0.5"), (ARC, "transmission=1")])
def test_scale_of_weights_changes_no_answer(ask: Callable[..., Found], request_: PathRequest, plain: str) -> None:
    def scaled(by: float) -> dict[str, float]:
        return {name: by * float(weight) for name, weight in (part.split("=") for part in plain.split(","))}

    expected = ask(request_, rank_by=plain, **BOUNDED)
    for by in (1e-3, 700.0):
        same(expected, ask(request_, rank_by=scaled(by), **BOUNDED))


Box = tuple[float, float, float, float]
#: Where fixed pivots must stand, to one side of the path and off its middle; a zone to keep out of, above it.
REGION: Box = (-160, -300, 250, -20)
ZONE: Box = (-50, 20, 30, 60)
ROOMY = {"pins_only": True, "max_size": 500.0, "limit": 6}


def told(found: Found) -> list[tuple[float, ...]]:
    """Return what does not depend on where and in which unit answers stand."""
    assert len(found) > 0
    return [(c.size / c.stroke, 1e3 * c.deviation / c.stroke, c.min_transmission, c.score or 0.0) for c in found]


def alike(one: Found, other: Found) -> None:
    """Assert that two lists hold the same designs in the same order, wherever they stand."""
    expected, found = told(one), told(other)
    assert len(found) == len(expected)
    for here, there in zip(found, expected, strict=True):
        assert here == pytest.approx(there, rel=1e-5)


def seen(box: Box, length: float, *, across: bool = False, along: bool = False) -> Box:
    """Return a box in mirrors across the middle of a path from (0, 0) to (length, 0) and along it."""
    x0, y0, x1, y1 = box
    x0, x1 = (length - x1, length - x0) if across else (x0, x1)
    return (x0, -y1, x1, -y0) if along else (x0, y0, x1, y1)


@pytest.mark.parametrize(("across", "along"), [(True, False), (False, True)])
def test_a_mirror_changes_no_answer(ask: Callable[..., Found], across: bool, along: bool) -> None:
    expected = ask(StraightLine(150, 0.5), fixed_pivots_in=REGION, **ROOMY)
    region = seen(REGION, 150, across=across, along=along)
    found = ask(StraightLine(150, 0.5), fixed_pivots_in=region, **ROOMY)
    alike(expected, found)
    for c in found:
        for (x, y, _), _ in c.pivots:
            assert region[0] <= x <= region[2]
            assert region[1] <= y <= region[3]


def test_a_mirror_changes_no_answer_along_an_arc_nor_beside_a_zone(ask: Callable[..., Found]) -> None:
    one, other = (
        ask(CircularArc(100, 0.5, 120), fixed_pivots_in=seen((-50, -200, 140, -30), 100, across=across), **ROOMY)
        for across in (False, True)
    )
    alike(one, other)
    one, other = (
        ask(StraightLine(150, 0.5), keep_out=[seen(ZONE, 150, along=along)], **ROOMY) for along in (False, True)
    )
    alike(one, other)


@pytest.mark.parametrize(
    ("request_", "region", "size"),
    [
        (StraightLine(150, 0.5, (1000, -700)), (840, -1000, 1250, -720), 500.0),
        (StraightLine(150, 0.5, along=90), (20, -160, 300, 250), 500.0),
        (StraightLine(150 / 25.4, 0.5 / 25.4, unit="in"), tuple(x / 25.4 for x in REGION), 500 / 25.4),
        (StraightLine(1.5e302, 5e299), tuple(x * 1e300 for x in REGION), 5e302),
        (StraightLine(1.5e-298, 5e-301), tuple(x * 1e-300 for x in REGION), 5e-298),
    ],
    ids=["place", "direction", "unit", "huge", "tiny"],
)
def test_place_direction_and_unit_change_no_answer(
    ask: Callable[..., Found], request_: PathRequest, region: Box, size: float
) -> None:
    expected = ask(StraightLine(150, 0.5), fixed_pivots_in=REGION, **ROOMY)
    alike(expected, ask(request_, fixed_pivots_in=region, **{**ROOMY, "max_size": size}))


@pytest.mark.parametrize(
    "options",
    [
        {"families": ["four-bar", "slider-crank"], "series": ["I.GG", "II.xy"]},
        {"keep_out": [ZONE, (100, 30, 160, 90)]},
    ],
    ids=["names", "zones"],
)
def test_the_order_of_what_is_listed_changes_no_answer(ask: Callable[..., Found], options: dict[str, Any]) -> None:
    turned = {name: values[::-1] for name, values in options.items()}
    same(ask(LINE, limit=6, **options), ask(LINE, limit=6, **turned))


def test_the_order_of_constraints_changes_no_answer(ask: Callable[..., Found]) -> None:
    bounds = {"max_size": 400.0, "min_transmission": 40.0, "fixed_pivots_in": REGION}
    same(ask(LINE, limit=6, **bounds), ask(LINE, limit=6, **dict(reversed(bounds.items()))))
