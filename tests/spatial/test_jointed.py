"""Mechanisms of joints and links against closed forms: full turns, dead points, freedoms, derivatives, wrong drives."""

from __future__ import annotations

from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np
import pytest

from catalogue.errors import CannotDrive, InvalidLinkage, InvalidRequest, NotMovable
from catalogue.kinematics.types import Array
from catalogue.spatial import (
    Angle,
    Cylindrical,
    GuideCoordinate,
    Joint,
    KeepAngle,
    Length,
    Link,
    Load,
    Mechanism,
    OnGuide,
    Prismatic,
    Revolute,
    Screw,
    Spherical,
    Travel,
    Wheel,
    in_time,
    kinematics,
    reactions,
    sensitivities,
    transmission,
)
from catalogue.spatial.continuation.dead_points import _with_node, dead_points
from catalogue.spatial.continuation.newton import across


def rssr(crank: Any, axis: Any, at: Any, rocker: Any, other: Any) -> Mechanism:
    """Crank about the origin, rocker about a point, and the link from point to point."""
    return Mechanism(
        [
            Revolute("crank", (0, 0, 0), axis=axis),
            Revolute("rocker", at, axis=other),
            Link("crank", crank, "rocker", rocker),
        ]
    )


PIN = (0.8, 0.6, 0.0)
RSSR = ((1.0, 0, 0), (0, 0, 1), (4.0, 0, 1), (4.0, 0.5, 4), (0, 1, 0))


def closed(q: Any, guess: Any) -> Any:
    """The rocker of `RSSR` in closed form, by mpmath: A cos p + B sin p + C = 0, the root next to a guess."""
    a = mp.matrix([mp.cos(q), mp.sin(q), 0])
    d = [4 - a[0], mp.mpf("0.5") - a[1], 1 - a[2]]
    square = (mp.mpf(4) - 1) ** 2 + mp.mpf("0.25") + 16
    # the rocker's end is (4 + 3 sin p, 0.5, 1 + 3 cos p)
    big_a, big_b, big_c = 6 * d[2], 6 * d[0], d[0] ** 2 + d[1] ** 2 + d[2] ** 2 + 9 - square
    middle, half = mp.atan2(big_b, big_a), mp.acos(-big_c / mp.sqrt(big_a**2 + big_b**2))
    roots = [middle + half, middle - half]
    return min((r + 2 * mp.pi * mp.nint((guess - r) / (2 * mp.pi)) for r in roots), key=lambda r: abs(r - guess))


@pytest.mark.slow
def test_a_full_turn_of_an_rssr_is_the_closed_form() -> None:
    """Positions to 1e-12, three derivatives to 1e-10; there is no idle rotation, and the turn closes."""
    mechanism = rssr(*RSSR)
    assert mechanism.mobility.freedoms == 1
    q = np.linspace(0, 2 * np.pi, 73)
    motion = mechanism.sweep(Joint("crank"), q)
    assert motion.success.all()
    got = motion.joint("rocker", order=3)
    with mp.workdps(40):
        guess = mp.mpf(0)
        for value, row in zip(q, got, strict=True):
            guess = closed(mp.mpf(float(value)), guess)
            exact = [mp.diff(lambda t, g=guess: closed(t, g), mp.mpf(float(value)), k) for k in range(4)]
            assert abs(row[0] - exact[0]) < 1e-12
            assert max(abs(row[k] - exact[k]) for k in (1, 2, 3)) < 1e-10


def discriminant(crank: Any, axis: Any, at: Any, rocker: Any, other: Any) -> Any:
    """A^2 + B^2 - C^2 of the closed input-output equation over a turn of the crank."""
    q = np.linspace(0, 2 * np.pi, 4001)[:, None]
    axis, other = axis / np.linalg.norm(axis), other / np.linalg.norm(other)
    a = crank * np.cos(q) + np.cross(axis, crank) * np.sin(q) + axis * (axis @ crank) * (1 - np.cos(q))
    b = rocker - at
    along = other * (other @ b)
    one, two = b - along, np.cross(other, b)
    d = at + along - a
    return (2 * d @ one) ** 2 + (2 * d @ two) ** 2 - ((d**2).sum(1) + one @ one - ((rocker - crank) ** 2).sum()) ** 2


def random_rssr(draw: np.random.Generator) -> Any:
    at = draw.uniform(-2, 2, 3)
    return draw.uniform(-1, 1, 3), draw.normal(size=3), at, at + draw.uniform(-1, 1, 3), draw.normal(size=3)


@pytest.mark.slow
def test_a_thousand_rssr_are_cranks_or_rockers_as_the_discriminant_says() -> None:
    draw = np.random.default_rng(0)
    drawn = [random_rssr(draw) for _ in range(1000)]
    together = rssr(*(np.stack(column) for column in zip(*drawn, strict=True)))
    cranks = 0
    for data, circuit in zip(drawn, together.circuits(Joint("crank")), strict=True):
        assert circuit.closed
        values = discriminant(*data)
        if np.abs(values).min() < 1e-6 * np.abs(values).max() and (values > -1e-6).all():
            continue  # the sampled discriminant cannot tell
        assert circuit.crank == (values > 0).all()
        cranks += circuit.crank
    assert 100 < cranks < 900


