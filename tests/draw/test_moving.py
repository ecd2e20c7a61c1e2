"""Moving drawings: no link stretches, links meet in every pose, and each pose is one of the linkage."""

from __future__ import annotations

import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue.draw.moving import LAYERS, STYLE, moving_svg
from catalogue.draw.poses import POSE_COUNT, poses
from catalogue.errors import InvalidRequest
from catalogue.guides.placed import PlacedGuide
from catalogue.kinematics.linkage import PR, RP, RR
from tests.curves import nearest
from tests.draw.samples import ARC, DWELL, EVERY, EXACT, MADE, NAMES, OPEN, OWN

SVG = "{http://www.w3.org/2000/svg}"
ALL = [*EVERY, OWN, OPEN, DWELL]
every = pytest.mark.parametrize("made", ALL, ids=[*NAMES, "own", "open", "dwell"])
#: Coordinates have two digits, angles three: by so much a point of a link may be off [px].
ROUNDING = 0.015


def values(group: ET.Element, kind: str) -> Any:
    """Return what a transform of a group runs through: places (m,), complex, or angles (m,) [rad]."""
    found = [e for e in group if e.tag == f"{SVG}animateTransform" and e.attrib["type"] == kind]
    told = found[0].attrib["values"] if found else group.attrib["transform"]
    rows = [[float(x) for x in re.findall(r"-?[\d.]+", part)] for part in told.split(";")]
    return np.array([complex(*row) for row in rows]) if kind == "translate" else np.radians([row[0] for row in rows])


def groups(root: ET.Element, kind: str) -> list[ET.Element]:
    return [e for e in root.iter(f"{SVG}g") if kind in e.attrib.get("class", "").split()]


def pins(element: ET.Element) -> list[complex]:
    found = [e for e in element if e.tag == f"{SVG}circle" and e.attrib["class"] == "pin"]
    return [complex(float(e.attrib["cx"]), float(e.attrib["cy"])) for e in found]


def coupler(root: ET.Element) -> tuple[Any, list[complex], complex]:
    """Return what the coupler does, poses (m, k) of places (k,); its pins and the guided point."""
    (carried,) = groups(root, "coupler")
    (turned,) = [e for e in carried if e.tag == f"{SVG}g"]
    places, angles = values(carried, "translate"), values(turned, "rotate")
    (guided,) = [e for e in turned if e.attrib.get("class") == "point"]
    at = complex(float(guided.attrib["cx"]), float(guided.attrib["cy"]))

    def move(z: complex) -> Any:
        return places + np.exp(1j * angles) * z

    return move, pins(turned), at


def scale_of(made: PlacedGuide, root: ET.Element) -> float:
    """Return the pixels per unit of length, from the path as it is drawn."""
    (path,) = [e for e in root.iter(f"{SVG}path") if e.attrib.get("class") == "path"]
    numbers = np.array(re.findall(r"-?[\d.]+", path.attrib["d"]), float).reshape(-1, 2) @ [1, 1j]
    real = poses(made).path
    return float(np.abs(numbers - numbers[0]).max() / np.abs(real - real[0]).max())


@every
def test_pins_keep_the_lengths_of_the_links_in_every_pose(made: PlacedGuide) -> None:
    root = ET.fromstring(moving_svg(made, width=720))
    scale, z = scale_of(made, root), made.linkage.points[0]
    move, held, _ = coupler(root)
    names = [i for i in (0, 1) if made.linkage.dyads[0][i] != RP]
    places = dict(zip(names, (move(pin) for pin in held), strict=True))
    off = ROUNDING + 2e-4 * 720  # of a length by the scale, which is read from a path of two digits
    cranks = groups(root, "crank")
    assert len(cranks) == (made.linkage.dyads[0] == RR).sum()
    for i, crank in zip([i for i in names if made.linkage.dyads[0][i] == RR], cranks, strict=True):
        pivot, angle = values(crank, "translate")[0], values(crank[0], "rotate")
        spokes = places[i] - pivot
        np.testing.assert_allclose(np.abs(spokes), abs(z[i, 1] - z[i, 0]) * scale, atol=off)
        assert np.ptp(np.abs(spokes)) < 4 * ROUNDING  # by itself it is sharper
        tip = np.exp(1j * angle) * np.abs(spokes).mean()
        assert np.abs(tip - spokes).max() < 4 * ROUNDING  # the crank ends where the coupler's pin is
    if len(places) == 2:
        assert np.ptp(np.abs(places[0] - places[1])) < 1e-9
        np.testing.assert_allclose(np.abs(places[0] - places[1]), abs(z[0, 1] - z[1, 1]) * scale, atol=off)


