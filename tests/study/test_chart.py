"""The map of a study: a cell for each request, steps between series, cards that cells lead to."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from catalogue import Candidate, Catalogue, InvalidRequest, Request, StraightLine, Study
from catalogue.find.answers import record, text_of
from catalogue.study.results_file import ResultsFile
from catalogue.study.task import Done

DEVIATIONS, SIZES = (0.3, 0.4, 0.5), (300, 400)


@pytest.fixture(scope="module")
def answers(small: Catalogue) -> list[Candidate]:
    """Return the best stored guides of two series or families."""
    found = small.find(StraightLine(150, 0.5), limit=12, refine=False)
    first = found[0]
    return [first, next(one for one in found if (one.series, one.family) != (first.series, first.family))]


@pytest.fixture
def study(answers: list[Candidate], tmp_path: Path) -> Study:
    """Return a study of six requests: one kind of answer at small sizes, another above, one cell without."""
    requests = [Request.of(StraightLine(150, d), max_size=s, refine=False) for d in DEVIATIONS for s in SIZES]
    file = ResultsFile(tmp_path / "x.study")
    file.add(requests)
    texts = [text_of(record(one)) for one in answers]
    done: list[Any] = [(k, 0, Done((texts[k % 2],), cost=0.1)) for k in range(1, 6)]
    advice = ((("max_size", "<500>", "400"),),)
    file.write([*done, (6, 0, Done(reason="no guide found", advice=advice))])
    return Study.open(file.path)


def drawn(study: Study, tmp_path: Path, **how: str) -> str:
    study.map(tmp_path / "map.html", **how)
    return (tmp_path / "map.html").read_text("utf-8")


@pytest.mark.slow
def test_each_request_is_a_cell_that_leads_to_its_card(study: Study, answers: list[Candidate], tmp_path: Path) -> None:
    text = drawn(study, tmp_path)
    cards = [f"cell-{k}" for k in range(1, 7)]
    assert sorted(re.findall(r'href="#(cell-\d)"', text)) == cards
    assert sorted(re.findall(r'<article id="(cell-\d)"', text)) == cards
    assert text.count('class="cell none"') == 1
    for code in study.to_pandas()["code"][:5]:
        assert f"<code>{code}</code>" in text
    assert "max_size &lt;500&gt;" in text
    assert text.count("guide-drawing") >= 5
    assert text.count("refine False") == 6
    assert all(f"{one.series} {one.family}" in text for one in answers)


def test_steps_stand_where_the_series_or_family_changes(study: Study, tmp_path: Path) -> None:
    """Sizes have answers of two kinds at each deviation; the cell without an answer differs from its neighbours."""
    text = drawn(study, tmp_path, x="deviation", y="max_size")
    steps = [dict(re.findall(r'([xy][12])="([\d.]+)"', one)) for one in re.findall(r"<line [^>]*step[^>]*>", text)]
    across = [one for one in steps if one["y1"] == one["y2"]]
    assert len(across) == 3
    assert len(steps) == 4


@pytest.mark.slow
def test_a_page_stands_alone_in_light_and_dark(study: Study, tmp_path: Path) -> None:
    text = drawn(study, tmp_path, value="size")
    assert "prefers-color-scheme: dark" in text
    assert not re.search(r'(src|href)="(?!#|data:)', text)
    assert "<script" not in text


def test_other_axes_have_charts_of_their_own(tmp_path: Path) -> None:
    line = Request.of(StraightLine(150, 0.5))
    three = [
        line.with_(deviation=d, max_size=s, min_transmission=t) for d in (0.4, 0.5) for s in SIZES for t in (0, 30)
    ]
    study = Study(three)
    assert drawn(study, tmp_path, x="max_size", y="min_transmission").count("<section") == 2
    with pytest.raises(InvalidRequest, match="24 at most"):
        drawn(
            Study([*three, *(line.with_(max_link=k) for k in range(100, 125))]), tmp_path, x="max_size", y="deviation"
        )


@pytest.mark.parametrize(
    ("how", "says"),
    [({"value": "beauty"}, "a map shows one of"), ({"x": "max_link"}, "does not vary"), ({"y": "x"}, "does not vary")],
)
def test_names_that_are_unknown_are_told(study: Study, tmp_path: Path, how: dict[str, str], says: str) -> None:
    with pytest.raises(InvalidRequest, match=says):
        drawn(study, tmp_path, **how)


def test_a_study_of_one_request_has_no_map(tmp_path: Path) -> None:
    with pytest.raises(InvalidRequest, match="needs an axis"):
        drawn(Study([Request.of(StraightLine(150, 0.5))]), tmp_path)
