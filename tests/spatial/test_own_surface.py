"""A user's own surface, loaded from a file outside the package, in both halves of `catalogue.spatial`."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue.spatial import (
    GuideCoordinate,
    Guides,
    Joint,
    Link,
    Mechanism,
    Mechanisms,
    OnGuide,
    Revolute,
    follow,
    jets,
)

OWN = Path(__file__).parent / "dropin" / "ellipsoid.py"


@pytest.fixture
def ellipsoid() -> Any:
    return runpy.run_path(str(OWN))["Ellipsoid"]()


def test_it_is_short() -> None:
    code = OWN.read_text("utf-8").split("class Ellipsoid")[1]
    assert len([line for line in code.splitlines() if line.strip()]) <= 15


def test_a_guided_body_runs_on_it(ellipsoid: Any) -> None:
    """Class III: two circles and the ellipsoid; the point stays on it, and of equal axes it is the sphere."""
    body = [(0, 0, 0), (0, 0, 1.745), (1.655, 0, 0.516)]
    circles = [
        Guides("circle", [0.5]),
        Guides("circle", [0.9], (1.6, 0.2, 0.3), (2, 2, 1, 0)),
    ]
    path, start = [[0.8], [0.9]], [[0.8, np.nan], [2.1, np.nan], [1.2, 0.3]]
    for axes in ((0.8, 0.9, 1.0), (0.9, 0.9, 0.9)):
        own = Guides(ellipsoid, axes, (0.4, -1.1, 0.2))
        batch = Mechanisms(body, [*circles, own], [(0, "u")])
        motion = follow(batch, path, start)
        assert motion.reason.tolist() == [""]
        x = motion.positions.points[:, 2] - np.array([0.4, -1.1, 0.2])
        assert np.abs(((x / axes) ** 2).sum(1) - 1).max() < 1e-13
        velocity = jets(batch, motion.node(1), [[1.0]]).points[0, 2, 1]
        assert abs((x[1] / np.square(axes)) @ velocity) < 1e-12
    sphere = Mechanisms(body, [*circles, Guides("sphere:zpole", [0.9], (0.4, -1.1, 0.2))], [(0, "u")])
    assert np.abs(follow(sphere, path, start).positions.points - motion.positions.points).max() < 1e-13


def test_a_mechanism_of_joints_runs_on_it(ellipsoid: Any) -> None:
    """A rod between a crank and an arm that turns, its middle on the ellipsoid; driven by the crank and by u."""
    at = np.array([0.8 * np.cos(0.3) * np.cos(0.2), 0.9 * np.sin(0.3) * np.cos(0.2), np.sin(0.2)])
    arm: list[Any] = [
        Revolute("arm", (0, 0, 2), axis=(1, 0, 0.5)),
        OnGuide("arm", at, ellipsoid, (0.8, 0.9, 1.0), name="egg", on="cradle"),
    ]
    mechanism = Mechanism(
        [*arm, Revolute("cradle", (0.1, 0.2, 0), axis=(0, 1, 1)), Revolute("crank", (3, 0, 0), axis=(0, 0, 1)),
         Link("crank", (3.5, 0, 0), "arm", (1, 1, 1), name="rod")]
    )  # fmt: skip
    assert mechanism.mobility.freedoms == 1
    motion = mechanism.sweep(Joint("crank"), np.linspace(0, 0.2, 11))
    assert motion.success.all()
    x = np.einsum("sji,sj->si", motion.rotation("cradle"), motion.point("arm", at) - motion.point("cradle", (0, 0, 0)))
    assert np.abs(((x / (0.8, 0.9, 1.0)) ** 2).sum(1) - 1).max() < 1e-14
    u = np.arctan2(x[:, 1] / 0.9, x[:, 0] / 0.8)
    again = mechanism.sweep(GuideCoordinate("egg", "u"), u)
    assert np.abs(again.joint("crank") - motion.drive).max() < 1e-11
    assert np.abs(again.joint("crank", order=2)[:, 1] * np.gradient(u, motion.drive, edge_order=2) - 1).max() < 5e-3