@every
def test_sliders_keep_their_lines_and_slides_their_points(made: PlacedGuide) -> None:
    root = ET.fromstring(moving_svg(made, width=720))
    kinds, z = made.linkage.dyads[0], made.linkage.points[0]
    move, held, _ = coupler(root)
    names = [i for i in (0, 1) if kinds[i] != RP]
    sliders = groups(root, "slider")
    for i, block in zip([i for i in (0, 1) if kinds[i] == PR], sliders, strict=True):
        at = values(block, "translate")
        assert np.abs(at - move(held[names.index(i)])).max() < 4 * ROUNDING
        assert np.ptp((at * z[i, 0]).real) < 4 * ROUNDING  # y is downwards: the conjugate of the normal
    shown = poses(made)
    for i in shown.rods:
        ends = shown.carried(shown.rods[i])
        away = ((ends - z[i, 0]) * shown.moving[:, i].conj()[:, None]).real
        assert np.abs(away).max() < 1e-9 * np.abs(shown.machine.extent - shown.machine.extent[0]).max()


@pytest.mark.parametrize("made", [MADE["slider-crank"], MADE["elliptic-trammel"]], ids=["slider-crank", "trammel"])
def test_the_line_of_a_slider_is_drawn_along_its_way_and_as_long(made: PlacedGuide) -> None:
    for turn in (0.0, 0.6, 2.0):
        z = np.exp(1j * turn)
        guided = z * complex(*made.guided)
        moved = catalogue.guide(made.linkage.moved(z, 0j), [guided.real, guided.imag])
        root = ET.fromstring(moving_svg(moved, width=720))
        lines = []
        for path in root.iter(f"{SVG}path"):
            if path.attrib.get("class") == "frame":
                lines.append(np.array(re.findall(r"-?[\d.]+", path.attrib["d"]), float).reshape(-1, 2)[-2:] @ [1, 1j])
        for block in groups(root, "slider"):
            at = values(block, "translate")
            way = at[np.abs(at - at[0]).argmax()] - at[0]
            (line,) = [one for one in lines if abs(np.sin(np.angle((one[1] - one[0]) / way))) < 0.01]
            run = ((at - line[0]) / (line[1] - line[0])).real
            assert run.min() > 0
            assert run.max() < 1


@every
def test_poses_are_those_of_the_motion(made: PlacedGuide) -> None:
    """Each pose keeps the constraints of both dyads, from the pivots alone."""
    shown, z = poses(made), made.linkage.points[0]
    size = np.abs(shown.machine.extent - shown.machine.extent[0]).max()
    start = complex(*made.guided)
    for i, kind in enumerate(shown.kinds):
        pin = shown.guided + np.exp(1j * shown.turn) * (z[i, 1] - start)
        if kind == RR:
            off = np.abs(pin - z[i, 0]) - abs(z[i, 1] - z[i, 0])
        elif kind == PR:
            off = ((pin - z[i, 1]) * z[i, 0].conjugate()).real
        else:
            seen = start + np.exp(-1j * shown.turn) * (z[i, 0] - shown.guided)  # the fixed pivot in the coupler
            off = ((seen - z[i, 0]) * z[i, 1].conjugate()).real
        assert np.abs(off).max() < 1e-9 * size
    assert len(shown.guided) >= (POSE_COUNT.turn if shown.closed else POSE_COUNT.stroke)
    assert len(shown.time) == len(shown.guided)
    assert (np.diff(shown.time) > 0).all()
    if shown.closed:
        assert abs(shown.guided[0] - shown.guided[-1]) < 1e-9 * size


@pytest.mark.parametrize("made", EVERY, ids=NAMES)
def test_poses_run_from_the_start_of_the_stroke_to_its_end(made: Any) -> None:
    guided = poses(made).guided
    assert abs(guided[0].real) < 0.01 * made.stroke
    assert abs(guided[-1].real - made.stroke) < 0.01 * made.stroke
    assert (np.abs(np.diff(guided)) < 0.2 * made.stroke).all()  # nothing jumps


