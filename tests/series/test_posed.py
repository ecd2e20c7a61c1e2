"""Closed answers to posed problems: they guide on the finite motion, and are as many as theory counts."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue.curvature_theory.instant import Instant
from catalogue.curvature_theory.leading_error import leading_error
from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.guidance.trace import extended
from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.types import Array
from catalogue.plugin.registry import Registry
from catalogue.series.posed import Posed, dual, unit
from tests.precision import EXTENDED, LONG

COUNT = 1000
#: What may be given.
GIVEN = ("fixed", "moving", "crank")
NAN = complex(np.nan, np.nan)


@pytest.fixture(scope="module")
def registry() -> Registry:
    return Registry()


def random_problems(given: str, path: str, n: int = COUNT, seed: int = 5) -> Posed:
    """Return problems of which every point is drawn from a normal distribution."""
    rng = np.random.default_rng(seed)
    centre, point, one, two = (rng.normal(size=n) + 1j * rng.normal(size=n) for _ in range(4))
    axis, none = unit(point - centre), np.full(n, NAN)
    return Posed(
        given, np.stack([one, two], axis=1), none if path == "slot" else point, none if path == "line" else centre, axis
    )


def posed(given: str, a: complex, b: complex, point: complex, centre: complex = NAN, axis: complex = 1j) -> Posed:
    """Return one problem."""
    along: Any = axis if np.isnan(centre) else unit(np.array(point - centre))
    return Posed(given, np.array([[a, b]]), *(np.array([z]) for z in (point, centre, along)))


def solutions(registry: Registry, problems: Posed) -> Iterator[tuple[str, Linkage, Array]]:
    """Yield the code of each series with its answers and the numbers of their problems."""
    for code, series in registry.series.items():
        pivots = series.answers(problems)
        linkage, good = Linkage.valid(pivots.reshape(-1, 2, 2, 3))
        if len(linkage):
            yield code, linkage, np.repeat(np.arange(len(pivots)), pivots.shape[1])[good]


def counted(registry: Registry, problems: Posed) -> Array:
    """Return how many real answers each problem has."""
    found = [which for _, _, which in solutions(registry, problems)]
    return np.bincount(np.concatenate(found) if found else np.zeros(0, int), minlength=len(problems.axis))


def off_nominal(linkage: Linkage, problems: Posed, which: Array, reach: Array) -> Array:
    """Return the farthest distances from the nominal over the windows +-reach along the path, in extended precision."""
    moving = linkage.inverted() if problems.path == "slot" else linkage
    point = (problems.centre if problems.path == "slot" else problems.point)[which]
    guides = extended(coupler_curve(moving, point))
    low, high = guides.window(-reach.astype(LONG), reach.astype(LONG))
    u, v = guides.path.window(low, high, np.linspace(-1, 1, 9))
    z = guides.point + (u + 1j * v) * guides.tangent
    if problems.path == "circle":
        centre = problems.centre[which]
        return np.asarray(np.abs(np.abs(z - centre) - np.abs(point.astype(np.clongdouble) - centre)).max(0))
    return np.asarray(np.abs(((z - point) * problems.axis[which].astype(np.clongdouble).conj()).real).max(0))


@pytest.mark.slow
@pytest.mark.parametrize("path", ["line", "circle", "slot"])
@pytest.mark.parametrize("given", GIVEN)
def test_every_answer_of_a_thousand_problems_is_guided_to_its_order_on_the_finite_motion(
    registry: Registry, given: str, path: str
) -> None:
    problems, least = random_problems(given, path), 4 if given == "crank" else 3
    for code, linkage, which in solutions(registry, problems):
        place = linkage.points
        held = place[:, 0] if given == "crank" else place[:, :, GIVEN.index(given)]
        assert (held == problems.pivots[which]).all(), f"{code} moved a given pivot"
        # a window in which the leading term is seen: neither so wide that the next one matters, nor lost in rounding
        moving = linkage.inverted() if path == "slot" else linkage
        point = (problems.centre if path == "slot" else problems.point)[which]
        law = leading_error(moving, point, circle=path == "circle", tolerance=1e-6)
        scale, room = np.minimum(linkage.size, 1.0), coupler_curve(moving, point).extent.min(0)
        with np.errstate(all="ignore"):
            reach = 0.5 * (1e-7 * scale / law.law(1.0)) ** (1 / law.power)
            reach = np.minimum(reach, np.minimum(2e-2 * scale, 0.1 * room))
            wide, narrow = (off_nominal(linkage, problems, which, f * reach) for f in (1.0, 0.5))
            slope = np.log2((wide / narrow).astype(float))
        seen = narrow > (1e-15 if EXTENDED else 1e-14) * scale  # else rounding hides it
        assert seen.mean() > 0.9, code
        assert np.quantile(slope[seen], 0.01) > least + 0.9, code
        assert (slope[seen] > least + 0.8).mean() > 0.995, code
        # pivots at a thousand times the place of the point carry too few digits: less may be said there than is true
        near = linkage.size < 1e3
        assert (law.order >= least)[near].all(), code
        assert near.mean() > 0.95, code


@pytest.mark.slow
@pytest.mark.parametrize("given", GIVEN)
@pytest.mark.parametrize("path", ["line", "circle", "slot"])
def test_answers_belong_to_the_series_that_gives_them(registry: Registry, given: str, path: str) -> None:
    for code, linkage, _ in solutions(registry, random_problems(given, path)):
        residual, _ = registry.series[code].classify(Instant(linkage))
        assert np.nanquantile(residual, 0.98) < 1e-8, code


@pytest.mark.parametrize(
    ("given", "path", "counts"),
    [
        ("fixed", "circle", {5: 0.18, 9: 0.22, 13: 0.60}),
        ("moving", "circle", {5: 0.18, 9: 0.22, 13: 0.60}),
        ("fixed", "line", {3: 0.43, 7: 0.57}),
        ("moving", "slot", {3: 0.43, 7: 0.57}),
        ("moving", "line", {3: 0.18, 5: 0.20, 7: 0.62}),  # the sheets of theory count two less: they leave out I.GG
        ("fixed", "slot", {3: 0.18, 5: 0.20, 7: 0.62}),
        ("crank", "line", {0: 0.40, 2: 0.60}),
        ("crank", "circle", {0: 0.45, 2: 0.55}),
    ],
)
def test_as_many_answers_are_real_as_theory_counts(
    registry: Registry, given: str, path: str, counts: dict[int, float]
) -> None:
    found = counted(registry, random_problems(given, path))
    share = {k: float((found == k).mean()) for k in np.unique(found)}
    assert share == pytest.approx(counts, abs=0.08)


def test_answers_of_a_problem_are_different_linkages(registry: Registry) -> None:
    problems = random_problems("fixed", "circle", 200)
    every = np.concatenate([s.answers(problems) for s in registry.series.values()], axis=1)[..., 1, :2]
    apart = np.abs(every[:, :, None] - every[:, None]).max(axis=(3, 4))
    apart[:, np.arange(apart.shape[1]), np.arange(apart.shape[1])] = np.nan
    assert np.nanmin(apart) > 1e-6


def test_a_naive_loop_traces_the_same_order(registry: Registry, naive: SimpleNamespace) -> None:
    problems, mp, steep = random_problems("fixed", "circle", 12), naive.mp, []
    with mp.workdps(50):
        for code, linkage, which in solutions(registry, problems):
            for pivots, k in zip(linkage.pivots, which, strict=True):
                loop = naive.Loop(pivots, complex(problems.point[k]), exact=True)
                drive, centre = "crank" if code == "parallel" else "coupler", mp.mpc(problems.centre[k])
                radius = abs(mp.mpc(problems.point[k]) - centre)
                wide, narrow = (abs(abs(loop.close(drive, mp.mpf(t)) - centre) - radius) for t in (1e-4, 5e-5))
                steep.append(float(mp.log(wide / narrow, 2)) if narrow else 9.0)
    assert len(steep) > 90
    assert np.median(steep) > 3.99
    assert np.quantile(steep, 0.1) > 3.9  # of some, the next term or the rounding of the pivots is seen


def test_the_inverse_problem_has_the_inverse_answers(registry: Registry) -> None:
    problems = random_problems("fixed", "line", 50)
    series = registry.series["II.xy"]
    assert series.solve is not None
    straight, back = series.answers(problems), registry.series["II*.xy"].answers(problems.inverted)
    np.testing.assert_array_equal(straight, back[..., ::-1, :])
    with np.errstate(invalid="ignore"):
        again = dual(dual(series.solve))(problems)
    assert again is not None
    np.testing.assert_allclose(again, straight, rtol=1e-12, atol=1e-12)


# -- data that are special -------------------------------------------------------------------------------------------
@pytest.mark.parametrize("size", [0.3, 1.0, 5.0])
def test_symmetric_fixed_pivots_give_roberts_linkages_of_order_five_to_a_line(registry: Registry, size: float) -> None:
    problem = posed("fixed", size * (-1 + 0.4j), size * (1 + 0.4j), 0j)
    found = {code: linkage for code, linkage, _ in solutions(registry, problem)}
    law = leading_error(found["I.GG"], np.zeros(len(found["I.GG"]), complex), circle=False, tolerance=1e-8)
    assert (law.order == 5).sum() == 2


def test_symmetric_fixed_pivots_give_linkages_of_order_five_to_a_circle(registry: Registry) -> None:
    problem = posed("fixed", -1 + 0j, 1 + 0j, 1.3j, -0.8j)
    found = {code: linkage for code, linkage, _ in solutions(registry, problem)}
    law = leading_error(found["I.GG"], np.full(len(found["I.GG"]), 1.3j), circle=True, tolerance=1e-8)
    assert (law.order >= 5).sum() >= 1
    assert np.abs(1.3j + law.normal / law.curvature + 0.8j)[law.order >= 5] == pytest.approx(0, abs=1e-9)


def test_centres_on_one_line_across_the_axis_give_parallel_cranks_of_order_four(registry: Registry) -> None:
    problem = posed("fixed", 1.0j, 2.3j, 0.7 + 0j, 0j)
    found = {code: linkage for code, linkage, _ in solutions(registry, problem)}
    assert "parallel" not in found  # its equations are singular there
    law = leading_error(found["IV.l"], np.array([0.7 + 0j]), circle=True, tolerance=1e-8)
    assert law.order.tolist() == [4]
    assert 0.7 + law.normal / law.curvature == pytest.approx(np.array([0j]), abs=1e-12)


@pytest.mark.parametrize("by", [3e5 * np.exp(0.4j), 2e-6 * np.exp(1.3j)])
def test_so_they_do_however_large_they_are_and_wherever_the_axis_points(registry: Registry, by: complex) -> None:
    problem = posed("fixed", 1.0j * by, 2.3j * by, 0.7 * by, 0j)
    (linkage,) = [linkage for code, linkage, _ in solutions(registry, problem) if code == "IV.l"]
    law = leading_error(linkage, np.array([0.7 * by]), circle=True, tolerance=1e-8)
    assert law.order.tolist() == [4]
    assert 0.7 + law.normal / law.curvature / by == pytest.approx(np.array([0j]), abs=1e-12)


@pytest.mark.parametrize(
    ("a", "b", "point", "centre", "lost", "kept"),
    [
        # the point on the circle through the centres: the pole would be at the point
        (1j, np.exp(0.25j * np.pi), 1 + 0j, -1 + 0j, {"III.KK"}, {"parallel"}),
        # centres on one line, askew: that circle has no middle, the parallel cranks no solution
        (1 + 1j, 2 + 2j, 0.7 + 0.1j, 0j, {"III.KK", "parallel"}, {"I.GG"}),
    ],
)
def test_degenerate_data_lose_just_the_answers_that_theory_says(
    registry: Registry, a: complex, b: complex, point: complex, centre: complex, lost: set[str], kept: set[str]
) -> None:
    found = {code for code, _, _ in solutions(registry, posed("fixed", a, b, point, centre))}
    assert not found & lost
    assert kept <= found


@pytest.mark.parametrize("given", GIVEN)
@pytest.mark.parametrize("path", ["line", "circle", "slot"])
def test_answers_turn_shift_and_grow_with_the_problem(registry: Registry, given: str, path: str) -> None:
    here = random_problems(given, path, 40)
    by, shift = 3 * np.exp(0.7j), 2 - 1j
    pivots, point, centre = (by * z + shift for z in (here.pivots, here.point, here.centre))
    there, solved = Posed(given, pivots, point, centre, unit(by) * here.axis), False
    for code, series in registry.series.items():
        before, after = (series.answers(one) for one in (here, there))
        z, moved = (one[..., 0] + 1j * one[..., 1] for one in (before, after))
        wanted = by * z + shift * before[..., 2]
        wanted = np.where(before[..., 2] == 0, unit(by) * z, wanted)
        near = 3e-9 * np.nanmax(np.abs(z), initial=1)
        np.testing.assert_allclose(moved, wanted, rtol=1e-9, atol=near, err_msg=code)
        solved |= bool(np.isfinite(before).any())
    assert solved


@pytest.mark.parametrize("given", GIVEN)
@pytest.mark.parametrize("path", ["line", "circle", "slot"])
def test_coincident_or_enormous_data_raise_nothing(registry: Registry, given: str, path: str) -> None:
    good = random_problems(given, path, 4)
    for pivots in (good.pivots * 0, good.pivots * 1e150, good.pivots[:, :1].repeat(2, 1)):
        problems = Posed(given, pivots, good.point, good.centre, good.axis)
        for series in registry.series.values():
            pivots_ = series.answers(problems)
            assert pivots_.shape[0] == 4
