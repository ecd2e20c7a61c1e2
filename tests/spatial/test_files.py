"""Mechanisms from files, and the command: the example files move, what is wrong is one line."""

from __future__ import annotations

import io
import json
import re
import tomllib
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from catalogue.cli import app
from catalogue.errors import CannotDrive, CatalogueError, InvalidRequest
from catalogue.folders import folder
from catalogue.spatial import Joint, load

FILES = sorted((folder("data") / "spatial").glob("*.toml"))


def run(*arguments: str, **how: Any) -> Any:
    """Return what a command gives, standard error apart, as click does by itself from 8.2 on."""
    apart: Any = {"mix_stderr": False} if "mix_stderr" in signature(CliRunner).parameters else {}
    return CliRunner(**apart).invoke(app, ["spatial", *arguments], **how)


@pytest.mark.parametrize("file", FILES, ids=lambda f: f.stem)
def test_every_example_moves(file: Path) -> None:
    job = load(file)
    name, scalar = next(iter(job.drives.items()))
    held = [s for s in job.drives.values() if s is not scalar][: job.mechanism.mobility.freedoms - 1]
    system = job.mechanism.system(*held, scalar)
    start = system.evaluate(system.design[None])[1][0, -1] * system.scalars[-1].unit
    motion = job.mechanism.sweep(scalar, start + np.array([-0.05, 0, 0.05]), held)
    assert motion.success.all(), name
    assert motion.residual().max() < 1e-11
    assert np.isfinite(job.table(motion).to_numpy()).all()


def test_json_says_the_same(tmp_path: Path) -> None:
    toml = folder("data") / "spatial" / "rssr.toml"
    other = tmp_path / "rssr.json"
    other.write_text(json.dumps(tomllib.loads(toml.read_text("utf-8"))), encoding="utf-8")
    one, two = load(toml), load(other)
    q = np.linspace(0, 1, 5)
    pd.testing.assert_frame_equal(
        one.table(one.mechanism.sweep(Joint("crank"), q)), two.table(two.mechanism.sweep(Joint("crank"), q))
    )


def test_the_command_sweeps() -> None:
    file = str(folder("data") / "spatial" / "five_link_axle.toml")
    done = run("sweep", file, "--drive", "travel", "--hold", "rack", "--from", "-80", "--to", "80", "--format", "csv")
    assert done.exit_code == 0, done.output
    table = pd.read_csv(io.StringIO(done.stdout))
    assert np.abs(table["travel [mm]"] - np.linspace(-80, 80, 21)).max() < 1e-9
    assert {"toe [deg]", "camber [deg]", "caster [deg]", "roll centre [mm]"} <= set(table)


def test_a_sweep_has_two_positions_or_more() -> None:
    file = str(folder("data") / "spatial" / "rssr.toml")
    sweep = ("sweep", file, "--drive", "crank", "--from", "0", "--to", "30", "--format", "csv", "--steps")
    assert len(pd.read_csv(io.StringIO(run(*sweep, "2").stdout))) == 2
    assert run(*sweep, "1").exit_code == 2


def test_the_command_runs_whole_circuits_and_reports_dead_points() -> None:
    file = str(folder("data") / "spatial" / "rssr.toml")
    done = run("sweep", file, "--drive", "crank", "--format", "json", "--steps", "9")
    rows = json.loads(done.stdout)
    assert "crank turns fully" in done.stderr
    assert rows[0]["rocker [deg]"] == pytest.approx(rows[-1]["rocker [deg]"], abs=1e-9)
    axle = str(folder("data") / "spatial" / "five_link_axle.toml")
    done = run("sweep", axle, "--drive", "travel", "--hold", "rack", "--from", "0", "--to", "2000")
    assert "dead point" in done.stderr
    assert done.exit_code == 0


def test_a_crank_is_shown_at_even_angles_and_rounding_as_nothing() -> None:
    file = str(folder("data") / "spatial" / "rssr.toml")
    done = run("sweep", file, "--drive", "crank", "--format", "csv", "--steps", "9")
    table = pd.read_csv(io.StringIO(done.stdout))
    np.testing.assert_allclose(table["drive [deg]"], np.linspace(0, 360, 9), atol=1e-9)
    axle = str(folder("data") / "spatial" / "five_link_axle.toml")
    shown = run(
        "sweep", axle, "--drive", "travel", "--hold", "rack", "--from", "-8", "--to", "8", "--steps", "3"
    ).stdout
    assert not re.search(r"e-1\d", shown)


def test_the_command_finds_assemblies() -> None:
    file = str(folder("data") / "spatial" / "rssr.toml")
    done = run("assemblies", file, "--drive", "crank", "--at", "30", "--format", "json")
    rows = json.loads(done.stdout)
    assert len(rows) == 2
    assert rows[0]["rocker [deg]"] == pytest.approx(-1.73417, abs=1e-4)


def test_assemblies_are_those_at_nought_unless_the_drive_stands_elsewhere() -> None:
    file = str(folder("data") / "spatial" / "rssr.toml")
    plain, nought, beside = (
        run("assemblies", file, "--drive", "crank", *at, "--format", "json").stdout
        for at in ((), ("--at", "0"), ("--at", "0.2"))
    )
    assert plain == nought != beside
    assert [row["drive [deg]"] for row in json.loads(plain)] == [0, 0]


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("[", "neither TOML nor JSON"),
        ("[[rope]]", "'rope' means nothing"),
        ("link = 3", "must be tables, each headed"),
        ("[[link]]\na = 'ground'\n", "link 1 needs from, b, to"),
        ("[[link]]\na = 'ground'\nlenght = 3\n", "'lenght' means nothing; its fields are"),
        ("[[revolute]]\nbody = 'a'\nat = [0, 0, 'x']\naxis = [0, 0, 1]\n", "3 numbers"),
        ("[[revolute]]\nbody = 'a'\nat = [0, 0, 0]\naxis = [0, 0, 1]\n[drive.x]\nkind = 'rope'\n", "needs a kind"),
    ],
)
def test_a_wrong_file_is_one_line(tmp_path: Path, text: str, match: str) -> None:
    file = tmp_path / "wrong.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(CatalogueError, match=match) as caught:
        load(file)
    assert "\n" not in str(caught.value)


def test_what_may_be_held_is_named() -> None:
    """Two freedoms, two drives: one drives, the other is to be held."""
    axle = str(folder("data") / "spatial" / "double_wishbone.toml")
    for command in ("sweep", "assemblies"):
        done = run(command, axle, "--drive", "travel")
        assert isinstance(done.exception, CannotDrive)
        assert str(done.exception) == "there are 2 freedoms: travel drives one, hold 1 more of rack"
    job = load(axle)
    assert job.driven("rack", ["travel"]) == (job.drive("rack"), [job.drive("travel")])


def test_a_drive_that_is_not_there_is_named() -> None:
    with pytest.raises(InvalidRequest, match="no drive 'crunk': the file has crank"):
        load(folder("data") / "spatial" / "rssr.toml").drive("crunk")
    with pytest.raises(InvalidRequest, match="cannot read"):
        load("nowhere.toml")
