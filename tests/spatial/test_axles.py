"""Axles from hard points, against a solver that knows wheel carriers as tetrahedra of distances."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from catalogue.spatial import Joint, Link, Mechanism, OnGuide, Prismatic, Revolute, Spherical, Travel, Wheel, kinematics
from tests.precision import EXTENDED

INNER = np.array([[-120, 450, 230], [130, 440, 240], [-150, 400, -60], [140, 390, -70], [90, 420, -10.0]])
OUTER = np.array([[-10, 690, 210], [15, 695, 215], [-20, 720, -90], [25, 715, -95], [110, 700, -5.0]])
CENTRE, AXIS = np.array([0, 760.0, 0]), np.array([0.01, 1, -0.02])
ALONG = CENTRE + 100 * AXIS


# -- an independent solution: four points of the carrier by their distances, the others as affine combinations
class Carrier:
    """Points of a rigid body: the first four are unknown, the others follow; no rotation occurs."""

    def __init__(self, points: Any) -> None:
        self.points = np.asarray(points, float)
        base = np.vstack([self.points[:4].T, np.ones(4)])
        every = np.vstack([self.points.T, np.ones(len(points))])
        self.share = np.linalg.solve(base, every).astype(np.longdouble)
        for _ in range(3):  # refined in extended precision
            self.share += np.linalg.solve(base, (every - base.astype(np.longdouble) @ self.share).astype(float))
        self.pairs = [(i, j) for i in range(4) for j in range(i)]

    def all(self, x: Any) -> Any:
        return (x.reshape(4, 3).T @ self.share).T

    def rigid(self, x: Any) -> list[Any]:
        p = x.reshape(4, 3)
        now = [((p[i] - p[j]) ** 2).sum() for i, j in self.pairs]
        return [a - ((self.points[i] - self.points[j]) ** 2).sum() for a, (i, j) in zip(now, self.pairs, strict=True)]

    def path(self, conditions: Any, values: Any, index: int) -> Any:
        """Return all points where the point of an index is at a height, by steps of a few millimetres."""
        out = {}
        for way in (1, -1):
            x = self.points[:4].ravel().copy()
            for v in sorted((v for v in values if way * v >= 0), key=abs):

                def equations(x: Any, v: float = v) -> Any:
                    p = self.all(x)
                    return np.array([*self.rigid(x), *conditions(p), p[index, 2] - self.points[index, 2] - v])

                x = polished(equations, x)
                out[v] = self.all(x)
        return np.array([out[v] for v in values], float)


def polished(equations: Any, x: Any) -> Any:
    """Newton's method with derivatives by complex steps; residuals and steps add up in extended precision."""
    x = np.asarray(x, np.longdouble)
    for _ in range(8):
        jacobian = np.stack([equations(x.astype(float) + 1e-30j * e).imag / 1e-30 for e in np.eye(len(x))], axis=1)
        x = x - np.linalg.solve(jacobian.astype(float), equations(x).astype(float))
    return x


def lengths(inner: Any, outer: Any) -> Any:
    """Return the conditions that the first points of a carrier keep their distances."""
    inner, outer = np.asarray(inner, float), np.asarray(outer, float)
    return lambda p: ((p[: len(inner)] - inner) ** 2).sum(1) - ((outer - inner) ** 2).sum(1)


def toe_camber(points: Any) -> tuple[Any, Any]:
    n = points[:, -1] - points[:, -2]
    n = n / np.linalg.norm(n, axis=1)[:, None]
    return np.degrees(np.arctan(n[:, 0] / n[:, 1])), -np.degrees(np.arcsin(n[:, 2]))


Z = np.linspace(-80, 80, 33)


def agrees(mechanism: Mechanism, expected: Any, body: str = "wheel") -> None:
    """The wheel centre to 1e-10 mm, toe and camber to a ten-billionth of a degree, if the reference is so exact."""
    close = 1e-10 if EXTENDED else 1e-9
    motion = mechanism.sweep(Travel(body, CENTRE), Z)
    table = kinematics(motion, Wheel(body, tuple(CENTRE), tuple(AXIS), 310.0))
    assert motion.success.all()
    assert np.abs(motion.point(body, CENTRE) - expected[:, -2]).max() < close
    toe, camber = toe_camber(expected)
    assert np.abs(table["toe [deg]"] - toe).max() < close
    assert np.abs(table["camber [deg]"] - camber).max() < close


@pytest.mark.slow
def test_five_links() -> None:
    mechanism = Mechanism([Link("ground", a, "wheel", b) for a, b in zip(INNER, OUTER, strict=True)])
    agrees(mechanism, Carrier([*OUTER, CENTRE, ALONG]).path(lengths(INNER, OUTER), Z, 5))


def test_the_page_of_the_documents_has_fourteen_lines() -> None:
    from pathlib import Path

    text = (Path(__file__).parents[2] / "data/documents/how-to/space.md").read_text("utf-8")
    code = text.split("<!-- five-link -->\n```python\n")[1].split("```")[0]
    assert len(code.strip().splitlines()) <= 14
    names: dict[str, Any] = {}
    exec(code, names)
    table = names["table"]
    assert len(table) == 161
    assert np.abs(table["travel [mm]"] - np.linspace(-80, 80, 161)).max() < 1e-9