@pytest.mark.slow
def test_a_rocker_has_the_dead_points_of_the_discriminant() -> None:
    draw = np.random.default_rng(4)
    for _ in range(20):
        data = random_rssr(draw)
        values = discriminant(*data)
        if (values > 0).all():
            continue
        circuit = rssr(*data).circuit(Joint("crank"))
        k = np.flatnonzero(values[:-1] * values[1:] < 0)
        angle = (k + values[k] / (values[k] - values[k + 1])) * 2 * np.pi / 4000
        for dead in circuit.dead_points:
            assert np.abs(np.angle(np.exp(1j * (angle - dead)))).min() < 1e-4
        motion = circuit.motion(200)
        assert motion.residual().max() < 1e-12
        assert motion.drive.min() >= circuit.limits[0] - 1e-9
        inside = rssr(*data).sweep(Joint("crank"), np.linspace(-7, 7, 101))
        assert (inside.success == ((inside.drive >= circuit.limits[0]) & (inside.drive <= circuit.limits[1]))).all()
        assert all(reason == "dead point" for _, reason in inside.ends[0])


@pytest.mark.slow
def test_dead_points_are_the_same_by_the_joint_and_by_the_angle_of_an_arm() -> None:
    """The angle of an arm is periodic, that of a joint is not; RSSR that turn back before a turn or after it."""
    draw = np.random.default_rng(4)
    for _ in range(3):
        data = random_rssr(draw)
        axis = np.array(data[1])
        by_joint = rssr(*data).circuit(Joint("crank"))
        by_angle = rssr(*data).circuit(Angle("crank", np.cross(axis, (0.3, 0.2, 1.0)), axis))
        assert len(by_joint.dead_points) == 2
        np.testing.assert_allclose(by_angle.dead_points, by_joint.dead_points, atol=1e-9)
        np.testing.assert_allclose(by_angle.limits, by_joint.limits, atol=1e-9)


@pytest.mark.parametrize("part", [0.2, 0.05])
def test_a_dead_point_a_little_beyond_two_nodes_is_found_too(part: float) -> None:
    """As where nodes are not exact: the node beyond it is moved before it by a part of the interval."""
    circuit = rssr(*random_rssr(np.random.default_rng(4))).circuit(Joint("crank"))
    curve, trace = circuit.curve, circuit.trace
    turns = np.flatnonzero(trace.slope[:-1] * trace.slope[1:] < 0)
    assert len(turns) == 2
    for k in turns.tolist():
        found = dead_points(curve, trace.take([k]), trace.take([k + 1]))
        s, state = float(found.s[0]), found.y[0]
        y, tangent, slope = across(curve, trace.at(np.array([s - part * (s - trace.s[k])])), trace.tangent[k][None])
        before = trace._replace(**{name: getattr(trace, name).copy() for name in trace._fields if name != "reason"})
        before.s[k + 1] = s - part * (s - trace.s[k])
        before.y[k + 1], before.rate[k + 1] = y[0], curve.system.lifted(y, tangent)[0]
        before.tangent[k + 1], before.slope[k + 1] = tangent[0], slope[0]
        assert before.slope[k] * before.slope[k + 1] > 0
        again = dead_points(curve, before.take([k]), before.take([k + 1]))
        np.testing.assert_allclose(again.y[0], state, atol=1e-8)


def test_the_drive_at_a_node_that_is_put_between_two_is_between_theirs() -> None:
    """The angle of an arm goes on from the node before, beyond half a turn too."""
    data = random_rssr(np.random.default_rng(4))
    axis = np.array(data[1])
    circuit = rssr(*data).circuit(Angle("crank", np.cross(axis, (0.3, 0.2, 1.0)), axis))
    curve, trace = circuit.curve, circuit.trace
    assert curve.system.scalars[-1].periodic
    for k in np.flatnonzero(trace.slope[:-1] * trace.slope[1:] > 0).tolist():
        more = _with_node(curve, trace, k, 0.5 * float(trace.s[k] + trace.s[k + 1]))
        low, high = sorted(trace.drive[k : k + 2])
        assert low < more.drive[k + 1] < high


