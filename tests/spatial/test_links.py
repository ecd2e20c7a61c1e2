"""A guide and the chain of links it stands for lead a point alike."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from catalogue.errors import InvalidRequest
from catalogue.spatial import KINDS, PAIRS, Link, Mechanism, OnGuide, Prismatic, Spherical, Travel, links

SHAPES: dict[str, tuple[float, ...]] = {
    "cylinder": (0.8,), "cone": (0.6,), "hyperboloid:sinh": (0.5, 0.9), "torus": (1.0, 0.4), "sphere": (0.9,),
    "plane": (), "circle": (0.7,), "helix": (0.7, -0.2), "line": (),
}  # fmt: skip


class Bowl(type(KINDS["sphere:zpole"])):  # type: ignore[misc]
    """A sphere by a name of its own."""

    name = "bowl"


ORIGIN, QUATERNION = np.array([1.0, 0.3, -0.2]), np.array([2.0, 1, 0.5, -1]) / 2.5


def body(guide: OnGuide | None, replaced: list[Any], conditions: int) -> Mechanism:
    """A body with one freedom: the guide, or its chain, and as many links as are wanted besides."""
    draw = np.random.default_rng(3)
    ends = draw.uniform(-1, 1, (6, 3)), draw.uniform(2, 3, (6, 3))
    rest = [Link("ground", b, "body", a) for a, b in zip(*ends, strict=True)][: 5 - conditions]
    return Mechanism([*([guide] if guide else replaced), *rest])


@pytest.mark.parametrize("name", SHAPES)
def test_links_lead_as_the_guide_does(name: str) -> None:
    kind = KINDS[name]
    u, w = np.array([0.7]), np.array([0.6])
    shape = np.array(SHAPES[name])[:, None]
    local = np.array([float(np.ravel(v)[0]) for v in kind.point(u, w, shape)])
    s, v = QUATERNION[0], QUATERNION[1:]
    v, s = v / np.linalg.norm(QUATERNION), s / np.linalg.norm(QUATERNION)
    x = ORIGIN + local + 2 * s * np.cross(v, local) + 2 * np.cross(v, np.cross(v, local))
    guide = OnGuide("body", x, kind, SHAPES[name], ORIGIN, QUATERNION, name="guide")
    one, other = body(guide, [], kind.conditions), body(None, links(guide), kind.conditions)
    assert one.mobility.freedoms == other.mobility.freedoms == 1
    drive = Travel("body", (0.1, 0.2, 0.3), (0.3, 1, 0.2))
    q = np.linspace(-0.1, 0.1, 9)
    first, second = one.sweep(drive, q), other.sweep(drive, q)
    assert first.success.sum() > 4
    assert (first.success == second.success).all()
    good = first.success
    for k, tolerance in ((0, 1e-12), (1, 1e-10), (2, 1e-8)):
        a, b = (m.point("body", (1, 1, 1), 2)[good][:, k] for m in (first, second))
        assert np.abs(a - b).max() < tolerance * max(1, np.abs(a).max())


def test_the_table_knows_every_kind() -> None:
    assert set(PAIRS) == {name.partition(":")[0] for name in KINDS}


def test_what_stands_for_no_chain_is_refused() -> None:
    with pytest.raises(InvalidRequest, match="a bowl stands for no chain"):
        links(OnGuide("body", (1, 0, 0), Bowl(), (1.0,)))
    with pytest.raises(InvalidRequest, match="on the axis"):
        links(OnGuide("body", (0, 0, 0), "cone", (0.5,)))
    assert [type(x) for x in links(OnGuide("body", (0, 0, 2), "line"))] == [Prismatic, Spherical]