@every
def test_velocity_is_along_the_way(made: PlacedGuide) -> None:
    shown = poses(made, 361)
    way, seen = np.gradient(shown.guided), np.isfinite(shown.velocity)
    seen &= np.abs(way) > 1e-3 * np.abs(way).max()
    assert seen.sum() > 200
    assert np.median(np.abs(np.angle(shown.velocity[seen] * way[seen].conj()))) < 0.02


def test_output_dyad_of_a_dwell_keeps_its_lengths_and_stands_still() -> None:
    shown = poses(DWELL, 361)
    assert shown.joint is not None
    start, joint, pivot = (complex(*z) for z in (DWELL.guided, DWELL.joint, DWELL.pivot))
    np.testing.assert_allclose(np.abs(shown.joint - shown.guided), abs(joint - start), rtol=1e-9)
    np.testing.assert_allclose(np.abs(shown.joint - pivot), abs(joint - pivot), rtol=1e-9)
    angle = np.degrees(np.unwrap(np.angle(shown.joint - pivot)))
    assert np.ptp(angle) == pytest.approx(DWELL.swing, rel=1e-3)
    drive = np.degrees(shown.cranks[DWELL.driver - 1])
    drive = drive - drive[0]
    rest = np.abs(angle - angle[0]) <= DWELL.residual
    assert np.ptp(drive) == pytest.approx(360)
    assert rest.sum() / len(rest) * 360 >= DWELL.angle - 2
    root = ET.fromstring(moving_svg(DWELL))
    rocker, rod = groups(root, "output")
    (end,) = pins(rocker[0])
    tip = values(rocker, "translate")[0] + np.exp(1j * values(rocker[0], "rotate")) * end.real
    (turned,) = [e for e in rod if e.tag == f"{SVG}g"]
    (body,) = [e for e in turned if e.tag == f"{SVG}path"]
    length = max(float(x) for x in re.findall(r"[ML](-?[\d.]+) ", body.attrib["d"]))
    back = values(rod, "translate") + np.exp(1j * values(turned, "rotate")) * length
    assert np.abs(tip - back).max() < 4 * ROUNDING  # rocker and rod end in the same joint


@every
def test_a_card_is_small_and_whole(made: PlacedGuide) -> None:
    card = moving_svg(made)
    assert len(card) < 16_000
    assert len(moving_svg(made, style=False)) < 13_000
    root = ET.fromstring(card)
    assert not list(root.iter(f"{SVG}script"))
    assert "http" not in card.replace("http://www.w3.org/2000/svg", "")  # it loads nothing
    assert "nan" not in re.sub(r"<title.*?</title>", "", card)
    durations = {e.attrib["dur"] for e in root.iter() if "dur" in e.attrib}
    assert durations == {"5s"}


@every
def test_names_of_elements_are_the_drawings_own(made: PlacedGuide) -> None:
    one, other = (set(re.findall(r'\bid="([^"]+)"', moving_svg(made, layers=LAYERS))) for _ in range(2))
    assert one
    assert not one & other
    assert moving_svg(made, prefix="a-") == moving_svg(made, prefix="a-")  # the same drawing otherwise


@every
def test_layers_are_there_and_can_be_hidden(made: PlacedGuide) -> None:
    root = ET.fromstring(moving_svg(made, layers=LAYERS, hidden=["pole"]))
    assert {e.attrib["class"].split()[1] for e in groups(root, "layer")} == set(LAYERS)
    assert root.attrib["class"] == "guide-drawing hide-pole"
    for name in LAYERS:
        assert f".guide-drawing.hide-{name} .layer.{name}{{display:none}}" in STYLE


