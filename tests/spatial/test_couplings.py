"""Universal joints, rigid connections, gears, racks and pinions, by closed formulas."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue.errors import CannotDrive, InvalidRequest
from catalogue.spatial import (
    Coupling,
    Fixed,
    Joint,
    Mechanism,
    Revolute,
    Travel,
    Universal,
    Wheel,
    kinematics,
    load,
)
from tests.spatial.test_axles import AXIS, CENTRE
from tests.spatial.test_files import run
from tests.spatial.test_several_drives import SLIDE, corner


def test_two_universal_joints_turn_as_their_angles_say() -> None:
    """Input and middle shaft at 30 degrees: the tangents are as the cosine."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    shafts: list[Any] = [
        Revolute("in", (0, 0, 0), axis=(1, 0, 0)),
        Universal("out", (0, 0, 0), axis=(-s, c, 0), axis_on=(0, 0, 1), on="in"),
        Revolute("out", (0, 0, 0), axis=(c, s, 0)),
    ]
    motion = Mechanism(shafts).sweep(Joint("in"), np.linspace(-1.4, 1.4, 15))
    assert motion.success.all()
    # the input's arm is square to the plane of both shafts
    assert np.abs(np.tan(motion.joint("out")) - c * np.tan(motion.drive)).max() < 1e-10


def test_a_hub_fixed_to_its_carrier_moves_with_it_and_is_put_together_in_one_way() -> None:
    axle = Mechanism([*corner(), SLIDE, Fixed("hub", on="wheel")])
    assert axle.mobility.freedoms == 2
    motion = axle.sweep({Travel("hub", CENTRE): [-50.0, 40], Joint("rack"): [5.0, -5]})
    assert np.abs(motion.point("hub", (10, 700, 30)) - motion.point("wheel", (10, 700, 30))).max() < 1e-10
    alone = Mechanism([Revolute("crank", (0, 0, 0), axis=(0, 0, 1)), Fixed("arm", on="crank", at=(1, 0, 0))])
    assert len(alone.assemblies(Joint("crank"), 0.3).hits) == 1


def test_gears_keep_their_ratio_and_count_as_no_freedom() -> None:
    z = (0, 0, 1.0)
    wheels: list[Any] = [Revolute("a", (0, 0, 0), axis=z), Revolute("b", (3, 0, 0), axis=z)]
    pair = Mechanism([*wheels, Coupling(Joint("a") + Joint("b") * 2)])
    assert pair.mobility.freedoms == 1
    motion = pair.sweep(Joint("a"), np.linspace(-9, 9, 19))
    assert np.abs(motion.joint("b") + motion.drive / 2).max() < 1e-12
    assert pair.one(0).mobility.freedoms == 1
    with pytest.raises(CannotDrive, match="1 freedoms: one drives, 0 must be held, not 1"):
        pair.sweep(Joint("a"), [0.1], [Joint("b")])
    with pytest.raises(InvalidRequest, match="must be of type Sum"):
        Coupling(Joint("a"))  # type: ignore[arg-type]


@pytest.mark.parametrize("grid", [True, False])
def test_a_pinion_steers_by_its_radius(grid: bool) -> None:
    """A wheel on a rack that a pinion moves: the columns are those of the rack, steered by the pinion's angle."""
    pinion = Revolute("pinion", (0, 0, 0), axis=(1, 0, 0))
    geared = Mechanism([*corner(), SLIDE, pinion, Coupling(Joint("rack") - Joint("pinion") * 8.0)])
    assert geared.mobility.freedoms == 2
    travel, wheel = Travel("wheel", CENTRE), Wheel("wheel", CENTRE, AXIS, 310.0)
    turned = np.array([-1.5, 1.0])
    motion = geared.sweep({travel: [30.0, 30.0][: 1 if grid else 2], Joint("pinion"): turned}, grid=grid)
    assert np.abs(motion.joint("rack") - 8 * turned).max() < 1e-10
    table = kinematics(motion, wheel, Joint("pinion"))
    plain = Mechanism([*corner(), SLIDE]).sweep({travel: [30.0, 30.0], Joint("rack"): 8 * turned})
    same = kinematics(plain, wheel, Joint("rack"))
    per_degree = table.pop("steering gradient [deg/deg]")
    assert np.allclose(per_degree, np.radians(8) * same.pop("steering gradient [deg/mm]"), atol=1e-8)
    for column in table:
        assert np.allclose(table[column], same[column], atol=1e-8), column
    assert motion.ratio(Joint("rack"), Joint("pinion"), [travel]) == pytest.approx([8, 8])


def test_files_have_universal_joints_rigid_connections_and_couplings(tmp_path: Path) -> None:
    z = [0, 0, 1]
    given = {
        "unit": "mm",
        "revolute": [{"body": "a", "at": [0, 0, 0], "axis": z}, {"body": "b", "at": [9, 0, 0], "axis": z}],
        "fixed": [{"body": "hub", "on": "b", "at": [9, 1, 0]}],
        "drive": {k: {"kind": "joint", "body": k} for k in "ab"},
        "coupling": [{"of": ["a", "b"], "weights": [1, 3]}],
        "point": [{"body": "hub", "at": [9, 1, 0], "name": "end"}],
    }
    file = tmp_path / "gears.json"
    file.write_text(json.dumps(given))
    job = load(file)
    assert job.mechanism.mobility.freedoms == 1
    done = run("sweep", str(file), "--drive", "a", "--from", "0", "--to", "90", "--steps", "2", "--format", "csv")
    head, _, row = (line.split(",") for line in done.stdout.splitlines())
    last = dict(zip(head, map(float, row), strict=True))
    assert last["b [deg]"] == pytest.approx(-30)
    assert last["end x [mm]"] == pytest.approx(9.5)
    given["coupling"] = [{"of": ["a", "c"]}]
    file.write_text(json.dumps(given))
    with pytest.raises(InvalidRequest, match="coupling 1 needs of"):
        load(file)


def test_a_steering_column_with_two_joints_turns_a_pinion_at_even_speed() -> None:
    """Two universal joints whose forks are in one plane, at equal angles: the output turns as the input."""
    c, s = np.cos(0.4), np.sin(0.4)
    column: list[Any] = [
        Revolute("wheel", (-1, 0, 0), axis=(1, 0, 0)),
        Universal("shaft", (0, 0, 0), axis=(-s, c, 0), axis_on=(0, 0, 1), on="wheel"),
        Universal("pinion", (c, s, 0), axis=(0, 0, 1), axis_on=(-s, c, 0), on="shaft"),
        Revolute("pinion", (c, s, 0), axis=(1, 0, 0)),
    ]
    mechanism = Mechanism(column)
    assert mechanism.mobility.freedoms == 1
    motion = mechanism.sweep(Joint("wheel"), np.linspace(-1.2, 1.2, 9))
    assert np.abs(motion.joint("pinion") - motion.drive).max() < 1e-9
