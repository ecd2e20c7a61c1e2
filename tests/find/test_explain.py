"""What an empty answer advises is followed, and an answer is found."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue, CircularArc, Found, StraightLine
from catalogue.candidates.batch import Origin, measured
from catalogue.find.explain import Explanation, _widened, rounded
from catalogue.find.find import is_answered
from catalogue.kinematics.linkage import Linkage
from catalogue.problem.constraints import Constraints
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking
from catalogue.search.starts import SearchReport

Ask = Callable[..., Found]
LEAD, TAIL = "no guide found; tested remedies: ", "; a smaller change may suffice"
LINE = StraightLine(150, 0.05)
#: A strip without a lower end.
BELOW = (-5, -np.inf, 5, -100)


def advised(told: str) -> list[dict[str, Any]]:
    """Return each relaxation that an explanation offers, as keywords of `find`; None: to be left out."""
    (line,) = [line for line in told.splitlines() if line.startswith(LEAD) and line.endswith(TAIL)]
    offers = []
    for offer in line.removeprefix(LEAD).removesuffix(TAIL).split(", or "):
        changes: dict[str, Any] = {}
        for one in offer.split(" with "):
            match = re.fullmatch(r"(without )?--([a-z-]+)((?: -?(?:inf|[\d.e+-]+))*)(?: \(asked [^)]*\))?", one.strip())
            assert match, one
            name, values = match[2].replace("-", "_"), [float(v) for v in match[3].split()]
            changes[name] = None if match[1] else values[0] if len(values) == 1 else values
        offers.append(changes)
    return offers


EMPTY: list[tuple[Any, dict[str, Any]]] = [
    (StraightLine(150, 0.0005), {"max_size": 170, "min_transmission": 70, "pins_only": True}),
    (LINE, {"max_size": 149, "pins_only": True}),
    (StraightLine(100, 0.01), {"pins_only": True, "swept_in": (-40, -70, 140, 70)}),
    (StraightLine(90, 0.045, along=-90), {"pins_only": True, "fixed_pivots_in": BELOW, "max_size": 110}),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("request_", "wanted"), EMPTY, ids=str)
def test_who_follows_the_advice_finds_an_answer(ask: Ask, request_: Any, wanted: dict[str, Any]) -> None:
    empty = ask(request_, **wanted)
    assert not empty
    told = empty.explain()
    assert "0 answers" in told
    assert re.search(r"\n  --[a-z-]+ is violated by [1-9]\d* of \d+ refined candidates\n", told)
    offers = advised(told)
    assert 1 <= len(offers) <= 3
    for changes in offers:
        relaxed = {name: value for name, value in {**wanted, **changes}.items() if value is not None}
        asked = replace(request_, deviation=relaxed.pop("deviation", request_.deviation))
        assert (asked, relaxed) != (request_, wanted)
        assert ask(asked, limit=1, **relaxed), (told, changes)


@pytest.mark.slow
def test_no_relaxation_is_searched_twice(small: Catalogue, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that could not be reduced was searched again to confirm what the first search had said."""
    empty = small.find(StraightLine(150, 0.001), max_size=120, min_transmission=50, pins_only=True)
    searched: list[Problem] = []

    def answered(database: Any, problem: Problem) -> bool:
        searched.append(problem)
        return is_answered(database, problem)

    monkeypatch.setattr("catalogue.find.find.is_answered", answered)
    assert advised(empty.explain())
    assert searched
    assert len({repr(one) for one in searched}) == len(searched)


@pytest.mark.slow
def test_of_pairs_the_one_that_is_relaxed_least_is_offered_first(ask: Ask) -> None:
    """And none by twenty times the deviation where another helps."""
    asked = StraightLine(40, 2.17e-4)
    empty = ask(asked, families=["four-bar"], max_size=57.9, min_transmission=85, min_link=26.8)
    offers = advised(empty.explain())
    assert {len(one) for one in offers} == {2}
    assert set(offers[0]) == {"max_size", "min_transmission"}
    assert all(one.get("deviation", 0) < 20 * asked.deviation for one in offers)