def test_pole_and_inflection_circle_are_those_of_the_theory() -> None:
    """The velocity of a coupler point is normal to its ray from the pole; one on the circle moves without curvature."""
    made = MADE["oldham"]
    root = ET.fromstring(moving_svg(made, layers=["pole", "circle"], still=True))
    (sign,) = groups(groups(root, "pole")[0], "sign")
    pole = values(sign, "translate")[0]
    (circle,) = list(groups(root, "circle")[0])
    centre = complex(float(circle.attrib["cx"]), float(circle.attrib["cy"]))
    radius = float(circle.attrib["r"])
    assert abs(abs(pole - centre) - radius) < 0.03
    shown = poses(made)
    scale = scale_of(made, root)
    start = complex(*made.guided)
    (dot,) = [e for e in root.iter(f"{SVG}circle") if e.attrib.get("class") == "point"]
    here = coupler(root)[0](complex(float(dot.attrib["cx"]), float(dot.attrib["cy"])))[0]

    def place(at: complex) -> complex:  # of paper in the plane, the guided point being known in both
        return complex(shown.guided[shown.middle] + ((at - here) / scale).conjugate())

    # in the position given all coupler points are where they are given
    turn = np.exp(-1j * shown.turn[shown.middle])
    on_circle = start + turn * (place(centre + radius * np.exp(0.4j)) - shown.guided[shown.middle])
    at_pole = start + turn * (place(pole) - shown.guided[shown.middle])
    moved = made.motion(3, points={"c": (on_circle.real, on_circle.imag), "p": (at_pole.real, at_pole.imag)})
    middle = made.motion(2001, points={"c": (on_circle.real, on_circle.imag), "p": (at_pole.real, at_pole.imag)})
    k = int(np.argmin(np.abs(np.radians(middle.coupler) - shown.turn[shown.middle])))
    assert abs(middle.velocities["p"][k]) < 2e-3 * np.abs(middle.velocities["guided"]).max()
    v, a = middle.velocities["c"][k], middle.accelerations["c"][k]
    assert abs((v.conjugate() * a).imag) < 0.02 * abs(v) * abs(a) + 1e-3 * abs(v) ** 2
    assert len(moved) == 3


def test_still_drawing_stands_in_the_position_given() -> None:
    still = moving_svg(ARC, still=True, layers=LAYERS)
    assert "animate" not in still
    root = ET.fromstring(still)
    move, _, guided = coupler(root)
    first = ET.fromstring(moving_svg(ARC))
    everywhere, _, _ = coupler(first)
    assert np.abs(everywhere(guided) - move(guided)[0]).min() < 0.05


def test_a_whole_turn_goes_round_and_comes_back() -> None:
    root = ET.fromstring(moving_svg(OWN, turn=True))
    move, _, guided = coupler(root)
    way = move(guided)
    assert abs(way[0] - way[-1]) < 2 * ROUNDING
    assert len(way) == POSE_COUNT.turn


def test_further_coupler_points_draw_their_paths() -> None:
    root = ET.fromstring(moving_svg(MADE["four-bar"], points={"B": (50.0, 10.0)}))
    (trace,) = [e for e in root.iter(f"{SVG}path") if e.attrib.get("class") == "path second"]
    (dot,) = [e for e in root.iter(f"{SVG}circle") if e.attrib.get("class") == "point second"]
    way = coupler(root)[0](complex(float(dot.attrib["cx"]), float(dot.attrib["cy"])))
    drawn = np.array(re.findall(r"-?[\d.]+", trace.attrib["d"]), float).reshape(-1, 2) @ [1, 1j]
    assert nearest(way, drawn).max() < 2 * ROUNDING  # every pose is on the path


@pytest.mark.slow
def test_size_is_kept() -> None:
    for made in ALL:
        root = ET.fromstring(moving_svg(made, width=300, height=200))
        assert root.attrib["viewBox"] == "0 0 300 200"
        assert float(ET.fromstring(moving_svg(made)).attrib["height"]) <= 360.01


def test_title_says_what_it_is_and_is_escaped() -> None:
    title = ET.fromstring(moving_svg(EXACT)).find(f"{SVG}title")
    assert title is not None
    assert title.text == "guide 1 · general elliptic trammel · a straight line of 100, exact"
    assert "&lt;x&gt;" in moving_svg(EXACT, title="<x>")


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"layers": ["poles"]}, "no layer 'poles'"),
        ({"width": 0}, "must be positive"),
        ({"height": float("nan")}, "must be positive"),
        ({"seconds": -1}, "must be positive"),
        ({"count": 2}, "3 to 361 poses"),
    ],
)
def test_what_cannot_be_drawn_is_refused(wrong: dict[str, Any], said: str) -> None:
    with pytest.raises(InvalidRequest, match=said):
        moving_svg(ARC, **wrong)


@pytest.mark.slow
def test_matplotlib_is_not_needed() -> None:
    code = """
import sys
sys.modules["matplotlib"] = None
import catalogue
g = catalogue.guide({"crank": 1, "rocker": 2.5, "ground": 2.2, "coupler": 2.5, "along": 1, "across": 1})
from catalogue.draw.moving import moving_svg
assert moving_svg(g).startswith("<svg")
"""
    subprocess.run([sys.executable, "-c", code], check=True)
