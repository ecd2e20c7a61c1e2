"""Where coupler points run straightest, against all windows of a path sampled densely."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import minimize

from catalogue.guidance.cells import Curves
from catalogue.guidance.deviation_curve import from_circle
from catalogue.guidance.stretches import longest, straightest
from catalogue.guidance.windows import Search, Stretches
from catalogue.kinematics.circuits import OPEN, Circuits, circuits
from catalogue.kinematics.linkage import FAMILIES, Linkage
from catalogue.kinematics.types import Array

Maker = Callable[..., Linkage]
every_family = pytest.mark.parametrize("family", FAMILIES)


def drawn(linkage: Linkage, seed: int) -> tuple[Circuits, Array]:
    """Return the circuits of linkages, and a random coupler point for each."""
    draw = np.random.default_rng(seed)
    n = len(linkage)
    point = linkage.points[:, 0, 1] + linkage.size * (draw.normal(size=n) + 1j * draw.normal(size=n))
    found = circuits(linkage)
    return found, point[found.of]


def along(found: Circuits, point: Array, at: Stretches, count: int = 257) -> Array:
    """Return the points of the paths over stretches, (count, n)."""
    share = np.linspace(0, 1, count)[:, None]
    some = found[at.circuit]
    return np.asarray(some.pose(at.low + (at.high - at.low) * share).point(point[at.circuit]))


@pytest.mark.slow
@pytest.mark.parametrize("family", [*FAMILIES][::2])
def test_no_window_within_the_deviation_is_longer(random_linkages: Maker, naive: SimpleNamespace, family: str) -> None:
    linkage = random_linkages(family, 1, 91)
    found, point = drawn(linkage, 1)
    allowed = 0.003 * linkage.size[found.of]
    at = longest(found, point, allowed, circle=False)
    assert (at.deviation <= allowed[at.circuit]).all()
    for k in range(len(linkage)):
        here = point[found.of == k][0]
        best = max(naive.longest_stretch(way, closed, allowed[found.of == k][0])
                   for way, closed in naive.ways_round(linkage.pivots[k], here))  # fmt: skip
        assert at.stroke[found.of[at.circuit] == k].max() > 0.99 * best


@pytest.mark.slow
@every_family
def test_the_deviation_is_half_the_width_of_the_narrowest_strip(
    random_linkages: Maker, naive: SimpleNamespace, family: str
) -> None:
    found, point = drawn(random_linkages(family, 10, 92), 2)
    size = np.abs(found.linkage.points).max((1, 2))
    at = straightest(found, point, 0.2 * size, circle=False, count=2)
    good = at[np.flatnonzero(np.isfinite(at.deviation))]
    assert len(good.low) > 10
    for z, deviation, stroke in zip(along(found, point, good, 2001).T, good.deviation, good.stroke, strict=True):
        assert naive.straightness(z)[1] == pytest.approx(stroke, rel=1e-5)  # along the strip
        assert naive.strip_of(z) == pytest.approx(deviation, rel=1e-3, abs=1e-14 * stroke)


@pytest.mark.slow
@every_family
def test_no_window_of_the_same_stroke_is_straighter(
    random_linkages: Maker, naive: SimpleNamespace, family: str
) -> None:
    """Each circuit's own path, cut at 1000 places where windows of the stroke begin."""
    found, point = drawn(random_linkages(family, 3, 93), 3)
    stroke = 0.3 * np.abs(found.linkage.points).max((1, 2))
    at = straightest(found, point, stroke, circle=False)
    for k in range(len(found)):
        if found.kind[k] == OPEN:
            continue
        s = np.linspace(0, 2, 4001) * found.period[k]
        z = found[k : k + 1].pose(s[:, None]).point(point[k : k + 1])[:, 0]
        least = math.inf
        for first in range(0, 2000, 4):
            far = np.abs(z[first : first + 2000] - z[first])
            last = int(np.argmax(far >= stroke[k]))
            if last > 8:
                half, length = naive.straightness(z[first : first + last + 1 : max(1, last // 60)])
                least = min(least, half if length < 1.02 * stroke[k] else math.inf)
        ours = np.fmin.reduce(at.deviation[at.circuit == k], initial=math.inf)
        # the naive window is longer by up to a step, and read at 60 of its points
        assert ours <= 1.01 * least or math.isinf(least)


@pytest.mark.slow
def test_stretches_stay_on_open_circuits(random_linkages: Maker) -> None:
    """The nearer the swinging block is to infinity, the straighter a path: it stops where the circuit does."""
    linkage = random_linkages("swinging-block", 40, 94)
    found, point = drawn(linkage, 4)
    size = linkage.size[found.of]
    every = [
        longest(found, point, 0.01 * size, circle=False),
        longest(found, point, 0.01 * size, circle=False, count=1),
        straightest(found, point, size, circle=False),
    ]
    for at in every:
        assert at.low.min() >= 0
        assert at.high.max() <= 2 * np.pi * (1 + 1e-12)
    at_an_end = (every[0].low == 0) | (every[0].high == 2 * np.pi)
    assert at_an_end.sum() > 40


@pytest.mark.slow
def test_the_longest_stroke_within_a_deviation_has_that_deviation(random_linkages: Maker) -> None:
    linkage = random_linkages("four-bar", 60, 95)
    found, point = drawn(linkage, 5)
    allowed = 0.003 * linkage.size[found.of]
    at = longest(found, point, allowed, circle=False)
    assert np.nanmedian(at.deviation / allowed[at.circuit]) > 0.99
    at = at[np.flatnonzero(np.isfinite(at.deviation))]
    alone = replace(found[at.circuit], of=np.arange(len(at.low)))  # each as if it were a linkage of its own
    again = straightest(alone, point[at.circuit], at.stroke, circle=False)
    # of the stretches of each the best is as good as that which was found
    best = np.full(len(at.low), np.inf)
    np.fmin.at(best, again.circuit, again.deviation)
    assert (best <= 1.01 * at.deviation).mean() > 0.95


@pytest.mark.parametrize("flat", [0.03, 0.01, 0.001])
@pytest.mark.parametrize("bearing", [0.0, 0.7, 2.3])
def test_a_stretch_reaches_to_where_its_path_turns_back(flat: float, bearing: float) -> None:
    """A point of an elliptic trammel, e off the middle of its rod 2 r, runs on an ellipse of half axes r + e, r - e: so
    flat a one is within the deviation all the way from vertex to vertex."""
    pivots = np.array([[[1, 0, 0], [0.0, 0.6, 1]], [[0, 1, 0], [0.8, 0.0, 1]]])
    middle, half = 0.4 + 0.3j, 0.5
    found = circuits(Linkage(pivots[None]))
    point = np.full(len(found), middle + half * (1 - flat) * np.exp(1j * bearing))
    at = longest(found, point, np.full(len(found), half * flat), circle=False)
    assert at.stroke.max() == pytest.approx(2 * half * (2 - flat), rel=1e-3)


@pytest.mark.slow
def test_a_stretch_grows_along_a_ridge_of_its_deviation(naive: SimpleNamespace) -> None:
    """Both ends of the longest window of this path lie where two deviations are equal, so that it grows only if they
    move at different rates, between the directions of either and of both: 0.2 % were missed by eight directions."""
    pivots = np.array(
        [
            [[-0.3592814319399219, -1.269157261624653, 1], [-1.6173129789668814, -1.1328220905468267, 1]],
            [[-0.7019371436092747, -0.712238897015357, 0], [-1.0153675078183177, 0.3059202031542598, 1]],
        ]
    )
    here, allowed = 0.36187706683330423 - 0.5771549241709583j, 0.003
    found = circuits(Linkage(pivots[None]))
    at = longest(found, np.full(len(found), here), np.full(len(found), allowed), circle=False)
    best = max(naive.longest_stretch(way, closed, allowed) for way, closed in naive.ways_round(pivots, here))
    assert at.stroke.max() > 0.9995 * best


@pytest.mark.slow
def test_every_point_of_a_parallelogram_runs_on_circles_of_the_crank() -> None:
    linkage = Linkage(np.array([[[0, 0], [0.6, 0.8]], [[3, 0], [3.6, 0.8]]]))
    found = circuits(linkage)[:1]
    point = np.array([1.3 + 2.1j])
    for radius in (None, 1.0):
        at = straightest(found, point, np.array([1.5]), circle=True, radius=radius, count=1)
        assert at.deviation[0] < 1e-12
    wider = straightest(found, point, np.array([1.5]), circle=True, radius=1.1, count=1)
    assert wider.deviation[0] == pytest.approx(off_the_best_circle(along(found, point, wider)[:, 0], 1.1), rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("radius", [0.8, 3.0])
def test_an_arc_of_a_given_radius_is_the_best_placed_one_of_exactly_that_radius(
    random_linkages: Maker, radius: float
) -> None:
    found, point = drawn(random_linkages("four-bar", 12, 96), 6)
    at = straightest(found, point, np.full(len(found), 0.5), circle=True, radius=radius, count=1)
    good = at[np.flatnonzero(np.isfinite(at.deviation))]
    assert len(good.low) >= 8
    for z, deviation in zip(along(found, point, good).T, good.deviation, strict=True):
        assert off_the_best_circle(z, radius) == pytest.approx(deviation, rel=1e-3)
        off = from_circle(z, (z[0], z[-1]), radius, deviation)
        assert np.abs(off).max() == pytest.approx(deviation, rel=1e-3)


@pytest.mark.parametrize("wave", [0.3, 1e-2, 1e-5])
def test_the_curve_of_deviations_is_that_of_the_best_placed_circle(wave: float) -> None:
    """Of an arc that is far from its circle too, whose ends alone would place it badly."""
    turn = np.linspace(0.3, 1.9, 61)
    z = (2 + wave * (np.sin(5 * turn) + turn)) * np.exp(-1j * turn)
    off = from_circle(z, (z[0], z[-1]), 2.0, wave)
    assert np.abs(off).max() == pytest.approx(off_the_best_circle(z, 2.0), rel=1e-4)
    assert off.max() == pytest.approx(-off.min(), rel=1e-3)


def off_the_best_circle(z: Array, radius: float) -> float:
    """Return the largest distance of points from the best-placed circle of a radius: a search over its centre."""
    best = math.inf
    chord = z[-1] - z[0]
    for side in (1, -1):
        start = 0.5 * (z[0] + z[-1]) + side * 1j * chord / abs(chord) * math.sqrt(radius**2 - 0.25 * abs(chord) ** 2)

        def worst(c: Array) -> float:
            return float(np.abs(np.abs(z - complex(*c)) - radius).max())

        x = np.array([start.real, start.imag])
        for _ in range(3):
            x = minimize(worst, x, method="Nelder-Mead", options={"xatol": 1e-12, "fatol": 1e-14, "maxiter": 2000}).x
        best = min(best, worst(x))
    return best


@pytest.mark.slow
def test_many_circuits_are_searched_alike_without_threads(
    random_linkages: Maker, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, point = drawn(random_linkages("slider-crank", 200, 98), 8)
    assert len(found) > 256  # shared among threads
    stroke = 0.3 * found.linkage.size

    def searched() -> list[Stretches]:
        return [
            straightest(found, point, stroke, circle=False, count=1),
            longest(found, point, 0.01 * stroke, circle=False, count=1),
        ]

    expected = searched()

    def no_thread(_: object) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr("threading.Thread.start", no_thread)
    for one, other in zip(searched(), expected, strict=True):
        for name in ("circuit", "low", "high", "stroke", "deviation"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_a_curve_is_as_long_as_its_path(random_linkages: Maker) -> None:
    found, point = drawn(random_linkages("four-bar", 10, 93), 3)
    curves = Curves.of(found, point, np.arange(len(found)))
    assert np.abs(curves.s[0]).max() == 0
    assert np.allclose(curves.s[-1], found.period, rtol=1e-12)
    chords = np.abs(np.diff(curves.at(curves.s), axis=0)).sum(0)
    assert np.allclose(curves.length, chords, rtol=1e-12)
    s = np.linspace(0, 1, 20_001)[:, None] * found.period
    assert np.abs(curves.length / np.abs(np.diff(found.pose(s).point(point), axis=0)).sum(0) - 1).max() < 5e-3


@pytest.mark.slow
@pytest.mark.parametrize("quick", [False, True])
def test_a_window_is_moved_to_where_those_about_it_are_no_straighter(random_linkages: Maker, quick: bool) -> None:
    """Against 161 windows on either side, as far as it may go."""
    found, point = drawn(random_linkages("four-bar", 10, 95), 5)
    seek = Search(Curves.of(found, point, np.arange(len(found))), False, None, quick)
    start, by = seek.about(seek.places(seek.cells(0.2 * seek.curves.across), 3))
    at, _ = seek.moved(start, by)
    least = np.full(len(by), np.inf)
    for way in np.linspace(-1, 1, 323):
        beside = seek.measured(replace(start, low=start.low + way * by, high=start.high + way * by))
        least = np.fmin(least, beside.deviation)
    there = np.isfinite(least)
    assert there.sum() > 25
    assert (at.deviation[there] <= 1.001 * least[there]).all()


def test_windows_are_sought_in_different_parts_of_a_path(random_linkages: Maker) -> None:
    found, point = drawn(random_linkages("four-bar", 20, 95), 5)
    curves = Curves.of(found, point, np.arange(len(found)))
    seek = Search(curves, False, None, quick=False)
    at = seek.places(seek.cells(0.2 * curves.across), 4)
    apart = []
    for k in np.unique(at.circuit):
        begin = np.sort(np.interp(at.low[at.circuit == k], curves.s[:, k], curves.run[:, k]))
        apart += np.diff(begin, append=begin[0] + 1).tolist()
    assert len(apart) > 2.5 * len(np.unique(at.circuit))
    assert np.quantile(apart, 0.1) > 0.02  # of the path; a piece is 0.006 of it at most
