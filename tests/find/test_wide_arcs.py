"""Arcs near a half circle and beyond, from the request to files: found, kept, drawn, exported, measured."""

from __future__ import annotations

import json
import math
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue import Catalogue, CircularArc, InvalidRequest, StraightLine
from catalogue.draw.still import deviation_along, still
from catalogue.guides.candidate import Candidate
from catalogue.guides.codes import record, remember, save
from tests import naive

pytestmark = pytest.mark.slow

ANGLES = [180, 200, 350]
Answers = Callable[[tuple[Any, ...], Callable[[], Any]], Any]


def asked(angle: float, **place: Any) -> CircularArc:
    return CircularArc(deviation=0.4, radius=50, angle=angle, **place)


@pytest.fixture(scope="module")
def found(small: Catalogue, answers: Callable[..., list[Candidate]]) -> Callable[..., list[Candidate]]:
    def sought(angle: float, family: str | None = None) -> list[Candidate]:
        families = [family] if family else ()
        question = ("wide arc", angle, family)
        return answers(question, lambda: list(small.find(asked(angle), families=families, limit=3)))

    return sought


@pytest.mark.slow
@pytest.mark.parametrize(("angle", "family"), [*((angle, None) for angle in ANGLES), (270, "four-bar")])
def test_answers_are_what_dense_samples_of_their_loops_say(
    found: Callable[..., list[Candidate]], angle: float, family: str | None
) -> None:
    answers = found(angle, family)
    assert len(answers) >= 2
    for one in answers[:2]:
        assert (one.radius, one.arc_angle) == (50, angle)
        assert one.stroke == pytest.approx(100 * math.sin(math.radians(angle / 2)))
        assert one.deviation <= 0.4
        assert one.min_transmission > 10
        way, phase = naive.way_through(np.array(one.pivots), complex(*one.guided))
        centre = 0.5 * one.stroke - 50j * math.cos(math.radians(angle / 2))
        deviation, *ends = naive.along_arc(way, phase, centre, 50, math.radians(angle))
        assert one.deviation == pytest.approx(deviation, rel=1e-4)
        for end in ends:
            assert min(abs(end), abs(end - one.stroke)) < 4 * deviation
        away = [abs(way(np.array([s]))[0] - centre) for s in np.linspace(0, 2 * np.pi, 13)]
        assert max(away) > 49.5
        assert one.allowance is not None
        if one.allowance < 0.0099 * (one.min_link or np.inf):  # no larger one is told
            assert one.kept_share == pytest.approx(0.95, abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("angle", [200])
def test_a_record_keeps_the_angle(found: Callable[..., list[Candidate]], angle: float, tmp_path: Path) -> None:
    answers = found(angle)
    for one, code in zip(answers, remember(answers), strict=True):
        again = catalogue.recall(code)
        assert again == one
        assert again.request.angle == angle
        np.testing.assert_allclose(again.path(11), one.path(11))
    save(answers, tmp_path / "kept.json")
    assert catalogue.load(tmp_path / "kept.json") == answers
    held = json.loads((tmp_path / "kept.json").read_text())
    held["answers"][0]["arc_angle"] = 120.0
    (tmp_path / "changed.json").write_text(json.dumps(held))
    with pytest.raises(InvalidRequest, match="damaged"):
        catalogue.load(tmp_path / "changed.json")


@pytest.mark.slow
def test_records_of_other_answers_say_no_angle(small: Catalogue) -> None:
    """So that they keep the codes that they had."""
    for request in (StraightLine(150, 0.05), CircularArc(100, 0.5, 120)):
        one = small.find(request, limit=1)[0]
        assert "arc_angle" not in record(one)
        assert one.arc_angle is None


@pytest.mark.slow
@pytest.mark.parametrize("angle", ANGLES)
def test_what_is_drawn_and_traced_goes_the_long_way_round(found: Callable[..., list[Candidate]], angle: float) -> None:
    for one in found(angle)[:2]:
        lines = {line.name: line.z for line in still(one).lines}
        centre = 0.5 * one.stroke - 50j * math.cos(math.radians(angle / 2))
        path, (position, error) = lines["path"], deviation_along(one)
        length = 50 * math.radians(angle)
        assert np.abs(np.diff(path)).sum() == pytest.approx(length, rel=0.01)
        assert np.ptp(position) == pytest.approx(length, rel=1e-3)
        assert np.abs(error).max() == pytest.approx(one.deviation, rel=5e-3)
        # the centre of a half circle is known along its chord only
        np.testing.assert_allclose(np.abs(path - centre), 50, atol=0.4)
        assert path.imag.max() == pytest.approx(50 + centre.imag, abs=0.4)
        motion = one.motion(73)
        assert np.abs(motion.deviation).max() == pytest.approx(one.deviation, rel=0.02)
        for tail, end in ((lines["path-before"], path[0]), (lines["path-after"], path[-1])):
            assert tail[0] == pytest.approx(end, abs=1e-9)
            gone = np.angle((tail[-1] - centre) / (end - centre))
            assert (gone > 0) == (end == path[0])  # the way on, round the same circle


@pytest.mark.slow
@pytest.mark.parametrize("angle", [270])
def test_files_hold_the_whole_arc(found: Callable[..., list[Candidate]], angle: float, tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    (one,) = found(angle, "four-bar")[:1]
    centre = 0.5 * one.stroke - 50j * math.cos(math.radians(angle / 2))
    one.export(tmp_path / "a.dxf")
    (spline,) = ezdxf.readfile(tmp_path / "a.dxf").modelspace().query("SPLINE[layer=='PATH']")
    z = np.array([complex(x, y) for x, y, _ in spline.flattening(0.001)])
    turned = np.unwrap(np.angle(z - centre))
    assert abs(turned[-1] - turned[0]) == pytest.approx(math.radians(angle), abs=0.02)
    np.testing.assert_allclose(np.abs(z - centre), 50, atol=2 * one.deviation)
    for suffix in ("FCMacro", "csv", "json"):
        one.export(tmp_path / f"a.{suffix}")
    pytest.importorskip("pylinkage")
    one.export(tmp_path / "a.py")
    runpy.run_path(str(tmp_path / "a.py"))  # which asserts the deviation


@pytest.mark.slow
def test_the_frame_and_the_unit_of_an_arc_change_nothing(small: Catalogue) -> None:
    here = small.find(asked(250), limit=3)
    there = small.find(asked(250, start=(300, -20), along=35, unit="mm"), limit=3)
    inches = small.find(CircularArc(deviation=4, radius=500, angle=250), limit=3)
    for one, other, larger in zip(here, there, inches, strict=True):
        np.testing.assert_allclose(other.at_home().pivots, one.pivots, atol=1e-6)
        size = np.where(one.linkage.finite, 10, 1)[0][..., None]
        np.testing.assert_allclose(np.array(larger.pivots)[..., :2], size * np.array(one.pivots)[..., :2], atol=1e-5)
        assert other.in_unit("in").deviation == pytest.approx(one.deviation / 25.4)
        assert other.in_unit("in").arc_angle == 250


@pytest.mark.slow
@pytest.mark.parametrize("angle", [180, 350])
def test_an_answer_is_measured_as_it_was_found(found: Callable[..., list[Candidate]], angle: float) -> None:
    for one in found(angle)[:2]:
        stretches = one.measure(radius=50, angle=angle)
        assert stretches[0].deviation <= one.deviation * (1 + 1e-6)
        (code,) = remember(stretches[:1])
        assert catalogue.recall(code) == stretches[0]
        assert stretches[0].allowance is None
        assert (one.measure(radius=50, angle=angle, deviation=0.4)[0].allowance or 0) > 0


@pytest.mark.slow
def test_an_answer_is_improved_along_its_arc(found: Callable[..., list[Candidate]]) -> None:
    one = found(270, "four-bar")[-1]
    better = catalogue.improve(one, asked(270), rank_by="deviation", hold="crank 1")
    assert better.before.deviation == pytest.approx(one.deviation, rel=1e-3)
    assert better.improved is not None
    assert better.improved.deviation < one.deviation
    assert better.improved.arc_angle == 270
    assert better.improved.lengths["crank 1"] == pytest.approx(one.lengths["crank 1"])


@pytest.mark.parametrize(
    "more",
    [{"slots": True}, {"returns": True}, {"series": "II.xy"}, {"order": 4}, {"fixed_pivots": (0, 0, 9, 9)},
     {"cognates": True}, {"round_to": 1}],
    ids=str,
)  # fmt: skip
def test_what_only_stored_guides_have_is_refused(small: Catalogue, more: dict[str, Any]) -> None:
    name = next(iter(more)).replace("_", "-")
    with pytest.raises(InvalidRequest, match=f"--{name} cannot be asked for along an arc near a half circle"):
        small.find(asked(200), **more)


@pytest.mark.slow
def test_an_arc_that_no_guide_runs_along_is_said_so(small: Catalogue) -> None:
    nothing = small.find(asked(300), families="four-bar", max_size=60)
    assert not len(nothing)
    assert "no guide found" in nothing.explain()
    assert "300\u00b0" in nothing.explain()


@pytest.mark.slow
def test_stored_guides_alone_are_said_to_follow_no_wide_arc(small: Catalogue) -> None:
    nothing = small.find(asked(200), refine=False)
    assert not len(nothing)
    assert "made to measure there: leave --no-refine out" in nothing.explain()


@pytest.mark.slow
@pytest.mark.parametrize("angle", [350])
def test_constraints_hold_beyond_a_half_circle(small: Catalogue, angle: float) -> None:
    bounds: dict[str, Any] = {"families": "four-bar", "min_transmission": 40, "max_size": 180}
    answers = small.find(asked(angle), limit=2, full_rotation=True, fixed_pivots_in=(-50, -80, 150, 90), **bounds)
    assert len(answers)
    for one in answers:
        assert one.min_transmission >= 40
        z = [complex(x, y) for dyad in one.pivots for x, y, _ in dyad]
        path = (one.path(2001) @ [1, 1j]).tolist()
        assert one.size == pytest.approx(naive.diameter([*z, *path]), rel=2e-3)
        assert one.size <= 180
        assert one.rotates
        assert all(-50 <= x <= 150 and -80 <= y <= 90 for (x, y, _), _ in one.pivots)