def parallelogram(small: Catalogue, request_: StraightLine, cranks: float, point: complex) -> Explanation:
    """Return what is told of a search in which a parallelogram came nearest; its cranks and point in strokes."""
    problem = Problem.of(request_, Constraints(pins_only=True), Ranking())
    pivots = np.ones((1, 2, 2, 3))
    pivots[0, :, :, :2] = [[[0.0, -cranks], [0.0, 0.0]], [[1.0, -cranks], [1.0, 0.0]]]
    linkage = Linkage(pivots)
    nothing = np.full(1, complex(np.nan, np.nan))
    nearest = measured(problem, Origin.made(linkage, "parallel"), linkage, np.array([point]), nothing)
    return Explanation(small.database, problem, request_, SearchReport(nearest=nearest), 0)


@pytest.mark.slow
def test_what_is_too_large_though_no_size_was_asked_for_is_said(small: Catalogue) -> None:
    """The nearest is a parallelogram with cranks of 200 strokes: straight enough, but larger than is looked for."""
    request_ = StraightLine(10, 1e-2)
    told = str(parallelogram(small, request_, 200.0, 0.5 + 1j).advice())
    ((name, size),) = advised(told)[0].items()
    assert name == "max_size"
    assert 2000 < size < 2500
    assert told.removesuffix(TAIL).endswith("(asked none: 1000 at most)")
    assert small.find(request_, pins_only=True, limit=1, max_size=size)


@pytest.mark.parametrize("stroke", [0.15, 150.0])
def test_what_a_deviation_that_is_tried_gives_is_within_it_and_makes_use_of_it(small: Catalogue, stroke: float) -> None:
    told = parallelogram(small, StraightLine(stroke, 1e-9 * stroke), 1.0, 0.5 + 0j)
    nearest = told.report.nearest
    assert nearest is not None
    bound = 0.01 * stroke * nearest.deviation[0]
    answers = told._answers({"deviation": bound}, nearest)
    assert answers is not None
    assert (stroke * answers.deviation <= bound).all()
    assert stroke * answers.deviation.max() > 0.1 * bound


@pytest.mark.slow
def test_a_relaxation_relaxes(ask: Ask) -> None:
    """Bounds are given on the side that is looser than what was asked."""
    request_, wanted = EMPTY[0]
    for changes in advised(ask(request_, **wanted).explain()):
        for name, value in changes.items():
            asked = request_.deviation if name == "deviation" else wanted[name]
            assert value < asked if name.startswith("min_") else value > asked


@pytest.mark.slow
def test_a_side_at_infinity_stays_there(ask: Ask) -> None:
    request_, wanted = EMPTY[-1]
    (box,) = [one["fixed_pivots_in"] for one in advised(ask(request_, **wanted).explain()) if "fixed_pivots_in" in one]
    assert box[1] == -np.inf
    assert np.isfinite([box[0], *box[2:]]).all()


@pytest.mark.slow
def test_a_relaxation_far_from_what_was_asked_is_sought_nearer(ask: Ask) -> None:
    """A thousandth of the stroke is answered; the nearest point of the search for a trillionth deviated by 200 times
    as much."""
    request_, wanted = StraightLine(100, 1e-11), {"pins_only": True, "max_size": 130}
    ((name, least),) = advised(ask(request_, **wanted).explain())[0].items()
    assert name == "deviation"
    assert least < 0.1


@pytest.mark.slow
def test_the_deviation_that_is_advised_is_little_more_than_is_needed(ask: Ask) -> None:
    wanted: dict[str, Any] = {"fixed_pivots": [(30, -100), (120, -100)], "limit": 1}
    request_ = StraightLine(150, 0.01)
    ((name, least),) = advised(ask(request_, **wanted).explain())[0].items()
    assert name == "deviation"
    assert ask(replace(request_, deviation=least), **wanted)
    assert not ask(replace(request_, deviation=0.8 * least), **wanted)


