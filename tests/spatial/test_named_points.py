"""Hard points by name and from CSV, vehicle axes, templates, the page of a motion."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue.errors import InvalidRequest
from catalogue.spatial import kinematics, load
from tests.spatial.test_axles import AXIS, BALLS, CENTRE, INNER, LOWER, OUTER, ROD, UPPER
from tests.spatial.test_files import run
from tests.spatial.test_steering_axis import MOUNT, RACK, STRUT, TRAVEL, WHEEL

POINTS: dict[str, Any] = {
    "lower front": LOWER[0], "lower rear": LOWER[1], "upper front": UPPER[0], "upper rear": UPPER[1],
    "lower ball": BALLS[0], "upper ball": BALLS[1], "tie inner": ROD[0], "tie outer": ROD[1],
    "wheel centre": CENTRE, "spindle": CENTRE + 100 * AXIS, "contact": (0, 766.2, -310),
    "spring lower": (0, 600, -80.0),
    "spring upper": (0, 520, 420.0), "strut top": MOUNT, "strut lower": (0, 680, 120.0),
    "pivot inner": (300, 300, 0.0), "pivot outer": (320, 600, 10.0),
}  # fmt: skip
NEEDED = {
    "double-wishbone": [name for name in POINTS if not name.startswith(("strut", "pivot"))],
    "mcpherson": [n for n in POINTS if not n.startswith(("upper", "spring", "pivot"))],
    "five-link": ["tie inner", "tie outer", "wheel centre", "spindle", "contact", "spring lower", "spring upper"],
    "trailing-arm": [
        "pivot inner",
        "pivot outer",
        "wheel centre",
        "spindle",
        "contact",
        "spring lower",
        "spring upper",
    ],
}
FIVE = ("upper rear", "upper front", "lower rear", "lower front")
#: Half turns to the axes of files.
AXES = {"ISO 8855": (1, 1, 1), "SAE": (1, -1, -1), "x rearwards": (-1, -1, 1)}


def listed(template: str, signs: Any = (1, 1, 1), factor: float = 1.0, unit: str = "mm") -> str:
    points = {name: POINTS[name] for name in NEEDED[template]}
    if template == "five-link":
        for k, name in enumerate(FIVE):
            points |= {f"{name} inner": INNER[k], f"{name} outer": OUTER[k]}
    rows = [",".join([name, *(repr(float(v)) for v in np.multiply(p, signs) * factor)]) for name, p in points.items()]
    return "\n".join([f"name,x [{unit}],y [{unit}],z [{unit}]", "# hard points", *rows])


@pytest.mark.parametrize("template", NEEDED)
def test_a_template_with_points_from_csv_moves_in_any_axes(template: str, tmp_path: Path) -> None:
    """In axes of SAE, or x rearwards, in metres, the columns of the wheel are the same."""
    tables = []
    for axes, signs in AXES.items():
        points, file = tmp_path / "points.csv", tmp_path / "axle.toml"
        points.write_text(listed(template, signs, 1e-3, "m"))
        source = Path(load(template, _written(tmp_path, template)).file).read_text("utf-8")
        file.write_text(f'axes = "{axes}"\n{source}')
        job = load(file, points)
        assert not job.unused
        hold = {"rack": 0.0} if "rack" in job.drives else {}
        motion = job.sweep({"travel": [-50.0, 0.0, 60.0]}, hold)
        assert motion.success.all()
        tables.append(job.table(motion))
        assert not tables[-1].attrs["reasons"]
    for other in tables[1:]:
        for column in tables[0]:
            if not str(column).startswith(("rack", "drive")):  # along axes of the file
                assert np.allclose(np.abs(other[column]), np.abs(tables[0][column]), atol=1e-8), column
        assert np.allclose(other["camber [deg]"], tables[0]["camber [deg]"], atol=1e-9)


def _written(folder: Path, template: str) -> Path:
    file = folder / "iso.csv"
    file.write_text(listed(template))
    return file


def test_the_strut_that_slides_on_a_rod_moves_as_one_on_a_line(tmp_path: Path) -> None:
    job = load("mcpherson", _written(tmp_path, "mcpherson"))
    assert job.mechanism.mobility.idle == ("rod",)
    table = job.table(job.sweep({"travel": [-50, 60]}, {"rack": 10.0}))
    other = kinematics(STRUT.sweep({TRAVEL: [-50, 60]}, hold={RACK: 10}), WHEEL, RACK)
    for column in ("toe [deg]", "camber [deg]", "caster [deg]", "kingpin inclination [deg]"):
        assert np.abs(table[column].to_numpy() - other[column].to_numpy()).max() < 1e-9


def test_axes_that_put_the_ground_above_the_wheel_are_refused(tmp_path: Path) -> None:
    points = tmp_path / "points.csv"
    points.write_text(listed("double-wishbone", AXES["SAE"]))
    with pytest.raises(InvalidRequest, match="not below the wheel centre in axes ISO 8855: state the axes"):
        load("double-wishbone", points)


def test_axes_and_side_in_the_list_of_points_are_checked(tmp_path: Path) -> None:
    """In axes of SAE camber keeps its sign; a left wheel on the right is refused."""
    plain = load("double-wishbone", _written(tmp_path, "double-wishbone"))
    assert any("not stated, read as ISO 8855" in line for line in plain.remarks())
    expected = plain.table(plain.sweep({"travel": [30.0]}, {"rack": 5.0}))
    points = tmp_path / "points.csv"
    for axes, signs in AXES.items():
        points.write_text(f"axes,{axes},,\nside,left\n{listed('double-wishbone', signs)}")
        job = load("double-wishbone", points)
        assert not job.remarks()
        table = job.table(job.sweep({"travel": [30.0]}, {"rack": 5.0}))
        for name in ("camber [deg]", "toe [deg]", "caster [deg]", "anti-dive [%]"):
            if name in expected:
                assert table[name][0] == pytest.approx(expected[name][0], abs=1e-9)
    points.write_text(f"side,left\n{listed('double-wishbone', AXES['x rearwards'])}")
    with pytest.raises(InvalidRequest, match="a left wheel is on the other side in axes ISO 8855"):
        load("double-wishbone", points)
    points.write_text(f"axes,DIN\n{listed('double-wishbone')}")
    with pytest.raises(InvalidRequest, match="line 1: axes must be one of 'ISO 8855', 'SAE'"):
        load("double-wishbone", points)
    points.write_text(f"axes,SAE\n{listed('double-wishbone')}")
    own = tmp_path / "own.toml"
    own.write_text(f'axes = "ISO 8855"\n{Path(plain.file).read_text("utf-8")}')
    with pytest.raises(InvalidRequest, match="is in axes ISO 8855, its hard points are in SAE"):
        load(own, points)
    with pytest.raises(InvalidRequest, match="templates are double-wishbone, five-link"):
        load("double-wish-bone")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("lower ball,", "lower bell,"), "needs the hard points lower ball"),
        (("tie inner,110.0", "tie inner,one"), "line 9: a hard point is a name and x, y, z"),
        (("spindle,", "contact,"), "is there twice"),
        (("x [mm]", "x [furlong]"), "no unit 'furlong'"),
    ],
)
def test_points_that_mean_nothing_are_one_line(change: tuple[str, str], message: str, tmp_path: Path) -> None:
    file = tmp_path / "points.csv"
    file.write_text(listed("double-wishbone").replace(*change))
    with pytest.raises(InvalidRequest, match=message):
        load("double-wishbone", file)


def test_semicolons_decimal_commas_and_points_left_over(tmp_path: Path) -> None:
    plain = _written(tmp_path, "double-wishbone")
    other = tmp_path / "other.csv"
    other.write_text(plain.read_text().replace(",", ";").replace(".", ",") + "\ncentre of gravity;1;2;3,5\n")
    job = load("double-wishbone", other)
    assert job.unused == ("centre of gravity",)
    one, two = (j.table(j.sweep({"travel": [30.0]}, {"rack": 0.0})) for j in (load("double-wishbone", plain), job))
    assert one.equals(two)


@pytest.mark.slow
def test_one_command_makes_a_page_of_a_list_of_points(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    points, page = _written(tmp_path, "double-wishbone"), tmp_path / "axle.html"
    points.write_text(points.read_text() + "\nspare,0,0,0\n")
    drives = ("--drive", "travel=-80:80:5", "--hold", "rack")
    done = run("sweep", "double-wishbone", "--points", str(points), *drives, "--report", str(page))
    assert done.exit_code == 0
    assert "hard points that nothing refers to: spare" in done.stderr
    text = page.read_text("utf-8")
    assert text.count("<img") >= 2
    for told in (
        "spare",
        "spring ratio [mm/mm]",
        "trail [mm]",
        "steering moves, spring held",
        "axes of the points ISO 8855",
    ):
        assert told in text
    refused = run("sweep", "double-wishbone", "--points", str(points), *drives, "--report", str(tmp_path / "axle.doc"))
    assert "a report is an HTML file" in str(refused.exception)
