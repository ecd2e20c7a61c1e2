"""Scripts: the FreeCAD macro, and the script that moves the guide by pylinkage and asserts its deviation."""

from __future__ import annotations

import ast
import importlib.util
import math
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import catalogue
from catalogue.errors import InvalidRequest
from tests.export.conftest import LINKS
from tests.export.test_levels import CARRIED, positions

FAMILIES = ("four-bar", "slider-crank", "inverted-slider-crank", "swinging-block", "elliptic-trammel", "oldham")
Six = dict[str, catalogue.Stretch]


@pytest.mark.parametrize("family", FAMILIES)
def test_the_macro_is_plain_python(six: Six, family: str) -> None:
    tree = ast.parse(str(six[family].export(format="freecad")))
    compile(tree, "guide.FCMacro", "exec")
    imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    imported |= {str(node.module) for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert imported == {"FreeCAD", "Part"}
    values = {
        node.targets[0].id: ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and node.targets[0].id.isupper()
    }
    told = {name: float(value) for name, value, _, _ in values["PARAMETERS"]}
    assert told["guided_x"] == six[family].guided[0]
    placed = {}
    for name, _, (x, y), angle, _, _, holes in values["LINKS"]:
        turn = complex(math.cos(math.radians(angle)), math.sin(math.radians(angle)))
        placed[name] = [complex(x, y) + turn * complex(*hole) for hole in holes]
    pivots = [complex(x, y) for dyad in six[family].pivots for x, y, w in dyad if w]
    for z in (*pivots, complex(*six[family].guided)):
        assert min(abs(z - hole) for holes in placed.values() for hole in holes) <= 1e-9 * six[family].size


def freecad(macro: Path, check: str) -> list[list[str]]:
    """Run a macro and then a check in FreeCAD; return what the check prints after RESULT, parted by bars."""
    command = shutil.which("freecadcmd") or shutil.which("FreeCADCmd")
    if command is None:
        pytest.skip("freecadcmd is not installed: it comes with the system's packages")
    script = macro.with_name("check.py")
    begin = f"exec(compile(open({str(macro)!r}, encoding='utf-8').read(), 'macro', 'exec'))\n"
    script.write_text(begin + check, "utf-8")
    done = subprocess.run([command, str(script)], capture_output=True, text=True, timeout=300, check=False)
    told = [text.split("|")[1:] for text in re.findall(r"RESULT.*", done.stdout)]
    assert told, done.stdout + done.stderr
    return told


CHECK = """
for one in document.Objects:
    if hasattr(one, "Shape"):
        print("RESULT", one.Label, one.Shape.isValid(), one.Shape.Volume, one.Placement.Base.x, sep="|")
print("RESULT", "sheet", sheet.get("crank_1").Value, sep="|")
"""
#: Moves all solids through poses `TURNS`, of x, y and angle for each link, and tells of those that overlap, and how
#: long the path is.
MOVE = """
solids = {one.Label: one for one in document.Objects if hasattr(one, "Shape") and one.Shape.Solids}
first = {name: one.Placement for name, one in solids.items()}
for number, pose in enumerate(TURNS):
    for name, (x, y, angle) in pose.items():
        solids[name].Placement = Placement(vector(x, y), Rotation(Vector(0, 0, 1), angle)).multiply(first[name])
    for name, one in solids.items():
        for other in [*solids][:[*solids].index(name)]:
            if one.Shape.common(solids[other].Shape).Volume > 1e-6 * one.Shape.Volume:
                print("RESULT", "overlap", number, name, other, sep="|")
ends = [vertex.Point for vertex in path.Shape.Vertexes]
print("RESULT", "solids", len(solids), len(TURNS), sep="|")
print("RESULT", "chord", (ends[-1] - ends[0]).Length, sep="|")
"""


@pytest.mark.slow
@pytest.mark.parametrize(("unit", "millimetres"), [("mm", 1.0), ("in", 25.4)])
def test_freecad_makes_the_bars(six: Six, tmp_path: Path, unit: str, millimetres: float) -> None:
    guide, macro = six["four-bar"], tmp_path / "guide.FCMacro"
    guide.export(macro, unit=unit, bar_width=20, hole=8)
    told = {line[0]: line[1:] for line in freecad(macro, CHECK)}
    length = guide.lengths["crank 1"]
    area = 20 * length + math.pi * 100 - 2 * math.pi * 16
    assert told["crank 1"][0] == "True"
    assert float(told["crank 1"][1]) == pytest.approx(area * 6 * millimetres**3, rel=1e-9)
    assert float(told["crank 1"][2]) == pytest.approx(guide.pivots[0][0][0] * millimetres, abs=1e-9)
    assert float(told["sheet"][0]) == pytest.approx(length * millimetres, rel=1e-12)
    assert {"frame", "crank 2", "coupler", "path"} < {*told}


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_fourteen_inches_are_355_6_mm_in_freecad_and_no_solids_overlap(tmp_path: Path, family: str) -> None:
    links = {name: value if name == "between" else value * 14 / 60 for name, value in LINKS[family].items()}
    (guide,) = catalogue.guide(links, unit="in").measure(stroke=14, limit=1)
    ends = [complex(*place) for place in (guide.path()[0], guide.path()[-1])]
    for unit in (None, "mm"):
        guide.export(macro := tmp_path / "guide.FCMacro", unit=unit)
        told = freecad(macro, "TURNS = [{}]" + MOVE)
        (chord,) = [float(line[1]) for line in told if line[0] == "chord"]
        assert chord == pytest.approx(25.4 * abs(ends[1] - ends[0]), rel=1e-9)
        assert chord == pytest.approx(355.6, rel=0.01)
        assert [line for line in told if line[0] == "overlap"] == []


@pytest.mark.slow
def test_no_solids_of_a_dwell_overlap_in_freecad_over_the_turn(small: catalogue.Catalogue, tmp_path: Path) -> None:
    (one,) = small.find_dwells(catalogue.StandStill(60, 1.0, 20), families=["four-bar"], limit=1)
    one.export(macro := tmp_path / "dwell.FCMacro", unit="mm")
    over = positions(one)[::3]
    poses = []
    for at in over:
        pose = {}
        for name, (a, b) in CARRIED.items():
            if a not in at or b not in at:
                continue
            turn = (at[b] - at[a]) / (over[0][b] - over[0][a])
            moved = at[a] - turn * over[0][a]
            pose[name] = (moved.real, moved.imag, math.degrees(math.atan2(turn.imag, turn.real)))
        poses.append(pose)
    told = freecad(macro, f"TURNS = {poses!r}" + MOVE)
    assert ["solids", "6", "24"] in told
    assert [line for line in told if line[0] == "overlap"] == []


def run(text: str, folder: Path) -> subprocess.CompletedProcess[str]:
    if importlib.util.find_spec("pylinkage") is None:
        pytest.skip("pylinkage is not installed: pip install pylinkage")
    file = folder / "guide.py"
    file.write_text(text, "utf-8")
    return subprocess.run([sys.executable, str(file)], capture_output=True, text=True, timeout=120, check=False)


@pytest.mark.slow
@pytest.mark.parametrize("which", ["four-bar", "slider-crank", "arc"])
def test_pylinkage_agrees_with_the_deviation(six: Six, arc: catalogue.Stretch, tmp_path: Path, which: str) -> None:
    guide = arc if which == "arc" else six[which]
    text = str(guide.export(format="pylinkage"))
    done = run(text, tmp_path)
    assert done.returncode == 0, done.stderr
    told = re.search(r"stroke ([\d.e+-]+), deviation ([\d.e+-]+)", done.stdout)
    assert told
    assert float(told[1]) == pytest.approx(guide.stroke, abs=guide.deviation)
    assert float(told[2]) == pytest.approx(guide.deviation, rel=1e-3)
    wrong = re.sub(r"^DEVIATION = .*$", f"DEVIATION = {1.05 * guide.deviation!r}", text, flags=re.MULTILINE)
    assert "AssertionError" in run(wrong, tmp_path).stderr


@pytest.mark.slow
@pytest.mark.parametrize("unit", [1.0, 1e-4])
@pytest.mark.parametrize("shift", [0, 1000 + 1000j, 1000 - 1000j, -1000 + 1000j, -1000 - 1000j])
def test_the_arc_of_a_script_is_where_the_guide_is(arc: catalogue.Stretch, shift: complex, unit: float) -> None:
    def moved(x: float, y: float, w: float = 1.0) -> list[float]:
        z = unit * (complex(x, y) + shift * w)
        return [z.real, z.imag, w]

    assert arc.radius
    pivots = [[moved(*pivot) for pivot in pair] for pair in arc.pivots]
    own = catalogue.guide(pivots, moved(*arc.guided)[:2])
    (guide,) = own.measure(stroke=unit * arc.stroke, radius=unit * arc.radius, limit=1)
    told = re.search(r"np\.abs\(z - \((.*)\)\) - ([\d.]+)\)", str(guide.export(format="pylinkage")))
    assert told
    off = np.abs(guide.motion(721).points["guided"] - complex(told[1])) - float(told[2])
    assert float(told[2]) == guide.radius
    assert np.abs(off).max() == pytest.approx(guide.deviation, rel=1e-3)


@pytest.mark.parametrize("family", FAMILIES[2:])
def test_families_that_pylinkage_cannot_move_are_refused(six: Six, family: str) -> None:
    with pytest.raises(InvalidRequest, match=f"no dyads for a guide of family {family}"):
        six[family].export(format="pylinkage")


@pytest.mark.slow
def test_a_guide_that_pylinkage_would_lose_is_refused(six: Six) -> None:
    with pytest.raises(InvalidRequest, match="passes a change point"):
        replace(six["four-bar"], pole=[0.0, 0.0]).export(format="pylinkage")
    with pytest.raises(InvalidRequest, match="asserts a deviation"):
        catalogue.guide(six["four-bar"].pivots, six["four-bar"].guided).export(format="pylinkage")
    swinging = {"ground": 1.6, "crank": 3.6, "coupler": 1.4, "rocker": 1.9, "along": 1.0, "across": 1.4}

    def turns_back(one: catalogue.Stretch, crank: int) -> bool:
        turned = np.diff(one.motion(721, driver=crank).drive)
        return bool(turned.min() < 0 < turned.max())

    found = catalogue.guide(swinging).measure(stroke=2.5, limit=2)
    (through,) = [one for one in found if turns_back(one, 1) and turns_back(one, 2)]
    with pytest.raises(InvalidRequest, match="dead point or a change point"):
        through.export(format="pylinkage")


@pytest.mark.slow
def test_the_crank_that_keeps_off_dead_points_drives() -> None:
    """On the third stretch crank 2 comes near one, crank 1 does not."""
    links = {"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80}
    guide = catalogue.guide(links).measure(stroke=118, limit=4)[2]
    least = []  # angle between the coupler and the crank that does not drive
    for driver in (1, 2):
        z, driven = guide.motion(721, driver=driver).points, 3 - driver
        turned = np.angle((z["A1*"] - z["A2*"]) / (z[f"A{driven}*"] - complex(*guide.pivots[driven - 1][0][:2])))
        least.append(np.degrees(np.arcsin(np.abs(np.sin(turned)))).min())
    assert least[0] > 10 * least[1]
    assert ', name="A1")' in str(guide.export(format="pylinkage"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("swinging", "stroke", "nears"),
    [
        ({"ground": 1.6, "crank": 3.6, "coupler": 1.4, "rocker": 1.9, "along": 1.0, "across": 1.4}, 1.5, 2),
        ({"crank": 3, "coupler": 2, "offset": 0.3, "along": 1.5, "across": 0.5}, 1.2, 3),
    ],
    ids=["four-bar", "slider-crank"],
)
def test_a_guide_that_comes_near_a_dead_point_is_refused_in_any_unit(
    swinging: dict[str, float], stroke: float, nears: int
) -> None:
    def told(one: catalogue.Stretch) -> str:
        try:
            return str(one.export(format="pylinkage"))
        except InvalidRequest as error:
            return str(error)

    for unit in (1e-3, 1.0, 1e3):
        links = {name: unit * value for name, value in swinging.items()}
        found = catalogue.guide(links).measure(stroke=stroke * unit, limit=8)
        near = [one.min_transmission < 4.5 for one in found]
        assert sum(near) == nears
        assert ["near a dead point" in told(one) for one in found] == near
