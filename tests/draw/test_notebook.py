"""What a notebook shows: guides that move, cards before a table, tables of linkages and of series."""

from __future__ import annotations

import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

import catalogue
from catalogue.draw.cards import CARDS
from catalogue.guides.own_chain import OwnChain
from catalogue.guides.placed import PlacedGuide
from catalogue.guides.results import Found
from catalogue.html_table import html_table
from tests.draw.samples import ARC, BARS, DWELL, EVERY, MADE, NAMES, OPEN, OWN

GUIDES = {**dict(zip(NAMES, EVERY, strict=True)), "own": OWN, "open": OPEN, "dwell": DWELL, "many bars": BARS}
every = pytest.mark.parametrize("made", GUIDES.values(), ids=GUIDES)


def whole(html: str) -> ET.Element:
    """Return HTML as a tree: it is written so that every element is closed."""
    return ET.fromstring(f"<div>{html.replace('<br>', '<br/>')}</div>")


@every
def test_a_guide_moves(made: PlacedGuide | OwnChain) -> None:
    html, svg = made._repr_html_(), made._repr_svg_()
    assert html is not None
    assert svg is not None
    whole(html)
    ET.fromstring(svg)
    assert "<animateTransform" in html
    assert "<animateTransform" in svg


@pytest.mark.slow
def test_a_guide_has_a_still_for_what_shows_no_html() -> None:
    assert (OWN._repr_png_() or b"").startswith(b"\x89PNG")
    assert (BARS._repr_png_() or b"").startswith(b"\x89PNG")


def test_measured_stretches_of_many_bars_are_cards() -> None:
    html = BARS.measure(stroke=3)._repr_html_()
    whole(html)
    assert "<animateTransform" in html
    assert "mechanism of 4 bars" in html


def test_without_matplotlib_it_moves_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("matplotlib.figure", "matplotlib.backends.backend_agg"):
        monkeypatch.setitem(sys.modules, module, None)
    assert ARC._repr_png_() is None
    assert ARC._repr_html_()


def test_what_cannot_be_drawn_shows_its_text() -> None:
    out_of_reach = replace(ARC, stroke=1e5)
    assert out_of_reach._repr_html_() is None
    assert out_of_reach._repr_svg_() is None
    assert out_of_reach._repr_png_() is None


def test_answers_are_cards_before_a_table() -> None:
    found = Found([*MADE.values(), ARC, ARC])
    html = found._repr_html_()
    tree = whole(html)
    svg = "{http://www.w3.org/2000/svg}svg"
    assert len(list(tree.iter(svg))) == CARDS.most < len(found)
    assert html.count("<style>") == 1  # once for all cards
    names = re.findall(r'id="([^"]+)"', html)
    assert len(names) == len(set(names))
    rows = [[cell.text for cell in row] for row in tree.iter("tr")]
    assert len(rows) == 1 + len(found)
    head = dict(zip(rows[0], rows[1], strict=True))
    assert head["family"] == "four-bar"
    assert head["deviation"] == f"{found[0].deviation:.3g}"
    assert "radius" in rows[0]  # of the arcs; the others have a dash there
    assert rows[1][rows[0].index("radius")] == "–"


def test_no_answers_say_why() -> None:
    assert Found([], "no guide found: <nothing>")._repr_html_() == "<pre>no guide found: &lt;nothing&gt;</pre>"


def test_answers_that_cannot_be_drawn_say_so() -> None:
    assert "does not lead" in Found([replace(ARC, stroke=1e5)])._repr_html_()


def test_linkages_and_series_are_tables() -> None:
    watt = [[[-1, 0.6], [0, 0.6]], [[1, -0.6], [0, -0.6]]]
    linkage = catalogue.Linkage(watt)
    tree = whole(linkage._repr_html_())
    cells = [cell.text for cell in tree.iter("td")]
    assert cells == ["four-bar", "(-1, 0.6)", "(0, 0.6)", "(1, -0.6)", "(0, -0.6)"]
    assert "∞ along (0, 1)" in MADE["elliptic-trammel"].linkage._repr_html_() or "∞" in OPEN.linkage._repr_html_()
    many = catalogue.Linkage(np.repeat(np.array(linkage.pivots), 100, axis=0))
    assert "… 40 more" in many._repr_html_()
    found = catalogue.classify(watt)
    rows = [[cell.text for cell in row] for row in whole(found._repr_html_()).iter("tr")]
    assert rows[1][1:4] == ["four-bar", found.configuration[0], "IV*.l"]
    near = [[cell.text for cell in row] for row in whole(found[0]._repr_html_()).iter("tr")]
    assert [row[0] for row in near[1:]] == [m.series for m in found[0].near]
    assert near[1][-1] == "✓"


def test_text_is_escaped() -> None:
    assert html_table(["<a>"], [["<b>"]]).count("&lt;") == 2


@pytest.mark.slow
def test_neither_import_nor_a_guide_loads_the_drawing() -> None:
    code = """
import sys, catalogue
guide = catalogue.guide({"crank": 1, "rocker": 2.5, "ground": 2.2, "coupler": 2.5, "along": 1, "across": 1})
guide.motion(5)
assert not [m for m in sys.modules if m.startswith(("catalogue.draw", "catalogue.html_table", "matplotlib", "PIL"))]
guide._repr_html_()
assert not [m for m in sys.modules if m.startswith(("matplotlib", "PIL"))]
"""
    subprocess.run([sys.executable, "-c", code], check=True)