LOWER = [(-150, 400, -60.0), (140, 390, -70.0)]
UPPER = [(-120, 450, 230.0), (130, 440, 240.0)]
BALLS = [(0, 720, -90.0), (5, 690, 215.0)]
ROD = [(110, 420, -10.0), (115, 700, -5.0)]


@pytest.mark.slow
def test_double_wishbone() -> None:
    """Wishbones as bodies on revolute joints, beside two links each for the other solver."""
    mechanism = Mechanism(
        [
            Revolute("lower", LOWER[0], to=LOWER[1]),
            Revolute("upper", UPPER[0], to=UPPER[1]),
            Spherical("wheel", BALLS[0], on="lower"),
            Spherical("wheel", BALLS[1], on="upper"),
            Link("ground", ROD[0], "wheel", ROD[1], name="tie rod"),
        ]
    )
    inner = np.array([*LOWER, *UPPER, ROD[0]])
    outer = np.array([BALLS[0], BALLS[0], BALLS[1], BALLS[1], ROD[1]])
    carrier = Carrier([BALLS[0], BALLS[1], ROD[1], CENTRE, ALONG])

    def conditions(p: Any) -> Any:
        return ((p[[0, 0, 1, 1, 2]] - inner) ** 2).sum(1) - ((outer - inner) ** 2).sum(1)

    agrees(mechanism, carrier.path(conditions, Z, 3))


@pytest.mark.slow
def test_mcpherson() -> None:
    """The upper mount stays on the axis of the strut, which the carrier holds: a line that the carrier moves."""
    mount, low = np.array([-20, 600, 560.0]), np.array([0, 680, 120.0])
    along = (mount - low) / np.linalg.norm(mount - low)
    turn = np.array([1 + along[2], -along[1], along[0], 0])  # from z to the axis
    mechanism = Mechanism(
        [
            Revolute("lower", LOWER[0], to=LOWER[1]),
            Spherical("wheel", BALLS[0], on="lower"),
            OnGuide("ground", mount, "line", origin=low, quaternion=turn, on="wheel"),
            Link("ground", ROD[0], "wheel", ROD[1]),
        ]
    )
    carrier = Carrier([BALLS[0], ROD[1], low, low + 200 * along + [100, 0, 0], low + 300 * along, CENTRE, ALONG])
    inner = np.array([*LOWER, ROD[0]])
    outer = np.array([BALLS[0], BALLS[0], ROD[1]])

    def conditions(p: Any) -> Any:
        held = ((p[[0, 0, 1]] - inner) ** 2).sum(1) - ((outer - inner) ** 2).sum(1)
        off = np.cross(p[4] - p[2], mount - p[2])
        return [*held, off[0], off[1]]

    agrees(mechanism, carrier.path(conditions, Z, 5))


def test_a_rack_steers_and_shows_the_steering_axis() -> None:
    """Of two ball joints the steering axis goes through both."""
    rack = Joint("rack")
    mechanism = Mechanism(
        [
            Revolute("lower", LOWER[0], to=LOWER[1]),
            Revolute("upper", UPPER[0], to=UPPER[1]),
            Spherical("wheel", BALLS[0], on="lower"),
            Spherical("wheel", BALLS[1], on="upper"),
            Prismatic("rack", (0, 1, 0)),
            Link("rack", ROD[0], "wheel", ROD[1]),
        ]
    )
    assert mechanism.mobility.freedoms == 2
    motion = mechanism.sweep(Travel("wheel", CENTRE), Z, hold=[rack])
    table = kinematics(motion, Wheel("wheel", tuple(CENTRE), tuple(AXIS), 310.0), steer=rack)
    low, high = (motion.point("wheel", b) for b in BALLS)
    k = high - low
    assert np.abs(table["caster [deg]"] - np.degrees(np.arctan2(-k[:, 0], k[:, 2]))).max() < 1e-9
    assert np.abs(table["kingpin inclination [deg]"] - np.degrees(np.arctan2(-k[:, 1], k[:, 2]))).max() < 1e-9


def test_rates_and_centres_are_those_of_the_path() -> None:
    """Roll centre and support angles by differences of what two poses show."""
    mechanism = Mechanism([Link("ground", a, "wheel", b) for a, b in zip(INNER, OUTER, strict=True)])
    wheel = Wheel("wheel", tuple(CENTRE), tuple(AXIS), 310.0)
    h = 1e-3
    motion = mechanism.sweep(Travel("wheel", CENTRE), [-h, 0.0, h])
    table = kinematics(motion, wheel)
    n = wheel.outboard()
    down = n * n[2] - [0, 0, 1]
    contact = CENTRE + 310 * down / np.linalg.norm(down)
    path = motion.point("wheel", contact)
    slope = (path[2] - path[0]) / (2 * h)
    assert table["half track [mm]"][1] == pytest.approx(contact[1], abs=1e-9)
    assert table["roll centre [mm]"][1] == pytest.approx(contact[1] * slope[1] / slope[2], abs=1e-6)
    lean = np.degrees(np.arctan2(slope[0], slope[2]))
    assert table["support angle of contact [deg]"][1] == pytest.approx(lean, abs=1e-6)
    axis = table.filter(like="screw axis").to_numpy()[1]
    pitch = table["pitch [mm/rad]"][1]
    spin, at = motion.spin("wheel")[1, 0], axis[3:]
    v = motion.point("wheel", CENTRE, 1)[1, 1]
    assert np.allclose(v, np.cross(spin, CENTRE - at) + pitch * spin, atol=1e-12)
