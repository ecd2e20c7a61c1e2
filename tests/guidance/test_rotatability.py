"""Which cranks turn fully, and how well they drive: against plain sweeps of the crank, one linkage at a time."""

from __future__ import annotations

import cmath
import math
from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np
import pytest

from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.guidance.metrics import measure, min_transmission_turn, rotates, rotation_margin, transmission_turn
from catalogue.guidance.trace import trace
from catalogue.kinematics.from_lengths import from_lengths
from catalogue.kinematics.linkage import Linkage

KINDS = ("four-bar", "slider-crank", "inverted-slider-crank")
SWEEP = 14400


def drawn(kind: str, count: int = 60) -> list[dict[str, float]]:
    """Return lengths of random linkages whose crank stands at some angle at which the chain closes."""
    draw = np.random.default_rng(KINDS.index(kind))
    made: list[dict[str, float]] = []
    while len(made) < count:
        a, b, c, g = draw.uniform(0.3, 2, 4)
        offset, angle = draw.uniform(-0.6, 0.6), float(draw.uniform(0, 360))
        one = {
            "four-bar": {"ground": g, "crank": a, "coupler": b, "rocker": c},
            "slider-crank": {"crank": 0.5 * a, "coupler": b, "offset": offset},
            "inverted-slider-crank": {"ground": g, "crank": a, "offset": 0.5 * offset},
        }[kind]
        if spare(one, math.radians(angle)) > 1e-3:
            made.append({**one, "angle": angle, "branch": float(draw.choice([-1, 1]))})
    return made


def spare(one: dict[str, float], phi: float) -> float:
    """Return by how much the chain closes with the crank at this angle; negative if it does not."""
    pin = cmath.rect(one["crank"], phi)
    if "rocker" in one:
        away = abs(one["ground"] - pin)
        return min(one["coupler"] + one["rocker"] - away, away - abs(one["coupler"] - one["rocker"]))
    if "coupler" in one:
        return one["coupler"] - abs(pin.imag - one["offset"])
    return abs(one["ground"] - pin) - abs(one["offset"])


def transmission(one: dict[str, float], phi: float) -> float:
    """Return the angle between the force on the driven pivot and the way that it cannot go [deg]."""
    pin = cmath.rect(one["crank"], phi)
    if "rocker" in one:  # the driven pin by the law of cosines, seen from the crank pin
        base = one["ground"] - pin
        cosine = (abs(base) ** 2 + one["coupler"] ** 2 - one["rocker"] ** 2) / (2 * abs(base) * one["coupler"])
        far = pin + cmath.rect(one["coupler"], cmath.phase(base) + math.acos(max(-1.0, min(1.0, cosine))))
        force, held = far - pin, far - one["ground"]
    elif "coupler" in one:
        up = one["offset"] - pin.imag
        force, held = complex(math.sqrt(max(0.0, one["coupler"] ** 2 - up**2)), up), 1j
    else:
        force = one["ground"] - pin
        lean = math.asin(min(1.0, abs(one["offset"]) / abs(force)))
        held = force * cmath.exp(1j * (lean + math.pi / 2))  # the normal of the coupler line
    angle = abs(math.degrees(cmath.phase(force / held)))
    return min(angle, 180 - angle)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_margin_is_the_least_by_which_the_chain_closes_over_a_turn(kind: str) -> None:
    made = drawn(kind)
    linkage = from_lengths({k: [one[k] for one in made] for k in made[0]})
    assert set(linkage.family) == {kind}
    margin = rotation_margin(linkage)
    sweep = [min(spare(one, math.radians(0.025) * k) for k in range(SWEEP)) for one in made]
    np.testing.assert_allclose(margin[:, 0], sweep, atol=2e-6)
    assert 5 < (margin[:, 0] > 0).sum() < len(made) - 5
    np.testing.assert_array_equal(rotates(linkage) & 1, np.array(sweep) > 0)
    if kind != "four-bar":
        assert np.isnan(margin[:, 1]).all()


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_transmission_over_the_turn_is_that_of_a_sweep(kind: str) -> None:
    made = drawn(kind)
    linkage = from_lengths({k: [one[k] for one in made] for k in made[0]})
    found = transmission_turn(linkage)[:, 0]
    for one, margin, angle in zip(made, rotation_margin(linkage)[:, 0], found, strict=True):
        if margin <= 0:
            assert math.isnan(angle)
        else:
            sweep = min(transmission(one, math.radians(0.025) * k) for k in range(SWEEP))
            assert angle == pytest.approx(sweep, abs=2e-3)


