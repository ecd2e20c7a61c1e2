"""Steering axis, roll centre and support angles over travel and rack, against ball joints and an independent solver."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest

from catalogue.folders import folder
from catalogue.spatial import (
    Joint,
    Length,
    Link,
    Mechanism,
    OnGuide,
    Prismatic,
    Revolute,
    Spherical,
    Travel,
    Wheel,
    load,
)
from catalogue.spatial import kinematics as columns
from catalogue.spatial.fitting.files import Asked
from tests.spatial.test_axles import AXIS, BALLS, CENTRE, INNER, LOWER, OUTER, ROD, UPPER, Carrier, polished

RACK, TRAVEL = Joint("rack"), Travel("wheel", CENTRE)
WHEEL = Wheel("wheel", tuple(CENTRE), tuple(AXIS), 310.0)
TOP = np.array([0.0, 520, 420])
SPRING = Length("ground", TOP, "wheel", OUTER[2])
MOUNT, LOW = np.array([-20, 600, 560.0]), np.array([0, 680, 120.0])
ALONG = (MOUNT - LOW) / np.linalg.norm(MOUNT - LOW)
CLOSE = 1e-9


def with_rack(*elements: Any, rod: Any = ROD) -> Mechanism:
    return Mechanism([*elements, Prismatic("rack", (0, 1, 0)), Link("rack", rod[0], "wheel", rod[1])])


ARM = [Revolute("lower", LOWER[0], to=LOWER[1]), Spherical("wheel", BALLS[0], on="lower")]
WISHBONE = with_rack(
    *ARM, Revolute("upper", UPPER[0], to=UPPER[1]), Spherical("wheel", BALLS[1], on="upper")
)  # fmt: skip
STRUT = with_rack(
    *ARM, OnGuide("ground", MOUNT, "line", origin=LOW, quaternion=[1 + ALONG[2], -ALONG[1], ALONG[0], 0], on="wheel")
)
LINKS = [Link("ground", a, "wheel", b) for a, b in zip(INNER[:4], OUTER[:4], strict=True)]
FIVE = with_rack(*LINKS, rod=(INNER[4], OUTER[4]))


# -- the other solver: points of the carrier by distances, rates by the derivative of those
def rods(points: Any, inner: Any, outer: Any) -> Callable[[Any, Any], Any]:
    """Return conditions that points keep distances to ground, the last one to the rack."""
    inner, outer = np.asarray(inner, float), np.asarray(outer, float)
    shift = np.zeros(inner.shape)
    shift[-1, 1] = 1
    return lambda p, rack: ((p[points] - inner - shift * rack) ** 2).sum(1) - ((outer - inner) ** 2).sum(1)


def strut(p: Any, rack: Any) -> Any:
    off = np.cross(p[4] - p[2], MOUNT - p[2])
    outer = [BALLS[0], BALLS[0], ROD[1]]
    return np.array([*rods([0, 0, 1], [*LOWER, ROD[0]], outer)(p, rack), off[0], off[1]])


#: Mechanism, spring, carrier with conditions, index of the wheel centre and of the point on which the spring stands.
AXLES: dict[str, Any] = {
    "double wishbone": (
        WISHBONE, (), Carrier([*BALLS, ROD[1], CENTRE]),
        rods([0, 0, 1, 1, 2], [*LOWER, *UPPER, ROD[0]], [BALLS[0], BALLS[0], BALLS[1], BALLS[1], ROD[1]]), 3, 0,
    ),
    "strut": (
        STRUT, (), Carrier([BALLS[0], ROD[1], LOW, LOW + 200 * ALONG + [100, 0, 0], LOW + 300 * ALONG, CENTRE]),
        strut, 5, 0,
    ),
    "five links": (FIVE, SPRING, Carrier([*OUTER, CENTRE]), rods([0, 1, 2, 3, 4], INNER, OUTER), 5, 2),
}  # fmt: skip


def rates(equations: Any, x: Any, moving: Any) -> tuple[Any, Any]:
    """Return velocity of the origin and spin, from the derivative of equations by what moves."""
    jacobian = np.stack([equations(x + 1e-30j * e, 0).imag / 1e-30 for e in np.eye(12)], axis=1).astype(float)
    v = np.linalg.solve(jacobian, -(equations(x, moving).imag / 1e-30).astype(float)).reshape(4, 3)
    p = x.reshape(4, 3)
    rows = [np.hstack([np.eye(3), -np.cross(np.eye(3), q)]) for q in p]
    twist = np.linalg.lstsq(np.vstack(rows), v.ravel(), rcond=None)[0]
    return twist[:3], twist[3:]


def expected(name: str, travel: float, rack: float) -> dict[str, float]:
    """Return the columns of one pose by the other solver."""
    _, _, carrier, conditions, centre, foot = AXLES[name]
    x = carrier.points[:4].ravel()
    for part in np.linspace(0.2, 1, 5):

        def posed(x: Any, up: Any = 0, part: float = part) -> Any:
            p = carrier.all(x)
            height = p[centre, 2] - CENTRE[2] - part * travel - up
            return np.array([*carrier.rigid(x), *conditions(p, part * rack), height])

        x = polished(posed, x)
    x = x.astype(float)
    length = ((carrier.all(x)[foot].astype(float) - TOP) ** 2).sum()

    def steered(x: Any, by: Any) -> Any:
        p = carrier.all(x)
        return np.array([*carrier.rigid(x), *conditions(p, rack + by), ((p[foot] - TOP) ** 2).sum() - length])

    at = carrier.all(x)[centre].astype(float)
    base = np.linalg.solve(np.vstack([carrier.points[:4].T, np.ones(4)]), [*(CENTRE + 100 * AXIS), 1])
    n = x.reshape(4, 3).T @ base - at
    n /= np.linalg.norm(n)
    contact = at + 310 * (d := n * n[2] - [0, 0, 1]) / np.linalg.norm(d)
    out = {"toe": np.degrees(np.arctan(n[0] / n[1])), "camber": -np.degrees(np.arcsin(n[2]))}
    v, w = rates(posed, x, 1e-30j)
    patch, hub = v + np.cross(w, contact), v + np.cross(w, at)
    out["roll centre"] = contact[1] * patch[1] / patch[2]
    out["support angle of contact"] = np.degrees(np.arctan2(patch[0], patch[2]))
    out["support angle of centre"] = np.degrees(np.arctan2(hub[0], hub[2]))
    v, w = rates(steered, x, 1e-30j)
    if name != "five links":  # the balls, by hand
        p = carrier.all(x).astype(float)
        w = p[0] - (p[1] if name == "double wishbone" else MOUNT)
        v = np.cross(p[0], w)
    w = w * np.sign(w[2])
    v = v * np.sign(w[2])
    # where the velocity is along the axis, on the ground
    skew = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    v = np.linalg.lstsq(skew, -(v - w * (v @ w) / (w @ w)), rcond=None)[0] if name == "five links" else p[0]
    ground = v + w * (contact[2] - v[2]) / w[2]
    out["caster"], out["kingpin inclination"] = (np.degrees(np.arctan2(-w[k], w[2])) for k in (0, 1))
    out["scrub radius"], out["trail"] = contact[1] - ground[1], ground[0] - contact[0]
    hub = v + w * (at[2] - v[2]) / w[2]
    out["kingpin offset"], out["caster offset"] = at[1] - hub[1], hub[0] - at[0]
    return out


def compare(name: str, table: pd.DataFrame, places: list[tuple[float, float]]) -> None:
    assert not table.attrs["reasons"]
    table.columns = [str(c).partition(" [")[0] for c in table.columns]
    for (_, row), place in zip(table.iterrows(), places, strict=True):
        for column, value in expected(name, *place).items():
            assert row[column] == pytest.approx(value, abs=CLOSE), (column, place)


@pytest.mark.slow
@pytest.mark.parametrize("name", AXLES)
def test_columns_are_those_of_an_independent_solver_whatever_drives(name: str) -> None:
    mechanism, spring = AXLES[name][:2]
    up, turned = [-60.0, 0.0, 70.0], [-25.0, 10.0]
    motion = mechanism.sweep(TRAVEL, up, [RACK])
    compare(name, columns(motion, WHEEL, RACK, spring), [(z, 0.0) for z in up])
    motion = mechanism.sweep(RACK, turned, [TRAVEL])
    compare(name, columns(motion, WHEEL, RACK, spring), [(0.0, r) for r in turned])
    still = spring or Joint("lower")
    motion = mechanism.sweep(RACK, turned, [still])
    heights = columns(motion, WHEEL, RACK, spring)["travel [mm]"]
    compare(name, columns(motion, WHEEL, RACK, spring), list(zip(heights, turned, strict=True)))


@pytest.mark.slow
@pytest.mark.parametrize("name", AXLES)
def test_columns_over_a_grid_of_travel_and_rack_are_those_of_the_ball_joints(name: str) -> None:
    mechanism, spring = AXLES[name][:2]
    motion = mechanism.sweep({TRAVEL: [-75.0, -20, 35, 80], RACK: [-35.0, 0, 15, 30]}, grid=True)
    table = columns(motion, WHEEL, RACK, spring).reset_index(drop=True)
    compare(name, table, [(float(z), float(r)) for z, r in motion.values])


def test_columns_are_nan_with_the_reason_where_nothing_determines_them() -> None:
    motion = FIVE.sweep(TRAVEL, [0.0, 10.0], [RACK])
    table = columns(motion, WHEEL, RACK)
    assert table["roll centre [mm]"].notna().all()
    table = columns(FIVE.sweep(RACK, [0.0, 10.0], [TRAVEL]), WHEEL)
    assert table["roll centre [mm]"].isna().all()
    assert "cannot move while" in table.attrs["reasons"]["roll centre [mm]"]
    still = columns(motion, WHEEL, RACK, RACK)
    assert still["trail [mm]"].isna().all()
    assert "cannot move while" in still.attrs["reasons"]["trail [mm]"]


def test_without_spring_and_arms_the_height_of_the_wheel_is_held() -> None:
    """The screw between two poses of the rack at one height, by their differences."""
    h = 1e-3
    motion = FIVE.sweep({RACK: [-h, 0.0, h]}, hold={TRAVEL: 20.0})
    table = columns(motion, WHEEL, RACK)
    turn = motion.rotation("wheel")
    spin = (turn[2] - turn[0]) / (2 * h) @ turn[1].T
    w = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    w *= np.sign(w[2])
    assert table["caster [deg]"][1] == pytest.approx(np.degrees(np.arctan2(-w[0], w[2])), abs=1e-6)
    assert table["kingpin inclination [deg]"][1] == pytest.approx(np.degrees(np.arctan2(-w[1], w[2])), abs=1e-6)
    toe, camber = table["toe [deg]"].to_numpy(), table["camber [deg]"].to_numpy()
    slope = (toe[0] - toe[2]) / (2 * h)
    assert table["steering gradient [deg/mm]"][1] == pytest.approx(slope, abs=1e-7)
    expected = (camber[2] - camber[0]) / (toe[0] - toe[2])
    assert table["camber by steering [deg/deg]"][1] == pytest.approx(expected, abs=1e-6)


def test_gradients_and_motion_ratios_are_differences_over_travel_whatever_drives() -> None:
    h = 1e-3
    spring = Length("ground", (0, 500, 400), "wheel", (0, 690, -60))
    for rack in (0.0, 15.0):
        near = WISHBONE.sweep({TRAVEL: [40 - h, 40.0, 40 + h]}, hold={RACK: rack})
        length, table = near.value(spring), columns(near, WHEEL, RACK)
        here = WISHBONE.sweep({RACK: [rack]}, hold={TRAVEL: 40})
        now = columns(here, WHEEL, RACK)
        for name, unit in (("toe", "deg"), ("camber", "deg"), ("half track", "mm")):
            slope = np.diff(table[f"{name} [{unit}]"].to_numpy()[::2])[0] / (2 * h)
            assert now[f"{name} gradient [{unit}/mm]"][0] == pytest.approx(slope, abs=1e-8)
        assert here.ratio(spring, TRAVEL, [RACK])[0] == pytest.approx((length[2] - length[0]) / (2 * h), abs=1e-8)
        foot = near.point("wheel", (0, 690, -60))
        assert np.abs(length - np.linalg.norm(foot - (0, 500, 400), axis=1)).max() < 1e-10
    both = spring + TRAVEL
    assert here.value(both)[0] == pytest.approx(here.value(spring)[0] + 40)
    assert here.value(RACK)[0] == pytest.approx(15)


@pytest.mark.slow
def test_a_motion_and_a_circuit_are_shown_in_a_line() -> None:
    motion = WISHBONE.sweep({TRAVEL: [0.0, 5], RACK: [0.0, 900]})
    assert repr(motion) == "<Motion by Travel wheel, Joint rack: 2 poses, 1 of 2 reached>"
    told = repr(WISHBONE.circuit(TRAVEL, [RACK]))
    assert told.startswith("<Circuit of Travel wheel: from -")
    assert len(told) < 100


def test_bounds_of_a_fit_are_on_the_axis_of_the_ball_joints() -> None:
    """The scrub radius that the example file bounds, by the line through both joints to the ground."""
    job = load(folder("data") / "spatial" / "double_wishbone.toml")
    (bound,) = Asked(job).bounds
    motion = job.mechanism.sweep(bound.over.drive, bound.over.values, bound.over.hold)
    low, high = motion.point("wheel", (0, 720, -90)), motion.point("wheel", (5, 690, 215))
    assert job.wheel is not None
    n = motion.direction("wheel", job.wheel.outboard())
    down = n * n[:, 2:] - [0, 0, 1]
    contact = motion.point("wheel", CENTRE) + 310 * down / np.linalg.norm(down, axis=1)[:, None]
    foot = low + (high - low) * ((contact[:, 2] - low[:, 2]) / (high - low)[:, 2])[:, None]
    assert bound.name == "scrub radius"
    assert np.abs(bound.reading(motion) - (contact - foot)[:, 1]).max() < CLOSE