def test_a_slider_follows_the_closed_form() -> None:
    """RSSP: the slider is a root of a quadratic."""
    mechanism = Mechanism(
        [
            Revolute("crank", (0, 0, 0), axis=(0, 0, 1)),
            Prismatic("slider", (1, 0, 0.5)),
            Link("crank", (1, 0, 0), "slider", (4, 1, 1)),
        ]
    )
    q = np.linspace(0, 2 * np.pi, 200)
    s = mechanism.sweep(Joint("crank"), q).joint("slider")
    a, e = np.stack([np.cos(q), np.sin(q), 0 * q], axis=1), np.array([1, 0, 0.5]) / np.sqrt(1.25)
    d = np.array([4, 1, 1]) - a
    b, c = d @ e, (d**2).sum(1) - 11
    assert np.abs(s - (-b + np.sqrt(b * b - c))).max() < 1e-12


def test_a_cardan_joint_turns_as_hooke_says() -> None:
    beta = np.arctan(0.75)
    out = (np.cos(beta), 0, np.sin(beta))
    mechanism = Mechanism(
        [
            Revolute("input", (0, 0, 0), axis=(1, 0, 0)),
            Revolute("output", (0, 0, 0), axis=out),
            KeepAngle("input", (0, 0, 1), "output", (0, 1, 0)),
        ]
    )
    q = np.linspace(0, 2 * np.pi, 361)
    got = mechanism.sweep(Joint("input"), q).joint("output")
    # the cross: one arm of each shaft, square to each other
    assert (
        np.abs(np.tan(got) * np.cos(beta) - np.tan(q))[np.abs(np.cos(q)) > 0.1].max() < 1e-9
        or np.abs(np.tan(got) - np.tan(q) * np.cos(beta))[np.abs(np.cos(q)) > 0.1].max() < 1e-9
    )
    assert got[-1] == pytest.approx(2 * np.pi, abs=1e-12)
    assert mechanism.circuit(Joint("input")).crank


def test_an_rscr_closes() -> None:
    """The coupler turns and slides on the rocker: where its ball is, is where the crank's is."""
    mechanism = Mechanism(
        [
            Revolute("crank", (0, 0, 0), axis=(0, 0, 1)),
            Revolute("rocker", (3, 0, 0), axis=(0, 1, 0)),
            Cylindrical("coupler", (3, 0, 2), axis=(1, 0.3, 0.2), on="rocker"),
            Spherical("coupler", (1, 0, 0), on="crank"),
        ]
    )
    assert mechanism.mobility.freedoms == 1
    motion = mechanism.sweep(Joint("crank"), np.linspace(-0.5, 0.5, 50))
    assert motion.success.all()
    assert np.abs(motion.point("coupler", (1, 0, 0)) - motion.point("crank", (1, 0, 0))).max() < 1e-14
    axis = motion.direction("rocker", (1, 0.3, 0.2))
    off = np.cross(axis, motion.point("coupler", (3, 0, 2)) - motion.point("rocker", (3, 0, 2)))
    assert np.abs(off).max() < 1e-14
    slide = motion.joint("coupler", 1)
    moved = motion.point("coupler", (3, 0, 2)) - motion.point("rocker", (3, 0, 2))
    assert np.abs((moved * axis).sum(1) / np.sqrt(1.13) - slide).max() < 1e-14


def platform(bend: float = 0.2) -> list[Link]:
    turn = 2 * np.pi * np.arange(6) / 6
    base = np.stack([3 * np.cos(turn + 0.2), 3 * np.sin(turn), 0 * turn], axis=1)
    height = 2 + 0.2 * np.cos(turn) + bend * np.cos(turn**2)
    top = np.stack([np.cos(turn + 0.7), 1.3 * np.sin(turn + 0.9), height], axis=1)
    return [Link("ground", a, "platform", b, name=f"leg {i}") for i, (a, b) in enumerate(zip(base, top, strict=True))]


def test_a_platform_with_six_legs_moves_when_one_is_driven() -> None:
    mechanism = Mechanism(platform())
    assert mechanism.mobility.freedoms == 0
    with pytest.raises(NotMovable, match="a structure"):
        mechanism.sweep(Travel("platform", (0, 0, 2)), [0.1])
    start = float(np.linalg.norm(np.subtract(platform()[0].to, platform()[0].from_)))
    q = np.linspace(start - 0.05, start + 0.02, 15)
    motion = mechanism.sweep(Length(link="leg 0"), q)
    assert motion.success.all()
    for i, leg in enumerate(platform()):
        length = np.linalg.norm(motion.point("platform", leg.to) - np.asarray(leg.from_), axis=1)
        wanted = q if i == 0 else np.linalg.norm(np.subtract(leg.to, leg.from_))
        assert np.abs(length - wanted).max() < 1e-14


def test_a_platform_whose_plates_are_affine_moves_though_all_legs_are_fixed() -> None:
    """Six points of one plane, and their affine images: Borel and Bricard's self-motion."""
    mechanism = Mechanism(platform(0.0))
    assert mechanism.mobility.freedoms == 1
    motion = mechanism.sweep(Angle("platform", (1, 0, 0), (0, 0, 1)), np.linspace(-0.1, 0.1, 5))
    assert motion.success.all()
    assert motion.residual().max() < 1e-12


