"""Axles of two wheels from the points of one, bars, live axles and twist beams, against solvers of their own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from catalogue.errors import InvalidRequest
from catalogue.spatial import Job, load
from tests.spatial.test_axles import Carrier, polished
from tests.spatial.test_named_points import POINTS, listed

BAR = {"bar pivot": (-200, 300, 50), "bar end": (-60, 560, 60), "drop link": (-20, 640, -70)}
CAR = {
    "wheelbase": 2700, "centre of gravity height": 550, "braking share": 0.6, "driving share": 0.4,
    "other roll centre": 120, "rack per turn": 52,
}  # fmt: skip
LIVE: dict[str, Any] = {
    "lower link body": (500, 420, -60), "lower link axle": (20, 520, -110),
    "upper link body": (450, 480, 130), "upper link axle": (10, 180, 140),
    "middle link body": (450, 0, 130), "middle link axle": (10, 0, 150),
    "Panhard rod body": (-60, -500, 40), "Panhard rod axle": (-60, 450, 20),
    "wheel centre": (0, 760, 0), "spindle": (0, 860, 0), "contact": (0, 760, -320),
}  # fmt: skip


def rows(points: dict[str, Any]) -> str:
    every = {name: np.ravel(value) for name, value in points.items()}
    return "\n".join([",".join([name, *(repr(float(v)) for v in value)]) for name, value in every.items()])


def job(folder: Path, template: str, text: str, both: bool = True) -> Job:
    file = folder / "points.csv"
    file.write_text(f"axes,ISO 8855\n{text}")
    found = load(template, file, both)
    assert not found.remarks()
    return found


def wishbone(folder: Path, both: bool = True) -> Job:
    return job(folder, "double-wishbone", f"{listed('double-wishbone')}\n{rows(BAR | CAR)}\naxle,front", both)


def test_each_wheel_of_an_axle_is_the_single_wheel_and_its_mirror_image(tmp_path: Path) -> None:
    one, axle = wishbone(tmp_path, False), wishbone(tmp_path)
    assert axle.mechanism.mobility.freedoms == 3
    up, down, rack = 45.0, -30.0, 12.0
    both = axle.table(axle.sweep({"left travel": [up], "right travel": [down], "rack": [rack]}, {}))
    left = one.table(one.sweep({"travel": [up]}, {"rack": rack}))
    right = one.table(one.sweep({"travel": [down]}, {"rack": -rack}))
    for side, table in (("left", left), ("right", right)):
        for name in (
            "toe",
            "camber",
            "caster",
            "kingpin inclination",
            "scrub radius",
            "trail",
            "anti-dive",
            "roll centre",
        ):
            column = next(c for c in table if str(c).startswith(f"{name} ["))
            assert both[f"{side} {column}"].iloc[0] == pytest.approx(table[column][0], abs=1e-9), column
        assert both[f"{side} spring [mm]"].iloc[0] == pytest.approx(table["spring [mm]"][0], abs=1e-9)
        assert both[f"{side} spring ratio [mm/mm]"].iloc[0] == pytest.approx(table["spring ratio [mm/mm]"][0], abs=1e-9)
        assert both[f"{side} bar [deg]"].iloc[0] == pytest.approx(table["bar [deg]"][0], abs=1e-9)
    twist = both["left bar [deg]"] - both["right bar [deg]"]
    assert both["bar twist [deg]"].iloc[0] == pytest.approx(twist.iloc[0], abs=1e-9)
    heave = axle.table(axle.sweep({"heave": [20.0]}, {"roll": 0.0, "rack": 0.0}))
    assert abs(heave["bar twist [deg]"].iloc[0]) < 1e-9
    assert heave["left camber [deg]"].iloc[0] == pytest.approx(heave["right camber [deg]"].iloc[0], abs=1e-9)


def test_the_twist_of_a_bar_is_that_of_two_levers_turned_by_hand(tmp_path: Path) -> None:
    """The drop link keeps its length; the ratio is a difference over roll."""
    axle = wishbone(tmp_path)
    h = 1e-3
    motion = axle.sweep({"roll": [60 - h, 60, 60 + h]}, {"heave": 10.0, "rack": 0.0})
    table = axle.table(motion)
    pivot, end, foot = (np.array(BAR[name], float) for name in ("bar pivot", "bar end", "drop link"))
    angles = []
    for side, sign in (("left", 1), ("right", -1)):
        low = motion.point(f"{side} lower", foot * [1, sign, 1])[1] * [1, sign, 1]

        def off(angle: float, low: Any = low) -> float:
            c, s = np.cos(angle), np.sin(angle)
            arm = end - pivot
            turned = pivot + np.array([c * arm[0] + s * arm[2], arm[1], c * arm[2] - s * arm[0]])  # about +y
            return float(np.linalg.norm(turned - low) - np.linalg.norm(end - foot))

        angles.append(np.degrees(brentq(off, -0.9, 0.9, xtol=1e-15)))
    assert table["left bar [deg]"].iloc[1] == pytest.approx(angles[0], abs=1e-9)
    assert table["bar twist [deg]"].iloc[1] == pytest.approx(angles[0] - angles[1], abs=1e-9)
    slope = (table["bar twist [deg]"].iloc[2] - table["bar twist [deg]"].iloc[0]) / (2 * h)
    assert table["bar twist ratio [deg/mm]"].iloc[1] == pytest.approx(slope, abs=1e-7)


def test_a_pinion_turns_the_rack_and_shows_the_steering_ratio(tmp_path: Path) -> None:
    axle = wishbone(tmp_path)
    h = 1e-2
    table = axle.table(axle.sweep({"pinion": [90 - h, 90.0, 90 + h, 360.0]}, {"heave": None, "roll": None}))
    assert table["rack [mm]"].to_numpy() == pytest.approx(np.array([90 - h, 90, 90 + h, 360]) / 360 * 52, abs=1e-9)
    assert (table["steering angle [deg]"] > 0).all()  # the rack moves to the left, ahead of the axle
    slope = -(table["left toe [deg]"].iloc[2] - table["left toe [deg]"].iloc[0]) / (2 * h)
    arms = wishbone(tmp_path)
    moved = arms.table(arms.sweep({"pinion": [90 - h, 90.0, 90 + h]}, {"left travel": None, "right travel": None}))
    assert moved["left steering gradient [deg/deg]"].iloc[1] == pytest.approx(slope, rel=0.02)
    for column in ("Ackermann [%]", "turning circle [mm]"):
        assert np.isfinite(table[column]).all()


def test_roll_steer_and_roll_camber_are_differences_over_roll(tmp_path: Path) -> None:
    axle, h = wishbone(tmp_path), 1e-2
    motion = axle.sweep({"roll": [30 - h, 30.0, 30 + h]}, {"heave": 5.0, "rack": 4.0})
    table = axle.table(motion)
    grounds = []
    for mounted in axle.wheels:
        n = motion.direction(mounted.wheel.carrier, mounted.wheel.outboard())
        down = n * n[:, 2:] - [0, 0, 1]
        centre = motion.point(mounted.wheel.carrier, mounted.wheel.centre)
        radius = mounted.wheel.rolling_radius()
        grounds.append(centre + radius * down / np.linalg.norm(down, axis=1)[:, None])
    over = grounds[1] - grounds[0]
    roll = np.degrees(np.arctan2(over[:, 2], -over[:, 1]))
    steer = table["steering angle [deg]"].to_numpy()
    assert table["roll steer [deg/deg]"].iloc[1] == pytest.approx(
        np.diff(steer[::2])[0] / np.diff(roll[::2])[0], abs=1e-6
    )
    camber = (table["right camber [deg]"] - table["left camber [deg]"]).to_numpy() / 2
    assert table["roll camber [deg/deg]"].iloc[1] == pytest.approx(
        np.diff(camber[::2])[0] / np.diff(roll[::2])[0], abs=1e-6
    )


@pytest.mark.parametrize(("axle", "braking", "driving"), [("front", "anti-dive", "driving anti-lift"),
                                                          ("rear", "braking anti-lift", "anti-squat")])  # fmt: skip
def test_support_is_the_virtual_work_of_the_force_over_that_of_the_shifted_weight(
    axle: str, braking: str, driving: str, tmp_path: Path
) -> None:
    """A force on the locked wheel, or at its centre, along the path of its point per unit of travel."""
    text = f"{listed('double-wishbone')}\n{rows(CAR)}\naxle,{axle}"
    one, h = job(tmp_path, "double-wishbone", text, False), 1e-3
    motion = one.sweep({"travel": [25 - h, 25.0, 25 + h]}, {"rack": 0.0})
    table = one.table(motion)
    assert one.wheel is not None
    n = motion.direction("wheel", one.wheel.outboard())[1]
    down = n * n[2] - [0, 0, 1]
    centre = motion.point("wheel", one.wheel.centre)
    contact = centre[1] + one.wheel.rolling_radius() * down / np.linalg.norm(down)
    turn = motion.rotation("wheel")
    material = np.asarray(one.wheel.centre) + turn[1].T @ (contact - centre[1])
    outward = 1.0 if axle == "front" else -1.0
    for name, share, path, force in (
        (braking, 0.6, motion.point("wheel", material), -1000.0),
        (driving, 0.4, centre, 1000.0),
    ):
        slope = (path[2] - path[0])[[0, 2]] / (2 * h)
        work = force * share * slope[0] / slope[1]  # of the horizontal force per unit of rise
        shifted = abs(force) * 550 / 2700 * (-1 if name in ("anti-dive", "anti-squat") else 1)
        assert table[f"{name} [%]"][1] == pytest.approx(100 * work / shifted, abs=1e-4)
    rise = table["roll centre [mm]"][1] - 120
    fall = np.degrees(np.arctan2(-outward * rise, 2700))
    assert table["roll axis [deg]"][1] == pytest.approx(fall, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("upper", ["upper link", "middle link"])
def test_a_live_axle_is_a_tetrahedron_of_distances_on_four_links(upper: str, tmp_path: Path) -> None:
    left_out = ("middle link", "Panhard") if upper == "upper link" else ("upper link",)
    points = {k: v for k, v in LIVE.items() if not k.startswith(left_out)}
    axle = job(tmp_path, "live-axle", rows(points))
    assert axle.mechanism.mobility.freedoms == 2
    mirror = np.array([1, -1, 1])
    ends = {k: np.array(v, float) for k, v in points.items()}
    inner = [ends["lower link body"], ends["lower link body"] * mirror]
    outer = [ends["lower link axle"], ends["lower link axle"] * mirror]
    if upper == "upper link":
        inner += [ends["upper link body"], ends["upper link body"] * mirror]
        outer += [ends["upper link axle"], ends["upper link axle"] * mirror]
    else:
        inner += [ends["middle link body"], ends["Panhard rod body"]]
        outer += [ends["middle link axle"], ends["Panhard rod axle"]]
    inner_, outer_ = np.array(inner), np.array(outer)
    wheels = np.array([[0, 760.0, 0], [0, -760, 0]])
    carrier = Carrier([*outer_[:3], (300, 0, 0), outer_[3], *wheels, wheels[0] + [0, 100, 0]])
    x = carrier.points[:4].ravel()
    heave, roll = 20.0, 70.0
    for part in np.linspace(0.2, 1, 5):

        def posed(x: Any, part: float = part) -> Any:
            p = carrier.all(x)
            kept = ((p[[0, 1, 2, 4]] - inner_) ** 2).sum(1) - ((outer_ - inner_) ** 2).sum(1)
            rise = p[5:7, 2]
            asked = [rise.sum() / 2 - part * heave, rise[0] - rise[1] - part * roll]
            return np.array([*carrier.rigid(x), *kept, *asked])

        x = polished(posed, x)
    at = carrier.all(x).astype(float)
    h = 1e-2
    motion = axle.sweep({"roll": [roll - h, roll, roll + h]}, {"heave": heave})
    for k, side in enumerate((1, -1)):
        assert np.abs(motion.point("axle", [0, 760 * side, 0])[1] - at[5 + k]).max() < 1e-9
    n = (at[7] - at[5]) / 100
    table = axle.table(motion)
    assert table["left toe [deg]"].iloc[1] == pytest.approx(np.degrees(np.arctan2(n[0], n[1])), abs=1e-9)
    assert table["left camber [deg]"].iloc[1] == pytest.approx(-np.degrees(np.arcsin(n[2])), abs=1e-9)
    # it rolls about the point across the vehicle that stands still
    turn, lines = motion.rotation("axle")[1], []
    for side, hub in ((1, at[5]), (-1, at[6])):
        down = n * n[2] - [0, 0, 1]
        contact = hub + 320 * down / np.linalg.norm(down)
        path = motion.point("axle", [0, 760 * side, 0] + turn.T @ (contact - hub))
        slope = (path[2] - path[0])[1:] / (2 * h)
        lines.append([*slope, slope @ contact[1:]])
    meet = np.linalg.solve(np.array(lines)[:, :2], np.array(lines)[:, 2])
    assert table["roll centre offset [mm]"].iloc[1] == pytest.approx(meet[0], abs=1e-4)
    assert np.isfinite(table["roll steer [deg/deg]"].iloc[1])
    # travel is that of both wheels together, whatever drives
    near = axle.sweep({"heave": [heave - h, heave, heave + h]}, {"roll": roll})
    hub = near.point("axle", [0, 760, 0])
    lean = np.degrees(np.arctan2(*(hub[2] - hub[0])[[0, 2]]))
    for columns in (table.iloc[1], axle.table(near).iloc[1]):
        assert columns["left support angle of centre [deg]"] == pytest.approx(lean, abs=1e-5)


def test_halves_of_a_twist_beam_turn_about_lines_through_bushing_and_middle(tmp_path: Path) -> None:
    """In roll each half turns about the line from its bushing to where the shear axis meets the middle plane."""
    points = {
        "bushing": (350, 560, 20), "shear centre": (250, 0, 30), "wheel centre": (0, 740, 0),
        "spindle": (0, 840, 3), "contact": (0, 742, -300),
        "spring lower": (40, 520, -20), "spring upper": (40, 520, 220),
    }  # fmt: skip
    axle = job(tmp_path, "twist-beam", rows(points))
    assert axle.mechanism.mobility.freedoms == 2
    h = 1e-3
    motion = axle.sweep({"roll": [-h, 0.0, h]}, {"heave": 0.0})
    turn = motion.rotation("left arm")
    spin = (turn[2] - turn[0]) / (2 * h)
    w = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    along = np.array([350, 560, 20.0]) - [250, 0, 30]
    assert np.linalg.norm(np.cross(w, along)) < 1e-7 * np.linalg.norm(w) * np.linalg.norm(along)
    heave = axle.sweep({"heave": [0.0, 30.0]}, {"roll": 0.0})
    wheel = np.array([0, 740.0, 0])
    for point in (wheel, np.array(points["spring lower"], float)):
        now = heave.point("left arm", point)[1]
        assert now[1] == pytest.approx(point[1], abs=1e-9)  # both halves turn as one about the line of bushings
        reach = [np.hypot(*(p - [350, 560, 20])[[0, 2]]) for p in (point, now)]
        assert reach[0] == pytest.approx(reach[1], abs=1e-9)
    assert not axle.table(heave).attrs["reasons"]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("bar pivot,1,2,3", "needs the hard points bar end, drop link"),
        ("centre of gravity height,550\naxle,front", "vehicle needs wheelbase"),
        ("wheelbase,2700\nbraking share,0.6\naxle,front", "height of the centre of gravity"),
        ("wheelbase,2700\nother roll centre,60", "axle must be one of 'front', 'rear'"),
        ("wheelbase,2700\ncentre of gravity height,550\nbraking share,60\naxle,front", "a share from 0 to 1, not 60"),
    ],
)
def test_what_is_half_given_is_one_line(more: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidRequest, match=message):
        job(tmp_path, "double-wishbone", f"{listed('double-wishbone')}\n{more}", False)


def test_files_without_another_side_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "rssr.toml"
    file.write_text('[[revolute]]\nbody = "crank"\nat = [0, 0, 0]\naxis = [0, 0, 1]\n')
    with pytest.raises(InvalidRequest, match=r"both sides are those of a file with one \[wheel\]"):
        load(file, both=True)
    assert set(POINTS)
