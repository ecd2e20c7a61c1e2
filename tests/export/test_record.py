"""JSON: the guide comes back as a linkage of one's own, to the last digit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import catalogue

FAMILIES = ("four-bar", "slider-crank", "inverted-slider-crank", "swinging-block", "elliptic-trammel", "oldham")
Six = dict[str, catalogue.Stretch]


@pytest.mark.parametrize("family", FAMILIES)
def test_the_guide_comes_back(six: Six, family: str, tmp_path: Path) -> None:
    guide, file = six[family], tmp_path / "guide.json"
    guide.export(file, unit="in")
    told = json.loads(file.read_text("utf-8"))
    again = catalogue.guide(told["pivots"], told["guided"])
    assert (told["pivots"], told["guided"]) == (guide.pivots, guide.guided)
    np.testing.assert_allclose(again.pivots, guide.pivots, rtol=0, atol=1e-15)  # normals are made unit vectors again
    assert again.lengths == pytest.approx(guide.lengths, abs=1e-12 * guide.size)
    assert (told["unit"], told["family"], told["lengths"]) == ("in", family, guide.lengths)
    assert [one["motion"] for one in told["limits"]["circuits"]] == [one.motion for one in guide.circuits]
    assert told["limits"]["dead_points"] == guide.dead_points
    assert (told["measured"]["stroke"], told["measured"]["deviation"]) == (guide.stroke, guide.deviation)
    assert told["provenance"]["program"] == f"mechanism-catalogue {catalogue.__version__}"


def test_what_comes_back_is_as_straight(six: Six) -> None:
    guide = six["four-bar"]
    told = json.loads(str(guide.export(format="json")))
    again = catalogue.guide(told["pivots"], told["guided"]).measure(stroke=guide.stroke)[0]
    assert again.deviation == pytest.approx(guide.deviation, rel=1e-4)


def test_a_linkage_of_ones_own_has_neither_stroke_nor_deviation() -> None:
    guide = catalogue.guide({"ground": 4, "crank": 1, "coupler": 3.5, "rocker": 3, "along": 2, "across": 1})
    told = json.loads(str(guide.export(format="json")))
    assert "deviation" not in told["measured"]
    assert told["limits"]["circuits"][0]["lead"] == "crank 1"
