from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
import pytest

from catalogue.chains.circuits import ChainCircuits, circuits
from catalogue.chains.given import GivenChain, read_chain
from catalogue.chains.rates import rates
from catalogue.errors import InvalidLinkage, InvalidRequest
from catalogue.kinematics.circuits import SWING, TURN
from tests.chains.known import BICYCLE, CHEBYSHEV, JANSEN, KLANN, PEAUCELLIER, hypocycloid
from tests.chains.newton import Loops

EVERY = {"Jansen": JANSEN, "Klann": KLANN, "Chebyshev": CHEBYSHEV, "bicycle": BICYCLE}


def circuit(given: Any) -> tuple[GivenChain, ChainCircuits]:
    read = read_chain(given)
    return read, circuits(read.chain, min(read.chain.structure.on[read.point]))


def guided(given: Any, s: Any) -> Any:
    read, found = circuit(given)
    return found.pose(np.asarray(s)[:, None]).point(read.chain.z[read.point])[:, 0]


@pytest.mark.parametrize("name", EVERY)
def test_a_published_mechanism_closes_as_newton_closes_it(name: str) -> None:
    read, found = circuit(EVERY[name])
    at = found.poses(found.period * np.linspace(0, 1, 181)[:, None])
    loops = Loops.of(read.chain)
    here = loops.unknowns(at)
    assert np.abs((loops.corrected(here) - here) / loops.scale(here.shape[-1])).max() < 1e-12


@pytest.mark.parametrize("name", EVERY)
def test_bars_keep_the_lengths_of_the_table(name: str) -> None:
    read, found = circuit(EVERY[name])
    at = found.poses(found.period * np.linspace(0, 1, 91)[:, None])
    structure, places = read.chain.structure, EVERY[name]["joints"]
    pairs = {frozenset((one, other)) for _, joints in structure.bars for one in joints for other in joints}
    told = [(joint, *item) for joint, place in places.items() if isinstance(place, dict) for item in place.items()]
    checked = 0
    for joint, other, length in told:
        if other in places and frozenset((joint, other)) in pairs:
            one, two = (at.joint(structure.joints.index(name)) for name in (joint, other))
            np.testing.assert_allclose(np.abs(one - two), length, rtol=1e-12)
            checked += 1
    assert checked >= 3


def test_cranks_of_walking_legs_turn_fully() -> None:
    assert [circuit(EVERY[name])[1].kind[0] for name in ("Jansen", "Klann", "Chebyshev")] == [TURN] * 3


def test_a_foot_is_flat_on_the_ground_for_much_of_the_turn() -> None:
    """What legs are known for: the lowest tenth of the height takes a quarter of the turn, half the stride."""
    for name in ("Jansen", "Klann", "Chebyshev"):
        z = guided(EVERY[name], np.linspace(0, 2 * np.pi, 721)[:-1])
        low = z.imag < z.imag.min() + 0.1 * np.ptp(z.imag)
        assert low.mean() > 1 / 4, name
        assert np.ptp(z[low].real) > 0.5 * np.ptp(z.real), name


def test_a_foot_kept_parallel_moves_as_its_ankle() -> None:
    read, found = circuit(CHEBYSHEV)
    at = found.poses(np.linspace(0, 6, 40)[:, None])
    toe, ankle = (at.joint(read.chain.structure.joints.index(name)) for name in ("toe", "P"))
    np.testing.assert_allclose(toe - ankle, np.broadcast_to((toe - ankle)[0], toe.shape), atol=1e-14)


