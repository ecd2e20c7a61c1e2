"""Every verb on a stretch of every family of two dyads: it works, or is refused in one line."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue import CatalogueError
from catalogue.draw import moving_svg
from catalogue.draw.datasheet_html import sheet_html
from catalogue.export.formats import FORMATS
from catalogue.find.answers import recall, remember
from catalogue.kinematics.linkage import FAMILIES, Linkage
from catalogue.web import asked, guides

pytestmark = [pytest.mark.slow, pytest.mark.parametrize("family", FAMILIES)]
#: Formats that a family with slides is refused by: links of fixed lengths.
REFUSED = {
    "pylinkage": {"inverted-slider-crank", "swinging-block", "elliptic-trammel", "oldham"},
}


@pytest.fixture
def stretch(random_linkages: Callable[..., Linkage], family: str) -> Any:
    """Return the straightest stretch of a random guide of a family."""
    for pivots in random_linkages(family, 12, 3).pivots:
        found = catalogue.guide(pivots.tolist(), (0.7, 0.4), unit="mm").measure(stroke=0.6, limit=1)
        if len(found) and found[0].deviation < 0.02 and found[0].min_transmission > 15:
            return found[0]
    raise AssertionError("no random linkage guides its point")


def test_the_narrowest_strip_about_its_motion_is_as_wide_as_told(stretch: Any) -> None:
    z = stretch.motion(401).points["guided"]
    assert abs(z[-1] - z[0]) == pytest.approx(0.6, rel=1e-3)
    ways = (z[-1] - z[0]) * np.exp(1j * np.linspace(-0.1, 0.1, 4001))
    half = 0.5 * np.ptp((z * (ways / np.abs(ways)).conj()[:, None]).imag, axis=1).min()
    assert half == pytest.approx(stretch.deviation, rel=1e-2, abs=1e-6)


def test_it_is_drawn_moves_and_has_a_sheet(stretch: Any) -> None:
    assert "<animateTransform" in moving_svg(stretch)
    assert re.search(r"<h1>.*</h1>", str(sheet_html(stretch)))


def test_each_format_is_written_or_refused(stretch: Any, family: str) -> None:
    for kind in (kind for kind in FORMATS if kind not in ("step", "xlsx", "parquet")):
        if family in REFUSED.get(kind, ()):
            with pytest.raises(CatalogueError) as told:
                stretch.export(format=kind)
            assert "\n" not in str(told.value)
        else:
            assert len(stretch.export(format=kind)) > 100


def test_its_code_restores_it_on_the_page(stretch: Any, monkeypatch: pytest.MonkeyPatch, small: Any) -> None:
    (code,) = remember([stretch])
    assert recall(code).to_dict() == stretch.to_dict()
    monkeypatch.setattr(asked, "_OPEN", [small])
    page = guides.guide_page(code, "mm")
    assert isinstance(page, guides.GuidePage)
    assert {number.label for number in page.card.numbers} >= {"Deviation", "Size", "Transmission"}
