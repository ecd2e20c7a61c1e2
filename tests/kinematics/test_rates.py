"""Velocities and accelerations: against differences of chains closed in 60 digits, and against power series."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from types import SimpleNamespace
from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np
import pytest

from catalogue.curvature_theory.taylor import path_series
from catalogue.kinematics.linkage import FAMILIES, RR, Linkage
from catalogue.kinematics.motion import COUPLER, motion
from catalogue.kinematics.rates import rates

Maker = Callable[..., Linkage]
#: What may drive each family: the crank of dyad 0 or 1, 2 the coupler.
DRIVEN = [(f, i) for f, i in product(FAMILIES, (0, 1, 2)) if i == 2 or FAMILIES[f][i] == RR]
every_drive = pytest.mark.parametrize(("family", "drive"), DRIVEN)
EACH = 30
POINT = 0.7 - 0.4j


def differences(naive: SimpleNamespace, pivots: Any, drive: int, point: complex) -> list[complex]:
    """Return velocity and acceleration of a coupler point, and of the coupler's angle, by the angle of the drive."""
    with mp.workdps(60):
        step, z = mp.mpf(10) ** -15, mp.mpc(point)
        chain = naive.Chain(pivots, drive if drive != 2 else follower(pivots), exact=True)
        side = min((1, -1), key=lambda way: off(chain.pose(mp.mpf(0), way)))

        def at(t: Any) -> tuple[Any, Any]:
            if drive == 2 and chain.lead != 2:
                # the crank's angle at which the coupler has turned by t
                t = mp.findroot(lambda x: mp.arg(chain.pose(x, side)[1]) - t, (0, t or step), tol=mp.mpf(10) ** -100)
            d, turn = chain.pose(t, side)
            return d + turn * z, mp.arg(turn)

        before, now, after = (at(k * step) for k in (-1, 0, 1))
        first = [(c - a) / (2 * step) for a, c in zip(before, after, strict=True)]
        second = [(c - 2 * b + a) / step**2 for a, b, c in zip(before, now, after, strict=True)]
        return [complex(x) for x in (*first, *second)]


def follower(pivots: Any) -> int:
    """Return which crank closes the chain whose coupler drives, 2 if there is none."""
    return next((i for i in (0, 1) if pivots[i, :, 2].all()), 2)


def off(pose: tuple[Any, Any]) -> float:
    return float(abs(pose[0]) + abs(pose[1] - 1))


@every_drive
@pytest.mark.slow
def test_they_are_those_of_small_steps_in_60_digits(
    random_linkages: Maker, naive: SimpleNamespace, family: str, drive: int
) -> None:
    linkage = random_linkages(family, EACH, 81)
    found = rates(linkage, np.full(EACH, drive))
    at = np.full(EACH, POINT)
    ours = np.stack([found.velocity_of(at), found.omega, found.acceleration_of(at), found.alpha], axis=1)
    theirs = np.array([differences(naive, one, drive, POINT) for one in linkage.pivots])
    for k in (0, 2):  # an angle and a point at the distance 1
        scale = np.abs(theirs[:, k : k + 2]).max(1, keepdims=True)
        assert (np.abs(ours - theirs)[:, k : k + 2] / scale).max() < 1e-10


@every_drive
def test_they_are_those_of_the_power_series(random_linkages: Maker, family: str, drive: int) -> None:
    """A chart's parameter is the tangent of half the angle of what drives: its derivatives are 2 and half of it."""
    linkage = random_linkages(family, 300, 82)
    found = rates(linkage, np.full(300, drive))
    at = np.full(300, POINT)
    series = path_series(motion(linkage, (drive + 1) if drive != 2 else COUPLER, at).point(at))
    velocity, acceleration = 0.5 * series[1], 0.5 * series[2]
    for ours, theirs in ((found.velocity_of(at), velocity), (found.acceleration_of(at), acceleration)):
        np.testing.assert_array_less(np.abs(ours - theirs), 1e-9 * (np.abs(theirs) + np.abs(velocity) ** 2 + 1))