def test_every_scalar_drives_to_the_same_poses() -> None:
    """Poses driven by the crank are met again by what they show of other scalars, with consistent derivatives."""
    mechanism = rssr(PIN, *RSSR[1:])
    first = mechanism.sweep(Joint("crank"), np.linspace(0, 0.4, 7))
    end = first.point("rocker", (4, 0.5, 4))
    length = np.linalg.norm(first.point("crank", PIN) - (3, 2, 1), axis=1)
    for drive, values in (
        (Joint("rocker"), first.joint("rocker")),
        (Travel("rocker", (4, 0.5, 4), "x"), end[:, 0] - 4),
        (Travel("crank", PIN, (0, 2, 0)), first.point("crank", PIN)[:, 1] - PIN[1]),
        (Length("ground", (3, 2, 1), "crank", PIN), length),
        (Angle("crank", (1, 0, 0), (0, 0, 1)), first.drive),
    ):
        again = mechanism.sweep(drive, values)
        assert np.abs(again.joint("crank") - first.drive).max() < 1e-12
        chain = again.joint("crank", order=1)[:, 1] * _slope(first, drive)
        assert np.abs(chain - 1).max() < 1e-10


def _slope(motion: Any, drive: Any) -> Any:
    """The derivative of a scalar by the crank, from readings."""
    if isinstance(drive, Joint):
        return motion.joint(drive.body, order=1)[:, 1]
    if isinstance(drive, Travel):
        along = {"x": (1, 0, 0)}.get(drive.along, (0, 1, 0)) if isinstance(drive.along, str) else (0, 1, 0)
        return motion.point(drive.body, drive.point, 1)[:, 1] @ along
    if isinstance(drive, Length):
        x = motion.point("crank", PIN, 1)
        e = x[:, 0] - np.array([3, 2, 1])
        return (e * x[:, 1]).sum(1) / np.linalg.norm(e, axis=1)
    return np.ones(len(motion.drive))


def test_a_guide_coordinate_drives() -> None:
    """A point on a circle: driven by its angle it is a crank."""
    common: list[Any] = [Revolute("rocker", (4, 0, 1), axis=(0, 1, 0)), Link("rod", (1, 0, 0), "rocker", (4, 0.5, 4))]
    body = [
        OnGuide("rod", (1, 0, 0), "circle", (1,), name="circle"),
        OnGuide("rod", (1, 0.5, 0), "plane", origin=(0, 0, 0), quaternion=(1, 0, 0, 0)),
        OnGuide("rod", (0.5, 0, 0), "plane", origin=(0, 0, 0), quaternion=(1, 0, 0, 0)),
        OnGuide("rod", (0.5, 0, 0), "sphere", (np.sqrt(2),), origin=(0.5, 1, 1)),
    ]
    motion = Mechanism([*common, *body]).sweep(GuideCoordinate("circle", "u"), np.linspace(0, 0.5, 11))
    expected = rssr(*RSSR).sweep(Joint("crank"), motion.drive)
    assert np.abs(motion.joint("rocker") - expected.joint("rocker")).max() < 1e-12


def test_a_coupler_that_is_a_body_spins_idly_and_is_told() -> None:
    mechanism = Mechanism(
        [
            Revolute("crank", (0, 0, 0), axis=(0, 0, 1)),
            Revolute("rocker", (4, 0, 1), axis=(0, 1, 0)),
            Spherical("coupler", (1, 0, 0), on="crank"),
            Spherical("coupler", (4, 0.5, 4), on="rocker"),
        ]
    )
    assert mechanism.mobility.freedoms == 1
    assert mechanism.mobility.idle == ("coupler",)
    q = np.linspace(0, 2 * np.pi, 100)
    motion = mechanism.sweep(Joint("crank"), q)
    expected = rssr(*RSSR).sweep(Joint("crank"), q)
    assert np.abs(motion.joint("rocker", order=2) - expected.joint("rocker", order=2)).max() < 1e-10
    assert mechanism.circuit(Joint("crank")).crank


def bennett() -> Mechanism:
    """Four revolute joints, a / sin alpha = b / sin beta: overconstrained, and it moves (Bennett 1903)."""
    alpha, beta = 0.7, 1.1
    a, b = 1.0, np.sin(beta) / np.sin(alpha)

    def turned(angle: float, axis: int) -> Any:
        c, s = np.cos(angle), np.sin(angle)
        out = np.eye(4)
        i, j = [(1, 2), (2, 0), (0, 1)][axis]
        out[i, i], out[i, j], out[j, i], out[j, j] = c, -s, s, c
        return out

    def link(theta: float, length: float, twist: float) -> Any:
        move = np.eye(4)
        move[0, 3] = length
        return turned(theta, 2) @ move @ turned(twist, 0)

    theta = 1.0
    ratio = np.sin((beta + alpha) / 2) / np.sin((beta - alpha) / 2)
    other = 2 * np.arctan(ratio / np.tan(theta / 2))
    frames = [np.eye(4)]
    for t, length, twist in ((theta, a, alpha), (other, b, beta), (2 * np.pi - theta, a, alpha)):
        frames.append(frames[-1] @ link(t, length, twist))
    close = frames[-1] @ link(2 * np.pi - other, b, beta)
    assert np.abs(close - np.eye(4)).max() < 1e-12
    joints: Any = [(f[:3, 3], f[:3, 2]) for f in frames]
    return Mechanism(
        [
            Revolute("first", joints[0][0], axis=joints[0][1]),
            Revolute("second", joints[1][0], axis=joints[1][1], on="first"),
            Revolute("third", joints[2][0], axis=joints[2][1], on="second"),
            Revolute("third", joints[3][0], axis=joints[3][1], name="last"),
        ]
    )