def test_second_crank_is_the_first_of_the_linkage_with_its_dyads_exchanged() -> None:
    made = drawn("four-bar")
    linkage = from_lengths({k: [one[k] for one in made] for k in made[0]})
    turned = Linkage(linkage.pivots[:, ::-1])
    np.testing.assert_array_equal(rotation_margin(turned), rotation_margin(linkage)[:, ::-1])
    np.testing.assert_array_equal(transmission_turn(turned), transmission_turn(linkage)[:, ::-1])


def test_golden_angles() -> None:
    crank_rocker = from_lengths({"ground": 4, "crank": 1, "coupler": 4, "rocker": 3, "angle": 70})  # arccos(2/3), 90
    slider = from_lengths({"crank": 1, "coupler": 3, "offset": 0.5, "angle": 70})  # arccos(1.5/3)
    slide = from_lengths({"ground": 2, "crank": 1, "offset": 0.5, "angle": 70})  # arccos(0.5/1)
    found = [float(min_transmission_turn(one)[0]) for one in (crank_rocker, slider, slide)]
    assert found == pytest.approx([48.189685104221404, 60.0, 60.0], abs=1e-12)
    np.testing.assert_array_equal(min_transmission_turn(crank_rocker, np.array([1])), found[:1])
    assert np.isnan(min_transmission_turn(crank_rocker, np.array([2]))).all()  # the rocker only swings
    assert np.isnan(min_transmission_turn(crank_rocker, np.array([0]))).all()


def test_angle_near_a_change_point_keeps_its_digits() -> None:
    for gap in (1e-3, 1e-5, 1e-7):
        linkage = from_lengths({"crank": 1, "coupler": 1 + gap, "angle": 40})
        z = linkage.points[0]
        with mp.workdps(40):  # from the pivots as they are rounded; the slider's line is y = offset
            a, b = (abs(mp.mpc(complex(q)) - mp.mpc(complex(p))) for p, q in ((z[0, 0], z[0, 1]), (z[0, 1], z[1, 1])))
            e = abs(mp.mpf(float(z[1, 1].imag)) - mp.mpf(float(z[0, 0].imag)))
            expected = float(mp.degrees(mp.acos((a + e) / b)))
        assert min_transmission_turn(linkage)[0] == pytest.approx(expected, rel=1e-8)


def change_points() -> list[tuple[list[Any], int]]:
    """Return linkages with a change point, and which cranks turn fully if a margin of 0 does."""
    p, q = cmath.rect(1, 0.7), cmath.rect(2.5, 0.2)
    kite = from_lengths({"ground": 1, "crank": 1, "coupler": 1.8, "rocker": 1.8, "angle": 50}).pivots[0].tolist()
    crossed = from_lengths({"ground": 2, "crank": 1, "coupler": 2, "rocker": 1, "angle": 50, "branch": -1})
    isosceles = from_lengths({"crank": 1.3, "coupler": 1.3, "angle": 35}).pivots[0].tolist()
    slide = from_lengths({"ground": 1.3, "crank": 1.3, "angle": 35}).pivots[0].tolist()
    flat = from_lengths({"ground": 3, "crank": 1, "coupler": 2.5, "rocker": 1.5, "angle": 35}).pivots[0].tolist()
    return [
        ([[[0, 0, 1], [p.real, p.imag, 1]], [[q.real, q.imag, 1], [(p + q).real, (p + q).imag, 1]]], 3),
        (crossed.pivots[0].tolist(), 3),
        (kite, 3),
        (isosceles, 1),
        (slide, 1),
        (flat, 1),  # shortest and longest are as long as the others
    ]


