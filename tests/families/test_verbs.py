"""Every verb on an answer of every family: it works, or is refused in one line."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import catalogue
from catalogue import Catalogue, CatalogueError, Constraints, InvalidRequest, StraightLine, Study, mechanism
from catalogue.collections.results import CollectionCandidate
from catalogue.draw import moving_svg
from catalogue.export.formats import FORMATS
from catalogue.export.write import TWO_DYADS
from catalogue.find import improve_chain
from catalogue.find.answers import recall
from catalogue.find.census import census
from catalogue.find.names import check_names
from catalogue.find.specimens import stretch_of
from catalogue.guides.codes import remember
from catalogue.web import guides
from tests.families.conftest import REGISTRY, ROWS

pytestmark = pytest.mark.slow
PLANAR = [(name, family) for name, family in ROWS if REGISTRY.collection(name).mechanism is not None]
#: The first family of each collection.
FIRST = [*{name: (name, family) for name, family in reversed(PLANAR)}.values()]
planar = pytest.mark.parametrize(("name", "family"), PLANAR, ids=[family for _, family in PLANAR])


@pytest.fixture(scope="module")
def own_of(answers_of: Callable[..., Any]) -> Callable[[str, str], Any]:
    """Return a maker of the first answer of a row as a mechanism."""
    return cache(lambda name, family: mechanism(answers_of(name, family)[0]))


@pytest.fixture
def own(own_of: Callable[[str, str], Any], name: str, family: str) -> Any:
    """Return the first answer of a row as a mechanism."""
    return own_of(name, family)


@planar
def test_measure_finds_the_path_again(own: Any) -> None:
    assert own.measure(stroke=100)[0].deviation <= 1.01 * own.deviation + 1e-9


@planar
def test_improve_is_no_worse_and_keeps_the_frame(own: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(improve_chain, "MOVES", improve_chain.MOVES._replace(starts=0))
    found = own.improve(StraightLine(100, 2, unit="mm"), hold="fixed-pivots")
    better = found.improved
    if better is None:
        assert "no way found to improve it" in found.explain()
        return
    assert better.deviation < found.before.deviation
    for joint in own.bars["frame"]:
        assert better.joints[joint] == pytest.approx(own.joints[joint])


@planar
def test_answers_are_cards_in_a_notebook(answers_of: Callable[..., Any], name: str, family: str) -> None:
    found = answers_of(name, family)[:2]
    page = ET.fromstring(f"<div>{found._repr_html_()}</div>")
    assert len(page.findall(".//{http://www.w3.org/2000/svg}svg")) == len(found)
    assert f"{found.collection.title}: {len(found)}" in "".join(page.itertext())
    assert page.findtext(".//b") == " ".join(part for part in ("0:", found[0].series, family) if part)
    head, first, *_ = ([cell.text for cell in row] for row in page.iter("tr"))
    assert first[head.index("size")] == f"{found[0].metrics['size']:.4g}"


def test_answers_in_space_are_a_table_in_a_notebook(answers_of: Callable[..., Any]) -> None:
    found = answers_of(*PLANAR[0])[:1]
    spatial = replace(found[0], collection=replace(found[0].collection, mechanism=None))
    page = ET.fromstring(f"<div>{replace(found, candidates=[spatial])._repr_html_()}</div>")
    assert not page.findall(".//{http://www.w3.org/2000/svg}svg")
    assert len(list(page.iter("tr"))) == 2


@planar
def test_a_code_restores_the_mechanism_where_it_stands(
    answers_of: Callable[..., Any], name: str, family: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(tmp_path / "answers.db"))
    one = answers_of(name, family)[-1]
    (code,) = remember([one])
    again = recall(code, REGISTRY.collection)
    assert again.to_dict() == one.to_dict()


@planar
def test_parts_of_the_moving_drawing_meet_at_the_joints(own: Any) -> None:
    """Pins and names are translated to the places of the joints; bars turn by their angles."""
    drawn = moving_svg(own, width=400, layers=("names",), count=9)
    shown = own.motion(3)
    names = re.findall(r'<g class="name" transform="translate\(([^)]*)\)"', drawn)
    assert len(names) == len(own.joints)
    assert len(re.findall(r'<g class="bar"', drawn)) == len(own.bars) - 1
    at = [complex(*map(float, place.split())) for place in names]
    z = [shown.points[name][1] if name in shown.points else complex(*own.joints[name]) for name in own.joints]
    # paper is the plane, mirrored, moved and scaled
    scale = abs(at[1] - at[0]) / abs(z[1] - z[0])
    for k in range(2, len(z)):
        assert abs(at[k] - at[0]) == pytest.approx(scale * abs(z[k] - z[0]), abs=1.0)


@pytest.mark.parametrize(("name", "family"), [row for row in PLANAR if row[1] in ("watt-1", "cardan-gears")])
def test_a_film_is_drawn(own: Any, tmp_path: Path) -> None:
    own.plot(tmp_path / "a.gif")
    assert (tmp_path / "a.gif").read_bytes().startswith(b"GIF8")


@planar
def test_each_format_is_written_or_refused(own: Any, solids: Callable[[Any], list[str]]) -> None:
    for kind in FORMATS:
        if kind in TWO_DYADS:
            with pytest.raises(CatalogueError, match=kind) as told:
                own.export(format=kind)
            assert "\n" not in str(told.value)
        elif kind == "step":
            assert len({*solids(own)}) >= len(own.bars)
        else:
            assert len(own.export(format=kind)) > 100


@pytest.mark.parametrize(("name", "family"), FIRST, ids=[name for name, _ in FIRST])
def test_a_sheet_is_printed(own: Any, tmp_path: Path) -> None:
    own.sheet(tmp_path / "sheet.pdf")
    assert (tmp_path / "sheet.pdf").read_bytes().startswith(b"%PDF")


def test_the_census_counts_every_family(families: Catalogue) -> None:
    cells = {(cell.series, cell.family): cell for cell in census(families.database, families.registry)}
    for row in PLANAR:
        assert cells[row].mechanisms == cells[row].guides > 0


@planar
def test_a_request_for_guides_says_where_the_family_is(families: Catalogue, name: str, family: str) -> None:
    with pytest.raises(InvalidRequest, match=f"'{family}' is a family of the collection {name}: search it with"):
        check_names(families.database, Constraints(families=[family]))


def test_a_study_has_a_row_for_a_family_of_many_bars(families_db: Path) -> None:
    base = {"stroke": 100, "deviation": 2, "limit": 1, "refine": False}
    with catalogue.open(families_db, build=False) as opened:
        study = Study.grid(base, families=[[family] for _, family in FIRST]).run(opened, engine="serial")
    for (name, family), reason in zip(FIRST, study.to_pandas()["reason"], strict=True):
        assert reason == f"'{family}' is a family of the collection {name}: search it with --collection {name}"


@planar
def test_the_page_shows_it(
    answers_of: Callable[..., Any], name: str, family: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(tmp_path / "answers.db"))
    one = answers_of(name, family)[0]
    (code,) = remember([one])
    monkeypatch.setattr(guides, "opened", lambda: type("Opened", (), {"registry": REGISTRY}))
    page = guides.guide_page(code, "in")
    assert isinstance(page, guides.GuidePage)
    assert page.unit == "in"
    told = {number.label: number for number in page.card.numbers + page.numbers}
    assert told["Deviation"].value == pytest.approx(one.deviation / 25.4, rel=1e-9, abs=1e-15)
    assert told["Stroke"].text == "3.93701"
    assert {place[0] for place in page.pivots} == {*stretch_of(one).joints}
    assert page.charts
    assert "<animateTransform" in page.drawing
    assert str(guides.file_of(code, "sheet", None)).startswith("<!doctype html>")
    assert "<script" in str(guides.file_of(code, "svg", None))
    for kind in page.missing:  # type: ignore[attr-defined]  # a tuple of names
        with pytest.raises(CatalogueError):
            guides.file_of(code, kind, None)


def test_an_answer_in_space_is_refused_by_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    collection = REGISTRY.collection("spatial-guidance")
    made = CollectionCandidate(1, collection, "II", "x", "x", (), 1.0, 0.1, None, {}, {})
    monkeypatch.setattr(guides, "opened", lambda: type("Opened", (), {"registry": REGISTRY}))
    monkeypatch.setattr(guides, "recall", lambda *_: made)
    with pytest.raises(CatalogueError, match="abcdefg is no planar guide"):
        guides.guide_page("abcdefg", None)
