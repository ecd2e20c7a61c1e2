"""Circuits of overconstrained linkages, whose conditions no fixed choice of rows keeps independent."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from catalogue.errors import NotMovable
from catalogue.spatial import Cylindrical, Joint, Link, Mechanism, Prismatic, Revolute, Spherical
from catalogue.spatial.jointed import compiled

TURN = 2 * np.pi


# -- rings of revolute joints from Denavit and Hartenberg's parameters, in a pose of their angles
def about(k: int, angle: float) -> Any:
    c, s = np.cos(angle), np.sin(angle)
    i, j = (k + 1) % 3, (k + 2) % 3
    out = np.eye(4)
    out[i, i] = out[j, j] = c
    out[j, i], out[i, j] = s, -s
    return out


def along(k: int, far: float) -> Any:
    out = np.eye(4)
    out[k, 3] = far
    return out


def axes(angles: Any, lengths: Any, twists: Any, offsets: Any) -> tuple[list[Any], Any]:
    """Return a point on each axis and its direction, and the pose of the last frame: the first one if it closes."""
    pose, out = np.eye(4), []
    for angle, a, alpha, d in zip(angles, lengths, twists, offsets, strict=True):
        out.append((pose[:3, 3].copy(), pose[:3, 2].copy()))
        pose = pose @ about(2, angle) @ along(2, d) @ along(0, a) @ about(0, alpha)
    return out, pose


def ring(joints: list[Any]) -> Mechanism:
    """Return a ring of revolute joints; the first one is its crank, on the ground, the last one closes it."""
    names = [*(f"b{k}" for k in range(1, len(joints))), "ground"]
    made = [Revolute("b1", joints[0][0], axis=joints[0][1])]
    for k in range(1, len(joints) - 1):
        made.append(Revolute(names[k], joints[k][0], axis=joints[k][1], on=names[k - 1]))
    last = len(joints) - 1
    return Mechanism([*made, Revolute(names[last - 1], joints[last][0], axis=joints[last][1], name="closing")])


def bennett_axes(a: float, b: float, alpha: float, beta: float, theta: float) -> tuple[list[Any], float]:
    """Return the axes of a linkage of Bennett's at the angle of its first joint, and that of the second."""
    ratio = np.sin((beta + alpha) / 2) / np.sin((beta - alpha) / 2)
    phi = 2 * np.arctan(ratio / np.tan(theta / 2))
    joints, pose = axes([theta, phi, -theta, -phi], [a, b, a, b], [alpha, beta, alpha, beta], np.zeros(4))
    assert np.abs(pose - np.eye(4)).max() < 1e-12
    return joints, phi


def many(linkages: list[list[Any]]) -> Mechanism:
    """Return rings as a batch."""
    return ring([(np.array([x[k][0] for x in linkages]), np.array([x[k][1] for x in linkages]))
                 for k in range(len(linkages[0]))])  # fmt: skip


def random_bennett(draw: Any) -> tuple[float, float, float, float]:
    while True:
        alpha, beta = draw.uniform(0.3, 2.8, 2)
        if abs(alpha - beta) > 0.2 and abs(alpha + beta - np.pi) > 0.2:
            a = draw.uniform(0.5, 2)
            return a, a * np.sin(beta) / np.sin(alpha), alpha, beta


