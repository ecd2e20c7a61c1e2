"""The allowance: the scatter of the pivots that leaves a path within its tolerance in 95 of 100."""

from __future__ import annotations

import importlib
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.candidates.batch import CandidateBatch, measure_traced, near_path, with_allowance
from catalogue.guidance import allowance as module
from catalogue.guidance.allowance import Reach, References, Zone, allowances, expected_deviation
from catalogue.guidance.allowance_slopes import slopes
from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.guidance.finite_scatter import finite_allowances, finite_expected
from catalogue.guidance.sensitivity import COUNT, displaced
from catalogue.problem.problem import Problem
from tests import naive

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from allowance import half_widths, is_capped, probability  # beside the command that measures more of them

FAMILIES = ["four-bar", "slider-crank", "inverted-slider-crank", "elliptic-trammel"]
#: Machines drawn: a share of 0.95 is then known to 0.0015, a tenth of what an allowance may be off; 4,000 leave 0.0034.
DRAWS = 20_000


def of_directions(nearness: Any) -> float:
    """Return the scatter at which paths that answer so in four directions are kept with 95 per cent."""
    half = module._directions()
    rates = nearness(np.concatenate([half, -half]))[None]
    none = np.zeros(rates.shape, int)
    return float(Reach(rates, none, np.zeros((*rates.shape, COUNT)), np.ones(rates.shape)).scatter()[0])


def test_directions_integrate_polynomials_up_to_degree_eleven() -> None:
    """The mean of even powers of a coordinate over the sphere in four dimensions; odd ones vanish."""
    half = module._directions()
    assert half.shape == (60, 4)
    np.testing.assert_allclose(np.linalg.norm(half, axis=1), 1)
    way = np.array([0.1, -0.7, 0.5, 0.3])
    way /= np.linalg.norm(way)
    for power, mean in ((2, 1 / 4), (4, 1 / 8), (6, 5 / 64), (8, 7 / 128), (10, 21 / 512)):
        assert np.mean((half @ way) ** power) == pytest.approx(mean, rel=1e-12)


def test_scatter_in_one_direction_is_that_of_a_normal_number() -> None:
    """Both sides end at 1: 1.95996 standard deviations; one side: 1.64485."""
    way = np.array([0.3, 0.2, -0.8, 0.4])
    way /= np.linalg.norm(way)
    assert of_directions(lambda u: np.abs(u @ way)) == pytest.approx(1 / 1.959964, rel=0.01)
    assert of_directions(lambda u: np.maximum(u @ way, 1e-9)) == pytest.approx(1 / 1.644854, rel=0.01)


def test_scatter_alike_in_all_directions_is_chi_distributed() -> None:
    assert of_directions(lambda u: np.ones(len(u))) == pytest.approx(1 / np.sqrt(9.487729), rel=1e-6)


def batches(small: Catalogue, request: Any, monkeypatch: pytest.MonkeyPatch, **wish: Any) -> tuple[Problem, Any]:
    """Return the problem of a request and its answers, before they are listed."""
    finding: Any = importlib.import_module("catalogue.find.find")
    seen: list[tuple[Problem, CandidateBatch]] = []
    plain = finding.candidates

    def spy(problem: Problem, *rest: Any) -> Any:
        seen.append((problem, rest[1].found))
        return plain(problem, *rest)

    monkeypatch.setattr(finding, "candidates", spy)
    small.find(request, **wish)
    return seen[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    "request_",
    [StraightLine(150, 0.05), CircularArc(radius=50, angle=270, deviation=0.3)],
    ids=["line", "wide arc"],
)
def test_expected_deviation_is_the_inverse_of_the_allowance(small: Catalogue, monkeypatch: Any, request_: Any) -> None:
    problem, found = batches(small, request_, monkeypatch, families=["four-bar"], limit=6)
    zone, compared = Zone(*problem.zone), 0
    for i in range(min(len(found), 12)):
        one = found[np.array([i])]
        asked = 1.7 * one.deviation[0] + 1e-4
        kept = allowances(asked, one.curve, one.traced, zone)
        if kept[0] < 0.0099 * one.measures.min_link[0]:
            compared += 1
            assert expected_deviation(kept[0], one.curve, one.traced, zone)[0] == pytest.approx(asked, rel=1e-4)
    assert compared > 3


