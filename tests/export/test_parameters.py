"""Parameters by name: read back, they are the guide's numbers to the last digit."""

from __future__ import annotations

import csv
import io
import math
import re

import numpy as np
import pytest

import catalogue

FAMILIES = ("four-bar", "slider-crank", "inverted-slider-crank", "swinging-block", "elliptic-trammel", "oldham")
Six = dict[str, catalogue.Stretch]


def equations(guide: catalogue.PlacedGuide, unit: str = "mm") -> dict[str, tuple[float, str]]:
    """Return values and units by name, from the text."""
    found = {}
    for line in str(guide.export(format="solidworks", unit=unit)).splitlines():
        match = re.fullmatch(r'"([a-z][a-z_0-9]*)" = (-?\d+(?:\.\d+)?)(mm|in|deg)', line)
        assert match, line
        assert match[1] not in found
        found[match[1]] = float(match[2]), match[3]
    return found


@pytest.mark.parametrize("family", FAMILIES)
def test_equations_hold_every_length_and_place(six: Six, family: str) -> None:
    guide = six[family]
    told = equations(guide, "in")
    for name, value in guide.lengths.items():
        length, unit = told[name.replace(" ", "_")]
        assert length == pytest.approx(value, rel=0, abs=1e-15 * guide.size)
        assert unit == "in"
    for i, dyad in enumerate(guide.pivots, 1):
        for what, (x, y, w) in zip(("fixed", "moving"), dyad, strict=True):
            if w:
                place = [told[f"{what}_{i}_{c}"][0] for c in "xy"]
                assert place == pytest.approx([x, y], rel=0, abs=1e-15 * guide.size)
            else:  # square to the line is the normal
                angle, unit = told[f"{what}_{i}_angle"]
                assert unit == "deg"
                assert abs(math.sin(math.radians(angle)) * y + math.cos(math.radians(angle)) * x) < 1e-15
    assert [told[f"guided_{c}"][0] for c in "xy"] == pytest.approx(guide.guided, rel=0, abs=1e-15 * guide.size)


@pytest.mark.parametrize("family", FAMILIES)
def test_the_linkage_is_made_again_from_its_parameters(six: Six, family: str) -> None:
    told = {name: value for name, (value, _) in equations(six[family]).items()}

    def pivot(name: str) -> list[float]:
        if f"{name}_x" in told:
            return [told[f"{name}_x"], told[f"{name}_y"], 1]
        normal = 1j * np.exp(1j * math.radians(told[f"{name}_angle"]))
        return [normal.real, normal.imag, 0]

    again = catalogue.guide(
        [[pivot(f"fixed_{i}"), pivot(f"moving_{i}")] for i in (1, 2)], (told["guided_x"], told["guided_y"])
    )
    guide = six[family]
    assert again.linkage.family[0] == family
    assert again.lengths == pytest.approx(guide.lengths, rel=1e-12, abs=1e-12 * guide.size)


def test_fusion_reads_names_units_expressions_and_comments(six: Six) -> None:
    rows = list(csv.DictReader(io.StringIO(str(six["slider-crank"].export(format="fusion", unit="mm")))))
    assert list(rows[0]) == ["Name", "Unit", "Expression", "Value", "Comments", "Favorite"]
    assert {row["Name"]: (float(row["Value"]), row["Unit"]) for row in rows} == equations(six["slider-crank"])
    for row in rows:
        assert row["Expression"] == f"{row['Value']} {row['Unit']}"
        assert row["Comments"]
        assert "e" not in row["Value"]


def test_sizes_of_the_parts_are_those_asked_for(six: Six) -> None:
    told = str(six["four-bar"].export(format="solidworks", bar_width=12.5, hole=4))
    assert '"bar_width" = 12.5mm\n"hole" = 4mm\n' in told