def test_an_overconstrained_loop_moves_and_says_so() -> None:
    mechanism = bennett()
    assert mechanism.mobility.freedoms == 1
    assert mechanism.mobility.redundant == ("last",)
    motion = mechanism.sweep(Joint("first"), np.linspace(-0.5, 0.5, 21))
    assert motion.success.all()
    assert motion.residual().max() < 1e-12


def test_wrong_drives_are_named_as_such() -> None:
    parallel = rssr((1, 0, 0), (0, 0, 1), (4, 0, 0), (4, 2, 0), (0, 0, 1))
    with pytest.raises(CannotDrive, match="cannot drive: it keeps its value"):
        parallel.sweep(Travel("crank", (1, 0, 0), "z"), [0.1])
    with pytest.raises(CannotDrive, match="dead point of this Travel"):
        parallel.sweep(Travel("crank", (1, 0, 0), "x"), [-0.1])
    with pytest.raises(CannotDrive, match="1 freedoms: one drives, 0 must be held, not 1"):
        parallel.sweep(Joint("crank"), [0.1], hold=[Joint("rocker")])
    with pytest.raises(InvalidRequest, match="finite numbers"):
        parallel.sweep(Joint("crank"), [np.nan])
    with pytest.raises(InvalidRequest, match="no body 'crack'"):
        parallel.sweep(Joint("crack"), [0.1])
    with pytest.raises(InvalidRequest, match="ground hangs on no joint that could be driven"):
        parallel.sweep(Joint("ground"), [0.0])
    with pytest.raises(InvalidRequest, match="no Link named 'leg'"):
        parallel.sweep(Length(link="leg"), [0.1])


@pytest.mark.parametrize(
    ("elements", "match"),
    [
        ([], "needs a body"),
        ([Link("a", (0, 0, 0), "a", (1, 0, 0))], "joins a to itself"),
        ([Link("a", (0, 0, 0), "ground", (0, 0, 0))], "has no length"),
        ([Revolute("a", (0, 0), axis=(0, 0, 1))], "3 numbers"),
        ([Revolute("a", (0, 0, 0), axis=(0, 0, 0))], "is no direction"),
        ([Revolute("a", (0, 0, 0))], "needs an axis"),
        ([Revolute("a", (0, 0, 0), to=(0, 0, 0))], "both points of its axis are one"),
        (
            [Revolute("a", (0, 0, 0), (0, 0, 1), on="b"), Revolute("b", (1, 0, 0), (0, 0, 1), on="a")],
            "hang on each other",
        ),
        ([OnGuide("a", (1, 0, 0), "sphere", (2.0,)), Revolute("a", (0, 0, 0), (0, 0, 1))], "off the sphere"),
        ([OnGuide("a", (1, 0, 0), "blob", (2.0,)), Revolute("a", (0, 0, 0), (0, 0, 1))], "no guide 'blob'"),
    ],
)
def test_what_is_no_mechanism_is_refused(elements: list[Any], match: str) -> None:
    with pytest.raises(InvalidLinkage, match=match):
        Mechanism(elements)


def test_time_derivatives_follow_the_law_of_the_drive() -> None:
    """sin(q(t)) for q = t + t^2 + t^3 at t = 0."""
    got = in_time([0.0, 1.0, 0.0, -1.0], [1.0, 2.0, 6.0])
    assert got.tolist() == [0.0, 1.0, 2.0, 5.0]


def test_a_batch_moves_as_each_alone() -> None:
    draw = np.random.default_rng(2)
    at = np.array([4, 0, 1]) + draw.uniform(-0.1, 0.1, (5, 3))
    q = np.linspace(0, 1, 11)
    one = [
        rssr((1, 0, 0), (0, 0, 1), x, (4, 0.5, 4), (0, 1, 0)).sweep(Joint("crank"), q).joint("rocker", order=2)
        for x in at
    ]
    both = rssr((1, 0, 0), (0, 0, 1), at, (4, 0.5, 4), (0, 1, 0)).sweep(Joint("crank"), q)
    assert both.joint("rocker", order=2).shape == (5, 11, 3)
    assert np.abs(both.joint("rocker", order=2) - np.stack(one)).max() < 1e-11


