"""Paths and grids of several drives, sums of scalars and held values, against mechanisms rebuilt in moved poses."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from catalogue.errors import CannotDrive, InvalidRequest
from catalogue.folders import folder
from catalogue.spatial import (
    Angle,
    Joint,
    Link,
    Mechanism,
    Prismatic,
    Revolute,
    Spherical,
    Sum,
    Travel,
    Wheel,
    kinematics,
    load,
)
from catalogue.spatial.jointed import compiled
from tests.spatial.test_files import run

CENTRE = np.array([0, 760.0, 0])
RACK = Joint("rack")
POINTS: dict[str, Any] = {
    "lower front": (-150, 400, -60.0), "lower rear": (140, 390, -70.0), "upper front": (-120, 450, 230.0),
    "upper rear": (130, 440, 240.0), "lower ball": (0, 720, -90.0), "upper ball": (5, 690, 215.0),
    "rod in": (110, 420, -10.0), "rod out": (115, 700, -5.0),
}  # fmt: skip
#: Bodies on which points move.
BODIES = {"lower ball": "wheel", "upper ball": "wheel", "rod in": "rack", "rod out": "wheel"}


def corner(p: Any = None, side: float = 1.0, name: str = "wheel") -> list[Any]:
    p = {k: np.asarray(v) * [1, side, 1] for k, v in (p or POINTS).items()}
    return [
        Revolute(f"{name} lower", p["lower front"], to=p["lower rear"]),
        Revolute(f"{name} upper", p["upper front"], to=p["upper rear"]),
        Spherical(name, p["lower ball"], on=f"{name} lower"),
        Spherical(name, p["upper ball"], on=f"{name} upper"),
        Link("rack", p["rod in"], name, p["rod out"]),
    ]


SLIDE = Prismatic("rack", (0, 1, 0))
AXLE = Mechanism([*corner(), SLIDE])
TRAVEL = Travel("wheel", CENTRE)
UP, TURNED = np.linspace(-80, 80, 5), np.linspace(-30, 20, 4)


@pytest.mark.parametrize("by_numba", [pytest.param(True, marks=pytest.mark.slow), False])
def test_grids_and_paths_are_mechanisms_rebuilt_in_moved_poses(by_numba: bool, monkeypatch: Any) -> None:
    if not by_numba:
        monkeypatch.setattr(compiled, "kernel", lambda: None)
    axle = Mechanism([*corner(), SLIDE])
    grid = axle.sweep({TRAVEL: UP, RACK: TURNED}, grid=True)
    assert grid.success.all()
    assert grid.stops == ((),)
    path = axle.sweep({TRAVEL: grid.values[:, 0], RACK: grid.values[:, 1]})
    at = grid.point("wheel", CENTRE)
    assert np.abs(at[:, 2] - np.repeat(UP, 4)).max() < 1e-10
    assert np.abs(path.point("wheel", POINTS["rod out"]) - grid.point("wheel", POINTS["rod out"])).max() < 1e-10
    for k in (0, 3, 9, 16, 19):
        moved = POINTS | {name: grid.point(body, POINTS[name])[k] for name, body in BODIES.items()}
        z, r = grid.values[k]
        back = Mechanism([*corner(moved), SLIDE]).sweep({Travel("wheel", at[k]): [-z], RACK: [-r]})
        for name, body in BODIES.items():
            assert np.abs(back.point(body, moved[name])[0] - POINTS[name]).max() < 1e-10
        assert np.abs(back.point("wheel", at[k])[0] - CENTRE).max() < 1e-10


def test_what_is_held_takes_the_value_given() -> None:
    held = AXLE.sweep(TRAVEL, UP, hold={RACK: 20})
    grid = AXLE.sweep({TRAVEL: UP, RACK: [20.0]}, grid=True)
    assert np.abs(held.point("wheel", CENTRE) - grid.point("wheel", CENTRE)).max() < 1e-10
    as_designed = AXLE.sweep(TRAVEL, UP, hold={RACK: None})
    assert np.array_equal(as_designed.states, AXLE.sweep(TRAVEL, UP, [RACK]).states)


def test_two_wheels_in_roll_and_heave_move_as_each_by_itself() -> None:
    left, right = Travel("wheel", CENTRE), Travel("other", CENTRE * [1, -1, 1])
    axle = Mechanism([*corner(), *corner(side=-1, name="other"), SLIDE])
    roll, heave = np.array([-60.0, 0, 40]), np.array([-20.0, 30])
    motion = axle.sweep({left - right: roll, (left + right) / 2: heave}, hold={RACK: 5}, grid=True)
    assert motion.success.all()
    for (lean, up), here in zip(motion.values, motion.point("wheel", CENTRE), strict=True):
        alone = AXLE.sweep(TRAVEL, [up + lean / 2], hold={RACK: 5})
        assert np.abs(alone.point("wheel", CENTRE)[0] - here).max() < 1e-10
    table = kinematics(motion, Wheel("wheel", CENTRE, (0, 1, 0), 310.0), RACK)
    alone = AXLE.sweep({TRAVEL: motion.values @ [0.5, 1]}, hold={RACK: 5})
    same = kinematics(alone, Wheel("wheel", CENTRE, (0, 1, 0), 310.0), RACK)
    for column in table:
        assert np.allclose(table[column], same[column], atol=1e-8), column


def test_frames_are_indexed_by_the_drives() -> None:
    grid = AXLE.sweep({TRAVEL: UP, RACK: TURNED}, grid=True)
    table = kinematics(grid, Wheel("wheel", CENTRE, (0, 1, 0), 310.0), RACK)
    assert table.index.names == ["Travel wheel [mm]", "Joint rack [mm]"]
    assert np.allclose(table["travel [mm]"].unstack(), UP[:, None])


def test_derivatives_by_each_drive_and_in_time_are_differences() -> None:
    h, z, r = 1e-3, 30.0, 12.0
    step = np.array([[0, 0], [h, 0], [-h, 0], [0, h], [0, -h]])
    motion = AXLE.sweep({TRAVEL: z + step[:, 0], RACK: r + step[:, 1]})
    x = motion.point("wheel", POINTS["rod out"])
    drives: list[Any] = [TRAVEL, RACK]
    for k, drive in enumerate(drives):
        rate = motion.by(drive).point("wheel", POINTS["rod out"], 2)[0]
        assert np.abs(rate[1] - (x[2 * k + 1] - x[2 * k + 2]) / (2 * h)).max() < 1e-7
        assert np.abs(rate[2] - (x[2 * k + 1] + x[2 * k + 2] - 2 * x[0]) / h**2).max() < 1e-5
    speed, more = np.array([300.0, -40]), np.array([1000.0, 500])
    t = np.array([0, 1e-5, -1e-5])[:, None]
    way = [z, r] + speed * t + more * t * t / 2
    at = AXLE.sweep({TRAVEL: way[:, 0], RACK: way[:, 1]})
    x, v = at.point("wheel", CENTRE), at.in_time([speed, more]).point("wheel", CENTRE, 2)
    assert np.abs(v[0, 1] - (x[1] - x[2]) / 2e-5).max() < 1e-5
    assert np.abs(v[0, 2] - (x[1] + x[2] - 2 * x[0]) / 1e-10).max() < 1e-1
    with pytest.raises(InvalidRequest, match="by which"):
        motion.point("wheel", CENTRE, 1)


@pytest.mark.slow
def test_a_batch_moves_as_each_of_it_and_ends_where_no_pose_is() -> None:
    inner = np.add([[0, 0, 0], [0, 0, 20], [5, -30, 0]], POINTS["rod in"])
    batch = Mechanism([*corner(POINTS | {"rod in": inner}), SLIDE])
    z, r = np.linspace(0, 400, 9), np.linspace(0, 9, 9)
    for motion in (batch.sweep({TRAVEL: z, RACK: r}), batch.sweep({TRAVEL: z[::4], RACK: r[::4]}, grid=True)):
        assert len(motion.stops) == 3
        for i in range(3):
            alone = batch.one(i).sweep({TRAVEL: motion.values[:, 0], RACK: motion.values[:, 1]})
            good = motion.success[i]
            assert 0 < good.sum() < len(good)
            assert "dead point" in motion.stops[i][0]
            assert (
                np.abs(motion.point("wheel", CENTRE)[i, good][:4] - alone.point("wheel", CENTRE)[good][:4]).max() < 1e-9
            )


def test_angles_add_up_across_half_turns() -> None:
    arm: list[Any] = [Revolute("a", (0, 0, 0), axis=(0, 0, 1)), Revolute("b", (2, 0, 0), axis=(0, 0, 1), on="a")]
    one, other = (Angle(body, (1, 0, 0), (0, 0, 1)) for body in "ab")
    turn = np.linspace(0, 7, 15)
    motion = Mechanism(arm).sweep({one: turn, other - one: np.sin(turn)})
    assert np.abs(motion.joint("a") - turn).max() < 1e-12
    assert np.abs(motion.joint("b") - np.sin(turn)).max() < 1e-12


def test_a_sum_may_mix_units_and_what_is_asked_twice_is_refused() -> None:
    with pytest.raises(InvalidRequest, match="not 0"):
        Sum((TRAVEL, RACK), (1.0, 0.0))
    both = AXLE.sweep(TRAVEL + Joint("wheel lower") * 100, [7.0], [RACK])  # 100 mm per radian
    assert both.point("wheel", CENTRE)[0, 2] + 100 * both.joint("wheel lower")[0] == pytest.approx(7)
    with pytest.raises(InvalidRequest, match="named twice"):
        AXLE.sweep({TRAVEL: [1.0]}, hold=[Travel("wheel", CENTRE)])
    with pytest.raises(InvalidRequest, match="as many values each"):
        AXLE.sweep({TRAVEL: [1.0, 2, 3], RACK: [1.0, 2]})
    with pytest.raises(CannotDrive, match="2 freedoms: 3 drive"):
        AXLE.sweep({TRAVEL: [1.0], RACK: [1.0], Joint("wheel lower"): [0.0]})
    with pytest.raises(CannotDrive, match="cannot drive together"):
        AXLE.sweep({RACK: [1.0], Travel("rack", (0, 0, 0), "y"): [1.0]})


def test_the_command_sweeps_grids_paths_and_sums(tmp_path: Path) -> None:
    example = folder("data") / "spatial" / "double_wishbone.toml"
    file = tmp_path / "axle.toml"
    file.write_text(
        example.read_text("utf-8").replace("[wheel]", '[drive.both]\nkind = "sum"\nof = ["travel", "rack"]\n\n[wheel]')
    )
    both = ("--drive", "travel=-80:80:3", "--drive", "rack=-10,10", "--format", "csv")
    table = pd.read_csv(io.StringIO(run("sweep", str(file), *both).stdout))
    assert table["drive rack [mm]"].tolist() == [-10, 10] * 3
    assert np.allclose(table["drive travel [mm]"], table["travel [mm]"])
    sums = ("--drive", "both=-5,15", "--hold", "rack=10", "--format", "csv")
    table = pd.read_csv(io.StringIO(run("sweep", str(file), *sums).stdout))
    assert np.allclose(table["travel [mm]"], [-15, 5])
    job = load(file)
    assert job.table(job.sweep({"travel": [0, 1], "rack": [0, 1]}, {})).index.names == [
        "drive travel [mm]",
        "drive rack [mm]",
    ]
    for wrong, message in (
        (("--drive", "travel=1:2", "--hold", "rack"), "FROM:TO:STEPS"),
        (("--drive", "travel", "--drive", "rack=1"), "say values of each drive"),
        (("--drive", "travel=1", "--hold", "rack=1,2"), "held at one value"),
        (("--drive", "travel", "--hold", "rack=1"), "a circuit holds design values"),
        (("--drive", "travel=1:3:nan", "--hold", "rack"), "FROM:TO:STEPS"),
    ):
        done = run("sweep", str(file), *wrong)
        assert done.exit_code != 0
        assert message in str(done.exception)
