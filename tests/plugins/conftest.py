"""What the tests of the built-in series share: golden cases, and the laws of the deviation for short strokes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue.curvature_theory.instant import Instant
from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.guidance.trace import trace
from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.types import Array
from catalogue.series.series import Guided, Member, Series
from catalogue.testing.base import apart

CASES = Path(__file__).parents[1] / "golden" / "series_cases.json"
#: Half strokes at which a law is measured, times the square of the point's distance from the pole if that is below 1.
HALVES = (0.04, 0.02, 0.01)
#: Deviation of u^m on [-1, 1] from the best line, from the best circle (a parabola).
LINE = {3: 0.125, 4: 0.5, 5: 0.326444, 6: 0.5}
CIRCLE = {5: 0.326444, 6: 3**-1.5}


@pytest.fixture(scope="session")
def cases(golden: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the golden cases of series, with the placed pivots of the golden mechanisms of the same `id`.

    `parameters` are those of our members, in the canonical frame, whose unit is `unit` (1 if missing) times `scale`;
    `guided` are pairs in that frame with their order of contact, `residuals` those of membership by series.
    """
    by_id = {case["id"]: case for case in golden}
    read: list[dict[str, Any]] = json.loads(CASES.read_text("utf-8"))
    return [{**by_id[case["id"]], "golden_series": None, **case} for case in read]


@pytest.fixture(scope="session")
def golden_members(cases: list[dict[str, Any]]) -> Callable[[Series], int]:
    """Return a check of a series' synthesis, guided pairs, orders and residuals, which returns the number of cases."""

    def check(series: Series) -> int:
        mine = [case for case in cases if case.get("parameters") and case["series"] == series.code]
        for case in mine:
            member = member_with(series, case["family"], case["parameters"])
            free = {p.name: np.array([case["parameters"][p.name]]) for p in member.parameters}
            unit = case.get("unit", 1.0)
            origin = complex(*(case["pole"] or case["origin"]))
            placed = Linkage(member.synthesise(free)).moved(unit * case["scale"] * complex(*case["x_axis"]), origin)
            expected = Linkage(case["pivots"])
            assert np.all(apart(placed.pivots[0], expected.pivots[0]) < 1e-9), case["id"]
            residual, _ = series.classify(Instant(expected))
            assert residual[0] < 1e-9, case["id"]
            guided = list(series.guided(member.complete(free)))
            for pair, order in ((np.array(g["pair"]), g["order"]) for g in case["guided"]):
                there = [g for g in guided if apart(g.pairs, pair) < 1e-9]
                assert [int(np.max(g.order)) for g in there] == [order], (case["id"], pair.tolist())
        return len(mine)

    return check


@pytest.fixture(scope="session")
def golden_residuals(cases: list[dict[str, Any]]) -> Callable[[Series], int]:
    """Return a check of a series' residual on the mechanisms of all series, which returns their number."""

    def check(series: Series) -> int:
        mine = [case for case in cases if series.code in case["residuals"]]
        linkage = Linkage([case["pivots"] for case in mine])
        residual, _ = series.classify(Instant(linkage))
        there = ~np.isnan(residual)
        np.testing.assert_allclose(
            residual[there], np.array([case["residuals"][series.code] for case in mine])[there], rtol=1e-9, atol=1e-12
        )
        return int(there.sum())

    return check


@pytest.fixture(scope="session")
def law() -> Callable[..., Array]:
    """Return a measure of the deviation, over the finite motion, against |c| h^m: ratios for shorter and shorter h."""

    def measure(series: Series, key: str, free: Mapping[str, float], label: str, m: int, c: float) -> Array:
        member = series.member(key)
        linkage = Linkage(member.synthesise({name: np.array([value]) for name, value in free.items()}))
        (guide,) = [g for g in series.guided(member.complete(free)) if g.label == label]  # type: ignore[arg-type]  # arrays as parameters
        linkage, point, circle = motion_of(linkage, guide)
        guides = coupler_curve(linkage, point, np.longdouble)
        limit = (CIRCLE if circle else LINE)[m] * abs(c)
        ratios = []
        for half in np.array(HALVES) * min(1.0, abs(point[0]) ** 2 or 1.0):
            traced = trace(guides, np.array([half], dtype=np.longdouble), circle=circle, split=False)
            ratios.append(float(traced.fit.deviation[0]) / (limit * half**m))
        return np.array(ratios)

    return measure


def motion_of(linkage: Linkage, guide: Guided) -> tuple[Linkage, Array, bool]:
    """Return the motion in which a guide is a point on a path, the point, and whether the path is a circle."""
    fixed, moving = guide.pairs[:, 0], guide.pairs[:, 1]
    slot = bool(moving[0, 2] == 0)
    x, y, w = (fixed if slot else moving)[0]
    return linkage.inverted() if slot else linkage, np.array([(x + 1j * y) / w]), not slot and bool(fixed[0, 2] != 0)


def member_with(series: Series, family: str, parameters: Mapping[str, float]) -> Member:
    """Return the first member of that family whose free parameters are among the given ones."""
    return next(m for m in series.members if m.family == family and {p.name for p in m.parameters} <= {*parameters})


@pytest.fixture(scope="session")
def tends_to_one() -> Callable[[Array], bool]:
    """Return a test of ratios to a law: the error falls with the stroke, at least in proportion, to a few per cent."""

    def test(ratios: Array) -> bool:
        error = np.abs(ratios - 1)
        print("ratios to the law:", ratios)
        return bool(error[-1] < 0.05 and np.all((error[1:] < 0.7 * error[:-1]) | (error[1:] < 1e-3)))

    return test
