"""Forces, sensitivities and functions, each by what the poses alone show."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from catalogue.errors import InvalidRequest
from catalogue.folders import folder
from catalogue.spatial import (
    Joint,
    Link,
    Load,
    Mechanism,
    Motion,
    Revolute,
    Travel,
    Wheel,
    kinematics,
    load,
    reactions,
    sensitivities,
    transmission,
)
from tests.spatial.test_files import run

INNER = np.array([[-120, 450, 230], [130, 440, 240], [-150, 400, -60], [140, 390, -70], [90, 420, -10.0]])
OUTER = np.array([[-10, 690, 210], [15, 695, 215], [-20, 720, -90], [25, 715, -95], [110, 700, -5.0]])
CENTRE = (0.0, 760.0, 0.0)


def axle(inner: np.ndarray = INNER, outer: np.ndarray = OUTER) -> Mechanism:
    return Mechanism(
        [Link("ground", a, "wheel", b, name=f"link {i}") for i, (a, b) in enumerate(zip(inner, outer, strict=True))]
    )


def test_forces_in_links_balance_the_load() -> None:
    """Forces and moments of links, drive and load on the carrier add up to nothing in every pose."""
    motion = axle().sweep(Travel("wheel", CENTRE), [-60.0, 0.0, 60.0])
    contact, force, moment = (5.0, 765.0, -310.0), np.array([-2000.0, 1500, 4000]), np.array([1e4, -2e4, 5e3])
    table = reactions(motion, [Load("wheel", force, contact, moment)])
    at = motion.point("wheel", contact)
    sum_force, sum_moment = np.tile(force, (3, 1)), np.cross(at, force) + moment
    for i in range(5):
        x = motion.point("wheel", OUTER[i])
        e = INNER[i] - x
        pull = table[f"link {i} [N]"].to_numpy()[:, None] * e / np.linalg.norm(e, axis=1)[:, None]
        sum_force, sum_moment = sum_force + pull, sum_moment + np.cross(x, pull)
    push = table["drive [N]"].to_numpy()[:, None] * [0.0, 0, 1]
    x = motion.point("wheel", CENTRE)
    assert np.abs(sum_force + push).max() < 1e-9
    assert np.abs(sum_moment + np.cross(x, push)).max() < 1e-6


def test_the_drive_of_a_crank_bears_the_virtual_work() -> None:
    elements: list[Any] = [
        Revolute("crank", (0, 0, 0), axis=(0, 0, 1)),
        Revolute("rocker", (4, 0, 1), axis=(0, 1, 0)),
        Link("crank", (1, 0, 0), "rocker", (4, 0.5, 4), name="rod"),
    ]
    motion = Mechanism(elements).sweep(Joint("crank"), np.linspace(0, 6, 13))
    table = reactions(motion, [Load("rocker", (0, 0, 0), (4, 0, 1), (0, 7.0, 0))])
    assert np.abs(table["drive [N mm]"] + 7 * motion.joint("rocker", order=1)[:, 1]).max() < 1e-12
    table = transmission(motion, "rocker", "rod")
    a, b = motion.point("crank", (1, 0, 0)), motion.point("rocker", (4, 0.5, 4))
    v = np.cross([0, 1, 0], b - (4, 0, 1))
    sine = np.abs(((b - a) * v).sum(1)) / np.linalg.norm(b - a, axis=1) / np.linalg.norm(v, axis=1)
    assert np.abs(np.sin(np.radians(table["transmission angle [deg]"])) - sine).max() < 1e-12
    assert np.abs(table["rocker [deg]"] - np.degrees(motion.joint("rocker"))).max() < 1e-12
    with pytest.raises(InvalidRequest, match="needs a link 'rope'"):
        transmission(motion, "rocker", "rope")


def test_what_is_held_bears_the_moment_about_its_joint() -> None:
    """An arm of three joints, of which the middle one drives: what is held in the order in which it was given."""
    arm: list[Any] = [
        Revolute("a", (0, 0, 0), axis=(0, 0, 1)),
        Revolute("b", (2, 0, 0), axis=(0, 1, 0), on="a"),
        Revolute("c", (3, 1, 0), axis=(0, 0, 1), on="b"),
    ]
    motion = Mechanism(arm).sweep(Joint("b"), [0.0, 0.3, 0.7], hold=(Joint("c"), Joint("a")))
    tip, force = (4, 1.5, 1), np.array([1.0, 2, 3])
    table = reactions(motion, [Load("c", force, tip)])
    at, elbow = motion.point("c", tip), motion.point("b", (3, 1, 0))
    moments = {
        "held 1": ((at - elbow), motion.point("b", (3, 1, 1)) - elbow),
        "held 2": (at, np.array([0, 0, 1])),
        "drive": (at - (2, 0, 0), np.array([0, 1, 0])),
    }
    assert set(table.columns) == {"drive [deg]", *(f"{name} [N mm]" for name in moments)}
    for name, (lever, axis) in moments.items():
        assert np.abs(table[f"{name} [N mm]"] + (np.cross(lever, force) * axis).sum(1)).max() < 1e-12


@pytest.mark.slow
def test_sensitivities_are_differences_of_designs() -> None:
    """Of toe, by each coordinate of two hard points, against mechanisms that are made with them displaced."""

    def toe(motion: Motion) -> np.ndarray:
        return kinematics(motion, Wheel("wheel", CENTRE, (0, 1, 0), 310.0))["toe [deg]"].to_numpy()

    drive, values = Travel("wheel", CENTRE), [-50.0, 0.0, 50.0]
    table = sensitivities(axle().sweep(drive, values), toe)
    assert table.shape == (3, 30)
    h = 1e-2
    for axis in range(3):
        for k, (label, inner, outer) in {4: ("link 4.from", 1, 0), 1: ("link 1.to", 0, 1)}.items():
            step = np.zeros((5, 3))
            step[k, axis] = h
            plus, minus = (
                toe(axle(INNER + s * inner * step, OUTER + s * outer * step).sweep(drive, values)) for s in (1, -1)
            )
            got = table[f"{label} {'xyz'[axis]}"].to_numpy()
            assert np.abs(got - (plus - minus) / (2 * h)).max() < 1e-8
            assert abs(got[1]) < 1e-9  # the design pose stays what it is


@pytest.mark.slow
def test_the_command_prints_reactions_and_sensitivities(tmp_path: Path) -> None:
    """Of a file with a load, those of Python; of two drives too."""
    source = (folder("data") / "spatial" / "double_wishbone.toml").read_text("utf-8")
    file = tmp_path / "axle.toml"
    load_table = '[[load]]\nbody = "wheel"\nforce = [-2000, 1500, 4000]\nat = [5, 765, -310]\n'
    file.write_text(f"{source}\n{load_table}")
    job = load(file)
    motion = job.sweep({"travel": [-40.0, 30.0]}, {"rack": 5.0})
    expected = reactions(motion, [Load("wheel", (-2000, 1500, 4000), (5, 765, -310))])
    drives = ("--drive", "travel=-40,30", "--hold", "rack=5", "--format", "csv")
    printed = pd.read_csv(io.StringIO(run("sweep", str(file), *drives).stdout))
    assert np.allclose(printed["tie rod [N]"], expected["tie rod [N]"])
    assert np.allclose(printed["drive [N]"], expected["drive [N]"])
    table = pd.read_csv(io.StringIO(run("sweep", str(file), *drives, "--sensitivity", "toe").stdout))
    by_hand = sensitivities(motion, lambda m: job.table(m)["toe [deg]"])
    assert np.allclose(table["tie rod.from z"], by_hand["tie rod.from z"], rtol=1e-9)
    both = ("--drive", "travel=-40,30", "--drive", "rack=0,5", "--format", "csv", "--sensitivity", "camber [deg]")
    grid = pd.read_csv(io.StringIO(run("sweep", str(file), *both).stdout))
    assert len(grid) == 4
    assert np.isfinite(grid.to_numpy()).all()
    refused = run("sweep", str(file), *drives, "--sensitivity", "tow")
    assert "no column is headed 'tow'" in str(refused.exception)