REQUESTS = [
    (StraightLine(150, 0.05), {"families": ["four-bar"]}),
    (StraightLine(150, 0.05), {"families": ["slider-crank"]}),
    (CircularArc(100, 0.05, 80), {"families": ["four-bar"]}),
    (CircularArc(100, 0.05), {"families": ["four-bar"]}),
]
IDS = ["line", "slider", "arc", "any arc"]


@pytest.mark.slow
@pytest.mark.parametrize(("request_", "wish"), REQUESTS, ids=IDS)
def test_rates_by_tolerance_and_deviation_are_those_of_differences(
    small: Catalogue, request_: Any, wish: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A deviation grows as all distances do."""
    problem, found = batches(small, request_, monkeypatch, limit=6, per_series=0, **wish)
    monkeypatch.setattr(module, "ALLOWANCE", module.ALLOWANCE._replace(largest=np.inf))
    zone, asked, plain, part = Zone(*problem.zone), problem.deviation, module.response, 1e-4
    by = slopes(asked, found.curve, found.traced, zone)

    def kept(share: float = 1.0, times: float = 1.0) -> Any:
        def grown(*given: Any) -> Any:
            here = plain(*given)
            return replace(here, error=times * here.error, deviation=times * here.deviation)

        monkeypatch.setattr(module, "response", grown)
        return allowances(share * asked, found.curve, found.traced, zone, rough=True)

    higher = (kept(share=1 + part) - kept(share=1 - part)) / (2 * part * asked)
    np.testing.assert_allclose(by.by_tolerance, higher, rtol=0.01)
    grown = (kept(times=1 + part) - kept(times=1 - part)) / (2 * part * found.deviation)
    np.testing.assert_allclose(by.by_deviation, grown, rtol=0.01, atol=1e-3 * np.abs(higher).max())
    assert (by.by_deviation < 0).all()


@pytest.mark.slow
def test_rates_by_pivots_are_those_of_differences(small: Catalogue, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of sliders whose deviation is small, so that the sensitivities alone decide; half of them at least, others stand
    where two references change places."""
    request = StraightLine(150, 0.5)
    problem, found = batches(
        small, request, monkeypatch, limit=12, per_series=0, refine=False, families=["slider-crank"]
    )
    problem = replace(problem, constraints=replace(problem.constraints, min_allowance=1e-6))
    found = measure_traced(problem, found.origin, found.curve, found.traced)
    by = slopes(problem.deviation, found.curve, found.traced, Zone(*problem.zone), rough=False)
    moves = [k for k in range(COUNT) if k != 8]  # along the path nothing changes
    wanted, step = np.zeros((len(found), len(moves))), 1e-7
    for column, k in enumerate(moves):
        ends = []
        for sign in (1, -1):
            move = np.broadcast_to(sign * step * np.eye(COUNT)[k], (len(found), COUNT))
            linkage, point, good = displaced(found.linkage, found.point, move)
            assert good.all()
            ends.append(near_path(problem, found.origin, coupler_curve(linkage, point, chart=found.chart)))
        wanted[:, column] = (ends[0].allowance - ends[1].allowance) / (2 * step)
    error = np.abs(by.by_pivots[:, moves] - wanted).max(1) / np.abs(wanted).max(1)
    assert np.median(error) < 0.1, error


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_paths_keep_the_tolerance_in_95_of_100_machines_drawn_at_the_allowance(small: Catalogue, family: str) -> None:
    request = StraightLine(150, 0.05)
    for c in small.find(request, families=[family], limit=2, per_series=0):
        share = probability(c, request, DRAWS)
        assert c.kept_share == pytest.approx(share, abs=0.03)  # of a thousand machines
        if is_capped(c):  # no larger one is told
            assert share > 0.935
        else:
            assert share == pytest.approx(0.95, abs=0.015)


@pytest.mark.slow
def test_hundreds_of_references_as_strict_as_one_another_all_count() -> None:
    """They end the reach in 400 directions of four coordinates, against normal numbers that are drawn."""
    rng = np.random.default_rng(2)
    ways = np.zeros((1, 400, COUNT))
    ways[..., :4] = rng.normal(size=(1, 400, 4))
    ways /= np.linalg.norm(ways, axis=-1, keepdims=True)
    none = np.zeros((1, 400))
    found = References(none.astype(int), none, none, ways, np.zeros(1), np.zeros(1, bool))
    scatter = module.allowed(found, np.zeros(1), np.ones(1))[0]
    kept = np.abs(ways[0] @ rng.normal(size=(COUNT, 20_000)) * scatter).max(0) <= 1
    assert kept.mean() == pytest.approx(0.95, abs=0.005)


@pytest.mark.slow
def test_an_allowance_does_not_depend_on_the_other_guides_of_a_batch(small: Catalogue, monkeypatch: Any) -> None:
    """Arcs of any radius, of which some are near a half circle and others shallow."""
    problem, found = batches(small, CircularArc(100, 0.05), monkeypatch, limit=12, per_series=0, pins_only=True)
    zone = Zone(*problem.zone)
    together = allowances(problem.deviation, found.curve, found.traced, zone)
    for i in range(len(found)):
        one = found[np.array([i])]
        alone = allowances(problem.deviation, one.curve, one.traced, zone)
        assert alone[0] == pytest.approx(together[i], rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("family", ["oldham", "four-bar"])
def test_arcs_of_any_radius_keep_the_tolerance_in_95_of_100_machines(
    small: Catalogue, family: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    request = CircularArc(100, 0.05)
    wish: dict[str, Any] = {"families": [family], "limit": 4, "per_series": 0}
    for seed, c in enumerate(small.find(request, **wish)):
        share = probability(c, request, 6000, seed)
        assert share > 0.935
        assert is_capped(c) or share < 0.965
    problem, found = batches(small, request, monkeypatch, **wish)
    found, zone = with_allowance(problem, found), Zone(*problem.zone)
    for i in range(len(found)):
        one = found[np.array([i])]
        kept = finite_allowances(problem.deviation, one.curve, one.traced, zone)
        assert kept[0] == pytest.approx(found.allowance[i], rel=1e-6)
        expected = finite_expected(float(kept[0]), one.curve, one.traced, zone)[0]
        if kept[0] < 0.0099 * one.measures.min_link[0] or family == "oldham":
            assert expected == pytest.approx(problem.deviation, rel=0.05)


@pytest.mark.slow
def test_a_bounded_allowance_of_an_arc_of_any_radius_is_that_which_is_listed(small: Catalogue) -> None:
    found = small.find(CircularArc(100, 0.05), min_allowance=0.2, limit=4, per_series=0)
    assert len(found) > 0
    assert all((c.allowance or 0) >= 0.2 * (1 - 1e-6) for c in found)


@pytest.mark.slow
def test_the_best_uniform_fit_of_the_benchmark_is_the_narrowest_strip_and_annulus() -> None:
    share = 0.5 - 0.5 * np.cos(np.pi * np.arange(129) / 128)
    phase = np.arccos(2 * share - 1)
    bumps = np.random.default_rng(0).normal(size=(7, 3)) * 0.1
    off = sum(np.cos(k * phase)[:, None] * bump for k, bump in enumerate(bumps))
    strip = half_widths(100 * share[:, None] + 1j * off, StraightLine(100, 1))
    turn = np.exp(1j * (np.pi / 2 + np.arcsin(50 / 80) * (1 - 2 * share)))
    arcs = (80 + off) * turn[:, None]
    annulus = half_widths(arcs, CircularArc(100, 1))
    given = half_widths(arcs, CircularArc(100, 1, 80))
    for i in range(3):
        assert strip[i] == pytest.approx(naive.strip_of(100 * share + 1j * off[:, i]), rel=1e-9)
        assert annulus[i] == pytest.approx(naive.narrowest_annulus(arcs[:, i])[0], rel=1e-9)

        def farthest(centre: Any, arc: Any = arcs[:, i]) -> float:
            return float(np.abs(np.abs(arc - complex(*centre)) - 80).max())

        best = minimize(farthest, np.zeros(2), method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12})
        assert given[i] == pytest.approx(best.fun, rel=1e-6)