def test_change_points_are_not_decided_by_rounding() -> None:
    draw = np.random.default_rng(8)
    for pivots, turns in change_points():
        one = Linkage([pivots] * 300)
        scale = np.exp(draw.normal(size=300) + 2j * np.pi * draw.random(300))
        shift = 3 * (draw.normal(size=300) + 1j * draw.normal(size=300)) * 10 ** draw.uniform(0, 3, 300)
        moved = one.moved(scale, shift, draw.random(300) > 0.5)
        assert (rotates(moved) == turns).all()
        margin, angle = rotation_margin(moved), transmission_turn(moved)
        for k in (0, 1):
            if turns >> k & 1:
                assert (margin[:, k] == 0).all()
                assert (angle[:, k] == 0).all()
            else:
                assert not (margin[:, k] >= 0).any()
                assert np.isnan(angle[:, k]).all()


def test_a_margin_above_rounding_is_not_a_change_point() -> None:
    longer = from_lengths({"crank": 1, "coupler": [1 + 1e-7, 1 - 1e-7], "angle": 40})
    np.testing.assert_allclose(rotation_margin(longer)[:, 0], [1e-7, -1e-7], rtol=1e-6)
    np.testing.assert_array_equal(rotates(longer), [1, 0])


def test_families_without_a_crank_have_no_margin() -> None:
    trammel = Linkage([[[0, 1, 0], [1, 0, 1]], [[1, 0, 0], [0, 1, 1]]])
    assert np.isnan(rotation_margin(trammel)).all()
    assert np.isnan(min_transmission_turn(trammel)).all()
    assert rotates(trammel)[0] == 0


@pytest.mark.slow
def test_where_a_crank_must_turn_the_transmission_is_of_a_crank_that_turns() -> None:
    """Sweep over the stroke: the angle is that of the crank that is named, though the rocker would drive better."""
    seen = 0
    for angle in range(0, 360, 8):
        linkage = from_lengths({"ground": 2.2, "crank": 0.8, "coupler": 2.4, "rocker": 1.6, "angle": angle})
        z = linkage.points[:, :, 1]
        guides = coupler_curve(linkage, z[:, 0] + (0.6 + 0.4j) * (z[:, 1] - z[:, 0]))
        traced = trace(guides, 0.3 * guides.extent.min(0), circle=False, split=False)
        free, turning = (measure(guides, traced, in_middle=True, turning=must) for must in (False, True))
        assert turning.driver[0] == 1
        for m in (free, turning):
            t = np.linspace(traced.low[0], traced.high[0], 2001)[:, None]
            d, x, _ = guides.motion.pose(t)
            at = [(z[:, i] + d + x * (z[:, i] - guides.motion.origin))[:, 0] for i in (0, 1)]
            coupler, driven = at[1] - at[0], at[2 - m.driver[0]] - linkage.points[0, 2 - m.driver[0], 0]
            sine = ((coupler.conj() * driven).imag / np.abs(coupler) / np.abs(driven)).tolist()
            least = 0.0 if min(sine) * max(sine) < 0 else min(math.degrees(math.asin(min(1.0, abs(s)))) for s in sine)
            assert m.min_transmission[0] == pytest.approx(least, abs=0.02)
        whole = float(min_transmission_turn(linkage)[0])
        assert whole <= turning.min_transmission[0] + 1e-6 <= free.min_transmission[0] + 2e-6
        seen += free.driver[0] == 2 and free.min_transmission[0] > turning.min_transmission[0] + 1
    assert seen >= 3
