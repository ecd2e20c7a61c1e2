"""Measures against loops over the positions, one linkage at a time."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from catalogue.guidance.coupler_curve import CouplerCurve, coupler_curve
from catalogue.guidance.metrics import _reach, best_turning_cranks, measure, rotates, rotation_margin
from catalogue.guidance.placement import placed
from catalogue.guidance.trace import Traced, trace
from catalogue.kinematics.linkage import FAMILIES, PR, RR, Linkage

Made = tuple[CouplerCurve, Traced]


def random_guides(random_linkages: Callable[..., Linkage], family: str, part: float) -> Made:
    """Return random guides of a family, traced over part of their extent."""
    draw = np.random.default_rng(1)
    linkage = random_linkages(family, 120, 3)
    guides = coupler_curve(linkage, draw.normal(size=120) + 1j * draw.normal(size=120))
    guides = guides[guides.extent.min(0) > 0.05]
    found = trace(guides, part * guides.extent.min(0), circle=False, split=False)
    good = np.isfinite(found.fit.deviation)
    return guides[good], found[good]


@pytest.fixture(params=list(FAMILIES))
def traced(request: pytest.FixtureRequest, random_linkages: Callable[..., Linkage]) -> Made:
    """Long strokes."""
    return random_guides(random_linkages, request.param, 0.4)


@pytest.fixture(params=list(FAMILIES))
def short(request: pytest.FixtureRequest, random_linkages: Callable[..., Linkage]) -> Made:
    """Strokes so short that the path is nearly straight."""
    return random_guides(random_linkages, request.param, 1e-3)


def poses(guides: CouplerCurve, found: Traced, share: Any) -> tuple[Any, Any]:
    d, x, _ = guides.motion.pose(found.low + (found.high - found.low) * np.asarray(share)[:, None])
    return d, x


@pytest.mark.slow
def test_transmission_angle_is_that_of_the_rays(traced: Made) -> None:
    """For each position: the angle at the driven pivot between the force and the direction in which it cannot move."""
    guides, found = traced
    d, x = poses(guides, found, np.linspace(0, 1, 201))
    expected = []
    for n, linkage in enumerate(guides.linkage):
        z, kind = linkage.points[0], linkage.dyads[0]
        per_driver = []
        for driver in (0, 1):
            if kind[driver] != RR and (kind == RR).any():
                continue
            least, driven = 90.0, 1 - driver
            for k in range(201):
                now = [z[i, 1] + d[k, n] + x[k, n] * (z[i, 1] - guides.motion.origin[n]) for i in (0, 1)]
                turned = [z[i, 1] * (1 + x[k, n]) for i in (0, 1)]
                ray = {0: now[driven] - z[driven, 0], 1: z[driven, 0], 2: turned[driven]}[kind[driven]]
                contact = z[driven, 0] if kind[driven] == 2 else now[driven]
                force = turned[driver] if kind[driver] == 2 else contact - now[driver]
                angle = abs(math.degrees(cmath.phase(force / ray)))
                least = min(least, angle, 180 - angle)
            per_driver.append(least)
        expected.append(max(per_driver))
    error = np.abs(measure(guides, found).min_transmission - expected)
    assert np.quantile(error, 0.9) < 0.05
    assert error.max() < 0.5  # beside a dead point, which 201 positions miss


def test_as_many_poses_are_read_as_an_angle_needs(traced: Made) -> None:
    """As of a slide that passes close by the pivot, and turns fast."""
    guides, found = traced
    few, many = measure(guides, found), measure(guides, found, poses=257)
    np.testing.assert_allclose(few.min_transmission, many.min_transmission, atol=0.01)
    assert np.isfinite(few.min_transmission).all()


@pytest.mark.slow
def test_least_transmission_angle_lies_between_the_poses(random_linkages: Callable[..., Linkage]) -> None:
    """A four-bar's angle is least where a crank comes in line with the frame: nowhere near a pose."""
    guides, found = random_guides(random_linkages, "four-bar", 0.3)
    t = found.low + (found.high - found.low) * np.linspace(0, 1, 20001)[:, None]
    d, x, _ = guides.motion.pose(t)
    z, origin = guides.linkage.points, guides.motion.origin
    one, other = (z[:, i, 1] + d + x * (z[:, i, 1] - origin) for i in (0, 1))
    driver = measure(guides, found).driver
    rod = np.where(driver == 2, other - one, one - other)
    crank = np.where(driver == 2, one - z[:, 0, 0], other - z[:, 1, 0])
    sine = np.abs((rod.conj() * crank).imag / np.abs(rod * crank))
    inner = (sine.argmin(0) > 200) & (sine.argmin(0) < 19800) & (sine.min(0) > 0.05)
    assert inner.sum() > 8
    error = np.abs(measure(guides, found).min_transmission - np.degrees(np.arcsin(sine.min(0))))[inner]
    assert np.median(error) < 1e-4
    assert error.max() < 0.01


