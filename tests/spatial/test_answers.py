"""Answers of the collection of guided bodies as mechanisms of guides, against the solver of the six classes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue.errors import InvalidRequest
from catalogue.spatial import load
from plugins.spatial_guidance.collection.definition import COLLECTION
from plugins.spatial_guidance.collection.measures import run as followed
from plugins.spatial_guidance.collection.plain_data import strokes
from tests.spatial.test_files import run


@pytest.fixture(scope="module")
def drawn() -> list[dict[str, Any]]:
    """Return two specimens of each class, as plain data."""
    rng = np.random.default_rng(3)
    return [dict(one.parameters) for family in COLLECTION.families for one in COLLECTION.draw(family, rng, 6)[:2]]


def saved(folder: Path, every: list[dict[str, Any]]) -> Path:
    file = folder / "answers.json"
    file.write_text(json.dumps({"answers": [{"unit": "mm", "parameters": one} for one in every]}))
    return file


def test_a_guided_body_moves_on_its_guides_as_its_class_does(drawn: list[dict[str, Any]], tmp_path: Path) -> None:
    file = saved(tmp_path, drawn)
    for k, one in enumerate(drawn):
        job = load(file, answer=k + 1)
        ends = dict(part.split("=") for part in job.title.partition(": ")[2].split(", "))
        ways = {drive: [float(v) for v in way.split(":")] for drive, way in ends.items()}
        values = {drive: np.linspace(low, high, 9) for drive, (low, high) in ways.items()}
        motion = job.sweep(values, {})
        assert motion.success.all(), job.title
        path = followed(strokes([one])).path[0]
        point = motion.point("body", job.points[0]["at"])
        size = np.ptp(np.array(one["body"]), axis=0).max()
        assert np.abs(point[[0, -1]] - path[[0, -1]]).max() < 1e-11 * size
        assert job.table(motion).filter(like="point").shape == (9, 3)


def test_the_command_moves_one_of_several_answers(drawn: list[dict[str, Any]], tmp_path: Path) -> None:
    file = saved(tmp_path, drawn[2:4])
    start = load(file, answer=2).title.partition("=")[2].split(":")[0]
    done = run("sweep", str(file), "--answer", "2", "--drive", f"u1={start}:{float(start) + 5}:3", "--format", "csv")
    assert done.exit_code == 0, done.output
    assert "holds 2 guided bodies: --answer says which" in done.stderr
    assert len(done.stdout.strip().splitlines()) == 4


def test_answers_that_are_no_guided_bodies_are_one_line(drawn: list[dict[str, Any]], tmp_path: Path) -> None:
    with pytest.raises(InvalidRequest, match="answer must be"):
        load(saved(tmp_path, drawn[:2]), answer=3)
    torn = {**drawn[0], "body": (np.array(drawn[0]["body"]) * [1, 1, 1.5]).tolist()}
    with pytest.raises(InvalidRequest, match="answer 1 is not closed at the start of its stroke"):
        load(saved(tmp_path, [torn]))
    with pytest.raises(InvalidRequest, match="answer 1 is no guided body"):
        load(saved(tmp_path, [{**drawn[0], "guides": [{}]}]))
    with pytest.raises(InvalidRequest, match="holds no answers of guided bodies"):
        load("double-wishbone", answer=2)
