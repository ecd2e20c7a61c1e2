"""The map of a study: a cell for each request, steps between series, cards that cells lead to."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue import Candidate, Catalogue, InvalidRequest, Request, StraightLine, Study
from catalogue.guides.codes import record, text_of
from catalogue.study.chart import LAYOUT
from catalogue.study.contours import contours
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


@pytest.mark.parametrize("asked", [lambda study: study[1], lambda s: s.map("x.html"), lambda s: s.front("x.html")])
def test_a_study_without_requests_says_so(tmp_path: Path, asked: Any) -> None:
    study = Study((), tmp_path / "x.study")
    assert study.to_pandas().empty
    with pytest.raises(InvalidRequest, match=r"x\.study has no requests: give the study some"):
        asked(study)


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
    (steps,) = re.findall(r'<path d="([^"]+)" class="step"', text)
    assert steps.count("h") == 3
    assert steps.count("M") == 4


def test_a_contour_runs_where_the_value_is_its_level_and_ends_at_steps() -> None:
    """The value is column plus two rows: between centres the contour of 4 is the line on which it is 4."""
    values = {(i, k): i + 2.0 * k for i in range(5) for k in range(4)}
    ends, none = contours(values, dict.fromkeys(values, "one"), (4.0, 19.0))
    inner = [end for each in ends for end in each if 0 <= end.real <= 4 and 0 <= end.imag <= 3]
    assert len(inner) > 16
    assert [end.real + 2 * end.imag for end in inner] == pytest.approx([4.0] * len(inner))
    (parted,) = contours(values, {place: place[0] > 1 for place in values}, (4.0,))
    assert not [each for each in parted if min(z.real for z in each) < 1.5 < max(z.real for z in each)]
    assert sum(end.real == 1.5 for each in parted for end in each) >= 2
    assert len(none) == 0


def test_a_contour_crosses_cells_of_one_column() -> None:
    """It is as wide as a cell, where the value between two cells is its level."""
    (ends,) = contours({(0, 0): 1.0, (0, 1): 2.0}, {(0, 0): "one", (0, 1): "one"}, (1.25,))
    assert sum(abs(one - other) for one, other in ends) == pytest.approx(1.0)
    assert {round(end.imag, 9) for each in ends for end in each} == {0.25}


@pytest.mark.slow
def test_a_map_draws_contours(answers: list[Candidate], tmp_path: Path) -> None:
    """Four cells of a kind, of two sizes, part along their middle; the contours stand between."""
    file = ResultsFile(tmp_path / "x.study")
    file.add([Request.of(StraightLine(150, d), max_size=s) for d in (0.3, 0.4) for s in SIZES])
    told = json.loads(text_of(record(answers[0])))
    sizes = (200.0, 200.0, 300.0, 300.0)
    file.write([(k, 0, Done((json.dumps({**told, "size": size}),))) for k, size in enumerate(sizes, 1)])
    text = drawn(Study.open(file.path), tmp_path, value="size", x="deviation", y="max_size")
    levels = re.findall(r'<path d="M([\d.]+) [^>]*class="level"', text)
    across = sorted(float(one) for one in levels)
    assert len(across) == 5  # 200, 220 ... 300 without the first, below which nothing is
    assert np.diff(across) == pytest.approx(np.full(4, 0.2 * LAYOUT.cell[0]), abs=0.05)


@pytest.fixture
def front(small: Catalogue, tmp_path: Path) -> Study:
    """Return a study of one request ranked by two criteria."""
    request = Request.of(StraightLine(150, 0.5), rank_by=["size", "transmission"], refine=False, limit=4)
    return Study([request], tmp_path / "front.study").run(small, engine="serial")


@pytest.mark.slow
def test_the_front_of_a_request_is_a_curve_with_a_card_a_point(front: Study, tmp_path: Path) -> None:
    front.front(tmp_path / "front.html")
    text = (tmp_path / "front.html").read_text("utf-8")
    guides = front[1].answers
    names = [f"answer-{k}" for k in range(1, len(guides) + 1)]
    assert re.findall(r'href="#(answer-\d+)"', text) == re.findall(r'<article id="(answer-\d+)"', text) == names
    assert all(f"<code>{code}</code>" in text for code in front.answers()["code"])
    (line,) = re.findall(r'<path d="M([^"]+)" class="front"', text)
    points = np.array([[float(part) for part in point.split()] for point in line.split("L")])
    assert len(points) == sum(one.front == 1 for one in guides) > 1
    assert (np.diff(points[:, 0]) >= 0).all()
    assert (np.diff(points[:, 1]) <= 0).all()  # a larger size has the larger angle, y downwards
    front.front(tmp_path / "front.html", x="transmission")
    assert "Size over minimum transmission angle" in (tmp_path / "front.html").read_text("utf-8")
    with pytest.raises(InvalidRequest, match="none of the criteria"):
        front.front(tmp_path / "front.html", x="score")


def test_a_request_ranked_by_one_number_has_no_front(study: Study, tmp_path: Path) -> None:
    with pytest.raises(InvalidRequest, match="two criteria or more"):
        study.front(tmp_path / "front.html")


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


def test_a_map_of_thousands_of_cells_has_no_cards_but_every_cell(
    study: Study, tmp_path: Path, monkeypatch: Any
) -> None:
    """Six cells count as thousands: five of them have answers."""
    monkeypatch.setattr("catalogue.study.chart.LAYOUT", replace(LAYOUT, single=5))
    text = drawn(study, tmp_path)
    squares = [
        (kind, data.count("z")) for data, kind in re.findall(r'<path d="([^"]+)" class="(tint cell[^"]*)"', text)
    ]
    assert sum(count for _, count in squares) == 6
    assert ("tint cell none", 1) in squares
    assert "<article" not in text
    assert "#cell-" not in text