@every_drive
def test_the_driving_link_turns_steadily(random_linkages: Maker, family: str, drive: int) -> None:
    linkage = random_linkages(family, 50, 83)
    found = rates(linkage, np.full(50, drive))
    spin, gain = (found.omega, found.alpha) if drive == 2 else found.crank(linkage, drive)
    scale = 1 + np.abs(found.omega) + np.abs(found.alpha)
    assert (np.abs(spin - 1) / scale).max() < 1e-12
    assert (np.abs(gain) / scale).max() < 1e-12


@pytest.mark.parametrize("kind", ["four-bar", "slider-crank", "inverted-slider-crank"])
def test_there_are_none_in_a_dead_point_but_just_beside(kind: str) -> None:
    # crank 1 turns about the origin; its pin is at 1 + 0.5 i, and the second ray points at it
    pin, ray = 1 + 0.5j, 0.6 + 0.8j
    second = {
        "four-bar": [pin + 4 * ray, pin + 2 * ray],
        "slider-crank": [ray, pin + 2 * ray],  # its line is normal to the coupler
        "inverted-slider-crank": [pin + 1.5 * ray, ray],  # the slide's line, at the distance 1.5 from the pin
    }[kind]
    w = {"four-bar": (1, 1), "slider-crank": (0, 1), "inverted-slider-crank": (1, 0)}[kind]
    ends = [[z.real, z.imag, k] for z, k in zip(second, w, strict=True)]
    dyads = np.array([[[0, 0, 1], [pin.real, pin.imag, 1]], ends])
    dead = rates(Linkage(dyads), np.array([0]))
    assert np.isnan([dead.omega[0], dead.alpha[0]]).all()
    assert np.isnan(dead.velocity_of(np.array([0j]))).all()
    beside = []
    for away in (1e-3, 1e-6):
        near = dyads.copy()
        turned = np.exp(1j * away) * pin
        near[0, 1, :2] = turned.real, turned.imag
        beside.append(rates(Linkage(near), np.array([0])).omega[0])
    assert np.isfinite(beside).all()
    assert abs(beside[1]) > 100 * abs(beside[0])  # the coupler turns ever faster
    other = rates(Linkage(dyads), np.array([2]))  # the coupler can drive
    assert np.isfinite([other.omega[0], other.alpha[0]]).all()


def test_what_is_no_crank_does_not_drive() -> None:
    slider = Linkage(np.array([[[0, 0, 1], [1, 1, 1]], [[0, 1, 0], [3, 0.5, 1]]]))
    assert np.isnan(rates(slider, np.array([1])).omega[0])
    assert np.isnan(rates(slider, np.array([0])).crank(slider, 1)[0][0])


@pytest.mark.parametrize("scale", [1e-150, 1e-14, 1e14, 1e150])
def test_rates_do_not_depend_on_the_unit_of_length(random_linkages: Maker, scale: float) -> None:
    for family in FAMILIES:
        linkage = random_linkages(family, 10, seed=4)
        pivots = linkage.pivots.copy()
        pivots[..., :2] *= np.where(pivots[..., 2:] == 0, 1.0, scale)
        drive = np.where(linkage.dyads[:, 0] == RR, 0, 2)
        one, two = rates(linkage, drive), rates(Linkage(pivots), drive)
        assert np.isfinite(one.omega).all()
        assert np.allclose(one.omega, two.omega, rtol=1e-9, atol=0)
        assert np.allclose(one.alpha, two.alpha, rtol=1e-9, atol=1e-12)
        z = np.full(10, 0.3 + 0.4j)
        for read in ("velocity_of", "acceleration_of"):
            assert np.allclose(getattr(two, read)(scale * z) / scale, getattr(one, read)(z), rtol=1e-9, atol=1e-12)
