"""Arcs near a half circle and beyond, traced along circuits: against dense samples of loops closed otherwise."""

from __future__ import annotations

import numpy as np
import pytest

from catalogue.find.measure import measure
from catalogue.guidance.best_circle import best_placed
from catalogue.guidance.minimum_zone import grid
from catalogue.guidance.uniform_fit import uniform_fit
from catalogue.guidance.wide_arc import along_circuits, traced_about
from catalogue.guides.own_guide import guide
from catalogue.kinematics.linkage import RR, Linkage
from catalogue.kinematics.types import Array
from tests import naive

ANGLES = [170, 180, 200, 270, 350]
FAMILIES = ["four-bar", "slider-crank", "inverted-slider-crank"]


def cranks(family: str, count: int, seed: int = 4) -> tuple[Linkage, Array]:
    """Return linkages with a crank of length 1 about the origin, and points near its end."""
    draw = np.random.default_rng(seed)

    def turned() -> Array:
        return np.asarray(np.exp(2j * np.pi * draw.random(count)))

    pin, second, other = turned(), draw.uniform(2, 5, count) * turned(), draw.uniform(2, 5, count) * turned()
    pivots = np.ones((count, 2, 2, 3))
    ends = np.stack([0 * pin, pin, second, second + other], axis=1).reshape(-1, 2, 2)
    if family == "slider-crank":
        ends[:, 1, 0], pivots[:, 1, 0, 2] = turned(), 0
    elif family == "inverted-slider-crank":
        ends[:, 1, 1], pivots[:, 1, 1, 2] = turned(), 0
    pivots[..., 0], pivots[..., 1] = ends.real, ends.imag
    return Linkage(pivots), pin + draw.uniform(0.02, 0.2, count) * turned()


@pytest.mark.slow
@pytest.mark.parametrize(("angle", "family"), [*zip(ANGLES, [*FAMILIES, *FAMILIES], strict=False)])
def test_deviation_and_ends_are_those_of_dense_samples(family: str, angle: float) -> None:
    linkage, point = cranks(family, 40)
    traced = traced_about(along_circuits(linkage, point), np.zeros(40, complex), np.full(40, 1.02), angle, 128, 512)
    good = np.flatnonzero(np.isfinite(traced.fit.deviation))
    assert len(good) > 8
    for i in good[:4]:
        way, phase = naive.way_through(linkage.pivots[i], complex(point[i]))
        deviation, *ends = naive.along_arc(way, phase, complex(traced.fit.centre[i]), 1.02, np.radians(angle))
        assert traced.fit.deviation[i] == pytest.approx(deviation, rel=3e-6)
        fit = traced.fit
        last = fit.start[i] + fit.stroke[i] * fit.along[i]
        told = sorted(ends, key=lambda end: abs(end - fit.start[i]))
        np.testing.assert_allclose(told, [fit.start[i], last], atol=3 * deviation)
        assert np.abs(np.abs(point[i] - fit.centre[i]) - 1.02) <= fit.deviation[i] * (1 + 1e-9)


@pytest.mark.parametrize("angle", ANGLES)
def test_the_nominal_goes_the_long_way_round(angle: float) -> None:
    linkage, point = cranks("four-bar", 20)
    traced = traced_about(along_circuits(linkage, point), np.zeros(20, complex), np.full(20, 1.02), angle)
    fit = traced.fit[np.flatnonzero(np.isfinite(traced.fit.deviation))]
    half = np.radians(angle / 2)
    np.testing.assert_allclose(fit.stroke, 2 * 1.02 * np.sin(half))
    np.testing.assert_allclose(fit.rise, 1.02 * (1 - np.cos(half)))
    np.testing.assert_allclose(np.abs(fit.start - fit.centre), 1.02)
    np.testing.assert_allclose(np.abs(fit.start + fit.stroke * fit.along - fit.centre), 1.02)
    assert fit.is_wide.all()


def test_a_parallelogram_is_exact_through_its_change_points() -> None:
    """Its motion goes straight on there; nothing but a guard leads it, so that no search offers it."""
    linkage = Linkage(np.array([[[[0, 0, 1], [0, 1, 1]], [[0.3, -0.8, 1], [0.3, 0.2, 1]]]]))
    point = np.array([0.7 + 0.4j])
    for angle in ANGLES:
        traced = traced_about(along_circuits(linkage, point), point - 1j, np.ones(1), angle)
        assert traced.fit.deviation[0] < 1e-13