def random_mechanism(draw: np.random.Generator, kind: int) -> tuple[Mechanism, Any, Any]:
    p, axis = draw.uniform(-1, 1, (12, 3)), draw.normal(size=(4, 3))
    if kind == 0:
        five = Mechanism([Link("ground", a, "body", b) for a, b in zip(p[:5], p[5:10], strict=True)])
        return five, Travel("body", p[10], axis[0]), np.linspace(-0.6, 0.6, 41)
    first: list[Any] = [Revolute("crank", p[0], axis=axis[0]), Revolute("rocker", p[1], axis=axis[1])]
    loop: list[Any] = [Link("crank", p[2], "rocker", p[3])]
    if kind == 1:
        loop = [Cylindrical("coupler", p[2], axis=axis[2], on="rocker"), Spherical("coupler", p[3], on="crank")]
    return Mechanism([*first, *loop]), Joint("crank"), np.linspace(-3, 3, 61)


@pytest.mark.slow
def test_no_sweep_changes_its_assembly(monkeypatch: pytest.MonkeyPatch) -> None:
    """90 random mechanisms, five links, RSCR and RSSR: wherever ten times smaller steps lead, up to the same ends."""
    from catalogue.spatial.continuation import tracing

    draw = np.random.default_rng(5)
    stopped = 0
    for k in range(90):
        mechanism, drive, values = random_mechanism(draw, k % 3)
        swept = mechanism.sweep(drive, values)
        with monkeypatch.context() as patch:
            short = tracing.LIMITS._replace(aim=1e-6, refused=1e-5, longest=0.03, turn=float(np.cos(0.1)))
            patch.setattr(tracing, "LIMITS", short)
            slowly = mechanism.sweep(drive, values)
        assert (swept.success == slowly.success).all()
        both = swept.success
        assert np.abs(swept.states[0, both] - slowly.states[0, both]).max(initial=0) < 1e-7
        for one, other in zip(swept.ends[0], slowly.ends[0], strict=True):
            assert (one is None) == (other is None)
            if one and other:
                assert one[1] == other[1] == "dead point"
                assert one[0] == pytest.approx(other[0], abs=1e-9)
                stopped += 1
    assert stopped > 60


# -- batches -----------------------------------------------------------------------------------------------------------
def axles(inner: Array, outer: Array, count: int) -> list[Link]:
    """Return links of five-link axles (5, 3) moved at random, each by itself."""
    draw = np.random.default_rng(4)
    ends = [np.asarray(v) + draw.normal(size=(count, 5, 3)) for v in (inner, outer)]
    return [Link("ground", ends[0][:, k], "wheel", ends[1][:, k]) for k in range(5)]


INNER = np.array([(-120, 450, 230), (130, 440, 240), (-150, 400, -60), (140, 390, -70), (90, 420, -10.0)])
OUTER = np.array([(-10, 690, 210), (15, 695, 215), (-20, 720, -90), (25, 715, -95), (110, 700, -5.0)])


@pytest.mark.parametrize(
    ("make", "values"),
    [
        (lambda c, a: Travel("wheel", c, a), [-10.0, 0, 30]),
        (lambda _, a: Angle("wheel", a, np.array([1.0, 0, 0])), [-0.001, 0, 0.001]),
    ],
    ids=["travel", "angle"],
)
def test_each_of_a_batch_moves_as_it_does_alone(make: Any, values: list[float]) -> None:
    """Driven at a point and along a direction of its own; points and directions of its own are read."""
    links, draw = axles(INNER, OUTER, 3), np.random.default_rng(5)
    centre = np.array([0, 760, 0.0]) + 5 * draw.normal(size=(3, 3))
    along = np.array([0, 0, 1.0]) + 0.1 * draw.normal(size=(3, 3))
    motion = Mechanism(links).sweep(make(centre, along), values)
    for i in range(3):
        alone = Mechanism([Link(x.a, x.from_[i], x.b, x.to[i]) for x in links]).sweep(make(centre[i], along[i]), values)
        assert alone.success.all()
        np.testing.assert_allclose(motion.point("wheel", centre)[i], alone.point("wheel", centre[i]), atol=1e-9)
        np.testing.assert_allclose(motion.direction("wheel", along)[i], alone.direction("wheel", along[i]), atol=1e-11)


def test_a_travel_is_that_of_its_own_point() -> None:
    links = axles(INNER, OUTER, 3)
    centre = np.array([[0, 760, 0.0], [5, 755, 8.0], [-4, 770, -6.0]])
    motion = Mechanism(links).sweep(Travel("wheel", centre), [-10.0, 0, 30])
    moved = motion.point("wheel", centre)[..., 2] - centre[:, None, 2]
    np.testing.assert_allclose(moved, np.broadcast_to([-10.0, 0, 30], (3, 3)), atol=1e-9)