def test_the_shock_of_a_bicycle_is_as_long_as_its_ends_are_apart() -> None:
    read, found = circuit(BICYCLE)
    s = found.phase + np.linspace(-0.3, 0.3, 31)[:, None]
    at = found.poses(s)
    structure = read.chain.structure
    number = structure.joints.index
    eye, mount, body = at.joint(number("eye")), at.joint(number("mount")), at.turn[structure.number("body")]
    off = ((eye - mount) * (body * np.exp(0.5j * np.pi) * read.chain.u[0]).conj()).real
    z = read.chain.z
    held = ((z[number("eye")] - z[number("mount")]) * (1j * read.chain.u[0]).conj()).real
    np.testing.assert_allclose(off, np.broadcast_to(held, off.shape), atol=1e-11)
    moves = rates(at)
    axle = moves.velocity_of(structure.number("seatstay"), z[number("axle")])
    shock = moves.velocity_of(structure.number("rocker"), z[number("eye")])
    length = ((eye - mount) / np.abs(eye - mount) * shock.conj()).real
    leverage = (np.abs(axle) / np.abs(length))[:, 0]
    path, run = at.joint(number("axle"))[:, 0], np.abs(eye - mount)[:, 0]
    measured = np.abs(path[2:] - path[:-2]) / np.abs(run[2:] - run[:-2])
    np.testing.assert_allclose(leverage[1:-1], measured, rtol=2e-3)


def test_peaucellier_is_straight_to_rounding_over_its_stroke() -> None:
    """But for the last thousandth of it, where all six bars but the crank are in line."""
    z = guided(PEAUCELLIER, np.pi / 2 + 0.98 * np.linspace(-np.pi / 2, np.pi / 2, 2001))
    assert np.ptp(z.imag) > 4.8
    assert np.ptp(z.real) / 2 < 1e-14 * np.ptp(z.imag)


def test_peaucellier_inverts() -> None:
    read, found = circuit(PEAUCELLIER)
    assert found.kind[0] == SWING
    at = found.poses(np.linspace(0.2, 2.9, 100)[:, None])
    c, p = (at.joint(read.chain.structure.joints.index(name)) for name in "CP")
    np.testing.assert_allclose(p * c.conj(), 5**2 - 2**2, rtol=1e-13)


@pytest.mark.parametrize(("ring", "planet"), [(2, 1), (3, 1), (5, 3), (7, 2)])
def test_a_geared_hypocycloid_is_that_of_the_formula(ring: int, planet: int) -> None:
    _, found = circuit(hypocycloid(ring, planet))
    s = np.linspace(0, found.period[0], 500)
    assert found.period[0] == pytest.approx(2 * np.pi * planet)
    arm = ring - planet
    expected = arm * np.exp(1j * s) + planet * np.exp(-1j * s * arm / planet)
    assert np.abs(guided(hypocycloid(ring, planet), s) - expected).max() < 1e-14 * 2 * ring


def test_cardan_gears_draw_a_straight_line() -> None:
    z = guided(hypocycloid(2, 1), np.linspace(0, 2 * np.pi, 1001))
    assert np.ptp(z.real) == pytest.approx(4)
    assert np.abs(z.imag).max() < 1e-15


def test_the_lengths_of_a_table_place_the_joints() -> None:
    read, _ = circuit(JANSEN)
    z = dict(zip(read.chain.structure.joints, read.chain.z[:, 0], strict=True))
    assert z["C"].imag > 0 > z["F"].imag
    assert abs(z["foot"] - z["G"]) == pytest.approx(65.7)
    assert read.name == "Jansen"


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"joints": None}, "'joints' must say something by name, not None"),
    ({"bars": {"frame": {"O": 1}}}, "bar 'frame' must be a list, not"),
    ({"drive": 3}, "drive must be of type str, not 3"),
    ({"point": "X"}, "the guided point 'X' is no joint on a bar"),
    ({"point": "O"}, "the guided point 'O' is on the frame, which stands still"),
    ({"name": 0}, "name must be of type str, not 0"),
    ({"colour": 1}, "a chain has no 'colour'"),
    ({"slides": [{"bar": "frame"}]}, "slide 0 must say bar, slider, angle or bar, slider, along"),
    (
        {"slides": [{"bar": "j", "slider": "k", "along": ["B", "B"]}], "bars": {**JANSEN["bars"], "k": ["F"]}},
        "a slide along B and B has no direction",
    ),
    ({"gears": [{"wheels": ["c", "k"], "carrier": "frame", "ratio": "2"}]}, "ratio must be a number, not '2'"),
    ({"parallel": [["c"]]}, "parallel must be the names of two bars"),
    ({"unit": "furlong"}, "furlong"),
]


