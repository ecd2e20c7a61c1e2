"""The answer object, its explanations, and stored guides one by one."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd
import pytest

from catalogue import Candidate, Catalogue, CircularArc, Found, InvalidRequest, Linkage, StraightLine
from catalogue.guides.results import SHOWN

LINE = StraightLine(150, 0.05)
Again = Callable[[Candidate], Any]


@pytest.fixture(scope="module")
def found(small: Catalogue) -> Found:
    return small.find(LINE, limit=8, min_transmission=30, families=["four-bar", "slider-crank"])


def test_what_is_printed_of_many_answers_says_how_many_are_not(found: Found) -> None:
    many = Found(found.candidates[:1] * (SHOWN + 7))
    first, *rows, last = repr(many).splitlines()
    assert first == f"<Found of {SHOWN + 7}>"
    assert len(rows) == SHOWN
    assert last == "  ... 7 more"
    assert "more" not in repr(Found(found.candidates[:1] * SHOWN))


@pytest.mark.slow
def test_found_is_a_sequence(found: Found) -> None:
    assert isinstance(found, Sequence)
    assert len(found) == 8
    assert found[0] is next(iter(found))
    assert found[-1] is found[7]
    assert list(found[2:4]) == [found[2], found[3]]
    assert found[3] in found
    assert found.index(found[5]) == 5
    with pytest.raises(IndexError):
        found[8]


@pytest.mark.slow
def test_deviations_are_positive_on_the_left_of_the_way(found: Found) -> None:
    """Beside the line through the ends of the path they are off by no more than where the nominal lies."""
    for one in found:
        moved = one.motion(41)
        z = moved.points["guided"]
        seen = (z - z[0]) / (z[-1] - z[0]) * abs(z[-1] - z[0])
        rest = moved.deviation - seen.imag
        assert np.abs(rest - np.polyval(np.polyfit(seen.real, rest, 1), seen.real)).max() <= 1e-6 * one.deviation
        assert np.abs(moved.deviation).max() == pytest.approx(one.deviation, rel=0.02)


def test_json_and_dataframe_say_the_same(found: Found) -> None:
    rows = json.loads(found.to_json())
    frame = found.to_pandas()
    assert isinstance(frame, pd.DataFrame)
    assert list(frame.columns) == list(rows[0])
    required = ["id", "family", "series", "configuration", "order", "stroke", "deviation", "size", "max_link",
                "max_ground", "max_arm", "min_transmission", "rotates", "pivots", "guided"]  # fmt: skip
    assert set(required) <= set(rows[0])
    for c, row, (_, series) in zip(found, rows, frame.iterrows(), strict=True):
        assert row == json.loads(json.dumps(c.to_dict()))
        assert series["pivots"] == row["pivots"]
        assert series["size"] == row["size"] == c.size
        assert np.shape(row["pivots"]) == (2, 2, 3)
        assert len(row["guided"]) == 2
        assert {w for pair in row["pivots"] for *_, w in pair} <= {0.0, 1.0}
    assert frame["deviation"].dtype == float
    assert frame["size"].dtype == float


def test_a_candidate_is_a_linkage_with_a_path(found: Found) -> None:
    for c in found:
        assert isinstance(c.linkage, Linkage)
        assert c.linkage.family[0] == c.family
        path = c.path(51)
        assert path.shape == (51, 2)
        assert np.all(np.abs(path[:, 1]) < 0.11)
        ends = sorted([path[0, 0], path[-1, 0]])
        np.testing.assert_allclose(ends, [0, 150], atol=0.05)
        assert np.hypot(*(path - c.guided).T).min() < 3
        assert c.request == StraightLine(150, c.deviation) or c.deviation < 1e-14


# -- explanations -----------------------------------------------------------------------------------------------------
@pytest.mark.slow
def test_a_full_answer_explains_itself(small: Catalogue, found: Found) -> None:
    told = found.explain()
    assert told.splitlines()[0].startswith("straight line of 150 within 0.05: ")
    assert "8 answers" in told
    assert f"database {small.database.path}" in told
    assert "no plugin loaded" in told
    assert all(f"{step} " in told.splitlines()[-1] for step in ("starts", "refine", "verify"))
    assert "no guide found" not in told
    arc = small.find(CircularArc(100, 0.1, 150), limit=2, refine=False).explain()
    assert arc.startswith("arc of chord 100 and radius 150 within 0.1")
    free = small.find(CircularArc(100, 0.1), limit=2, refine=False).explain()
    assert free.startswith("arc of chord 100 and any radius within 0.1")


def test_a_score_is_what_its_parts_make_by_hand(found: Found) -> None:
    """The geometric mean of how desirable size, transmission angle, allowance, shortest link, ground and travel are."""
    for c in found:
        short = [c.min_link or np.inf, c.max_ground or np.inf]
        shares = [
            (900 - c.size) / (900 - 150), (c.min_transmission - 15) / (60 - 15), (c.allowance or 0) / (2 * 0.05),
            *((length - 0.05 * 150) / (0.25 * 150 - 0.05 * 150) for length in short),
            (150 - (c.travel or 0.0)) / (150 - 75),
        ]  # fmt: skip
        assert c.score == pytest.approx(100 * np.prod(np.clip(shares, 0, 1)) ** (1 / 6), rel=1e-6)
    assert [c.score for c in found] == sorted((c.score or 0 for c in found), reverse=True)


@pytest.mark.slow
def test_play_as_large_as_the_allowance_uses_up_the_tolerance(small: Catalogue) -> None:
    """With play as large as the allowance the path keeps what was asked, and no more."""
    c = small.find(LINE, limit=1, families=["four-bar"], refine=False)[0]
    (again,) = [d for d in small.find(LINE, limit=20, per_series=0, families=["four-bar"], refine=False,
                                      play=c.allowance or 0.0) if d.id == c.id][:1]  # fmt: skip
    assert again.expected == pytest.approx(0.05, rel=1e-3)


# -- stored guides ----------------------------------------------------------------------------------------------------
def test_a_stored_guide_is_shown(small: Catalogue, found: Found) -> None:
    stored = [c for c in found if c.id is not None]
    assert stored
    for c in stored:
        assert c.id is not None
        guide = small.guide(c.id)
        assert guide.id == c.id
        assert (guide.family, guide.series, guide.configuration, guide.order) == (
            c.family, c.series, c.configuration, c.order)  # fmt: skip
        assert guide.kind == "line"
        assert guide.curvature == 0
        assert len(guide.linkage) == 1
        assert guide.linkage.family[0] == c.family
        if guide.name is None:
            assert guide.provenance["seed"] == 0
            assert set(guide.provenance) == {"plugin", "plugin_version", "plan", "seed", "number"}
        assert np.all(np.diff(guide.reaches["stroke"]) > -1e-9), "a looser level has a longer stroke"
        assert np.all(guide.reaches["deviation"] <= 10.0 ** guide.reaches["level"])
        assert list(guide.reaches["level"]) == sorted(guide.rows)


@pytest.mark.slow
def test_a_stored_guide_is_laid_along_a_stroke(small: Catalogue, again: Again) -> None:
    ids = {c.id for family in ("four-bar", "slider-crank", "inverted-slider-crank")
           for c in small.find(StraightLine(150, 0.5), limit=2, refine=False, families=[family])}  # fmt: skip
    for number in ids:
        assert number is not None
        guide = small.guide(number)
        for level in (min(guide.rows), max(guide.rows)):
            c = guide.at(75.0, level)
            assert c.stroke == 75
            a = again(c)
            assert c.deviation == pytest.approx(a.deviation, rel=1e-2, abs=1e-15 * c.size)
            assert c.deviation <= 1.1 * 10.0**level * 75
            row = np.flatnonzero(guide.reaches["level"] == level)[0]
            assert c.size == pytest.approx(75 * guide.reaches["size"][row], rel=1e-2)
            assert c.deviation == pytest.approx(
                75 * guide.reaches["deviation"][row], rel=0.1, abs=np.finfo(float).eps * c.size
            )


@pytest.mark.slow
def test_a_stored_arc_is_laid_along_a_chord(small: Catalogue, again: Again) -> None:
    found = small.find(CircularArc(100, 0.1), limit=3, refine=False, families=["four-bar"])
    assert found
    for c in found:
        assert c.id is not None
        guide = small.guide(c.id)
        assert guide.kind == "circle"
        laid = guide.at(10.0)
        assert laid.radius is not None
        a = again(laid)
        assert laid.deviation == pytest.approx(a.deviation, rel=1e-2, abs=1e-14 * laid.size)
        assert laid.radius == pytest.approx(a.radius, rel=1e-3)


@pytest.mark.parametrize("name", [10**9, "1000000000", "Nobody's linkage", -1, "", "1e3", 10**30, "9" * 30])
def test_a_guide_that_is_not_there(small: Catalogue, name: Any) -> None:
    with pytest.raises(InvalidRequest, match=r"^the database holds no guide "):
        small.guide(name)


def test_a_level_or_stroke_that_cannot_be_laid(small: Catalogue, found: Found) -> None:
    guide = small.guide(next(c.id for c in found if c.id is not None))
    with pytest.raises(InvalidRequest, match=f"guide {guide.id} has no reach of level 3; it has -"):
        guide.at(1.0, 3)
    for stroke in (0, -1, float("nan"), "long"):
        with pytest.raises(InvalidRequest, match="stroke must be a"):
            guide.at(stroke)  # type: ignore[arg-type]  # wrong on purpose
