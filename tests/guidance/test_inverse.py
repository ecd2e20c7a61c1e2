"""Machines with a slot, and points that return, against plain positions: nothing is inverted or differentiated here."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue.guidance.coupler_curve import CouplerCurve, coupler_curve
from catalogue.guidance.drive import DRIVE_GRID, SampledPoses, drive_metrics
from catalogue.guidance.metrics import measure, rotation_margin
from catalogue.guidance.swept_area import link_segments
from catalogue.guidance.trace import Traced, trace
from catalogue.kinematics.linkage import FAMILIES, RR, Linkage

Made = tuple[CouplerCurve, Traced]

#: How far a slide may stop, of its distance, from the last of 8,001 places of its pivot.
STOP = 1e-6


def steady(traced: Traced) -> Any:
    return np.isfinite(traced.fit.deviation) & (traced.fit.stroke > 0)


@pytest.fixture(params=list(FAMILIES))
def slots(request: pytest.FixtureRequest, random_linkages: Callable[..., Linkage]) -> Made:
    """Return inversions of random machines of a family, in mid-stroke; their guided points are pins in slots."""
    draw = np.random.default_rng(5)
    linkage = random_linkages(request.param, 60, 3).inverted()
    guides = coupler_curve(linkage, draw.normal(size=60) + 1j * draw.normal(size=60))
    guides = guides[guides.extent.min(0) > 0.05]
    traced = trace(guides, 0.3 * guides.extent.min(0), circle=False, split=False)
    good = steady(traced)
    return guides[good], traced[good]


def machine(guides: CouplerCurve, traced: Traced, n: int, count: int) -> SimpleNamespace:
    """Return positions of one machine in the plane of its own frame, by laying two marks of the frame on each other.

    The traced motion moves the frame over the coupler: two of its points, 0 and 1, tell where everything else is seen.
    """
    t = np.linspace(traced.low[n], traced.high[n], count)[:, None]
    d, x = (p[:, 0] for p in guides[n : n + 1].motion.pose(t)[:2])
    origin, z = guides.motion.origin[n], guides.linkage.points[n]
    zero, one = (p + d + x * (p - origin) for p in (0.0, 1.0))
    pin = guides.point[n] + d + x * (guides.point[n] - origin)

    def seen(p: Any, direction: bool = False) -> Any:
        return (p - (0 if direction else zero)) / (one - zero)

    finite = guides.linkage.finite[n]
    return SimpleNamespace(
        fixed=z[:, 1],
        moving=[seen(np.full(count, z[i, 0]), direction=not finite[i, 0]) for i in (0, 1)],
        dyads=[
            {(True, True): "crank", (False, True): "slide", (True, False): "slider"}[tuple(finite[i])] for i in (0, 1)
        ],
        on_slides=[p + d + x * (p - origin) for p in z[:, 1]],  # where the coupler sees fixed pivots
        seen=lambda p, k: seen(np.full(count, p))[k],
        pin_in_slot=pin,
        turn=-np.unwrap(np.angle(one - zero)),
        slot=[seen(np.full(count, pin[k])) for k in (0, -1)],
        middle=seen(np.full(count, pin[0] + (pin[-1] - pin[0]) / 2)),
    )


def transmission(one: SimpleNamespace, driver: int) -> float:
    driven = 1 - driver
    push = one.moving[driver]
    if one.dyads[driven] == "crank":
        force, held = one.moving[driven] - push, one.moving[driven] - one.fixed[driven]
    elif one.dyads[driven] == "slider":  # on a line whose normal is the fixed pivot
        force, held = one.moving[driven] - push, one.fixed[driven]
    else:  # a line of the coupler, with this normal, through a fixed point
        force, held = one.fixed[driven] - push, one.moving[driven]
    angle = np.unwrap(np.angle(force / held), period=math.pi)
    from_line = np.abs(angle - math.pi * np.round(angle / math.pi))
    crossed = np.floor(angle.max() / math.pi) > np.floor(angle.min() / math.pi)
    return 0.0 if crossed else math.degrees(from_line.min())


def test_transmission_and_drive_are_those_of_the_machine(slots: Made) -> None:
    guides, traced = slots
    m, shown = (measure(guides, traced, 65, in_middle=True, inverse=inverse) for inverse in (True, False))
    works = drive_metrics(guides, traced, m, inverse=True)
    apart = 0
    assert len(guides) > 25
    for n in range(len(guides)):
        one = machine(guides, traced, n, 2001)
        assert np.degrees(np.ptp(one.turn)) == pytest.approx(works.rotation[n], rel=1e-3, abs=1e-6)
        assert m.rotation[n] == pytest.approx(works.rotation[n], rel=1e-2, abs=1e-6)
        cranks = [k for k in (0, 1) if one.dyads[k] == "crank"]
        if not cranks:
            assert m.driver[n] == 0
            continue
        angles = {k: transmission(one, k) for k in cranks}
        k = int(m.driver[n]) - 1
        assert m.min_transmission[n] == pytest.approx(angles[k], abs=0.1)
        assert angles[k] == pytest.approx(max(angles.values()), abs=0.1)
        apart += abs(m.min_transmission[n] - shown.min_transmission[n]) > 5
        crank = np.unwrap(np.angle(one.moving[k] - one.fixed[k]))
        if np.isfinite(works.drive_angle[n]):
            assert math.degrees(abs(crank[-1] - crank[0])) == pytest.approx(works.drive_angle[n], rel=1e-6)
            speed = np.abs(np.diff(one.pin_in_slot)) / np.abs(np.diff(crank))
            assert speed.min() / speed.max() == pytest.approx(works.uniformity[n], rel=2e-2, abs=2e-3)
            lever = np.abs(np.diff(one.moving[k])) / np.abs(np.diff(one.pin_in_slot))
            assert lever.min() == pytest.approx(works.advantage[n], rel=2e-2, abs=2e-3)
    if (guides.linkage.dyads == RR).any() and (guides.linkage.family != "four-bar").any():
        assert apart > 5  # the traced inversion is driven otherwise


def test_links_ground_and_arm_are_those_of_the_machine(slots: Made) -> None:
    guides, traced = slots
    m = measure(guides, traced, 65, inverse=True)
    shown = measure(guides, traced, 65)
    np.testing.assert_array_equal(m.size, shown.size)  # the same positions, seen from another plane
    np.testing.assert_array_equal(m.box, shown.box)
    margin = rotation_margin(guides.linkage.inverted())
    np.testing.assert_array_equal(m.rotates, 1 * (margin[:, 0] >= 0) + 2 * (margin[:, 1] >= 0))
    for n in range(len(guides)):
        one = machine(guides, traced, n, 3)
        links = [abs(one.moving[i][0] - one.fixed[i]) for i in (0, 1) if one.dyads[i] == "crank"]
        on_coupler = [one.moving[i][0] for i in (0, 1) if one.dyads[i] != "slide"]
        on_frame = [one.fixed[i] for i in (0, 1) if one.dyads[i] != "slider"]
        links += [abs(on_coupler[0] - on_coupler[1])] if len(on_coupler) == 2 else []
        ground = abs(on_frame[0] - on_frame[1]) if len(on_frame) == 2 else math.nan
        assert m.max_link[n] == pytest.approx(max(links, default=math.nan), nan_ok=True)
        assert m.min_link[n] == pytest.approx(min(links, default=math.nan), nan_ok=True)
        assert m.max_ground[n] == pytest.approx(ground, nan_ok=True)
        arm = min((abs(one.middle[0] - p) for p in on_coupler), default=math.nan)
        assert m.max_arm[n] == pytest.approx(arm, abs=0.2 * float(traced.fit.stroke[n]), nan_ok=True)


@pytest.mark.slow
def test_bars_of_a_machine_with_a_slot_end_in_its_pivots_and_at_the_ends_of_its_slots(
    slots: Made, naive: SimpleNamespace
) -> None:
    guides, traced = slots
    # a swinging block may run fast in mid-stroke
    moves = SampledPoses.of(guides, traced, 2 * DRIVE_GRID.most, inverse=True)
    swept = link_segments(guides.linkage.inverted(), moves)
    every = [machine(guides, traced, n, 8001) for n in range(len(guides))]
    kinds = {kind for one in every for kind in one.dyads}
    # of two rails; of two slots, each along itself, from ends to ends, and from ends to the ends of the slot of the pin
    more = 2 * ("slider" in kinds) + (2 + 4 + 8) * ("slide" in kinds)
    assert swept.shape[2:] == (8 + more, 2)
    for n, one in enumerate(every):
        sliders, slides = ([i for i in (0, 1) if one.dyads[i] == kind] for kind in ("slider", "slide"))
        rails = [end for i in sliders for end in naive.segment(one.moving[i])]
        carried = [end for i in slides for end in naive.segment(one.on_slides[i])]
        for k in (0, -1):
            joints = [one.fixed[i] for i in (0, 1) if one.dyads[i] != "slider"]
            joints += [one.moving[i][k] for i in (0, 1) if one.dyads[i] != "slide"]
            joints += [end[k] for end in one.slot]
            ends = swept[k, n].ravel()
            for joint in joints:
                assert np.abs(ends - joint).min() < 1e-8 * (1 + abs(joint))
            stops = np.array(rails + [one.seen(end, k) for end in carried])
            for stop in stops:
                assert np.abs(ends - stop).min() < STOP * (1 + abs(stop))
            for end in ends:
                at_stop = len(stops) and np.abs(stops - end).min() < STOP * (1 + abs(end))
                assert at_stop or np.abs(np.array(joints) - end).min() < 1e-8 * (1 + abs(end))


# -- points that return ----------------------------------------------------------------------------------------------
@pytest.mark.slow
def test_points_that_return_work_as_a_dense_sampling_says(random_linkages: Callable[..., Linkage]) -> None:
    linkage = random_linkages("four-bar", 80, 11)
    from catalogue.curvature_theory.analysis import curvature

    pole = curvature(linkage).pole
    guides = coupler_curve(linkage, pole[:, 0] + 1j * pole[:, 1])
    guides = guides[guides.cusp & (guides.extent.min(0) > 0.02)]
    traced = trace(guides, 0.3 * guides.extent.min(0), circle=True, split=False)
    good = steady(traced)
    guides, traced = guides[good], traced[good]
    m = measure(guides, traced)
    works, seen = drive_metrics(guides, traced, m), 0
    for n in range(len(guides)):
        t = np.linspace(traced.low[n], traced.high[n], 20001)[:, None]
        d, x = (p[:, 0] for p in guides[n : n + 1].motion.pose(t)[:2])
        z, origin, k = guides.linkage.points[n], guides.motion.origin[n], int(m.driver[n]) - 1
        path, pin = (p + d + x * (p - origin) for p in (guides.point[n], z[k, 1]))
        crank = np.unwrap(np.angle(pin - z[k, 0]))
        step = np.diff(crank)
        if not (step > 0).all() and not (step < 0).all():
            assert math.isnan(works.drive_angle[n])
            continue
        seen += 1
        assert works.drive_angle[n] == pytest.approx(math.degrees(abs(crank[-1] - crank[0])), rel=1e-6)
        assert works.advantage[n] == pytest.approx((np.abs(np.diff(pin)) / np.abs(np.diff(path))).min(), rel=5e-3)
        speed = np.abs(np.diff(path)) / np.abs(step)
        assert speed.min() < 1e-3 * speed.max()  # it rests
        assert works.uniformity[n] == 0
    assert seen > 10