@pytest.mark.parametrize(
    ("links", "drive", "match"),
    [
        (axles(INNER, OUTER, 3), Travel("wheel", np.zeros((2, 3))), "batches of 2 and 3 mechanisms"),
        ([Link("ground", np.zeros((2, 3)), "wheel", np.ones((3, 3)))], Joint("wheel"), "batches of 2 and 3 mechanisms"),
        (
            [*axles(INNER, OUTER, 2)[:4], OnGuide("wheel", np.ones((2, 3)), "plane")],
            Travel("wheel", (0, 760, 0)),
            "same for a whole batch",
        ),
        (
            [*axles(INNER, OUTER, 2)[:4], OnGuide("wheel", (0, 760, 0), "plane", origin=np.zeros((2, 3)))],
            Travel("wheel", (0, 760, 0)),
            "same for a whole batch",
        ),
    ],
)
def test_batches_that_do_not_fit_are_refused(links: list[Any], drive: Any, match: str) -> None:
    with pytest.raises(InvalidLinkage, match=match):
        Mechanism(links).sweep(drive, [0.0, 1.0])


@pytest.mark.slow
def test_what_is_read_off_a_batch_is_what_is_read_off_each_alone() -> None:
    """Wheels of their own, loads of their own, what each hard point does; rows by mechanism and pose."""
    links, values = axles(INNER, OUTER, 3), [-30.0, 0, 45]
    centre = np.array([[0, 760, 0.0], [5, 755, 8.0], [-4, 770, -6.0]])
    axis, force = (
        np.array([[0.01, 1, -0.02], [0, 1, 0.01], [0.02, 1, 0]]),
        np.array([[0, 0, 4e3], [1e3, 0, 0], [0, 9, 9]]),
    )

    def read(links: list[Link], at: Array, axis: Array, force: Array) -> list[Any]:
        motion = Mechanism(links).sweep(Travel("wheel", at), values)
        return [
            kinematics(motion, Wheel("wheel", at, axis, 310)),
            reactions(motion, [Load("wheel", force, at)]),
            sensitivities(motion, lambda m: m.point("wheel", at)[..., 1]),
        ]

    batch = read(links, centre, axis, force)
    for i in range(3):
        own = [Link(x.a, x.from_[i], x.b, x.to[i]) for x in links]
        for whole, alone in zip(batch, read(own, centre[i], axis[i], force[i]), strict=True):
            mine = whole.loc[i]
            assert list(mine.columns) == list(alone.columns)
            np.testing.assert_allclose(mine, alone, rtol=1e-6, atol=1e-7)
            if alone.index.name:
                assert mine.index.equals(alone.index)
    motion = Mechanism(links).sweep(Travel("wheel", centre), values)
    with pytest.raises(InvalidRequest, match="one for each of 3 mechanisms, not 2"):
        motion.point("wheel", np.zeros((2, 3)))


@pytest.mark.slow
def test_circuits_of_a_batch_are_those_of_each_alone() -> None:
    """RSSR whose rocker drives, so that each circuit has dead points; poses along it are of that mechanism."""
    ends = np.array([[4, 0, 3.0], [4, 0.2, 2.8], [4.1, 0, 3.2]])

    def loop(end: Array) -> Mechanism:
        crank, rocker = Revolute("crank", (0, 0, 0), axis=(0, 0, 1)), Revolute("rocker", (4, 0, 1), axis=(0, 1, 0))
        return Mechanism([crank, rocker, Link("crank", (1, 0, 0), "rocker", end, name="rod")])

    batch = loop(ends)
    found = batch.circuits(Joint("rocker"))
    with pytest.raises(InvalidRequest, match="ask for `circuits`"):
        batch.circuit(Joint("rocker"))
    for i, one in enumerate(found):
        alone = loop(ends[i]).circuit(Joint("rocker"))
        assert one.closed
        assert len(one.dead_points) == 2
        np.testing.assert_allclose(one.dead_points, alone.dead_points, atol=1e-9)
        assert one.length == pytest.approx(alone.length, rel=1e-6)
        motion = one.motion(20)
        assert motion.residual().max() < 1e-12
        assert "transmission angle [deg]" in transmission(motion, "rocker", "rod")
    cranks = batch.circuits(Joint("crank"))
    assert [c.crank for c in cranks] == [True] * 3
    for i, one in enumerate(cranks):
        turned = loop(ends[i]).sweep(Joint("crank"), one.motion(5).drive).joint("rocker")
        np.testing.assert_allclose(one.motion(5).joint("rocker"), turned, atol=1e-9)