def test_transmission_angle_is_0_where_a_dead_point_lies_on_the_way() -> None:
    """Crank 1 short, crank 2 long: led by the coupler's angle, the linkage passes dead points of either crank."""
    found = []
    for bar in (1.7, 2.0, 2.2):
        linkage = Linkage(four_bar(2.5, 1.0, bar, 1.2))
        point = linkage.points[:, 0, 1] + 0.5 * (linkage.points[:, 1, 1] - linkage.points[:, 0, 1])
        guides = coupler_curve(linkage, point)
        traced = trace(guides, 0.99 * guides.extent.min(0), circle=False, split=False)
        coarse, fine = measure(guides, traced), measure(guides, traced, poses=129)
        assert coarse.min_transmission[0] == pytest.approx(fine.min_transmission[0], abs=0.1)
        found.append(coarse.min_transmission[0])
    assert min(found) >= 0


def runs_of_slides(guides: CouplerCurve, found: Traced, naive: Any) -> list[list[tuple[bool, complex, complex]]]:
    """Return whether it is a rail, and its ends in mid-stroke, of each slide; the stroke runs along x about 0.

    A rail is where its moving pivot has been in the frame, a slot where its fixed pivot has been in the coupler.
    """
    d, x = poses(guides, found, np.linspace(0, 1, 101))
    every = []
    for n, linkage in enumerate(guides.linkage):
        origin, along = guides.motion.origin[n], found.fit.along[n]
        centre = found.fit.start[n] + found.fit.stroke[n] / 2 * along

        def carried(p: Any, d: Any, x: Any, origin: complex = origin) -> Any:
            return p + d + x * (p - origin)

        path = carried(guides.point[n] + found.shift[n], d[:, n], x[:, n])
        k = np.abs(((path - centre) / along).real).argmin()
        runs = []
        for (fixed, moving), kind in zip(linkage.points[0], linkage.dyads[0], strict=True):
            if kind == RR:
                continue
            if kind == PR:
                places = carried(moving, d[:, n], x[:, n])
            else:
                seen = [(fixed - e + y * origin) / (1 + y) for e, y in zip(d[:, n], x[:, n], strict=True)]
                places = carried(np.array(seen), d[k, n], x[k, n])
            one, other = naive.segment(places)
            runs.append((kind == PR, (one - centre) / along, (other - centre) / along))
        every.append(runs)
    return every


def test_lengths_and_boxes_are_those_of_the_placed_linkage(short: Made, naive: Any) -> None:
    guides, found = short
    stroke = found.fit.stroke
    m = measure(guides, found)
    linkage, _, _ = placed(guides, found, stroke)
    for n, runs in enumerate(runs_of_slides(guides, found, naive)):
        z, finite, kind = linkage.points[n], linkage.finite[n], linkage.dyads[n]
        links = [abs(z[i, 1] - z[i, 0]) for i in (0, 1) if kind[i] == RR]
        if finite[:, 1].all():
            links.append(abs(z[0, 1] - z[1, 1]))
        tight: dict[str, Any] = {"rel": 1e-9}
        # pivots in mid-stroke are interpolated
        rough: dict[str, Any] = {"abs": 1e-3 * float(guides.linkage.size[n] + stroke[n])}
        for name, value in (("max_link", max(links, default=math.nan)), ("min_link", min(links, default=math.nan))):
            assert getattr(m, name)[n] == pytest.approx(value, nan_ok=True, **tight)
        ground = abs(z[0, 0] - z[1, 0]) if finite[:, 0].all() else math.nan
        assert m.max_ground[n] == pytest.approx(ground, nan_ok=True, **tight)
        before = guides.linkage.points[n]
        arms = [abs(guides.point[n] - before[i, 1]) for i in (0, 1) if finite[i, 1]]
        assert m.max_arm[n] == pytest.approx(min(arms, default=math.nan), nan_ok=True, **tight)
        ends = [0, stroke[n], complex(stroke[n] / 2, 0)]
        every = [complex(z[i, k]) for i in (0, 1) for k in (0, 1) if finite[i, k]]
        travel = max((abs(one - other) for _, one, other in runs), default=math.nan)
        assert m.travel[n] == pytest.approx(travel, rel=1e-3, nan_ok=True)
        every += [end + stroke[n] / 2 for _, *slide in runs for end in slide]
        assert m.size[n] == pytest.approx(naive.diameter(every + ends), **rough)
        for planes, box in (((0,), m.fixed_box[n]), ((0, 1), m.box[n])):
            inside = [z[i, k] - stroke[n] / 2 for k in planes for i in (0, 1) if finite[i, k]]
            inside += [end for rail, *slide in runs if rail or 1 in planes for end in slide]
            if not inside:
                assert np.isnan(box).all()
                continue
            x, y = np.real(inside), np.imag(inside)
            expected = [x.min(), y.min(), x.max(), y.max()]
            np.testing.assert_allclose(box, expected, atol=rough["abs"])