@pytest.mark.parametrize(("change", "wrong"), WRONG)
def test_wrong_data_are_refused_in_one_line(change: dict[str, Any], wrong: str) -> None:
    with pytest.raises((InvalidLinkage, InvalidRequest), match=wrong) as caught:
        read_chain({**JANSEN, **change})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["joints", "bars", "drive", "point"])
def test_what_is_missing_is_named(name: str) -> None:
    with pytest.raises(InvalidLinkage, match=f"a chain needs '{name}'"):
        read_chain({key: value for key, value in JANSEN.items() if key != name})


@pytest.mark.parametrize(
    ("joint", "place", "wrong"),
    [
        ("C", [1, 2, 3], "joint 'C' must be x and y, or distances from joints before it"),
        ("C", [1, float("inf")], "joint 'C' has a coordinate that is not finite"),
        ("C", {"B": 50, "D": 2, "side": "left"}, "cannot be 50 and 2 away from joints that are 53.5"),
        ("C", {"B": 50, "X": 41.5, "side": "left"}, "is placed from 'X', which is no joint before it"),
        ("C", {"B": 50, "D": 41.5}, "needs a position, distances from two joints and"),
        ("C", {"B": 50, "D": 41.5, "side": "up"}, "needs a position, distances from two joints and"),
        ("C", {"B": -50, "D": 41.5, "side": "left"}, "needs distances above zero"),
        ("C", {"B": "50", "D": 41.5, "side": "left"}, "its distance from 'B' must be a number, not '50'"),
        ("C", {"from": "D", "to": "D", "along": 1, "across": 0}, "lies along no way"),
        ("C", {}, "needs distances above zero"),
        ("C", {"B": 50, "D": 41.5, "side": ["left"]}, "needs a position, distances from two joints and"),
        ("C", {"from": ["B"], "to": "D", "along": 1, "across": 0}, "is placed from .'B'., which is no joint before"),
        ("C", {"from": "B", "to": {"D": 1}, "along": 1, "across": 0}, "which is no joint before it"),
        ("C", {"B": 1e300, "D": 1e300, "side": "left"}, "joint 'C' stands on two joints that coincide"),
        ("C", [1e308, 1e308], "joint 'C' lies beyond 1e.60: choose another unit"),
        ("C", [float("nan"), 0], "joint 'C' has a coordinate that is not finite"),
        ("B", [0, 0], "joints of 'crank' coincide: it drives nothing"),
    ],
)
def test_a_joint_that_cannot_be_placed_is_named(joint: str, place: Any, wrong: str) -> None:
    given = deepcopy(JANSEN)
    given["joints"][joint] = place
    with pytest.raises((InvalidLinkage, InvalidRequest), match=wrong):
        read_chain(given)


@pytest.mark.parametrize("scale", [1e-57, 1e57])
def test_lengths_of_any_unit_place_the_joints_alike(scale: float) -> None:
    given, read = deepcopy(JANSEN), read_chain(JANSEN)
    for joint, place in JANSEN["joints"].items():
        if isinstance(place, list):
            given["joints"][joint] = [scale * x for x in place]
        else:
            held = {key: scale * value for key, value in place.items() if key not in ("side", "angle")}
            given["joints"][joint] = {**place, **held}
    np.testing.assert_allclose(read_chain(given).chain.z, scale * read.chain.z, rtol=1e-12)
    at, small = (circuit(one)[1].poses(np.linspace(0, 6, 25)[:, None]) for one in (JANSEN, given))
    np.testing.assert_allclose(small.joint(read.point), scale * at.joint(read.point), rtol=1e-11)
