"""Mechanisms of many bars as files: what an independent reader recovers has the given lengths."""

from __future__ import annotations

import ast
import csv
import io
import json
import math
import re
from itertools import combinations, product
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from catalogue import mechanism
from catalogue.errors import InvalidLinkage, InvalidRequest
from catalogue.export.levels import _Assignment, _is_between
from catalogue.export.links import taken_apart
from catalogue.guides.own_chain import OwnChain
from catalogue.kinematics.splines import cubic
from tests.chains.known import BICYCLE, CHEBYSHEV, JANSEN, PEAUCELLIER
from tests.curves import off_spline
from tests.export.test_table import workbook

#: The lengths of Jansen's leg as they are given, by bar and joints.
GIVEN = {
    "crank O B": 15, "j B C": 50, "upper C D": 41.5, "upper C E": 55.8, "upper D E": 40.1, "k B F": 61.9, "c F D": 39.3,
    "f E G": 39.4, "lower G F": 36.7, "lower G foot": 65.7, "lower F foot": 49,
}  # fmt: skip
#: Gears of Cardan: the point runs along a diameter.
CARDAN = {
    "joints": {"O": [0, 0], "A": [1, 0], "P": [2, 0]},
    "bars": {"frame": "O", "arm": "OA", "planet": "AP"},
    "gears": [{"wheels": ["frame", "planet"], "carrier": "arm", "ratio": 2}],
    "drive": "arm",
    "point": "P",
}
SVG = "{http://www.w3.org/2000/svg}"
EVERY = {"leg": JANSEN, "bike": BICYCLE, "lambda": CHEBYSHEV, "cell": PEAUCELLIER, "gears": CARDAN}


def leg(unit: str | None = None) -> OwnChain:
    return mechanism(JANSEN, unit=unit)


def holes_of_dxf(text: str) -> tuple[Any, dict[str, list[complex]]]:
    """Return the document, and the holes of each block where it stands."""
    ezdxf = pytest.importorskip("ezdxf", reason="comes with the extra `cad`, of which `test` is made")
    document = ezdxf.read(io.StringIO(text))
    found = {}
    for one in document.modelspace().query("INSERT"):
        at, turn = complex(*one.dxf.insert.vec2), np.exp(1j * math.radians(one.dxf.rotation))
        block = document.blocks.get(one.dxf.name)
        found[one.dxf.name] = [at + turn * complex(*c.dxf.center.vec2) for c in block.query("CIRCLE")]
    return document, found


def distances(z: list[complex]) -> list[float]:
    return sorted(abs(a - b) for a, b in combinations(z, 2))


def given_distances(bar: str) -> list[float]:
    return sorted(length for name, length in GIVEN.items() if name.split()[0] == bar)


@pytest.mark.slow
def test_blocks_of_a_dxf_have_the_given_lengths() -> None:
    document, holes = holes_of_dxf(str(leg().export(format="dxf", unit="mm")))
    assert document.header["$INSUNITS"] == 4
    assert not document.audit().errors
    for bar in ("crank", "j", "upper", "k", "c", "f", "lower"):
        assert distances(holes[bar.upper()]) == pytest.approx(given_distances(bar), abs=1e-10)
    told = sorted(dimension.get_measurement() for dimension in document.modelspace().query("DIMENSION"))
    assert told == pytest.approx(sorted([*GIVEN.values(), math.hypot(38, 7.8)]))


@pytest.mark.slow
def test_fourteen_inches_are_355_6_millimetres_in_every_format() -> None:
    size = 14 / 15  # the crank is 15 long
    joints = {name: [size * x for x in at] for name, at in leg().joints.items()}
    inch = mechanism({**leg().given, "joints": joints, "unit": "in"})
    assert inch.lengths["crank O B"] == pytest.approx(14)
    for unit, length, code in (("in", 14, 1), ("mm", 355.6, 4), (None, 14, 1)):
        document, holes = holes_of_dxf(str(inch.export(format="dxf", unit=unit)))
        assert document.header["$INSUNITS"] == code
        assert distances(holes["CRANK"]) == pytest.approx([length])
        record = json.loads(inch.export(format="json", unit=unit))
        assert record["unit"] == unit or unit is None
        assert record["lengths"]["crank O B"] == pytest.approx(length)
        assert f'"bar_crank_O_B" = {length}' in re.sub(r"(\d\.\d{3})\d+", r"\1", str(
            inch.export(format="solidworks", unit=unit)
        )).replace("355.600", "355.6")  # fmt: skip
        row = next(row for row in csv.reader(io.StringIO(str(inch.export(format="fusion", unit=unit))))
                   if row[0] == "bar_crank_O_B")  # fmt: skip
        assert row[1] == unit or unit is None
        assert float(row[3]) == pytest.approx(length)
        table = list(csv.DictReader(io.StringIO(str(inch.export(format="csv", unit=unit)))))
        x, y = (float(table[7][f"B {axis} [{unit or 'in'}]"]) for axis in "xy")
        assert math.hypot(x, y) == pytest.approx(length)
        head, first, *_ = workbook(inch.export(format="xlsx", unit=unit, columns=["drive", "B"]))  # type: ignore[arg-type]
        assert head[1] == f"B x [{unit or 'in'}]"
        assert math.hypot(first[1], first[2]) == pytest.approx(length)


