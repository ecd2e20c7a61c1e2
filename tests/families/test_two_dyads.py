"""Every verb on a stretch of every family of two dyads: it works, or is refused in one line."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue, CatalogueError, Study
from catalogue.draw import moving_svg
from catalogue.draw.datasheet_html import sheet_html
from catalogue.export.formats import FORMATS
from catalogue.find.answers import recall
from catalogue.find.census import NORMAL, census
from catalogue.guides.codes import remember
from catalogue.kinematics.linkage import FAMILIES
from catalogue.web import asked, guides
from tests.families.conftest import STROKE

pytestmark = pytest.mark.slow
families = pytest.mark.parametrize("family", FAMILIES)
#: Formats that a family with slides is refused by: links of fixed lengths.
REFUSED = {
    "pylinkage": {"inverted-slider-crank", "swinging-block", "elliptic-trammel", "oldham"},
}


@pytest.fixture
def stretch(stretches: Callable[[str], list[Any]], family: str) -> Any:
    """Return the straightest stretch of a random guide of a family."""
    return stretches(family)[0]


@families
def test_the_narrowest_strip_about_its_motion_is_as_wide_as_told(stretch: Any) -> None:
    z = stretch.motion(401).points["guided"]
    assert abs(z[-1] - z[0]) == pytest.approx(STROKE, rel=1e-3)
    ways = (z[-1] - z[0]) * np.exp(1j * np.linspace(-0.1, 0.1, 4001))
    half = 0.5 * np.ptp((z * (ways / np.abs(ways)).conj()[:, None]).imag, axis=1).min()
    assert half == pytest.approx(stretch.deviation, rel=1e-2, abs=1e-6)


@families
def test_it_is_drawn_moves_and_has_a_sheet(stretch: Any, tmp_path: Path) -> None:
    assert "<animateTransform" in moving_svg(stretch)
    assert re.search(r"<h1>.*</h1>", str(sheet_html(stretch)))
    stretch.sheet(tmp_path / "sheet.pdf")
    assert (tmp_path / "sheet.pdf").read_bytes().startswith(b"%PDF")


@families
def test_each_format_is_written_or_refused(stretch: Any, family: str, solids: Callable[[Any], list[str]]) -> None:
    for kind in FORMATS:
        if family in REFUSED.get(kind, ()):
            with pytest.raises(CatalogueError) as told:
                stretch.export(format=kind)
            assert "\n" not in str(told.value)
        elif kind == "step":
            assert {"frame", "coupler"} < {*solids(stretch)}
        else:
            assert len(stretch.export(format=kind)) > 100


@families
def test_its_code_restores_it_on_the_page(stretch: Any, monkeypatch: pytest.MonkeyPatch, small: Any) -> None:
    (code,) = remember([stretch])
    assert recall(code).to_dict() == stretch.to_dict()
    monkeypatch.setattr(asked, "_OPEN", [small])
    page = guides.guide_page(code, "mm")
    assert isinstance(page, guides.GuidePage)
    assert {number.label for number in page.card.numbers} >= {"Deviation", "Size", "Transmission"}


def test_the_census_counts_every_family_that_is_stored(small: Catalogue) -> None:
    cells = census(small.database, small.registry)
    assert {cell.family for cell in cells} == {*NORMAL} == {*FAMILIES}
    counted = {family: sum(c.guides + c.named for c in cells if c.family == family) for family in FAMILIES}
    held = small.guides().groupby("family")["id"].count()
    assert {family: count for family, count in counted.items() if count} == held.to_dict()


def test_a_study_has_a_row_for_every_family(small: Catalogue) -> None:
    """With its best answer, or the reason for none."""
    base = {"path": "circular-arc", "stroke": 100, "deviation": 5, "limit": 1, "refine": False}
    held = [*small.guides().family.unique()]
    table = Study.grid(base, families=[[family] for family in held]).run(small, engine="serial").to_pandas()
    assert [*table["families"]] == held
    for family, row in zip(held, table.to_dict("records"), strict=True):
        assert row["status"] in ("answers", "none")
        assert row["best_family"] == family if row["status"] == "answers" else row["reason"]