@pytest.mark.parametrize("by_numba", [pytest.param(True, marks=pytest.mark.slow), False])
def test_two_hundred_bennett_linkages_turn_fully(by_numba: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lengths are to each other as the sines of the twists: each crank turns fully (Bennett 1903)."""
    if not by_numba:
        monkeypatch.setattr(compiled, "kernel", lambda: None)
    draw = np.random.default_rng(3)
    found = many([bennett_axes(*random_bennett(draw), draw.uniform(0.3, 2.8))[0] for _ in range(200)])
    assert all(c.closed and c.crank for c in found.circuits(Joint("b1")))
    turns = found.sweep(Joint("b1"), np.linspace(-np.pi, np.pi, 7))
    assert turns.success.all()
    assert turns.residual().max() < 1e-11


def goldberg(draw: Any) -> tuple[list[Any], Any]:
    """Return the axes of a Goldberg linkage: two of Bennett's with a common link, which is taken out.

    With them the angle of its first joint from the design pose, over that of the first linkage.
    """
    a, b, alpha, beta = random_bennett(draw)
    gamma = random_bennett(draw)[3]
    c = a * np.sin(gamma) / np.sin(alpha)
    one, other = draw.uniform(0.4, 2.7, 2)
    (first, _), (second, _) = bennett_axes(a, b, alpha, beta, one), bennett_axes(a, c, alpha, gamma, other)

    def seen(joints: list[Any], theta: float) -> list[Any]:
        back = about(2, -theta)[:3, :3]
        return [(back @ p, back @ z) for p, z in joints]

    first, second = seen(first, one), seen(second, other)

    def angle(theta: Any) -> Any:
        parts = []
        for q, twist in ((theta, beta), (theta - one + other, gamma)):
            ratio = np.sin((twist + alpha) / 2) / np.sin((twist - alpha) / 2)
            parts.append(2 * np.arctan2(ratio * np.cos(q / 2), np.sin(q / 2)))
        return parts[0] - parts[1]

    return [first[1], first[2], first[3], second[3], second[2]], lambda q: angle(q + one) - angle(one)


@pytest.mark.slow
def test_fifty_goldberg_linkages_go_as_far_as_their_two_bennett_linkages() -> None:
    draw = np.random.default_rng(4)
    made = [goldberg(draw) for _ in range(50)]
    q = np.linspace(0, 4 * np.pi, 4001)
    for circuit, (_, angle) in zip(many([x for x, _ in made]).circuits(Joint("b1")), made, strict=True):
        assert circuit.closed
        value = np.unwrap(angle(q))
        if abs(value[2000] - value[0]) > 1:  # both turn against each other: twice round
            assert abs(abs(circuit.trace.drive[-1] - circuit.trace.drive[0]) - abs(value[2000] - value[0])) < 1e-6
            continue
        for k, end in ((value.argmin(), min), (value.argmax(), max)):
            sign = 1 if end is min else -1

            def off_end(t: float, k: int = k, value: Any = value, angle: Any = angle, sign: int = sign) -> float:
                return float(sign * np.unwrap([value[k], *angle(np.array([t]))])[1])

            around = (q[k] - 0.01, q[k] + 0.01)
            best = minimize_scalar(off_end, bounds=around, method="bounded", options={"xatol": 1e-10})
            least = sign * best.fun
            off = [(one - least + np.pi) % TURN - np.pi for one in circuit.limits]
            assert min(map(abs, off)) < 1e-8


@pytest.mark.slow
def test_fifty_bricard_linkages_close_and_stay_symmetric_to_their_line() -> None:
    """Three axes and what a half turn makes of them: the motion keeps the line, and the curve of poses is closed."""
    draw = np.random.default_rng(5)
    made = []
    for _ in range(50):
        half = [(p, z / np.linalg.norm(z)) for p, z in draw.normal(size=(3, 2, 3))]
        made.append([*half, *((p * [-1, -1, 1], z * [-1, -1, 1]) for p, z in half)])
    rings = many(made)
    assert rings.mobility.freedoms == 1
    for i, circuit in enumerate(rings.circuits(Joint("b1"))):
        assert circuit.closed, i
        motion = circuit.motion(25)
        assert motion.residual().max() < 1e-10
        turned = [motion.joint(f"b{k}") for k in range(1, 6)]
        assert np.abs(np.sin((turned[0] - turned[3]) / 2)).max() < 1e-8
        assert np.abs(np.sin((turned[1] - turned[4]) / 2)).max() < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("alpha", [1.1, np.pi / 2, 2.0])
def test_a_threefold_bricard_linkage_closes_through_any_angle(alpha: float) -> None:
    """Angles alternate and satisfy one equation (Chen, You and Tarnai 2005, (7))."""
    theta = 0.9 if alpha != np.pi / 2 else np.pi / 2 + 0.4
    c, s = np.cos(alpha), np.sin(alpha)
    p, q = s * s + (1 + c * c) * np.cos(theta), -2 * c * np.sin(theta)
    phi = np.arctan2(q, p) + np.arccos(-(c * c + s * s * np.cos(theta)) / np.hypot(p, q))
    joints, pose = axes([theta, phi] * 3, np.ones(6), [alpha, -alpha] * 3, np.zeros(6))
    assert np.abs(pose - np.eye(4)).max() < 1e-12
    circuit = ring(joints).circuit(Joint("b1"))
    assert circuit.closed
    turned = circuit.motion(40)
    one, other = turned.joint("b1") + theta, turned.joint("b2") + phi
    left = c * c + s * s * (np.cos(one) + np.cos(other)) + (1 + c * c) * np.cos(one) * np.cos(other)
    assert np.abs(left - 2 * c * np.sin(one) * np.sin(other)).max() < 1e-9


def test_a_sarrus_linkage_lifts_straight() -> None:
    x, y = (1.0, 0, 0), (0, 1.0, 0)
    chains = [("a", y, (2.0, 0, 0), (3.0, 0, 1), (2.0, 0, 2)), ("b", x, (0, 2.0, 0), (0, 3.5, 0.8), (0, 2.0, 2))]
    made: list[Any] = []
    for name, axis, low, middle, high in chains:
        made += [Revolute(f"{name}1", low, axis=axis), Revolute(f"{name}2", middle, axis=axis, on=f"{name}1")]
        made.append(Revolute("top", high, axis=axis, on=f"{name}2"))
    mechanism = Mechanism(made)
    assert mechanism.mobility.freedoms == 1
    motion = mechanism.sweep(Joint("a1"), np.linspace(-0.7, 0.6, 27))
    assert motion.success.all()
    moved = motion.point("top", (0.3, 0.2, 2)) - (0.3, 0.2, 2)
    assert np.abs(moved[:, :2]).max() < 1e-11
    assert np.abs(moved[:, 2] - 2 * (np.cos(motion.drive) - np.sin(motion.drive) - 1)).max() < 1e-10


def cranks(*pivots: tuple[float, float]) -> Mechanism:
    """Return parallel cranks of length 1, at right angles to the x axis, which one body joins."""
    z, made = (0, 0, 1.0), list[Any]()
    for k, (x, y) in enumerate(pivots):
        made += [Revolute(f"c{k}", (x, y, 0), axis=z), Revolute("bar", (x, y + 1, 0), axis=z, on=f"c{k}")]
    return Mechanism(made)


@pytest.mark.slow
def test_parallel_cranks_change_where_their_pivots_are_in_line_and_else_turn_fully() -> None:
    for pivots in (((0, 0), (3, 0)), ((0, 0), (3, 0), (5, 0)), ((0, 0), (1, 0), (2, 0), (7, 0))):
        circuit = cranks(*pivots).circuit(Joint("c0"))
        assert circuit.reason == "branch point"
        assert np.abs(np.array(circuit.limits) - [-np.pi / 2, np.pi / 2]).max() < 1e-4
    for pivots in (((0, 0), (3, 0), (5, 1)), ((0, 0), (3, 0), (5, 1), (2, -3))):
        assert cranks(*pivots).circuit(Joint("c0")).crank


def test_a_scott_russell_linkage_with_both_slides_turns_fully() -> None:
    z, angle = (0, 0, 1.0), 0.4
    end = 2 * np.array([np.cos(angle), np.sin(angle), 0])
    mechanism = Mechanism(
        [
            Revolute("crank", (0, 0, 0), axis=z),
            Revolute("bar", end / 2, axis=z, on="crank"),
            Prismatic("across", (1, 0, 0)),
            Prismatic("up", (0, 1, 0)),
            Revolute("bar", end * [1, 0, 0], axis=z, on="across"),
            Revolute("bar", end * [0, 1, 0], axis=z, on="up"),
        ]
    )
    assert mechanism.mobility.freedoms == 1
    assert mechanism.circuit(Joint("crank")).crank


# -- what the design pose is ------------------------------------------------------------------------------------------
def test_a_stretched_linkage_is_said_to_be_singular(recwarn: pytest.WarningsRecorder) -> None:
    z = (0, 0, 1.0)
    every: list[list[Any]] = [
        [Revolute("a", (0, 0, 0), axis=z), Revolute("b", (1, 0, 0), axis=z, on="a"),
         Revolute("c", (3, 0, 0), axis=z), Revolute("b", (2, 0, 0), axis=z, on="c")],
        [Revolute("a", (0, 0, 0), axis=z), Revolute("c", (3, 0, 0), axis=z), Link("a", (1, 0, 0), "c", (2, 0, 0))],
    ]  # fmt: skip
    for flat in every:
        with pytest.raises(NotMovable, match="singular"):
            Mechanism(flat).sweep(Joint("a"), [0.1])
    assert not recwarn.list


def test_a_piston_between_a_cylindrical_joint_and_a_ball_is_idle() -> None:
    """It slides as the arm tells it; who drives its rotation has one more freedom."""
    low, high = np.array([0.0, 500, 0]), np.array([0.0, 400, 500])
    axis = high - low
    arm: list[Any] = [
        Revolute("arm", (0, 0, 0), axis=(1, 0, 0)),
        Revolute("rocker", (0, 300, 600), axis=(1, 0, 0)),
        Cylindrical("piston", high, axis=axis, on="rocker"),
        Spherical("piston", low, on="arm"),
    ]
    mobility = Mechanism(arm).mobility
    assert mobility.idle == ("piston",)
    assert mobility.freedoms == 1
    motion = Mechanism(arm).sweep(Joint("arm"), [-0.1, 0.1, 0.2])
    foot, head, slide = motion.point("arm", low), motion.point("rocker", high), motion.joint("piston", 1)
    assert np.abs(np.linalg.norm(head - foot, axis=1) - np.linalg.norm(axis) + slide).max() < 1e-9
    freed = Mechanism(arm).sweep({Joint("arm"): [0.1], Joint("piston"): [0.5]})
    assert freed.joint("piston") == pytest.approx(0.5)


def test_a_telescope_between_two_balls_spins_idly() -> None:
    top, foot = np.array([0.0, 400, 500]), np.array([0.0, 500, 0])
    strut: list[Any] = [
        Revolute("arm", (0, 0, 0), axis=(1, 0, 0.1)),
        Spherical("tube", top),
        Prismatic("rod", foot - top, on="tube"),
        Spherical("rod", foot, on="arm"),
    ]
    assert Mechanism(strut).mobility.idle == ("tube",)
    motion = Mechanism(strut).sweep(Joint("arm"), np.linspace(-0.4, 0.4, 9))
    far = np.linalg.norm(motion.point("rod", foot) - top, axis=1)
    assert np.abs(motion.joint("rod") - (far - np.linalg.norm(foot - top))).max() < 1e-10


def test_a_rounded_linkage_says_by_how_much_it_is_missed() -> None:
    joints = [(p.round(6), z.round(6)) for p, z in bennett_axes(100, 160, np.radians(30), np.arcsin(0.8), 0.7)[0]]
    with pytest.raises(NotMovable, match=r"if closing could be off by \S+e-0[5-7] mm"):
        ring(joints).sweep(Joint("b1"), [0.1])


def test_a_batch_of_which_one_is_no_linkage_says_so_over_several_drives() -> None:
    """Of the second the closing axis is tilted: the conditions that the first implies are missed."""
    up, tilted = (0, 0, 1.0), np.array([[0, 0, 1.0], [0.1, 0, 1.0]])
    loop: list[Any] = [
        Revolute("crank", (0, 0, 0), axis=up), Revolute("rocker", (4, 0, 0), axis=up),
        Revolute("coupler", (1, 0, 0), axis=up, on="crank"), Revolute("coupler", (4, 3, 0), axis=tilted, on="rocker"),
        Prismatic("slide", (1, 0, 0)),
    ]  # fmt: skip
    motion = Mechanism(loop).sweep({Joint("crank"): [0.0, 0.3], Joint("slide"): [0.0, 1.0]})
    assert motion.success.tolist() == [[True] * 2, [False] * 2]
    assert "not met in this one" in motion.stops[1][0]