def test_function_generators_of_a_batch() -> None:
    ends = np.array([[4, 0, 3.0], [4, 0.2, 2.8]])
    axis = np.array([[0, 1, 0], [0.1, 1, 0.1]])

    def read(end: Array, axis: Array) -> Any:
        loop: list[Any] = [
            Revolute("crank", (0, 0, 0), axis=(0, 0, 1)),
            Revolute("rocker", (4, 0, 1), axis=axis),
            Link("crank", (1, 0, 0), "rocker", end, name="rod"),
        ]
        return transmission(Mechanism(loop).sweep(Joint("crank"), [-0.2, 0.0, 0.3]), "rocker", "rod")

    batch = read(ends, axis)
    for i in range(2):
        np.testing.assert_allclose(batch.loc[i], read(ends[i], axis[i]), rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_scalars_that_differ_in_the_last_digits_are_two() -> None:
    """Also within a batch so large that numpy would print an ellipsis for its middle."""
    links = axles(INNER, OUTER, 400)
    mechanism, centre = Mechanism(links), np.tile([0, 760, 0.0], (400, 1))
    other = centre.copy()
    other[200, 2] = 50
    first, second = (mechanism.sweep(Travel("wheel", c), [10.0]) for c in (centre, other))
    assert mechanism.system(Travel("wheel", centre)) is mechanism.system(Travel("wheel", centre.copy()))
    apart = np.abs(first.point("wheel", centre) - second.point("wheel", centre)).max((1, 2))
    assert np.flatnonzero(apart > 1e-9).tolist() == [200]


def test_conditions_that_only_the_first_of_a_batch_implies_are_missed_with_a_reason() -> None:
    """A plane four-bar of revolute joints, three of whose conditions are redundant; of the second an axis is tilted."""
    up, tilted = (0, 0, 1.0), np.array([[0, 0, 1.0], [0.1, 0, 1.0]])
    loop = [
        Revolute("crank", (0, 0, 0), axis=up),
        Revolute("rocker", (4, 0, 0), axis=up),
        Revolute("coupler", (1, 0, 0), axis=up, on="crank"),
        Revolute("coupler", (4, 3, 0), axis=tilted, on="rocker"),
    ]
    motion = Mechanism(loop).sweep(Joint("crank"), [0.0, 0.3, 0.6])
    assert motion.success.tolist() == [[True] * 3, [False] * 3]
    assert motion.ends[0] == (None, None)
    assert "not met in this one" in motion.ends[1][0][1]


# -- screws ------------------------------------------------------------------------------------------------------------
def test_a_screw_advances_by_its_lead_and_turns_a_push_into_a_torque() -> None:
    """On oblique axes, in a batch of two: its point is on a helix, with derivatives; force times lead over a turn."""
    axis, at = np.array([[1.0, 2, 2], [0, 0, 1]]), np.array([[0.3, -0.2, 0.5], [0, 0, 0]])
    end = np.array([2.0, 1.0, -1.0])
    many = Mechanism([Screw("nut", at, axis=axis, lead=-0.7)])
    q = np.linspace(-4, 9, 27)
    motion = many.sweep(Joint("nut"), q)
    x = motion.point("nut", end, 2)
    for i in range(2):
        k = axis[i] / np.linalg.norm(axis[i])
        arm = end - at[i]
        c, s = np.cos(q)[:, None], np.sin(q)[:, None]
        turned = arm * c + np.cross(k, arm) * s + k * (k @ arm) * (1 - c)
        assert np.abs(x[i, :, 0] - (at[i] + turned - 0.7 * k * q[:, None] / (2 * np.pi))).max() < 1e-13
        rate = np.cross(k, turned) - 0.7 * k / (2 * np.pi)
        assert np.abs(x[i, :, 1] - rate).max() < 1e-13
        assert np.abs(x[i, :, 2] - np.cross(k, np.cross(k, turned))).max() < 1e-13
    alone = Mechanism([Screw("nut", at[0], axis=axis[0], lead=-0.7)], unit="m").sweep(Joint("nut"), [0.0, 1.0])
    borne = reactions(alone, [Load("nut", 30 * axis[0] / 3, at[0])])
    np.testing.assert_allclose(borne["drive [N m]"], 30 * 0.7 / (2 * np.pi), rtol=1e-12)


def test_a_spindle_moves_a_slide() -> None:
    """A nut on a spindle that a slide keeps from turning: it goes by the lead, against the spindle."""
    along = (0, 0, 1.0)
    press: list[Any] = [
        Revolute("spindle", (0, 0, 0), axis=along),
        Screw("nut", (0, 0, 0), axis=along, on="spindle", lead=5.0),
        Prismatic("nut", along),
    ]
    mechanism = Mechanism(press)
    assert mechanism.mobility.freedoms == 1
    motion = mechanism.sweep(Joint("spindle"), np.linspace(0, 4 * np.pi, 9))
    np.testing.assert_allclose(motion.point("nut", (10, 0, 0))[:, 2], -np.linspace(0, 10, 9), atol=1e-9)
    with pytest.raises(InvalidLinkage, match="state a screw before"):
        Mechanism([press[0], press[2], press[1]])