def four_bar(ground: float, crank: float, coupler: float, rocker: float) -> list[Any]:
    """Return the pivots of a four-bar from its lengths, in a position it can take."""
    for phi in np.radians(np.arange(3, 360, 7)):
        a = crank * np.exp(1j * phi)
        away = abs(ground - a)
        if abs(coupler - rocker) < away < coupler + rocker:
            cosine = (away**2 + coupler**2 - rocker**2) / (2 * away * coupler)
            b = a + coupler * np.exp(1j * (np.angle(ground - a) + np.arccos(cosine)))
            return [[[0, 0, 1], [a.real, a.imag, 1]], [[ground, 0, 1], [b.real, b.imag, 1]]]
    raise AssertionError("no such linkage")


def test_cranks_that_turn_fully_are_those_of_grashof() -> None:
    draw = np.random.default_rng(4)
    made: list[list[list[list[float]]]] = []
    expected: list[int] = []
    while len(made) < 400:
        lengths = draw.uniform(0.2, 2, 4)
        if 2 * max(lengths) >= sum(lengths) or abs(2 * (max(lengths) + min(lengths)) - sum(lengths)) < 1e-3:
            continue
        ground, crank, _, rocker = lengths
        turns = max(lengths) + min(lengths) < sum(lengths) / 2
        shortest = min(lengths)
        made.append(four_bar(*lengths))
        expected.append(turns * ((shortest in (ground, crank)) + 2 * (shortest in (ground, rocker))))
    np.testing.assert_array_equal(rotates(Linkage(made)), expected)


def test_crank_of_a_slider_crank_turns_fully_if_the_coupler_reaches() -> None:
    draw = np.random.default_rng(5)
    made: list[list[list[list[float]]]] = []
    expected: list[int] = []
    for _ in range(200):
        crank, coupler, offset = draw.uniform(0.3, 1), draw.uniform(0.3, 2), draw.uniform(-1, 1)
        phi = draw.uniform(0, 2 * np.pi)
        a = crank * np.exp(1j * phi)
        if abs(a.imag - offset) >= coupler:
            continue
        b = complex(a.real + math.sqrt(coupler**2 - (a.imag - offset) ** 2), offset)
        made.append([[[0, 0, 1], [a.real, a.imag, 1]], [[0, 1, 0], [b.real, b.imag, 1]]])
        expected.append(int(coupler > crank + abs(offset)))
    np.testing.assert_array_equal(rotates(Linkage(made)), expected)
    # as the second dyad it is the second bit
    np.testing.assert_array_equal(rotates(Linkage(np.array(made)[:, ::-1])), 2 * np.array(expected))


def test_a_crank_that_turns_fully_drives_where_one_is_wanted(random_linkages: Callable[..., Linkage]) -> None:
    guides, found = random_guides(random_linkages, "four-bar", 0.3)
    turns = rotates(guides.linkage)
    better, wanted = (measure(guides, found, turning=turning) for turning in (False, True))
    lacking = 1 + rotation_margin(guides.linkage).argmax(1)
    np.testing.assert_array_equal(wanted.driver, np.choose(turns, [lacking, 1, 2, better.driver]))
    worse = wanted.driver != better.driver
    assert worse.sum() > 5
    assert (wanted.min_transmission[worse] < better.min_transmission[worse]).all()
    np.testing.assert_array_equal(wanted.min_transmission[~worse], better.min_transmission[~worse])


def test_the_size_is_that_of_the_whole_path_not_of_the_poses_that_are_read() -> None:
    share = -np.cos(np.pi * np.arange(17) / 16)
    centre, pivots = np.array([0.3, 0.2j]), np.array([[-1.0, np.nan], [0.2 + 1j, 1.5]])
    arcs = centre + np.array([0.6, 0.8]) * np.exp(1j * (0.11 + share[:, None] * np.array([0.9, 1.2])))
    dense = centre + np.array([0.6, 0.8]) * np.exp(
        1j * (0.11 + np.linspace(-1, 1, 20001)[:, None] * np.array([0.9, 1.2]))
    )
    far = [max(np.nanmax(np.abs(dense[:, i, None] - pivots[i])), np.abs(dense[0, i] - dense[-1, i])) for i in range(2)]
    assert _reach(arcs, pivots) == pytest.approx(far, rel=1e-6)


def test_the_crank_that_lacks_least_is_to_drive_before_it_turns(random_linkages: Callable[..., Linkage]) -> None:
    for family in ("four-bar", "slider-crank", "inverted-slider-crank", "elliptic-trammel"):
        linkage = random_linkages(family, 300, 8)
        margin, found = np.nan_to_num(rotation_margin(linkage), nan=-np.inf), best_turning_cranks(linkage)
        turns = rotates(linkage)
        np.testing.assert_array_equal(found[turns > 0], turns[turns > 0])
        swings = (turns == 0) & np.isfinite(margin).any(1)
        np.testing.assert_array_equal(found[swings], 1 + margin[swings].argmax(1))
        assert not found[np.isinf(margin).all(1)].any()
        assert swings.any() == (family != "elliptic-trammel")
