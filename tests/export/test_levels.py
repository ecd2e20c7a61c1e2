"""Levels of the parts: no two that meet in motion share one, checked on the outlines that the macro holds."""

from __future__ import annotations

import ast
import cmath
import math
from itertools import combinations
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue import Catalogue, StandStill
from catalogue.guides.dwell import DwellCandidate
from catalogue.guides.placed import PlacedGuide

pytestmark = pytest.mark.slow

#: Positions of the crank over its turn.
TURN = 72


def links_of(guide: PlacedGuide) -> dict[str, Any]:
    """Return level, origin, angle, outline and holes of each link, as the macro says them."""
    tree = ast.parse(str(guide.export(format="freecad", unit="mm")))
    (rows,) = [
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and node.targets[0].id == "LINKS"
    ]
    return {row[0]: row[1:] for row in rows}


def border(corners: list[tuple[float, float, float]]) -> Any:
    """Return points along an outline whose sides are lines and arcs."""
    found: list[complex] = []
    for (x0, y0, bulge), (x1, y1, _) in zip(corners, corners[1:] + corners[:1], strict=True):
        a, b = complex(x0, y0), complex(x1, y1)
        if bulge:
            sweep = 4 * math.atan(bulge)
            centre = a + (b - a) * (0.5 + 0.5j / math.tan(0.5 * sweep))
            found += [centre + (a - centre) * cmath.exp(1j * sweep * k / 12) for k in range(12)]
        else:
            found += [a + (b - a) * k / 12 for k in range(12)]
    return np.array(found)


def positions(guide: PlacedGuide) -> list[dict[str, complex]]:
    """Return where the pivots of a four-bar, and the joint of a dwell, are over the turn of its driving crank."""
    pairs = [[complex(*pivot[:2]) for pivot in pair] for pair in guide.pivots]
    lead = getattr(guide, "driver", 1)
    (a, p), (b, q) = pairs[lead - 1], pairs[2 - lead]
    guided, found = complex(*guide.guided), []
    side = 1 if ((b - p).conjugate() * (q - p)).imag > 0 else -1

    def meet(c: complex, r: float, d: complex, s: float, way: int) -> complex:
        along = (r * r - s * s + abs(d - c) ** 2) / (2 * abs(d - c))
        off = math.sqrt(max(r * r - along * along, 0.0))
        return c + (d - c) / abs(d - c) * complex(along, way * off)

    for angle in 2 * np.pi * np.arange(TURN) / TURN:
        first = a + (p - a) * cmath.exp(1j * angle)
        second = meet(first, abs(q - p), b, abs(q - b), side)
        point = first + (guided - p) * (second - first) / (q - p)
        at = {f"A{lead}": a, f"A{lead}*": first, f"A{3 - lead}": b, f"A{3 - lead}*": second, "guided": point}
        if isinstance(guide, DwellCandidate):
            joint, pivot = complex(*guide.joint), complex(*guide.pivot)
            way = 1 if ((pivot - guided).conjugate() * (joint - guided)).imag > 0 else -1
            at |= {"B": pivot, "J": meet(point, abs(joint - guided), pivot, abs(joint - pivot), way)}
        found.append(at)
    return found


#: The two pivots by which each link is carried.
CARRIED = {"frame": ("A1", "A2"), "crank 1": ("A1", "A1*"), "crank 2": ("A2", "A2*"), "coupler": ("A1*", "A2*"),
           "rod": ("guided", "J"), "rocker": ("B", "J")}  # fmt: skip


def meetings(naive: SimpleNamespace, guide: PlacedGuide) -> list[tuple[str, str]]:
    """Return the pairs of links of one level that overlap in some position of the turn."""
    told, over = links_of(guide), positions(guide)
    start = over[0]
    outlines = {}
    for name, (_, (x, y), angle, corners, _, _) in told.items():
        outlines[name] = complex(x, y) + cmath.exp(1j * math.radians(angle)) * border(corners)
    found = []
    for one, other in combinations(told, 2):
        if told[one][0] != told[other][0]:
            continue
        for at in over:
            carried = []
            for name in (one, other):
                a, b = CARRIED[name]
                turn = (at[b] - at[a]) / (start[b] - start[a])
                carried.append(at[a] + turn * (outlines[name] - start[a]))
            for ring, points in (carried, carried[::-1]):
                polygon = [(z.real, z.imag) for z in ring]
                if any(naive.inside(polygon, z.real, z.imag) for z in points[::3]):
                    found.append((one, other))
                    break
            if found and found[-1] == (one, other):
                break
    return found


CRANK_ROCKERS = {
    "open": {"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80},
    "crossed": {"ground": 100, "crank": 60, "coupler": 110, "rocker": 100, "along": 55, "across": 10, "branch": -1},
    "hoeken": {"ground": 200, "crank": 100, "coupler": 250, "rocker": 250, "along": 500, "across": 0},
}


@pytest.mark.parametrize("name", CRANK_ROCKERS)
def test_no_two_links_of_a_level_meet_over_the_turn(naive: SimpleNamespace, name: str) -> None:
    guide = catalogue.guide(CRANK_ROCKERS[name])
    assert meetings(naive, guide) == []


def test_no_two_links_of_a_dwell_meet_on_a_level(small: Catalogue, naive: SimpleNamespace) -> None:
    found = small.find_dwells(StandStill(60, 1.0, 20), families=["four-bar"], limit=4)
    assert found
    for one in found:
        assert {"rod", "rocker"} < {*links_of(one)}
        assert meetings(naive, one) == []


def test_the_files_tell_the_levels(six: dict[str, catalogue.Stretch]) -> None:
    for family, guide in six.items():
        told = links_of(guide)
        macro = str(guide.export(format="freecad", unit="mm"))
        drawing = str(guide.export(format="dxf", unit="mm"))
        for name, row in told.items():
            level = row[0]
            assert f"{name}, level {level}\n" in drawing, family
            (line,) = [text for text in macro.splitlines() if text.startswith(f"# level {level}: ")]
            assert name in line.partition(": ")[2].split(", ")
        top = max(row[0] for row in told.values()) + 1
        assert f"vector(x, y, {top} * THICKNESS)" in macro


@pytest.mark.parametrize("name", CRANK_ROCKERS)
@pytest.mark.parametrize("size", [1e-153, 1e-100, 1e100, 1e149])
def test_levels_are_those_of_the_shape_at_any_size(name: str, size: float) -> None:
    """The product of two areas overflows above 1e77, and vanishes below 1e-81."""
    links = CRANK_ROCKERS[name]
    lengths = {key: value if key == "branch" else size * value for key, value in links.items()}
    told, large = links_of(catalogue.guide(links)), links_of(catalogue.guide(lengths))
    assert {key: row[0] for key, row in large.items()} == {key: row[0] for key, row in told.items()}
