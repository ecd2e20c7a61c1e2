"""``catalogue spatial fit``: what a file asks for is fitted, and the file that is written moves as the report says."""

from __future__ import annotations

import io
import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from catalogue.errors import CatalogueError
from catalogue.folders import folder
from catalogue.spatial import load
from catalogue.spatial.fitting.files import fit_file, toml
from tests.spatial.test_files import run as command

RSSR = (folder("data") / "spatial" / "rssr.toml").read_text("utf-8").split("# the rocker as")[0]
SWING = """
[fit.sweep.swing]
drive = "crank"
from = -40
to = 40
steps = 5
"""
GOAL = """
[[fit.target]]
read = "rocker [deg]"
x = [-40, 0, 40]
y = [-12, 0, 12]
offset = true
tolerance = 2.0
"""
TOOL = """
[[point]]
name = "tool"
body = "rocker"
at = [40, 5, 50]

[[fit.target]]
point = "tool"
"""
BOX = """
[[fit.box]]
point = "rod.from"
half = [6, 10, 0]
"""


def run(*arguments: str) -> Any:
    return command(*arguments, standalone_mode=False)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    made = tmp_path / "mine.toml"
    made.write_text(RSSR + SWING + GOAL + BOX, encoding="utf-8")
    return made


@pytest.mark.slow
def test_the_file_that_is_written_moves_as_was_told(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "fitted.toml"
    done = run("fit", str(file), "--out", str(out), "--format", "json")
    assert done.return_value == 0, done.output
    answer = json.loads(done.stdout)
    [target] = answer["targets"]
    assert target["met"]
    assert answer["success"]
    assert target["largest after"] <= 2.0 < target["largest before"]
    sweep = run("sweep", str(out), "--drive", "crank", "--from", "-40", "--to", "40", "--steps", "5", "--format", "csv")
    table = pd.read_csv(io.StringIO(sweep.stdout))
    off = table["rocker [deg]"] - np.array([-12, -6, 0, 6, 12])
    off -= off.mean()
    assert np.abs(off).max() == pytest.approx(target["largest after"], abs=1e-9)
    was, now = (tomllib.loads(f.read_text("utf-8")) for f in (file, out))
    [moved] = answer["points"]
    np.testing.assert_allclose(
        np.subtract(now["link"][0]["from"], was["link"][0]["from"]), [moved[f"d{k} [mm]"] for k in "xyz"], atol=1e-12
    )
    now["link"][0]["from"] = was["link"][0]["from"]
    assert now == was
    assert "is there already" in str(run("fit", str(file), "--out", str(out)).exception)


@pytest.mark.slow
def test_the_table_has_units_and_says_what_was_missed(file: Path) -> None:
    file.write_text(file.read_text("utf-8").replace("tolerance = 2.0", "tolerance = 0.001"), encoding="utf-8")
    done = run("fit", str(file), "--starts", "1")
    assert done.return_value == 1
    assert "rocker" in done.stdout
    assert "deg" in done.stdout
    assert "dx [mm]" in done.stdout
    assert "rocker is missed by" in done.stderr
    assert "where the drive is" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", ["double_wishbone", "rssr"])
def test_the_examples_are_fitted(name: str) -> None:
    found = fit_file(load(folder("data") / "spatial" / f"{name}.toml"), steps=15)
    assert found.success
    assert not found.refused.keys() - {"dead point"}


@pytest.mark.slow
def test_lengths_points_and_lists_of_values_are_targets_too(file: Path) -> None:
    more = """
[[point]]
name = "tool"
body = "rocker"
at = [40, 5, 50]

[fit.sweep.one]
drive = "crank"
values = [-10, 0, 10]

[[fit.target]]
length = "rod"
value = 45
over = "one"

[[fit.target]]
point = "tool"
line = { at = [40, 5, 50], along = [1, 0, 0] }
over = "one"

[[fit.target]]
point = "tool"
circle = { centre = [40, 5, 10], axis = [0, 1, 0], radius = 40 }
over = "one"

[[fit.target]]
point = "tool"
values = [[38, 5, 50], [40, 5, 50], [42, 5, 50]]
over = "one"

[[fit.bound]]
length = "rod"
most = 60
over = "one"
"""
    file.write_text(RSSR + SWING + more + GOAL.replace("read", 'over = "swing"\nread') + BOX, encoding="utf-8")
    found = fit_file(load(file), starts=1, steps=5)
    table = found.targets.set_index("target")
    assert list(found.targets["target"]) == ["length of rod", "tool", "tool", "tool", "rocker"]
    rod = np.hypot(np.hypot(30, 5), 40)
    assert table["largest before"]["length of rod"] == pytest.approx(rod - 45, abs=1e-9)
    circle = found.targets["largest before"][2]
    assert circle == pytest.approx(0, abs=1e-12)
    assert found.bounds["kept"].all()


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("", "nothing of what is to be fitted"),
        ("[[fit.goal]]\nread = 'x'\n", "'goal' means nothing"),
        (SWING + "[[fit.target]]\nvalue = 1\n" + BOX, "one of read, length and point"),
        (SWING + "[[fit.target]]\nread = 'rocker [deg]'\n" + BOX, "one of value, values, and x with y"),
        (SWING + "[[fit.target]]\nread = 'rocket [deg]'\nvalue = 1\n" + BOX, "no column 'rocket .deg.', only drive"),
        (SWING + GOAL.replace("offset", "ofset") + BOX, "'ofset' means nothing; its fields are"),
        (SWING + GOAL.replace("x = [-40", "x = [-30") + BOX, "x runs from -30 to 40, the drive from -40 to 40"),
        (SWING + GOAL + "over = 'bump'\n" + BOX, "over must name a sweep, one of swing"),
        (SWING.replace("to = 40", "too = 40") + GOAL + BOX, "'too' means nothing"),
        (SWING.replace("to = 40", "") + GOAL + BOX, "needs values, or from and to"),
        (SWING + GOAL + BOX.replace("rod.from", "rod"), "no hard point 'rod', only"),
        (SWING + GOAL + BOX.replace("[6, 10, 0]", "'wide'"), "must be a number or 3 numbers"),
        (SWING + GOAL + "[[fit.box]]\nhalf = 3\n", "needs point, or points"),
        (SWING + GOAL, "nothing may move"),
        (SWING + BOX, "give a Target"),
        (SWING + GOAL + "over = []\n" + BOX, "over must name a sweep"),
        (SWING + GOAL.replace("offset = true", "offset = 'no'") + BOX, "offset must be true or false"),
        (SWING.replace("steps = 5", "steps = 1000000000") + GOAL + BOX, "from 2 to 10000"),
        (SWING.replace("to = 40", "to = [1, 2]") + GOAL + BOX, "to must be a finite number"),
        (SWING + TOOL + "line = { at = [1, 2], along = [1, 0, 0] }\n" + BOX, "at must be 3 finite numbers"),
        (SWING + TOOL + "line = { at = [1, 2, 3], along = [0, 0, 0] }\n" + BOX, "along is no direction"),
        (SWING + TOOL + "circle = { centre = [1, 2, 3] }\n" + BOX, "needs centre, axis, radius"),
        (SWING + TOOL + "values = [[1, 2], [3]]\n" + BOX, "values must be finite numbers"),
        (SWING + TOOL + "values = [1, 2]\n" + BOX, r"values of shape \(2,\) for readings of shape \(5, 3\)"),
        (SWING + GOAL.replace("2.0", "'fine'") + BOX, "tolerance must be a finite number"),
        (SWING + "[[fit.target]]\npoint = 'tool'\nvalue = 1\n" + BOX, r"no \[\[point\]\] named 'tool'"),
    ],
)
def test_a_wrong_section_is_one_line(tmp_path: Path, text: str, match: str) -> None:
    file = tmp_path / "wrong.toml"
    file.write_text(RSSR + text, encoding="utf-8")
    with pytest.raises(CatalogueError, match=match) as caught:
        fit_file(load(file), starts=1, steps=2)
    assert "\n" not in str(caught.value)


def test_what_is_written_as_toml_reads_the_same() -> None:
    odd = {
        "unit": 'a "b" \\ \n é \x7f',
        "flag": True,
        "none": [],
        "drive": {"x y": {"kind": "joint", "at": [1, 2.5, -1e-300]}, "b": {}},
        "link": [{"a": "ground", "at": [{"deep": 1}, 2]}, {"line": {"at": [0.1, 0, 0]}}],
        "fit": {"sweep": {"s": {"from": -1}}, "target": [{"read": "x"}, {"line": {"at": [1]}}]},
    }
    assert tomllib.loads(toml(odd)) == odd
