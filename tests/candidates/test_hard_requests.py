"""Constraints and costs of candidates, beside figures that share no formula with the catalogue.

The known linkages of the hard requests of `tests/benchmarks/recall_requests.json`, of which every constraint is met by
a hair, as `tests/benchmarks/independent_figures.py` has it.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue import CircularArc, Constraints, StraightLine
from catalogue.candidates.batch import CandidateBatch, Origin, measured
from catalogue.candidates.feasibility import cost, feasibility
from catalogue.guidance.drive import drive_metrics
from catalogue.kinematics.linkage import Linkage
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
REQUESTS = json.loads((BENCHMARKS / "recall_requests.json").read_text())
#: One of each group.
SOME = [*{entry["group"]: entry for entry in REQUESTS if entry["known"]}.values()]
#: What the 401 positions of the independent search miss of the largest distance from a path, relative.
MISSED = 1e-4


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The independent figures; their folder is on the path as long as a test runs."""
    monkeypatch.setattr(sys, "path", [str(BENCHMARKS), *sys.path])
    import independent_figures

    return independent_figures


def problem_of(entry: dict[str, Any], **changes: Any) -> Problem:
    """Return the problem of a request."""
    stroke, deviation = entry["stroke"], entry["deviation"]
    line = entry["kind"] == "straight-line"
    request = StraightLine(stroke, deviation) if line else CircularArc(stroke, deviation, entry["radius"])
    ranking = Ranking.of(request, entry["rank_by"], limit=1)
    return Problem.of(request, Constraints.of(entry["constraints"] | changes), ranking, 1, 1)


def known_of(entry: dict[str, Any], problem: Problem) -> CandidateBatch:
    """Return the known linkage of a request as a candidate."""
    pivots = np.array([entry["known"]["pivots"]], float)
    pivots[..., :2] /= np.where(pivots[..., 2:] != 0, entry["stroke"], 1)
    linkage, valid = Linkage.valid(pivots)
    assert valid.all()
    point = np.array([complex(*entry["known"]["guided"]) / entry["stroke"]])
    return measured(problem, Origin.made(linkage, "general"), linkage, point, np.full(1, complex(np.nan, np.nan)))


@pytest.mark.parametrize("entry", SOME, ids=lambda entry: entry["name"])
def test_known_linkage_meets_its_constraints(entry: dict[str, Any]) -> None:
    problem = problem_of(entry)
    amounts = feasibility(problem, known_of(entry, problem)).amounts
    assert {name: amount[0] for name, amount in amounts.items() if amount[0] > MISSED} == {}


@pytest.mark.slow
@pytest.mark.parametrize("entry", SOME[::2], ids=lambda entry: entry["name"])
def test_figures_are_those_of_independent_motion(entry: dict[str, Any], figures: Any) -> None:
    problem = problem_of(entry)
    found, stroke = known_of(entry, problem), entry["stroke"]
    turns = problem.constraints.full_rotation
    m = figures.measured(
        entry["known"]["pivots"], entry["known"]["guided"], stroke, circle=entry["kind"] == "circular-arc",
        radius=entry["radius"], turns=turns, tolerance=entry["deviation"], draws=4000,
    )  # fmt: skip
    got = found.measures
    assert found.deviation[0] == pytest.approx(m.deviation / stroke, rel=1e-3)
    assert got.size[0] == pytest.approx(m.size / stroke, rel=1e-4)
    assert got.min_transmission[0] == pytest.approx(m.transmission, abs=0.02)
    drive = drive_metrics(found.curve, found.traced, got)
    for name in ("rotation", "drive_angle", "uniformity", "advantage"):
        assert getattr(drive, name)[0] == pytest.approx(getattr(m, name), rel=1e-3, nan_ok=True)
    for name in ("max_link", "min_link", "max_arm", "travel"):
        value = getattr(m, name)
        assert np.nan_to_num(getattr(got, name)[0]) == pytest.approx((value or 0) / stroke, rel=1e-4)
    theirs = figures.cost(m, entry["rank_by"], stroke, turns, entry["deviation"])
    ours = float(cost(problem, found)[0])
    if entry["rank_by"] == "score":  # minus the logarithm, of what is drawn on one side
        assert np.exp(-ours) == pytest.approx(1 - theirs, rel=0.02)
    elif entry["rank_by"] != "deviation":
        assert ours == pytest.approx(theirs, abs=2e-4)
