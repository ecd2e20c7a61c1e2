"""What is handed over of a motion lies on the true curve: tables, drawings that stand or move, splines of CAD files."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from functools import cache, lru_cache
from typing import Any

import numpy as np
import pytest

from catalogue.draw import moving_svg
from catalogue.draw.frame import Frame
from catalogue.draw.moving_layers import Layers
from catalogue.draw.poses import POSE_COUNT, poses
from catalogue.draw.svg import Clock
from catalogue.errors import InvalidRequest
from catalogue.export.links import taken_apart
from catalogue.guides.own_guide import OwnGuide
from catalogue.kinematics.circuits import OPEN, circuits
from catalogue.kinematics.linkage import RR
from catalogue.kinematics.splines import cubic
from tests.curves import apart, nearest, off_spline
from tests.true_curves import random_linkages, rockers, true_curve

#: What a drawn path, and a spline, may be off the true curve [width or height of the curve, the larger one].
DRAWN, SPLINE = 1e-4, 2.9e-7
#: Positions of a table, and the part of its whole way that something runs at most from one to the next: 8/(n - 1).
ROWS = 73


@lru_cache(maxsize=1)
def linkages() -> list[OwnGuide]:
    return [*rockers(), *random_linkages(284, 7)]


@cache
def true(k: int) -> Any:
    return true_curve(linkages()[k])


def extent(z: Any) -> float:
    return float(max(np.ptp(z.real), np.ptp(z.imag)))


parts = pytest.mark.parametrize("part", [0, *(pytest.param(part, marks=pytest.mark.slow) for part in range(1, 10))])


@pytest.mark.slow
@parts
def test_a_drawn_path_lies_on_the_true_curve(part: int) -> None:
    for k in range(part, 300, 10):
        guide, curve = linkages()[k], true(k)
        drawn = poses(guide).path
        if circuits(guide.linkage).kind[0] == OPEN:  # of which the part that is near is drawn
            assert nearest(drawn, curve).max() < DRAWN * extent(drawn)
            within = curve[np.abs(curve - complex(*guide.guided)) < 2 * float(guide.linkage.size[0])]
            assert nearest(within, drawn).max() < DRAWN * extent(drawn)
        else:
            assert apart(drawn, curve) < DRAWN * extent(curve), guide.pivots


@pytest.mark.slow
@parts
def test_the_spline_of_a_file_lies_on_the_true_curve(part: int) -> None:
    for k in range(part, 300, 10):
        guide, curve = linkages()[k], true(k)
        try:
            links = taken_apart(guide)
        except InvalidRequest:  # it leads to infinity
            assert circuits(guide.linkage).kind[0] == OPEN
            continue
        spline = cubic(links.knots, links.path)
        control = spline.c[:, 0] + 1j * spline.c[:, 1]
        assert off_spline(3, spline.t, control, curve[:: 1 + len(curve) // 500]) < SPLINE * extent(curve)


@pytest.mark.slow
@parts
def test_no_row_of_a_table_is_farther_from_the_next_than_the_stated_share(part: int) -> None:
    for k in range(part, 300, 10):
        guide = linkages()[k]
        moved, fine = guide.motion(ROWS), guide.motion(5001)
        for name, places in moved.points.items():
            way = np.abs(np.diff(fine.points[name])).sum()
            run = np.searchsorted(fine.phase, moved.phase)
            each = np.append(0, np.cumsum(np.abs(np.diff(fine.points[name]))))[np.minimum(run, 5000)]
            assert np.diff(each).max() <= 1.01 * 8 / (ROWS - 1) * way, (name, guide.pivots)
            assert np.abs(np.diff(places)).max() <= 8 / (ROWS - 1) * way
        for angle in (moved.coupler, *moved.cranks.values()):
            assert np.abs(np.diff(angle)).max() < 360


@pytest.mark.slow
@parts
def test_links_of_a_moving_drawing_meet_between_its_poses_too(part: int) -> None:
    for k in range(part, 300, 10):
        shown = poses(linkages()[k])
        spread = extent(shown.machine.extent)
        for angle in (shown.turn, *shown.cranks.values()):
            assert np.abs(np.diff(angle)).max() < np.radians(25)
        for i, angle in shown.cranks.items():
            pin = shown.moving[:, i] - shown.fixed[i]
            between = np.abs(0.5 * (pin[1:] + pin[:-1]) - np.abs(pin[0]) * np.exp(0.5j * (angle[1:] + angle[:-1])))
            assert between.max() < 2 * POSE_COUNT.error * spread


def test_the_stated_share_is_told_where_rows_are_asked_for() -> None:
    assert "8/(samples - 1)" in str(OwnGuide.motion.__doc__)


@pytest.mark.slow
@pytest.mark.parametrize("k", range(16))
def test_a_nearly_equal_triple_rocker_is_whole_in_every_file(k: int, read_dxf: Any) -> None:
    pytest.importorskip("ezdxf", reason="comes with the extra `cad`, of which `test` is made")
    guide, curve = linkages()[k], true(k)
    (path,) = read_dxf(str(guide.export(format="dxf"))).of("SPLINE", "PATH")
    control = np.array([complex(float(x), float(y)) for x, y in zip(path.all(10), path.all(20), strict=True)])
    knots = np.array([float(t) for t in path.all(40)])
    assert off_spline(3, knots, control, curve[::11]) < SPLINE * extent(curve)


@pytest.mark.parametrize("k", range(4))
def test_a_moving_drawing_passes_poses_when_they_are_passed(k: int) -> None:
    """Where poses are not even in time every part of the drawing says when it passes them."""
    shown = poses(linkages()[k])
    steps = np.diff(shown.time)
    assert steps.max() > 1.5 * steps.min()
    drawn = ET.fromstring(moving_svg(linkages()[k]))
    moves = [part for part in drawn.iter() if "values" in part.attrib]
    assert len(moves) > 3
    for part in moves:
        times = [float(t) for t in part.attrib["keyTimes"].split(";")]
        assert len(times) == len(part.attrib["values"].split(";"))
        np.testing.assert_allclose(times, shown.time, atol=1e-5)
        assert (times[0], times[-1]) == (0, 1)


@pytest.mark.slow
@parts
def test_a_slot_ends_where_the_block_turns(part: int) -> None:
    """No place of a block is beyond the ends of its slot, and both are reached, to a billionth."""
    seen = 0
    for k in range(part, 300, 10):
        guide = linkages()[k]
        if circuits(guide.linkage).kind[0] == OPEN or (guide.linkage.dyads[0] == RR).all():
            continue
        links = taken_apart(guide)
        fine = guide.motion(20001)
        for link in links.links:
            for name, ends in link.slots.items():
                a, b = (link.placed(end) for end in ends)
                i = int(name[-1]) - 1
                if name.startswith("slider"):
                    at = fine.points[f"A{i + 1}*"]
                else:
                    back = np.exp(-1j * np.radians(fine.coupler))
                    pivot = complex(guide.linkage.points[0, i, 0])
                    at = complex(*guide.guided) + back * (pivot - fine.points["guided"])
                along = ((at - a) / (b - a)).real
                assert -1e-9 < along.min() < 1e-6
                assert 1 - 1e-6 < along.max() < 1 + 1e-9
                seen += 1
    assert seen


@pytest.mark.parametrize("k", [0, 1, 3, 7, 11])
def test_a_centrode_lies_where_the_coupler_is_at_rest(k: int) -> None:
    """The pole from the velocities of two points, on paper, against the polyline that is drawn."""
    guide = linkages()[k]
    shown = poses(guide)
    frame = Frame.around(shown.machine, 360.0, None, 1.06)
    drawn = Layers(guide, shown, frame, Clock(5.0, True, 0, True)).drawn("centrodes")
    line = ET.fromstring(drawn).find("path")
    assert line is not None
    pieces = [re.findall(r"-?[\d.]+", piece) for piece in line.attrib["d"].split("M") if piece]
    places = [np.array(piece, float).reshape(-1, 2) @ [1, 1j] for piece in pieces]
    moved = guide.motion(4001)
    (z, v), (w, u) = ((moved.points[name], moved.velocities[name]) for name in ("guided", "A1*"))
    with np.errstate(all="ignore"):
        pole = frame.at(z - v * (w - z) / (u - v))
        seen = np.isfinite(pole) & (np.abs(pole - complex(frame.width, frame.height) / 2) < 0.5 * frame.height)
    least = np.min([nearest(pole[seen], piece) for piece in places if len(piece) > 1], axis=0)
    assert seen.sum() > 50
    assert least.max() < 2e-3 * frame.width
