"""Answers to a tighter request, refined without a search."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue, Request, StraightLine
from catalogue.candidates.feasibility import cost, feasibility
from catalogue.find.find import find
from catalogue.find.follow import followed
from catalogue.find.starts import start_batch
from catalogue.guides.results import Found

WANTED: dict[str, Any] = {"limit": 4, "fixed_pivots_in": (-150, -100, 250, 100)}


def request(deviation: float, **more: Any) -> Request:
    return Request.of(StraightLine(150, deviation), **{**WANTED, **more})


@pytest.fixture(scope="module")
def tighter(small: Catalogue) -> Found:
    return find(small, request(0.3))


def test_known_answers_within_the_gap_are_refined_and_none_gets_worse(tighter: Found) -> None:
    problem = request(0.4).problem
    known = start_batch(problem, tighter)
    found = followed(problem, known)
    assert found is not None
    assert feasibility(problem, found).all.all()
    assert cost(problem, found).min() <= cost(problem, known).min()


@pytest.mark.parametrize(
    "other",
    [
        {"limit": 12},  # more than there are
        {"fixed_pivots_in": (-20, -20, 170, 20)},  # outside
        {"rank_by": "max_arm"},  # of which no least value is known
        {"rank_by": ("size", "transmission")},
        {"effort": 2},
    ],
)
def test_known_answers_that_do_not_suffice_are_left_to_a_search(tighter: Found, other: dict[str, Any]) -> None:
    problem = request(0.4, **other).problem
    assert followed(problem, start_batch(problem, tighter)) is None


def test_no_search_is_run_where_known_answers_suffice(tighter: Found, small: Catalogue) -> None:
    """The best answer is at least as good as the best known one, judged as it is shown."""
    wanted = request(0.4)
    found = find(small, wanted, tuple(tighter), warm=True, follow=True)
    assert found.explanation.report.eligible == 0
    assert find(small, wanted, tuple(tighter), warm=True).explanation.report.eligible > 0
    assert len(found) == 4
    assert found.cost is not None
    known = start_batch(wanted.problem, tighter)
    assert found.cost <= float(np.min(cost(wanted.problem, known))) + 1e-4
