"""Rails and slots of answers, followed again by loops closed in another way: where they lie, and how long they are."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue import Candidate, CircularArc, Found, StraightLine
from catalogue.problem.region import Region
from tests.find.conftest import Again, at_home

pytestmark = pytest.mark.slow

LINE, ARC = StraightLine(150, 0.5), CircularArc(150, 0.5, 200)
SLIDERS: dict[str, Any] = {"families": ["slider-crank", "inverted-slider-crank", "elliptic-trammel"], "per_series": 0}
Ask = Callable[..., Found]


@pytest.fixture
def slides(naive: SimpleNamespace) -> Callable[[Candidate], list[tuple[str, complex, complex]]]:
    """Return of each slide of an answer its kind, and the ends of its rail or slot in mid-stroke."""

    def followed(c: Candidate) -> list[tuple[str, complex, complex]]:
        pivots, guided = at_home(c)
        found: list[tuple[str, complex, complex]] = naive.Loop(pivots, guided).slides(c.stroke, 1201)
        return found

    return followed


@pytest.mark.slow
@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
def test_travel_and_size_are_those_of_the_second_measurement(
    ask: Ask, again: Callable[..., Again], request_: Any
) -> None:
    found = ask(request_, **SLIDERS)
    assert len({c.family for c in found}) > 1 or request_ is ARC  # of which the small catalogue holds sliders alone
    for c in found:
        there = again(c, request_.radius if request_ is ARC else None)
        assert c.travel == pytest.approx(there.travel, abs=1e-4 * c.size)
        assert c.size == pytest.approx(there.size, rel=3e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "kinds"), [("fixed_pivots_in", ("PR",)), ("pivots_in", ("PR", "RP"))])
def test_no_rail_leaves_the_box_of_the_pivots(
    ask: Ask, slides: Callable[..., Any], name: str, kinds: tuple[str, ...]
) -> None:
    """With pivots alone in the box rails once lay anywhere, and were worth most."""
    box = (-math.inf, -25, math.inf, 25) if name == "fixed_pivots_in" else (-60, -60, 260, 110)
    wish: dict[str, Any] = {name: box, "max_size": 500, "min_transmission": 35}
    request = StraightLine(200, 0.5)
    held = 0
    for c in [*ask(request, **wish), *ask(request, **wish, families=["slider-crank"], per_series=0)]:
        for kind, *ends in slides(c):
            if kind in kinds:
                held += 1
                for end in ends:
                    assert box[0] - 0.01 <= end.real <= box[2] + 0.01
                    assert box[1] - 0.01 <= end.imag <= box[3] + 0.01
    assert held or not len(ask(request, **wish, families=["slider-crank"], per_series=0))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["keep_out", "swept_in"])
def test_no_rail_runs_through_a_zone_or_out_of_the_room(ask: Ask, slides: Callable[..., Any], kind: str) -> None:
    """The zone lies where the rail of the best answer is, clear of its pivots in mid-stroke."""
    best = next(c for c in ask(LINE, families=["slider-crank"], per_series=0) if c.travel and c.travel > 10)
    ((_, a, b),) = slides(best)
    away = max((a, b), key=lambda end: abs(end - complex(*best.guided)))
    if kind == "keep_out":
        x, y = away.real, away.imag
        zone = (x - 3, y - 3, x + 3, y + 3)
        wish: dict[str, Any] = {"keep_out": [zone]}
        region = Region.of("zone", zone)
    else:
        side = 500.0
        room = (-side, -side, 150 + side, away.imag - 1) if away.imag > 0 else (-side, away.imag + 1, 150 + side, side)
        wish, region = {"swept_in": room}, Region.of("room", room)
    found = ask(LINE, families=["slider-crank"], per_series=0, **wish)
    assert len(found)
    for c in found:
        for _, one, other in slides(c):
            inside = region.holds(one + (other - one) * np.linspace(0, 1, 101))
            assert (inside == (kind == "swept_in")).all()


@pytest.mark.slow
def test_travel_is_bounded_and_told_what_it_would_have_to_be(ask: Ask) -> None:
    wish: dict[str, Any] = {"families": ["slider-crank"], "per_series": 0}
    free = [c.travel for c in ask(LINE, **wish)]
    bound = 0.5 * max(t for t in free if t is not None)
    found = ask(LINE, **wish, max_travel=bound)
    assert len(found)
    assert all(c.travel is not None and c.travel <= bound * (1 + 1e-9) for c in found)
    assert all(c.travel is None for c in ask(LINE, pins_only=True, max_travel=1e-3))
    none = ask(LINE, **wish, max_travel=1e-6, max_size=200)
    assert not len(none)
    assert "--max-travel" in none.explain()


@pytest.mark.slow
def test_the_first_answers_have_no_rail_that_could_guide_by_itself(ask: Ask) -> None:
    found = ask(StraightLine(150, 0.05))
    assert len(found) >= 10
    assert all((c.travel or 0.0) <= 75 for c in found[:10])
    assert any(c.travel for c in found)
    assert any(c.travel is None for c in found)