@pytest.mark.slow
@pytest.mark.parametrize("angle", [170.0, 180.0, 250.0, 350.0])
def test_a_best_placed_circle_is_that_of_linear_programmes(angle: float) -> None:
    points, half = grid(128), np.radians(angle / 2)
    for seed in range(4):
        draw = np.random.default_rng(seed)
        waves = [(k, 0.02 * draw.normal(), draw.uniform(0, 6)) for k in range(2, 7)]

        def path(turn: Array, waves: list[tuple[int, float, float]] = waves) -> Array:
            return (2 + sum(a * np.cos(k * turn + b) for k, a, b in waves)) * np.exp(1j * turn)

        z = path(half * points.nodes)[:, None]
        found = best_placed(z, np.array([2.0]), np.array([0.02 + 0.01j]), points)
        want, _ = naive.off_arc(path(np.linspace(-half, half, 20001)), 2.0, 0j)
        assert found.deviation[0] == pytest.approx(want, rel=1e-5)


def test_fits_do_not_depend_on_their_neighbours() -> None:
    draw = np.random.default_rng(1)
    angle = np.linspace(-3, 3, 101)[:, None] + np.zeros(20)
    terms, values = np.stack([np.cos(angle), np.sin(angle)]), draw.normal(size=(101, 20))
    fit, error, _ = uniform_fit(terms, values)
    for i in range(20):
        alone, least, _ = uniform_fit(terms[..., [i]], values[:, [i]])
        np.testing.assert_allclose(alone[:, 0], fit[:, i], atol=1e-12)
        assert error[i] == pytest.approx(least[0], rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(("angle", "family"), [*zip((180, 270, 200), FAMILIES, strict=True)])
def test_no_arc_between_others_is_better_than_the_measured_one(family: str, angle: float) -> None:
    linkage, point = cranks(family, 6, seed=9)
    for i in range(6):
        one = guide(linkage[[i]], (point[i].real, point[i].imag))
        found = measure(one, radius=1.05, angle=angle, limit=1)
        some = along_circuits(linkage[[i]], point[[i]]).motion.circuits
        poses = [some.pose((some.phase + share * some.period)[None]) for share in np.linspace(0, 1, 90, endpoint=False)]
        placed = Linkage(np.concatenate([pose.linkages(some.linkage).pivots for pose in poses]))
        at = np.concatenate([pose.point(point[[i]])[0] for pose in poses])
        fit = traced_about(along_circuits(placed, at), np.zeros(90, complex), np.full(90, 1.05), angle).fit
        tried = np.nan_to_num(fit.deviation, nan=np.inf)
        assert len(tried) == 90
        best = int(np.argmin(tried))
        if np.isfinite([tried[best - 1], tried[best], tried[(best + 1) % 90]]).all():
            assert found[0].deviation <= tried.min() * (1 + 1e-4)
            assert found[0].arc_angle == angle


def test_cranks_that_turn_fully_are_among_those_that_are_tried() -> None:
    for family in FAMILIES:
        assert (cranks(family, 40)[0].dyads == RR).any(1).all()


@pytest.mark.slow
def test_no_deviation_is_told_of_a_few_places_alone() -> None:
    """Where the descent ends far from the best place its extremes are not those that decide: this
    stretch deviated by 0.0131 as told, by 0.718 in truth; the best of the loop's deviates by 0.04225."""
    pivots = [
        [[49.98328299554417, 1.8611600541074131, 1.0], [49.96750595534422, 56.37019856747902, 1.0]],
        [[49.99997799445526, -51.22947000995063, 1.0], [-0.9999955237666527, 0.002992063946201192, 0.0]],
    ]
    best = guide(pivots, (49.99991944607102, 50.04225400351685)).measure(radius=50, angle=180)[0]
    low, high = best._window
    curve, traced = best._traced()
    z = curve.motion.pose(np.linspace(low, high, 4001)[:, None]).point(curve.point)[:, 0]
    off = np.abs(np.abs(z - traced.fit.centre[0]) - 50).max()
    assert best.deviation == pytest.approx(off, rel=1e-5)
    assert best.deviation == pytest.approx(0.04225491, rel=1e-6)
