"""Constraints that cannot be meant are refused in one line that names them; those that can are carried along."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from catalogue import InvalidRequest
from catalogue.problem.constraints import Constraints
from catalogue.quantities import DRIVE, LENGTHS

NUMBERS = [
    (math.nan, "finite number above zero, not nan"),
    (math.inf, "finite number above zero, not inf"),
    (0, "finite number above zero, not 0"),
    (-150, "finite number above zero, not -150"),
    ("long", "must be a number, not 'long'"),
    (1j, "must be a number, not 1j"),
]


@pytest.mark.parametrize(("value", "message"), NUMBERS)
@pytest.mark.parametrize("name", [*LENGTHS, *DRIVE])
def test_bounds_refuse(name: str, value: Any, message: str) -> None:
    with pytest.raises(InvalidRequest, match=f"^{name} .*{message}"):
        Constraints(**{name: value})


@pytest.mark.parametrize("angle", [-1, 90, 180, math.nan, math.inf, "steep", None])
@pytest.mark.parametrize("name", ["min_transmission", "min_transmission_turn"])
def test_transmission_angles_refuse(name: str, angle: Any) -> None:
    with pytest.raises(InvalidRequest, match=rf"^{name} must be "):
        Constraints(**{name: angle})


def test_a_transmission_angle_over_the_turn_asks_for_the_turn() -> None:
    assert Constraints(min_transmission_turn=30).full_rotation
    assert not Constraints(min_transmission=30).full_rotation


def test_links_must_leave_room() -> None:
    with pytest.raises(InvalidRequest, match="min_link 20 is above max_link 10"):
        Constraints(min_link=20, max_link=10)


@pytest.mark.parametrize("order", [-1, 3.5, "high", None])
def test_order_refuses(order: Any) -> None:
    assert Constraints(order=np.int64(3)).order == 3  # type: ignore[arg-type]  # a whole number, but no int
    with pytest.raises(InvalidRequest, match=r"^order must be (a whole number|at least 0), not"):
        Constraints(order=order)


@pytest.mark.parametrize(
    ("wish", "says"),
    [
        ({"fixed_pivots": ((0, 0), (0, 0))}, "coincide"),
        ({"fixed_pivots": ((0, 0), (0, np.nan))}, "not finite"),
        ({"fixed_pivots": (0, 1, 2)}, "two points"),
        ({"fixed_pivots": ((0,), (1,), (2,), (3,))}, "two points"),
        ({"crank": "here"}, "two points"),
        ({"fixed_pivots": (0, 0, 1, 1), "moving_pivots": (0, 0, 1, 1)}, "exclude one another"),
        ({"within": 1.0}, "within says"),
        ({"fixed_pivots": (0, 0, 1, 1), "within": -1.0}, "above zero"),
        ({"fixed_pivots": (0, 0, 1, 1), "slots": True}, "slots"),
        ({"slots": True, "returns": True}, "exclude one another"),
        ({"bolts": 3}, "unknown constraint: 'bolts'"),
    ],
)
def test_what_contradicts_itself_is_refused_in_one_line(wish: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidRequest, match=says) as error:
        Constraints.of(wish)
    assert "\n" not in str(error.value)


def test_active_names_what_is_set() -> None:
    assert Constraints().active() == []
    wanted = Constraints(families="four-bar", max_size=3, pivots_in=(0, 0, 1, 1), pins_only=True, min_transmission=40)
    assert wanted.active() == ["families", "pins_only", "pivots_in", "max_size", "min_transmission"]
    assert wanted.families == ("four-bar",)


def test_lengths_and_places_are_carried_and_nothing_else() -> None:
    wanted = Constraints(
        families="four-bar", order=4, max_size=30, min_link=2, min_allowance=0.5, min_transmission=40,
        max_rotation=90, min_advantage=0.2, play=0.1, fixed_pivots_in=(0, 1, 2, 5), keep_out=[(1, 1, 3, 4)],
    )  # fmt: skip
    there = wanted.carried(2j, 1 + 1j)
    doubled = ("max_size", "min_link", "min_allowance", "play")
    assert [getattr(there, n) for n in doubled] == [60, 4, 1, 0.2]
    same = ("families", "order", "min_transmission", "max_rotation", "min_advantage")
    assert [getattr(there, n) for n in same] == [getattr(wanted, n) for n in same]
    assert there.active() == wanted.active()
    # a quarter turn: x' = 1 - 2 y, y' = 1 + 2 x
    assert there.fixed_pivots_in.box == (-9, 1, -1, 5)
    assert there.keep_out[0].box == (-7, 3, -1, 7)
    given = Constraints(crank=((0, 0), (1, 2)), within=0.5).carried(2j, 1 + 1j)
    assert given.crank == ((1, 1), (-3, 3))
    assert given.within == 1
