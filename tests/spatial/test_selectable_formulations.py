"""The three formulations as a user selects them: the same results, and a reason where one of them is singular."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue.errors import InvalidRequest

Make = Callable[..., tuple[Any, Any]]
Cases = list[SimpleNamespace]
OTHERS = ("euler-angles", "distances")
#: Cases in which the line A1A2 is along z, and those whose body is flat.
ALONG_Z, FLAT = {"III-trammel"}, {"II-coplanar-body"}


def off(found: Any, expected: Any) -> float:
    return float(np.abs(found - expected).max() / max(np.abs(expected).max(), 1e-300))


@pytest.mark.slow
@pytest.mark.parametrize("formulation", OTHERS)
def test_golden_positions_and_reduced_derivatives(
    golden_cases: Cases, spatial: SimpleNamespace, tools: SimpleNamespace, formulation: str
) -> None:
    """Twenty cases of 50 digits, from the rough starts, up to the fourth derivative, spins up to the third."""
    refused = FLAT if formulation == "distances" else set()
    met = 0
    for c in golden_cases:
        m = replace(c.mechanism, formulation=formulation)
        at = spatial.solve_positions(m, c.q[:, 0], tools.start(c.case))
        if c.id in refused:
            assert "flat body" in str(at.reason[0])
            continue
        met += 1
        assert at.success[0], (c.id, at.reason)
        jets = spatial.jets(m, at, c.q[:, 1:])
        expected = tools.numbers(c.case["solution"]["points"])
        digits = 3e-15 * jets.condition[0] + 1e-13
        assert np.abs(at.points[0] - expected[:, 0]).max() < 10 * digits * m.diameter[0], c.id
        for k in range(1, 5):
            assert off(jets.points[0, :, k], expected[:, k]) < 100 * digits, (c.id, k)
        for k, name in enumerate(("omega", "alpha", "alpha_dot")):
            assert off(jets.spin[0, k], tools.numbers(c.case["solution"][name])) < 100 * digits, (c.id, name)
    assert met == 20 - len(refused)


@pytest.mark.slow
@pytest.mark.parametrize("formulation", OTHERS)
def test_motions_and_their_ends_are_the_same(
    spatial: SimpleNamespace, make: Make, tools: SimpleNamespace, formulation: str
) -> None:
    for name in ("I", "II", "III", "IV", "V", "VI"):
        m, start = make(name, 12, 4, kinds=("cylinder", "cone", "hyperboloid:sinh", "torus", "sphere:zpole"))
        path = tools.driven(m, start)[:, None] + np.linspace(0, 0.3, 6)[:, None]
        one, other = (spatial.follow(x, path, start) for x in (m, replace(m, formulation=formulation)))
        assert other.reason.tolist() == one.reason.tolist(), name
        assert np.abs(other.end - one.end).max() < 1e-6
        good = one.positions.success
        assert other.positions.success.tolist() == good.tolist()
        error = np.abs(other.positions.points - one.positions.points)[good].max((1, 2))
        assert (error < 1e-14 * one.positions.condition[good] + 1e-12).all(), name
        rates = np.eye(m.freedom, 3)
        rates[:, 1:] = 0
        a, b = (spatial.jets(x, one.node(0), rates) for x in (m, replace(m, formulation=formulation)))
        apart = np.abs(a.points - b.points).max((1, 3)) / np.abs(a.points).max((1, 3))
        assert (apart < 1e-13 * b.condition[:, None]).all(), name


@pytest.mark.parametrize("formulation", OTHERS)
@pytest.mark.parametrize("name", ["II", "V"])
def test_short_motions_of_a_batch_pass_the_same_points(
    spatial: SimpleNamespace, make: Make, tools: SimpleNamespace, formulation: str, name: str
) -> None:
    """Each mechanism on a path of its own."""
    m, start = make(name, 5)
    q = tools.driven(m, start)
    path = q[:, None] + 0.02 * np.arange(4)[:, None] * np.linspace(-1, 1, 5)[:, None, None]
    one, other = (spatial.follow(which, path, start) for which in (m, replace(m, formulation=formulation)))
    assert one.positions.success.all()
    assert other.positions.success.all()
    np.testing.assert_allclose(other.positions.points, one.positions.points, atol=1e-9 * m.diameter.max())


def test_euler_angles_say_where_they_are_singular(spatial: SimpleNamespace, golden_cases: Cases) -> None:
    """A body whose A1A2 stands along z; and one that comes to stand so on its way, where the pose goes on."""
    (c,) = [c for c in golden_cases if c.id == "III-trammel"]
    body = [(0, 0, 0), (0, 0, 2), (1, 0, 0.5)]
    guides = [
        spatial.Guides("line"),
        spatial.Guides("line"),
        spatial.Guides("sphere", [1.0], (1.0, 1.0, 0.5)),
    ]
    m = spatial.Mechanisms(body, guides, [(0, "u")])
    start = [(0.0, np.nan), (2.0, np.nan), (1.5, 0.0)]
    assert spatial.solve_positions(m, [0.0], start).success[0]
    at = spatial.solve_positions(replace(m, formulation="euler-angles"), [0.0], start)
    assert not at.success[0]
    assert "along z" in str(at.reason[0])
    assert spatial.solve_positions(replace(m, formulation="distances"), [0.0], start).success[0]
    # the trammel in the plane of x and z: its bar comes to stand along z where the first slider is in the middle
    turn = np.array([np.sqrt(0.5), np.sqrt(0.5), 0, 0])
    upright = [spatial.Guides(g.kinds[0], g.parameters, _turned(spatial, turn, g.origin), _times(turn, g.quaternion))
               for g in c.mechanism.guides]  # fmt: skip
    trammel = spatial.Mechanisms(c.mechanism.body, upright, c.mechanism.drivers)
    path = np.linspace(c.q[0, 0], -0.5, 12)[:, None]
    whole = spatial.follow(trammel, path, c.at.coordinates)
    other = spatial.follow(replace(trammel, formulation="euler-angles"), path, c.at.coordinates)
    assert whole.reason[0] == ""
    assert "along z" in str(other.reason[0])
    assert abs(other.end_drivers[0, 0]) < 1e-3
    assert 0 < other.reached[0] < whole.reached[0]


def _turned(spatial: SimpleNamespace, turn: Any, origin: Any) -> Any:
    return origin @ spatial.matrix(turn[:, None])[..., 0].T


def _times(a: Any, b: Any) -> Any:
    s, v, t, w = a[0], a[1:], b[..., :1], b[..., 1:]
    return np.concatenate([s * t - (v * w).sum(-1, keepdims=True), s * w + t * v + np.cross(v, w)], axis=-1)


def test_distances_say_what_they_do_not_determine(spatial: SimpleNamespace, golden_cases: Cases) -> None:
    (c,) = [c for c in golden_cases if c.id == "I-five-spheres"]
    body = c.mechanism.body[0].copy()
    body[4] = body[0]
    m = spatial.Mechanisms(body, c.mechanism.guides, c.mechanism.drivers, formulation="distances")
    assert "coincide" in str(spatial.solve_positions(m, c.q[:, 0], c.at).reason[0])
    whole = replace(c.mechanism, formulation="distances")
    draw = np.random.default_rng(3)
    starts = draw.uniform(-np.pi, np.pi, (60, 5, 2))
    found = spatial.solve_positions(whole[np.zeros(60, int)], c.q[:, 0], starts)
    expected = np.array([[[float(v) for v in p] for p in mode] for mode in c.case["modes"]["points"]])
    assert found.success.any()
    apart = np.abs(found.points[found.success][:, None] - expected).max((2, 3)).min(1)
    assert apart.max() < 1e-9  # neither mirror images nor bodies that break the tenth distance


def test_a_formulation_that_is_not_there_is_refused(golden_cases: Cases) -> None:
    with pytest.raises(InvalidRequest, match="one of 'pose', 'euler-angles', 'distances', not 'quaternions'"):
        replace(golden_cases[0].mechanism, formulation="quaternions")
