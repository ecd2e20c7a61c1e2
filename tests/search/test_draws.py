"""Starts are made of the families that suit what is asked."""

from __future__ import annotations

from typing import Any

import pytest

from catalogue import StraightLine
from catalogue.problem.constraints import Constraints
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking
from catalogue.search.draws import allowed
from catalogue.search.euler_savary import PINNED

LINE = StraightLine(1, 1e-3)


def asked(request: Any, **wanted: Any) -> Problem:
    return Problem.of(request, Constraints(**wanted), Ranking())


@pytest.mark.parametrize(
    ("wanted", "made"),
    [
        ({}, ["four-bar", "slider-crank"]),
        ({"pins_only": True}, ["four-bar"]),
        ({"families": ["slider-crank"]}, ["slider-crank"]),
        ({"families": ["slider-crank"], "pins_only": True}, []),
        ({"families": ["elliptic-trammel"]}, []),
        ({"series": ["II.xy"]}, []),
        ({"order": 4}, []),
        ({"slots": True}, []),
    ],
)
def test_only_what_is_asked_for_is_made(wanted: dict[str, Any], made: list[str]) -> None:
    assert allowed(asked(LINE, **wanted), PINNED) == made