def test_an_svg_is_in_true_size() -> None:
    inch = mechanism(CHEBYSHEV, unit="in")
    root = ElementTree.fromstring(str(inch.export(format="svg")))  # written here
    wide = float(root.attrib["width"].removesuffix("mm"))
    box = [float(x) for x in root.attrib["viewBox"].split()]
    assert wide / box[2] == pytest.approx(25.4)
    assert float(root.attrib["height"].removesuffix("mm")) / box[3] == pytest.approx(25.4)
    cut = {one.attrib["id"]: one for one in root.iter(f"{SVG}g")}
    for bar, length in (("crank", 1), ("rocker", 2.5), ("frame", 2)):
        z = [complex(float(c.attrib["cx"]), float(c.attrib["cy"])) for c in cut[f"cut {bar}"].iter(f"{SVG}circle")]
        assert distances(z) == pytest.approx([length])
    texts = [one.text for one in cut["NAMES"].iter(f"{SVG}text")]
    assert "foot is kept parallel to frame: what keeps it is not drawn" in texts


def test_an_outline_of_an_svg_is_a_bar_with_round_ends() -> None:
    root = ElementTree.fromstring(str(leg().export(format="svg", unit="mm", bar_width=4)))
    (bar,) = (one for one in root.iter(f"{SVG}g") if one.attrib["id"] == "cut crank")
    (path,) = bar.iter(f"{SVG}path")
    arcs = re.findall(r"A([\d.]+) ([\d.]+) 0 0 0 ([-\d.]+) ([-\d.]+)", path.attrib["d"])
    assert [float(radius) for arc in arcs for radius in arc[:2]] == pytest.approx([2] * 4)
    start, *_ = re.findall(r"M([-\d.]+) ([-\d.]+)", path.attrib["d"])
    assert abs(complex(*map(float, start)) - complex(*map(float, arcs[0][2:]))) == pytest.approx(4)


@pytest.mark.parametrize("which", EVERY)
def test_a_record_is_read_again_as_the_same_mechanism(which: str) -> None:
    one = mechanism(EVERY[which])
    again = mechanism(json.loads(one.export(format="json")))
    assert again.given == one.given
    assert again.unit == one.unit


def test_a_record_whose_lengths_were_changed_is_refused() -> None:
    record = json.loads(leg().export(format="json"))
    record["lengths"]["crank O B"] = 16
    with pytest.raises(InvalidLinkage, match="they are 15 apart by `joints`: change these, or leave out `lengths`"):
        mechanism(record)


@pytest.mark.slow
def test_a_stretch_says_what_was_measured_and_draws_its_stroke() -> None:
    best = leg().measure(stroke=30)[0]
    record = json.loads(best.export(format="json"))
    assert record["measured"]["stroke"] == pytest.approx(30)
    assert record["measured"]["deviation"] == best.deviation
    table = list(csv.DictReader(io.StringIO(str(best.export(format="csv")))))
    ends = [complex(float(row["foot x [length]"]), float(row["foot y [length]"])) for row in (table[0], table[-1])]
    assert abs(ends[1] - ends[0]) == pytest.approx(30, abs=2 * best.deviation)
    document, _ = holes_of_dxf(str(best.export(format="dxf", unit="mm")))
    (spline,) = document.modelspace().query("SPLINE")
    points = np.array([complex(*p.vec2) for p in spline.flattening(1e-3)])
    assert abs(points[-1] - points[0]) == pytest.approx(30, abs=2 * best.deviation)
    turn = [
        float(row["drive [deg]"]) for row in csv.DictReader(io.StringIO(str(best.export(format="csv", over="circuit"))))
    ]
    assert turn[-1] - turn[0] == pytest.approx(360)


