"""The instant from the placed pivots of every golden linkage, against 50- and 60-digit arithmetic."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest

from catalogue.curvature_theory.analysis import DEAD_POINT, PARALLEL, REGULAR, Curvature, curvature
from catalogue.curvature_theory.configuration import configuration
from catalogue.curvature_theory.dead_points import dead_points
from catalogue.kinematics.linkage import FAMILIES, Linkage
from catalogue.kinematics.types import Array

TOLERANCE = 1e-11
#: Where two pairs coincide rounding splits them by the root of the machine precision.
DOUBLE = 1e-7
Case = dict[str, Any]


class Golden:
    """The cases with their analysis: of a dead point the branch whose pole is the golden one."""

    def __init__(self, cases: list[Case]) -> None:
        self.cases = cases
        self.linkage = Linkage([case["pivots"] for case in cases])
        self.given = curvature(self.linkage)
        branches = dead_points(self.linkage)
        self.instants = [self._branch(i, branches) for i in range(len(cases))]

    def _branch(self, i: int, branches: Curvature) -> Curvature:
        if self.given.state[i] != DEAD_POINT:
            return self.given[i]
        both = branches[[2 * i, 2 * i + 1]]
        return both[int(np.nanargmin(np.hypot(*(both.pole - self.cases[i]["pole"]).T)))]

    def wrong(self, error: Any, least: int, tolerance: float = TOLERANCE) -> dict[str, float]:
        """Return the errors beyond the tolerance by case; an error of None means: nothing to compare."""
        found = {}
        for case, instant in zip(self.cases, self.instants, strict=True):
            value = error(case, instant)
            if value is not None:
                found[case["id"]] = float(value)
        assert len(found) >= least
        return {name: value for name, value in found.items() if not value < tolerance}


@pytest.fixture(scope="module")
def analysed(golden: list[Case]) -> Golden:
    return Golden(golden)


def chordal(one: Array, other: Array, centre: Array, unit: float) -> float:
    """Chordal distance of two points of the plane closed by one point at infinity; there the angle of the lines."""
    (p, at), (q, other_at) = (((z[:2] - z[2] * centre) / (unit if z[2] else 1), z[2]) for z in (one, other))
    if not at and not other_at:
        return float(abs(p[0] * q[1] - p[1] * q[0]))
    if not at or not other_at:
        finite = q if not at else p
        return float(1 / np.sqrt(1 + finite @ finite))
    return float(np.hypot(*(p - q)) / np.sqrt((1 + p @ p) * (1 + q @ q)))


def test_every_family_and_every_series_is_there(golden: list[Case]) -> None:
    assert {case["family"] for case in golden} == set(FAMILIES)
    series = Counter(case["series"] for case in golden)
    unstarred = {"I_GG", "I_Gy", "I_yy", "GENERIC", "P_parallel"}
    starred = {"II_ooo", "II_xoy", "II_yy", "II_x0", "II_xy", "II_y0", "III_KK", "III_Kx", "IV_lambda", "IV_x"}
    assert unstarred | starred | {name.replace("_", "*_") for name in starred} <= set(series)
    assert min(series.values()) >= 4


def test_families_are_recognised(analysed: Golden) -> None:
    assert analysed.linkage.family.tolist() == [case["family"] for case in analysed.cases]


def test_configurations_are_named(analysed: Golden) -> None:
    names = configuration(analysed.linkage, analysed.given)
    pairs = [
        (case["id"], name, case["configuration"])
        for case, name in zip(analysed.cases, names, strict=True)
        if "configuration" in case
    ]
    assert [pair for pair in pairs if pair[1] != pair[2]] == []
    assert {pair[1] for pair in pairs} >= {"PP", "XX", "DX", "DT", "VC", "VN", "TC", "dead-point", "equal", "single"}


def test_states_are_told_apart(analysed: Golden) -> None:
    expected = [
        PARALLEL if case["pole"] is None else DEAD_POINT if case.get("configuration") == "dead-point" else REGULAR
        for case in analysed.cases
    ]
    assert analysed.given.state.tolist() == expected
    assert min(Counter(expected).values()) > 20


def test_poles_are_met(analysed: Golden) -> None:
    def error(case: Case, instant: Curvature) -> Any:
        return None if case["pole"] is None else np.hypot(*(instant.pole[0] - case["pole"])) / case["scale"]

    assert analysed.wrong(error, least=260) == {}


def test_origins_of_parallel_transformations_are_met(analysed: Golden) -> None:
    def error(case: Case, instant: Curvature) -> Any:
        if "k" not in case:
            return None
        return np.hypot(*(instant.pole[0] - case["origin"])) / case["scale"]

    assert analysed.wrong(error, least=20) == {}


def test_axes_are_met(analysed: Golden) -> None:
    def error(case: Case, instant: Curvature) -> Any:
        x = np.array(case["x_axis"])
        off = instant.axes[0] - [x, [-x[1], x[0]]]
        if case["pole"] is None:  # parallel cranks: the axes of a half-turn are as good
            off = min(off, instant.axes[0] + [x, [-x[1], x[0]]], key=lambda v: np.abs(v).max())
        return np.abs(off).max()

    assert analysed.wrong(error, least=290) == {}


def test_diameters_of_the_inflection_circle_are_met(analysed: Golden) -> None:
    def error(case: Case, instant: Curvature) -> Any:
        return None if case["rho0"] is None else abs(instant.rho0[0] / case["rho0"] - 1)

    assert analysed.wrong(error, least=260) == {}
    parallel = [case["rho0"] is None for case in analysed.cases]
    assert np.isinf(analysed.given.rho0[parallel]).all()


@pytest.mark.parametrize("name", ["kappa", "kappa_star", "s"])
def test_parameters_of_the_cubics_are_met(analysed: Golden, name: str) -> None:
    def error(case: Case, instant: Curvature) -> Any:
        if name not in case:
            return None
        return abs(getattr(instant, name)[0] * case["rho0"] - case[name]) / max(1, abs(case[name]))

    assert analysed.wrong(error, least=230) == {}


@pytest.mark.parametrize("name", ["k", "k_star"])
def test_parameters_of_parallel_transformations_are_met(analysed: Golden, name: str) -> None:
    def error(case: Case, instant: Curvature) -> Any:
        if name not in case:
            return None
        return abs(getattr(instant, name)[0] / case["scale"] ** 2 - case[name]) / max(1, abs(case[name]))

    assert analysed.wrong(error, least=20) == {}


@pytest.mark.parametrize("name", ["undulation", "cuspidation"])
def test_undulation_and_cuspidation_are_met(analysed: Golden, name: str) -> None:
    def error(case: Case, instant: Curvature) -> Any:
        if not isinstance(case.get(name), list):
            return None
        return np.hypot(*(getattr(instant, name)[0] - case[name])) / case["scale"]

    assert analysed.wrong(error, least=150) == {}


@pytest.mark.parametrize("name", ["undulation", "cuspidation"])
def test_where_a_whole_circle_or_nothing_qualifies_there_is_no_point(analysed: Golden, name: str) -> None:
    def error(case: Case, instant: Curvature) -> Any:
        if not isinstance(case.get(name), str):
            return None
        words = {"circle": f"{name} all over", "none": f"no {name}"}[case[name]]
        return 1 - (np.isnan(getattr(instant, name)).all() and words in instant.reason[0])

    assert analysed.wrong(error, least=50) == {}


def test_principal_pairs_are_met(analysed: Golden) -> None:
    def error(case: Case, instant: Curvature) -> Any:
        if not case.get("pairs"):
            return None
        centre = np.array(case.get("origin", case["pole"]), dtype=float)
        worst = 0.0
        for pair in np.array(case["pairs"], dtype=float):
            off = [
                max(chordal(mine, golden, centre, case["scale"]) for mine, golden in zip(found, pair, strict=True))
                for found in instant.principal_pairs[0]
                if not np.isnan(found).any()
            ]
            worst = max(worst, min(off, default=np.inf))
        return worst if case["known"] != "double" else worst * TOLERANCE / DOUBLE

    assert analysed.wrong(error, least=220) == {}
    assert Counter(case.get("known") for case in analysed.cases)["double"] >= 6


def test_imaginary_pairs_are_nan(analysed: Golden) -> None:
    def error(case: Case, instant: Curvature) -> Any:
        if case.get("pairs") != [] or case["known"] != "all":
            return None
        return 1 - (np.isnan(instant.principal_pairs).all() and "imaginary" in instant.reason[0])

    assert analysed.wrong(error, least=15) == {}


def test_undetermined_pairs_are_nan(analysed: Golden) -> None:
    """Cyclic motions guide every point exactly; in II_yy, II*_yy both pairs fall into the pole, on a ray left open."""

    def error(case: Case, instant: Curvature) -> Any:
        if case.get("known") != "undetermined":
            return None
        return 1 - (np.isnan(instant.principal_pairs).all() and "undetermined" in instant.reason[0])

    assert analysed.wrong(error, least=24) == {}


def test_guided_points_of_parallel_cranks_lie_on_the_axis(analysed: Golden) -> None:
    """Series IV*: every coupler point of the x axis is an undulation point."""

    def error(case: Case, instant: Curvature) -> Any:
        if "guided" not in case or case["pole"] is not None:
            return None
        assert abs(instant.k_star[0]) < 1e-14 * case["scale"] ** 2
        return abs((np.array(case["guided"]) - instant.pole[0]) @ instant.axes[0, 1]) / case["scale"]

    assert analysed.wrong(error, least=5) == {}
