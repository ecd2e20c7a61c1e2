"""Positions between long steps are those that short steps lead to, and none is taken from another branch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np
import pytest

from catalogue.spatial.continuation.curve import Traces
from catalogue.spatial.guided import compiled

Make = Callable[..., tuple[Any, Any]]


@pytest.fixture(autouse=True, params=["numpy", pytest.param("numba", marks=pytest.mark.slow)])
def by(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """By what motions are computed."""
    way = str(request.param)
    if way == "numpy":
        monkeypatch.setattr(compiled, "fast", lambda _: None)
    elif compiled.kernel() is None:
        pytest.skip("numba, of the extra `fast`, is not installed")
    else:
        monkeypatch.setattr(compiled, "MIN_POSITIONS", 0)
    return way


def four_bar(spatial: SimpleNamespace, crank: float, coupler: float, rocker: float, ground: float) -> Any:
    """Return a planar four-bar as a mechanism of class III, and a start with its rocker above."""
    guides = [spatial.Guides("circle", (crank,)), spatial.Guides("circle", (rocker,), (ground, 0, 0))]
    body = [(0, 0, 0), (coupler, 0, 0), (0.5 * coupler, 0.7, 0)]
    m = spatial.Mechanisms(body, [*guides, spatial.Guides("plane")], [(0, "u")])

    def start(u: float) -> Any:
        a = crank * np.array([np.cos(u), np.sin(u)])
        to = np.array([ground, 0]) - a
        far = np.hypot(*to)
        along = (far**2 + coupler**2 - rocker**2) / (2 * far)
        across = np.sqrt(coupler**2 - along**2)
        b = a + (along * to + across * np.array([-to[1], to[0]])) / far
        x = (b - a) / coupler
        c = a + 0.5 * coupler * x + 0.7 * np.array([-x[1], x[0]])
        return [(u, np.nan), (np.arctan2(b[1], b[0] - ground), np.nan), (np.arctan2(c[1], c[0]), np.hypot(*c))]

    return m, start


def marched(spatial: SimpleNamespace, m: Any, path: Any, start: Any) -> Any:
    """Return the motion by steps from node to node."""
    with mock.patch.object(spatial.follow_, "corners", lambda nodes: np.ones(nodes.shape[:2], bool)):
        return spatial.follow(m, path, start)


@pytest.mark.slow
@pytest.mark.parametrize("formulation", ["pose", "euler-angles", "distances"])
@pytest.mark.parametrize("name", ["I", "II", "III", "IV", "V", "VI"])
def test_long_steps_lead_where_short_ones_do(
    spatial: SimpleNamespace, make: Make, tools: SimpleNamespace, name: str, formulation: str
) -> None:
    m, start = make(name, 24)
    m = replace(m, formulation=formulation)
    path = tools.driven(m, start)[:, None] + np.linspace(0, 0.7, 90)[:, None]
    one, other = spatial.follow(m, path, start), marched(spatial, m, path, start)
    assert one.reached.tolist() == other.reached.tolist()
    assert one.reason.tolist() == other.reason.tolist()
    assert one.steps.sum() < 0.7 * other.steps.sum()
    turned = one.reason == "turning point"
    np.testing.assert_allclose(one.end[turned], other.end[turned], atol=1e-9)
    for key, off in (("points", 1e-12), ("coordinates", 1e-10), ("quaternion", 1e-12)):
        np.testing.assert_allclose(getattr(one.positions, key), getattr(other.positions, key), atol=off)


@pytest.mark.slow
def test_one_mechanism_moves_as_in_a_batch(spatial: SimpleNamespace, make: Make, tools: SimpleNamespace) -> None:
    m, start = make("II", 40)
    path = tools.driven(m, start)[:, None] + np.linspace(0, 0.5, 50)[:, None]
    batch = spatial.follow(m, path, start)
    points = batch.positions.points.reshape(40, 50, -1, 3)
    for i in range(0, 40, 5):
        one = spatial.follow(m[[i]], path[i], start[i])
        assert (one.reached[0], one.reason[0]) == (batch.reached[i], batch.reason[i])
        np.testing.assert_allclose(one.positions.points, points[i], atol=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize("gap", [1e-1, 1e-3, 1e-5, 1e-7])
@pytest.mark.parametrize("nodes", [13, 200])
def test_a_branch_that_nearly_meets_another_is_kept(spatial: SimpleNamespace, gap: float, nodes: int) -> None:
    """A parallelogram but for its rocker: coupler and rocker nearly come in line, and never do."""
    m, start = four_bar(spatial, 1.0, 2.0, 1.0 + gap, 2.0)
    moved = spatial.follow(m, np.linspace(0.9, 0.9 + 2 * np.pi, nodes)[:, None], start(0.9))
    assert moved.reason[0] == ""
    a, b = moved.positions.points[:, 0], moved.positions.points[:, 1]
    side = np.cross(b - a, b - [2.0, 0, 0])[:, 2]
    assert (np.sign(side) == np.sign(side[0])).all()
    assert np.abs(b[-1] - b[0]).max() < 1e-9
    assert np.abs(np.linalg.norm(b - a, axis=1) - 2).max() < 1e-13


@pytest.mark.parametrize("nodes", [2, 9, 300])
def test_a_fold_ends_the_motion_however_dense_the_nodes(spatial: SimpleNamespace, nodes: int) -> None:
    """Rocker and coupler in line at  (b + c)^2 = a^2 + d^2 - 2 a d cos u; nodes crowd before it and beyond."""
    m, start = four_bar(spatial, 1.5, 1.1, 1.2, 2.0)
    end = np.arccos((1.5**2 + 2.0**2 - 2.3**2) / (2 * 1.5 * 2.0))
    near = end + np.array([-1e-2, -1e-4, -1e-6, -1e-8, 1e-8, 1e-4])
    path = np.concatenate([np.linspace(0.6, end - 0.1, nodes), near, np.linspace(end + 0.1, 2.5, nodes)])
    moved = spatial.follow(m, path[:, None], start(0.6))
    assert moved.reason[0] == "turning point"
    assert moved.reached[0] == nodes + 4
    assert abs(moved.end_drivers[0, 0] - end) < 1e-13
    assert moved.positions.success.sum() == nodes + 4


def test_corners_are_where_a_path_does_not_go_straight_on(spatial: SimpleNamespace) -> None:
    one = np.array([0, 0.1, 0.3, 0.7, 0.6, 0.5, 0.5, 0.4, 0.4 + 1e-9])
    assert np.flatnonzero(spatial.corners(one[None, :, None])[0]).tolist() == [0, 3, 5, 6, 7, 8]
    two = np.array([[0, 0], [1, 2], [2, 4], [3, 6], [3, 7], [3, 8], [3, 8.5]]) / 3
    assert np.flatnonzero(spatial.corners(two[None])[0]).tolist() == [0, 3, 6]
    bent = np.stack([np.cos(np.linspace(0, 1, 200)), np.sin(np.linspace(0, 1, 200))], axis=1)
    assert spatial.corners(bent[None]).all()
    assert spatial.corners(np.zeros((2, 1, 3))).all()


@pytest.mark.slow
def test_paths_with_corners_are_filled_between_them(
    spatial: SimpleNamespace, make: Make, tools: SimpleNamespace
) -> None:
    """Around a square and home, with ten nodes on each of its sides, and one where nothing moves."""
    m, start = make("V", 30)
    side = np.linspace(0, 0.02, 11)[:-1]
    zero = np.zeros_like(side)
    square = np.concatenate([np.stack(v, 1) for v in ((side, zero), (zero + 0.02, side), (0.02 - side, zero + 0.02),
                                                      (zero, 0.02 - side), ([0, 0], [0, 0]))])  # fmt: skip
    path = tools.driven(m, start)[:, None] + square
    one, other = spatial.follow(m, path, start), marched(spatial, m, path, start)
    assert one.reached.tolist() == other.reached.tolist()
    assert (one.reached == len(square)).sum() > 20
    np.testing.assert_allclose(one.positions.points, other.positions.points, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("off", [1e-6, 1e-2, 0.3, np.nan])
def test_wrong_interpolation_gives_no_wrong_position(
    spatial: SimpleNamespace, make: Make, tools: SimpleNamespace, off: float, by: str
) -> None:
    """Steps lead to what is in doubt; what is still in doubt there ends the motion."""
    if by == "numba":
        pytest.skip("it interpolates by itself")
    m, start = make("I", 12)
    path = tools.driven(m, start)[:, None] + np.linspace(0, 0.4, 41)[:, None]
    plain, call = spatial.follow(m, path, start), Traces.between

    def wrong(self: Any, who: Any, value: Any) -> Any:
        states, *others = call(self, who, value)
        return states + off * np.sin(50 * value)[:, None], *others

    with mock.patch.object(Traces, "between", wrong):
        found = spatial.follow(m, path, start)
    good = found.positions.success
    np.testing.assert_allclose(found.positions.points[good], plain.positions.points[good], atol=1e-12)
    assert (good == plain.positions.success).all() == (off < 1e-3)
    if off < 1e-3:
        assert found.reason.tolist() == plain.reason.tolist()
    else:
        assert "step too small" in found.reason


def test_a_node_where_the_determinant_has_another_sign_is_refused(
    spatial: SimpleNamespace, make: Make, tools: SimpleNamespace
) -> None:
    m, start = make("III", 8)
    path = tools.driven(m, start)[:, None] + np.linspace(0, 0.1, 21)[:, None]
    first = spatial.solve_positions(m, path[:, 0], start)
    asked: list[Any] = []

    def kept(*given: Any) -> Any:
        asked.append(given)
        return fill(*given)

    fill, walk = spatial.fill, spatial.Walk(m, path, first.state, spatial.corners(path))
    with mock.patch.object(spatial.walk_, "fill", kept):
        walk.run()
    curve, traces, sign, *others = asked[0]
    assert fill(curve, traces, sign, *others)[1].all()
    assert not fill(curve, traces, -sign, *others)[1].any()