@pytest.mark.parametrize("which", EVERY)
def test_the_spline_follows_the_path(which: str) -> None:
    one = mechanism(EVERY[which])
    links = taken_apart(one)
    spline = cubic(links.knots, links.path)
    low, _, high = one.drawn
    inner = np.linspace(low + 1e-3, high - 1e-3, 500)
    z = one.circuit.poses(inner[:, None]).joint(one.read.point)[:, 0]
    assert off_spline(3, spline.t, spline.c[:, 0] + 1j * spline.c[:, 1], z) < 1e-6 * links.size


@pytest.mark.slow
def test_a_slider_runs_in_a_slot_of_its_travel() -> None:
    bike = mechanism(BICYCLE)
    best = bike.measure(stroke=40)[0]
    links = {link.name: link for link in taken_apart(best).links}
    assert (links["shaft"].kind, links["shaft"].within) == ("block", "body")
    moved = best.motion(2001, between=[("mount", "eye")])
    apart = moved.distances["mount-eye"][0]
    first, last = links["body"].slots["shaft"]
    mount = links["body"].holes["mount"]
    assert sorted((abs(first - mount), abs(last - mount))) == pytest.approx([apart.min(), apart.max()], rel=1e-6)


def test_parts_of_a_leg_that_meet_lie_in_different_levels() -> None:
    tree = ast.parse(str(leg().export(format="freecad", unit="mm")))
    (rows,) = [
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and node.targets[0].id == "LINKS"
    ]
    level = {row[0]: row[1] for row in rows}
    assert level["frame"] == 0
    for joint in leg().joints:
        for one, other in combinations([bar for bar, joints in leg().bars.items() if joint in joints], 2):
            assert level[one] != level[other]


def test_the_search_for_levels_agrees_with_all_assignments() -> None:
    rng = np.random.default_rng(3)
    for _ in range(60):
        names = [*"abcde"[: rng.integers(2, 6)]]
        pairs = [*combinations(names, 2)]
        conflicts = {pair for pair in pairs if rng.random() < 0.5}
        ends = {f"p{k}": pair for k, pair in enumerate(pairs) if rng.random() < 0.5}
        crossings = {(pin, name) for pin, joined in ends.items() for name in names
                     if name not in joined and rng.random() < 0.5}  # fmt: skip
        ranks = []
        for levels in product(range(len(names)), repeat=len(names) - 1):
            of = dict(zip(names, (0, *levels), strict=True))
            if all(of[a] != of[b] for a, b in conflicts):
                met = sum(_is_between(of, ends[pin], name) for pin, name in crossings)
                ranks.append(((met, max(levels, default=0), sum(levels), *levels), of))
        assert _Assignment(names, conflicts, crossings, ends).best() == min(ranks, key=lambda rank: rank[0])[1]


def test_pitch_circles_are_drawn_and_teeth_are_not() -> None:
    document, _ = holes_of_dxf(str(mechanism(CARDAN, unit="mm").export(format="dxf")))
    circles = document.modelspace().query('CIRCLE[layer=="WHEELS"]')
    assert sorted(circle.dxf.radius for circle in circles) == pytest.approx([1, 2])
    texts = [text.dxf.text for text in document.modelspace().query("TEXT")]
    assert "frame and planet are wheels: pitch circles are drawn, teeth are not" in texts
    assert '"wheel_planet_radius" = 1mm' in str(mechanism(CARDAN, unit="mm").export(format="solidworks"))


def test_names_that_a_program_takes_for_one_are_told_apart() -> None:
    bars = {"frame": ["A", "D"], "Arm.1": ["A", "B"], "arm-1": ["B", "C", "P"], "ARM+1": ["C", "D"]}
    joints = {"A": [0, 0], "D": [2, 0], "B": [0, 1], "C": [2, 2.5], "P": [4, 4]}
    one = mechanism({"joints": joints, "bars": bars, "drive": "Arm.1", "point": "P", "unit": "mm"})
    _, holes = holes_of_dxf(str(one.export(format="dxf")))
    assert {*holes} == {"FRAME", "ARM_1", "ARM_1_2", "ARM_1_3"}


def test_a_format_of_two_dyads_is_refused_with_those_that_there_are() -> None:
    with pytest.raises(
        InvalidRequest, match=r"pylinkage holds linkages of two dyads: export .* as dxf, json, csv, xlsx"
    ):
        leg().export(format="pylinkage")


@pytest.mark.slow
def test_bars_that_coincide_in_a_joint_have_one_hole() -> None:
    joints = {**leg().joints, "toe": leg().joints["foot"]}
    bars = {**leg().bars, "lower": ["G", "F", "foot", "toe"]}
    one = mechanism({**leg().given, "joints": joints, "bars": bars})
    _, holes = holes_of_dxf(str(one.export(format="dxf", unit="mm")))
    assert distances(holes["LOWER"]) == pytest.approx(given_distances("lower"))
