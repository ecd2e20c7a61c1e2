"""Mechanisms of many bars of the user: measured, moved, drawn, kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue import ChainStretch, InvalidRequest, OwnChain, guide, measure, mechanism
from catalogue.errors import InvalidLinkage
from catalogue.find.answers import answer
from catalogue.guides.codes import code_of, record, text_of
from tests.chains.known import BICYCLE, CHEBYSHEV, JANSEN, PEAUCELLIER

#: A four-bar as a mechanism of many bars, and as a linkage.
LENGTHS = {"crank": 100, "rocker": 250, "ground": 220, "coupler": 250, "along": 125, "across": 80, "angle": 60}

#: A crank and a slider that drives it.
PUSHED: dict[str, Any] = {
    "joints": {"A": [0, 0], "B": [1, 1], "C": [4, 0], "P": [2, 2]},
    "bars": {"frame": "A", "crank": "AB", "rod": "BCP", "block": "C"},
    "slides": [{"bar": "frame", "slider": "block", "angle": 0}],
    "drive": "block",
    "point": "P",
}


@pytest.fixture(autouse=True)
def own_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(tmp_path / "answers.db"))


def four_bar() -> tuple[Any, OwnChain]:
    linkage = guide(LENGTHS)
    (a, b), (d, c) = ([pivot[:2] for pivot in dyad] for dyad in linkage.pivots)
    bars = {"frame": ["A", "D"], "crank": ["A", "B"], "coupler": ["B", "C", "P"], "rocker": ["C", "D"]}
    joints = {"A": a, "B": b, "C": c, "D": d, "P": linkage.guided}
    return linkage, OwnChain.of({"joints": joints, "bars": bars, "drive": "crank", "point": "P"})


@pytest.mark.slow
def test_a_four_bar_of_bars_is_measured_as_the_linkage() -> None:
    linkage, chain = four_bar()
    known = [one for one in linkage.measure(stroke=120) if one.given]
    found = chain.measure(stroke=120)
    assert [one.deviation for one in found][: len(known)] == pytest.approx([one.deviation for one in known], rel=1e-5)
    by_crank = known[0].motion(samples=129, driver=1).transmission
    assert found[0].min_transmission == pytest.approx(by_crank.min(), abs=0.05)


def test_a_four_bar_of_bars_moves_as_the_linkage() -> None:
    linkage, chain = four_bar()
    known, found = linkage.motion(samples=37), chain.motion(samples=37)
    moved = np.interp(known.drive - known.drive[0], found.drive, found.angles["coupler"])
    np.testing.assert_allclose(moved, known.coupler, atol=0.5)
    there = chain.circuit.poses(np.radians(known.drive - known.drive[0])[:, None]).joint(4)[:, 0]
    np.testing.assert_allclose(there, known.points["guided"], atol=1e-9)
    np.testing.assert_allclose(found.ratios["rocker"][0], known.ratios["crank 2"][0], rtol=1e-9)
    np.testing.assert_allclose(found.accelerations["P"][0], known.accelerations["guided"][0], rtol=1e-9)


@pytest.mark.slow
def test_the_deviation_is_that_of_the_narrowest_strip() -> None:
    best = mechanism(CHEBYSHEV).measure(stroke=4)[0]
    s = np.linspace(best._window[0], best._window[1], 2001)
    z = best.circuit.pose(s[:, None]).point(np.array([best.guided_point]))[:, 0]
    turned = z * np.exp(-1j * np.radians(best.along))
    assert np.ptp(turned.imag) / 2 == pytest.approx(best.deviation, rel=1e-4)
    assert np.ptp(turned.real) == pytest.approx(4, rel=1e-6)


@pytest.mark.slow
def test_the_longest_stretch_keeps_within_the_deviation() -> None:
    best = mechanism(JANSEN).measure(deviation=0.5)[0]
    assert best.stroke > 20
    assert best.deviation <= 0.5 * (1 + 1e-9)


@pytest.mark.slow
def test_an_exact_mechanism_is_told_as_exact() -> None:
    best = mechanism(PEAUCELLIER).measure(stroke=3)[0]
    assert best.deviation < 1e-13


@pytest.mark.slow
def test_arcs_are_measured_too() -> None:
    found = mechanism(JANSEN).measure(stroke=40, radius=100)
    assert found[0].radius == 100
    assert found[0].deviation < 1
    assert mechanism(JANSEN).measure(stroke=40, arc=True)[0].deviation <= found[0].deviation * (1 + 1e-6)


@pytest.mark.slow
def test_a_stretch_on_the_way_back_is_listed_once() -> None:
    found = mechanism(BICYCLE).measure(stroke=40)
    starts = [complex(*one.start) for one in found]
    assert len({(round(z.real, 3), round(z.imag, 3)) for z in starts}) == len(starts)


@pytest.mark.slow
def test_size_and_transmission_are_those_over_the_stroke() -> None:
    best = mechanism(JANSEN).measure(stroke=30)[0]
    at = best.circuit.poses(np.linspace(best._window[0], best._window[1], 400)[:, None])
    places = np.array([at.joint(j)[:, 0] for j in range(len(best.joints))]).ravel()
    assert best.size == pytest.approx(np.abs(places[:, None] - places).max(), rel=1e-4)
    assert best.min_transmission == pytest.approx(np.degrees(np.arcsin(np.sqrt(at.sines.min()))), abs=0.05)


def test_a_distance_has_its_ratio_to_the_drive() -> None:
    motion = mechanism(BICYCLE).motion(samples=2001, between=[("eye", "mount")])
    apart, ratio = motion.distances["eye-mount"]
    rate = np.gradient(apart, np.unwrap(np.radians(motion.drive)))
    inside = (np.abs(ratio) < 300) & (np.abs(np.gradient(motion.drive)) > 0.02)
    assert inside.sum() > 1000
    assert np.median(np.abs(rate - ratio)[inside]) < 0.05


def test_the_table_has_every_bar_and_joint_with_its_unit() -> None:
    table = mechanism(BICYCLE).motion(samples=3, between=[("eye", "mount")]).to_pandas()
    for heading in ("drive [deg]", "rocker [deg]", "axle x [mm]", "axle vx [mm/rad]", "eye-mount ratio [mm/rad]"):
        assert heading in table
    assert "main x [mm]" not in table  # it stands still
    inches = mechanism(BICYCLE).motion(samples=3).to_pandas(unit="in")
    np.testing.assert_allclose(inches["axle x [in]"] * 25.4, table["axle x [mm]"])


@pytest.mark.slow
def test_a_pushed_mechanism_counts_its_way() -> None:
    bars = {"frame": ["D"], "piston": ["B"], "rod": ["B", "C"], "rocker": ["C", "D", "P"]}
    joints = {"D": [0, 0], "B": [-3, 0.5], "C": [-0.5, 1], "P": [2, 2]}
    slides = [{"bar": "frame", "slider": "piston", "angle": 0}]
    mine = mechanism({"joints": joints, "bars": bars, "slides": slides, "drive": "piston", "point": "P", "unit": "cm"})
    table = mine.motion(samples=9).to_pandas()
    assert {"drive [cm]", "P vx [1]", "P ax [1/cm]", "rocker ratio [1/cm]"} <= {*table}
    assert mine.measure(stroke=0.5, arc=True)[0].deviation < 1e-6  # a rocker leads along a circle


@pytest.mark.slow
def test_a_stretch_keeps_its_code_and_comes_back(tmp_path: Path) -> None:
    found = mechanism(JANSEN).measure(stroke=30)
    (code, *_) = found.remember()
    assert catalogue.recall(code) == found[0]
    found.save(tmp_path / "kept.json")
    assert catalogue.load(tmp_path / "kept.json") == list(found)
    assert found[0].code == code


def test_a_mechanism_keeps_its_code_and_comes_back() -> None:
    from catalogue.guides.codes import remember

    mine = mechanism(BICYCLE)
    (code,) = remember([mine])
    assert catalogue.recall(code) == mine


@pytest.mark.slow
def test_a_record_that_disagrees_with_its_mechanism_is_refused() -> None:
    best = mechanism(JANSEN).measure(stroke=30)[0]
    held = record(replace(best, deviation=0.5 * best.deviation))
    with pytest.raises(InvalidRequest, match="deviation"):
        answer({**held, "code": code_of(text_of(held))})


@pytest.mark.slow
def test_units_are_converted() -> None:
    best = mechanism(BICYCLE).measure(stroke=40)[0]
    assert isinstance(best, ChainStretch)
    inches = best.in_unit("in")
    assert inches.stroke == pytest.approx(best.stroke / 25.4)
    assert inches.size == pytest.approx(best.size / 25.4)
    assert inches.start == pytest.approx([x / 25.4 for x in best.start])
    assert (inches.drive_from, inches.along) == (best.drive_from, best.along)
    again = mechanism(BICYCLE).in_unit("in").measure(stroke=40 / 25.4)[0]
    assert inches.start == pytest.approx(again.start, rel=1e-6)
    assert inches.deviation_again() == pytest.approx(inches.deviation, rel=1e-3)
    assert inches.over_window()["min_transmission"] == pytest.approx(best.min_transmission)


@pytest.mark.slow
def test_the_way_of_a_driving_slider_is_converted_as_a_length() -> None:
    best = mechanism(PUSHED, unit="in").measure(stroke=0.5)[0]
    here, there = best.in_unit("mm"), mechanism(PUSHED, unit="in").in_unit("mm").measure(stroke=12.7)[0]
    assert [here.drive_from, here.drive_to] == pytest.approx([25.4 * best.drive_from, 25.4 * best.drive_to])
    assert [here.drive_from, here.drive_to] == pytest.approx([there.drive_from, there.drive_to], rel=1e-6)


def test_a_bar_named_as_a_column_has_one_of_its_own() -> None:
    names = {"coupler": "transmission", "rocker": "drive"}
    bars = {names.get(bar, bar): joints for bar, joints in four_bar()[1].bars.items()}
    chain = replace(four_bar()[1], bars=bars)
    table, plain = (one.motion(5).to_pandas() for one in (chain, four_bar()[1]))
    assert table["bar transmission [deg]"].tolist() == plain["coupler [deg]"].tolist()
    assert table["bar drive [deg]"].tolist() == plain["rocker [deg]"].tolist()
    for name in ("drive [deg]", "transmission [deg]"):
        assert table[name].tolist() == plain[name].tolist()


@pytest.mark.slow
def test_it_is_drawn(tmp_path: Path) -> None:
    mine = mechanism(JANSEN)
    for one, file in ((mine, "still.svg"), (mine.measure(stroke=30)[0], "stretch.svg")):
        one.plot(tmp_path / file)
        text = (tmp_path / file).read_text()
        for gid in ("path", "crank", "upper", "joint-E", "ground-O", "guided-foot", "name-foot"):
            assert f'id="{gid}"' in text, gid
    assert 'id="start-crank"' in text
    again = (tmp_path / "stretch.svg").read_bytes()
    mine.measure(stroke=30)[0].plot(tmp_path / "stretch.svg")
    assert (tmp_path / "stretch.svg").read_bytes() == again


@pytest.mark.slow
def test_a_stroke_out_of_reach_is_explained() -> None:
    assert (
        "on no circuit does its point run forward over a stroke of 500"
        in mechanism(JANSEN).measure(stroke=500).explain()
    )


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda mine: mine.measure(radius=30, angle=300), "not measured yet on mechanisms of many bars"),
        (lambda mine: mine.measure(), "say over which stroke"),
        (lambda mine: mine.measure(stroke=30, deviation=1), "give the stroke or the deviation alone"),
        (lambda mine: mine.motion(5, between=[("E", "E")]), "the distance of joint 'E' from itself is zero"),
        (lambda mine: mine.motion(3, between=[("X", "B")]), "there is no joint 'X'"),
        (lambda mine: mine.motion(points={"a": (0, 0)}), "name it there"),
        (lambda mine: mine.motion(driver=1), "the drive of a mechanism of many bars"),
        (lambda mine: measure([mine, guide(LENGTHS)], stroke=10), "alone, not together with"),
        (lambda _: guide(JANSEN), "a mechanism of many bars is made by"),
        (lambda _: mechanism(3), "is a mapping, not 3"),  # type: ignore[arg-type]  # a mistake
    ],
)
def test_invalid_questions_are_refused(ask: Callable[[OwnChain], object], message: str) -> None:
    with pytest.raises(InvalidRequest, match=message):
        ask(mechanism(JANSEN))


def test_a_chain_without_a_point_is_refused() -> None:
    with pytest.raises(InvalidLinkage, match="a chain needs 'point'"):
        mechanism({name: value for name, value in JANSEN.items() if name != "point"})
