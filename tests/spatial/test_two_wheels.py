"""Both wheels of an axle in heave, roll and steering, by lines and circles drawn by hand."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue.errors import InvalidRequest
from catalogue.spatial import Joint, Mechanism, Travel, Wheel, axle, kinematics, load
from tests.spatial.test_several_drives import CENTRE, POINTS, SLIDE, corner

RACK = Joint("rack")
OTHER = CENTRE * [1, -1, 1]
LEFT, RIGHT = Travel("wheel", CENTRE), Travel("other", OTHER)
WHEELS = (Wheel("wheel", CENTRE, (0.01, 1, -0.02), 310.0), Wheel("other", OTHER, (0.01, -1, -0.02), 310.0))
BOTH = Mechanism([*corner(), *corner(side=-1, name="other"), SLIDE])


@pytest.mark.slow
def test_the_roll_centre_is_where_the_normals_of_both_paths_meet() -> None:
    """Paths of the points of the tyres on the ground, by differences, over roll and heave."""
    h = 1e-3
    motion = BOTH.sweep({LEFT - RIGHT: [0.0, 60, -30], (LEFT + RIGHT) / 2: [20.0, 0, 10]}, hold={RACK: 3})
    table = axle(motion, *WHEELS, RACK)
    for k in range(3):
        lines, contacts = list[Any](), list[Any]()
        for wheel, travel, still in ((WHEELS[0], LEFT, RIGHT), (WHEELS[1], RIGHT, LEFT)):
            here = [motion.value(s)[k] for s in (travel, still)]
            near = BOTH.sweep({travel: [here[0] - h, here[0], here[0] + h]}, hold={still: here[1], RACK: 3})
            centre, n = (f(wheel.carrier, v) for f, v in ((near.point, wheel.centre), (near.direction, wheel.axis)))
            n = n[1] / np.linalg.norm(n[1])
            down = n * n[2] - [0, 0, 1]
            contact = centre[1] + 310 * down / np.linalg.norm(down)
            back = near.rotation(wheel.carrier)
            material = wheel.centre + back[1].T @ (contact - centre[1])
            path = near.point(wheel.carrier, material)
            slope = (path[2] - path[0])[1:] / (2 * h)
            contacts.append(contact[1:])
            lines.append([*slope, slope @ contact[1:]])
        rows = np.array(lines)
        meet = np.linalg.solve(rows[:, :2], rows[:, 2])
        (y1, z1), (y2, z2) = contacts
        ground = z1 + (z2 - z1) * (meet[0] - y1) / (y2 - y1)
        assert table["roll centre offset [mm]"].iloc[k] == pytest.approx(meet[0], abs=1e-5)
        assert table["roll centre height [mm]"].iloc[k] == pytest.approx(meet[1] - ground, abs=1e-5)
        assert table["track [mm]"].iloc[k] == pytest.approx(y1 - y2, abs=1e-9)


def test_steering_geometry_is_that_of_two_circles_about_one_point() -> None:
    base = 2600.0
    motion = BOTH.sweep({RACK: [-40.0, 25.0]}, hold=[LEFT, RIGHT])
    table = axle(motion, *WHEELS, RACK, base)
    toe = [kinematics(motion, w, RACK)["toe [deg]"].to_numpy() for w in WHEELS]
    to_left = np.radians([-toe[0], toe[1]])
    for k in range(2):
        left_turn = to_left[:, k].sum() > 0
        inner, outer = np.abs(to_left[:, k] if left_turn else to_left[::-1, k])
        assert np.sign(to_left[0, k]) == np.sign(to_left[1, k])
        ideal = np.arctan(1 / (1 / np.tan(outer) - table["track [mm]"][k] / base))
        assert table["Ackermann [%]"][k] == pytest.approx(100 * (inner - outer) / (ideal - outer), rel=1e-10)
        assert table["turning circle [mm]"][k] == pytest.approx(2 * base / np.sin(outer), rel=1e-12)
        assert table["steering angle [deg]"][k] == pytest.approx(np.degrees(to_left[:, k].mean()))
    with pytest.raises(InvalidRequest, match="either side"):
        axle(motion, WHEELS[0], WHEELS[0])
    with pytest.raises(InvalidRequest, match="wheelbase"):
        axle(motion, *WHEELS, RACK, 0.0)


def test_a_file_has_two_wheels_with_names(tmp_path: Path) -> None:
    given: dict[str, Any] = {"unit": "mm", "prismatic": [{"body": "rack", "axis": [0, 1, 0]}]}
    given |= {"revolute": [], "spherical": [], "link": [], "drive": {"rack": {"kind": "joint", "body": "rack"}}}
    given |= {"wheel": [], "vehicle": {"wheelbase": 2600}}
    for name, side in (("left", 1), ("right", -1)):
        p = {k: [float(c) for c in np.multiply(v, [1, side, 1])] for k, v in POINTS.items()}
        for arm in ("lower", "upper"):
            body = f"{name} {arm}"
            given["revolute"].append({"body": body, "at": p[f"{arm} front"], "to": p[f"{arm} rear"]})
            given["spherical"].append({"body": name, "on": body, "at": p[f"{arm} ball"]})
        given["link"].append({"a": "rack", "from": p["rod in"], "b": name, "to": p["rod out"]})
        centre = [0.0, 760.0 * side, 0.0]
        given["drive"][f"{name} travel"] = {"kind": "travel", "body": name, "point": centre}
        given["wheel"].append(
            {"name": name, "carrier": name, "centre": centre, "axis": [0, 1, 0], "radius": 310, "steer": "rack"}
        )
    given["drive"]["roll"] = {"kind": "sum", "of": ["left travel", "right travel"], "weights": [1, -1]}
    given["drive"]["heave"] = {"kind": "sum", "of": ["left travel", "right travel"], "weights": [0.5, 0.5]}
    file = tmp_path / "axle.json"
    file.write_text(json.dumps(given))
    job = load(file)
    table = job.table(job.sweep({"roll": [-60, 0, 60], "heave": [0, 20]}, {"rack": 8.0}, grid=True))
    for name in ("left toe [deg]", "right toe [deg]", "track [mm]", "Ackermann [%]", "left caster [deg]"):
        assert np.isfinite(table[name]).all()
    assert np.allclose(table["left travel [mm]"] - table["right travel [mm]"], np.repeat([-60, 0, 60], 2))
    given["wheel"][1].pop("name")
    file.write_text(json.dumps(given))
    with pytest.raises(InvalidRequest, match="several wheels need a name each"):
        load(file)