@pytest.mark.parametrize(
    ("request_", "wanted", "says"),
    [
        (LINE, {"families": ["elliptic-trammel"], "slots": True}, "--family elliptic-trammel with --slots"),
        (LINE, {"series": ["IV.l"], "order": 30}, "--series IV.l with --order 30"),
        (CircularArc(1, 0.01, 2), {"families": ["oldham"], "returns": True}, "--family oldham with --returns"),
    ],
    ids=str,
)
def test_what_the_catalogue_does_not_hold_is_said(ask: Ask, request_: Any, wanted: dict[str, Any], says: str) -> None:
    told = ask(request_, **wanted).explain()
    assert f"no guide found: none is stored for {says} and such a path; leave one of them out" in told


@pytest.mark.parametrize(
    ("wanted", "says"),
    [
        ({"families": ["elliptic-trammel"], "pins_only": True}, "no elliptic-trammel has two dyads of pins"),
        (
            {"families": ["oldham", "elliptic-trammel"], "full_rotation": True},
            "no oldham or elliptic-trammel has a crank",
        ),
        ({"families": ["elliptic-trammel"], "min_advantage": 1}, "no elliptic-trammel has a crank"),
        (
            {"families": ["slider-crank"], "fixed_pivots": (0, 0.5, 1, 1)},
            "no slider-crank has two fixed pivots at finite distance",
        ),
    ],
    ids=str,
)
def test_what_no_family_has_is_said(ask: Ask, wanted: dict[str, Any], says: str) -> None:
    constraint = [*wanted][-1].replace("_", "-")
    told = ask(LINE, refine=False, **wanted).explain()
    assert f"no guide found: {says}, which --{constraint} asks for; leave one of them out" in told


def test_of_guides_as_they_are_stored_the_bound_is_named(ask: Ask) -> None:
    told = ask(LINE, refine=False, families=["elliptic-trammel"], max_travel=1e-3).explain()
    assert re.search(r"none of \d+ stored reaches meets --max-travel as it is; leave --no-refine out", told)


@pytest.mark.slow
def test_steps_take_time_and_do_not_overlap(small: Catalogue) -> None:
    """Of a Pareto search, which runs one search for each criterion, all are counted, none twice."""
    start = time.perf_counter()
    found = small.find(LINE, rank_by=["size", "balance"], limit=3, families=["four-bar"])
    whole = time.perf_counter() - start
    assert found.explanation is not None
    seconds = found.explanation.report.seconds
    assert {"starts", "refine", "verify"} <= set(seconds)
    assert all(s >= 0 for s in seconds.values())
    assert sum(seconds.values()) <= whole


@pytest.mark.parametrize("room", [0.0, 0.02])
def test_a_bound_that_is_advised_is_met_and_has_four_digits(room: float) -> None:
    for value in 10 ** np.random.default_rng(1).uniform(-9, 9, 500):
        least, most = rounded(value, room, up=False), rounded(value, room, up=True)
        assert least is not None
        assert most is not None
        assert least <= value * (1 - room)
        assert most >= value * (1 + room)
        assert most - least < (2 * room + 0.003) * value
        for bound in (least, most):
            assert bound == float(f"{bound:.3e}")
    assert rounded(1.0, 1.0, up=False) is None


def test_a_box_that_is_advised_holds_what_was_asked_and_all_places() -> None:
    """With room on all sides, in the unit and the frame of who asks."""
    request_ = StraightLine(50, 0.1, (30.0, -20.0), 25.0)
    problem = Problem.of(request_, Constraints(fixed_pivots_in=(10, 20, 15, 30)), Ranking())
    places = np.array([0.2 + 0.3j, -1 + 2j])
    x0, y0, x1, y1 = _widened(problem, "fixed_pivots_in", places, 0.1).box
    there = 30 - 20j + 50 * np.exp(1j * np.radians(25)) * places
    assert x0 <= min(10, there.real.min() - 5 + 1e-3)
    assert y0 <= min(20, there.imag.min() - 5 + 1e-3)
    assert x1 >= max(15, there.real.max() + 5 - 1e-3)
    assert y1 >= max(30, there.imag.max() + 5 - 1e-3)
