"""Assemblies counted: no joint put in reversed, none missed in silence, against public counts and another solver."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

from catalogue.spatial import Angle, Cylindrical, Joint, Length, Link, Mechanism, Prismatic, Revolute, Spherical
from tests.spatial.test_files import run
from tests.spatial.test_overconstrained import axes, ring

Z = (0, 0, 1.0)
#: A hand of six revolute joints (Manseur and Doty 1989): lengths, twists, offsets.
HAND = [0.3, 1, 0, 1.5, 0, 0], np.radians([90, 1, 90, 1, 90, 1.0]), [0, 0, 0.2, 0, 0, 0]
#: A platform that has 40 postures (Dietmaier 1998): points of base and platform, and lengths of legs.
BASE = [[0, 0, 0], [1.107915, 0, 0], [0.549094, 0.756063, 0], [0.735077, -0.223935, 0.525991],
        [0.514188, -0.526063, -0.368418], [0.590473, 0.094733, -0.205018]]  # fmt: skip
TOP = [[0, 0, 0], [0.542805, 0, 0], [0.956919, -0.528915, 0], [0.665885, -0.353482, 1.402538],
       [0.478359, 1.158742, 0.107672], [-0.137087, -0.235121, 0.353913]]  # fmt: skip
LEGS = [1, 0.645275, 1.086284, 1.503439, 1.281933, 0.771071]


def postures(angles: Any, starts: int) -> int:
    """Count the postures of the hand by another solver: the product of its matrices, from random angles."""
    target, draw, found = axes(angles, *HAND)[1], np.random.default_rng(2), list[Any]()

    def off(q: Any) -> Any:
        return (axes(q, *HAND)[1] - target)[:3].ravel()

    for start in draw.uniform(-np.pi, np.pi, (starts, 6)):
        best = least_squares(off, start, xtol=1e-14)
        mark = np.exp(1j * best.x)
        if best.cost < 1e-12 and not any(np.abs(mark - other).max() < 1e-4 for other in found):
            found.append(mark)
    return len(found)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("angles", "count"),
    [([0.8, 2.5, 1.7, -1.7, -1.3, 2.3], 16), ([-2.6, -1.7, 1.9, 0.5, -2.6, -0.4], 12)],
)
def test_a_hand_of_six_revolute_joints_has_twelve_or_sixteen_postures(angles: Any, count: int) -> None:
    assert postures(angles, 150) == count
    joints, pose = axes(angles, *HAND)
    closed = ring([*joints, (pose[:3, 3], pose[:3, 2])])
    found = closed.assemblies(Angle("b6", pose[:3, 0], pose[:3, 2]), 0.0, hits=8)
    assert len(found.hits) == count
    assert found.even
    assert found.motion.residual().max() < 1e-10


@pytest.mark.slow
def test_a_joint_is_not_closed_reversed() -> None:
    """Of a slider-crank closed by its slide and of a spherical four-bar there are two assemblies, not four."""
    crank, rod = Revolute("crank", (0, 0, 0), axis=Z), Revolute("rod", (1, 0, 0), axis=Z, on="crank")
    pin = Revolute("block", (4, 0, 0), axis=Z, on="rod")
    for slide in (Prismatic("block", (1, 0, 0)), Cylindrical("block", (4, 0, 0), axis=(1, 0, 0))):
        assert len(Mechanism([crank, rod, pin, slide]).assemblies(Joint("crank"), 0.3).hits) == 2
    tilted: Any = [np.array([np.sin(a), 0.3 * a, np.cos(a)]) for a in (0.2, 0.7, 1.0, 1.3)]
    mechanism = Mechanism(
        [
            Revolute("a", (0, 0, 0), axis=tilted[0]), Revolute("b", (0, 0, 0), axis=tilted[1], on="a"),
            Revolute("c", (0, 0, 0), axis=tilted[3]), Revolute("b", (0, 0, 0), axis=tilted[2], on="c"),
        ]
    )  # fmt: skip
    assert len(mechanism.assemblies(Joint("a"), 0.0).hits) == 2
    ball = Mechanism([crank, Revolute("rocker", (4, 0, 0), axis=Z), Spherical("rod", (1, 0, 0), on="crank"),
                      Spherical("rocker", (4, 3, 0), on="rod")])  # fmt: skip
    assert len(ball.assemblies(Joint("crank"), 0.3).hits) == 2


def platform() -> tuple[Any, Any]:
    """Return the legs' ends of a platform in one of its postures."""

    def lengths(v: Any) -> Any:
        w, x, y, z = v[:4]
        turn = np.array([[w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
                         [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
                         [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]])  # fmt: skip
        at = np.asarray(TOP) @ turn.T + v[4:]
        return at, np.array([*((at - BASE) ** 2).sum(1) - np.square(LEGS), v[:4] @ v[:4] - 1])

    def off(v: Any) -> Any:
        return lengths(v)[1]

    draw = np.random.default_rng(0)
    while True:
        best = least_squares(off, draw.normal(size=7), xtol=1e-15, ftol=1e-15, gtol=1e-15)
        if best.cost < 1e-24:
            return BASE, lengths(best.x)[0]


@pytest.mark.slow
def test_a_platform_with_forty_postures_says_what_may_be_missing_and_finds_all(tmp_path: Path) -> None:
    base, top = platform()
    made = Mechanism(
        [Link("ground", a, "top", b, name=f"leg {k}") for k, (a, b) in enumerate(zip(base, top, strict=True))]
    )
    few = made.assemblies(Length(link="leg 0"), 1.0, most=1024)
    assert few.starts == 1024
    assert len(few.hits) < 40
    assert few.scarce
    assert "others may be missing" in few.remarks()[1]
    many = made.assemblies(Length(link="leg 0"), 1.0, most=40_000)
    assert len(many.hits) == 40
    assert not many.scarce
    assert len(many.remarks()) == 1
    file = tmp_path / "platform.json"
    links = [{"name": f"leg {k}", "a": "ground", "from": list(map(float, a)), "b": "top", "to": list(map(float, b))}
             for k, (a, b) in enumerate(zip(base, top, strict=True))]  # fmt: skip
    file.write_text(json.dumps({"unit": "m", "link": links, "drive": {"leg": {"kind": "length", "link": "leg 0"}}}))
    done = run("assemblies", str(file), "--drive", "leg", "--at", "1", "--most", "600", "--hits", "9", "--seed", "4")
    assert "found by 600 random starts" in done.stderr
    assert "others may be missing" in done.stderr


def test_an_odd_number_is_told_where_loops_are_closed_by_independent_conditions() -> None:
    """Not of a pair of wheels without a loop, nor of parallel cranks, whose conditions imply each other."""
    wheels = [Revolute("a", (0, 0, 0), axis=Z), Revolute("b", (3, 0, 0), axis=Z, on="a")]
    free = Mechanism(wheels).assemblies(Joint("a"), 0.2, [Joint("b")])
    assert len(free.hits) == 1
    assert not any("odd" in line for line in free.remarks())
    rocker = Revolute("rocker", (4, 0, 1), axis=(0, 1, 0))
    rssr = Mechanism([wheels[0], rocker, Link("a", (1, 0, 0), "rocker", (4, 0, 3))])
    assert len(rssr.assemblies(Joint("a"), 0.2).hits) == 2
    one = next(
        found for seed in range(9) if len((found := rssr.assemblies(Joint("a"), 0.2, most=1, seed=seed)).hits) == 1
    )
    assert any("odd" in line for line in one.remarks())
