"""Motions of guided bodies by numba and by numpy are the same, to rounding, on the same branches."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue.spatial.continuation.curve import rises
from catalogue.spatial.geometry.guides import KINDS
from catalogue.spatial.geometry.surfaces import Plane
from catalogue.spatial.guided import compiled
from catalogue.spatial.guided.walk import LIMITS
from tests.benchmarks.spatial_work_precision import Single, refined
from tests.spatial import test_follow
from tests.spatial.test_follow import path_of

Make = Callable[..., tuple[Any, Any]]
MEASURED = ("quaternion", "translation", "points", "coordinates", "residual", "condition", "success")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("numba") is None, reason="numba, of the extra `fast`, is not installed"),
]


def both(monkeypatch: pytest.MonkeyPatch, run: Callable[[], Any]) -> tuple[Any, Any]:
    """Return what a call gives compiled, and by numpy."""
    with monkeypatch.context() as patch:
        patch.setattr(compiled, "MIN_POSITIONS", np.inf)
        plain = run()
    with monkeypatch.context() as patch:
        patch.setattr(compiled, "MIN_POSITIONS", 0)
        return run(), plain


def same(one: Any, other: Any, size: float = 1.0) -> None:
    """Two motions of bodies of a size are the same."""
    assert one.reached.tolist() == other.reached.tolist()
    assert one.reason.tolist() == other.reason.tolist()
    np.testing.assert_allclose(one.end, other.end, atol=1e-10)
    a, b = one.positions, other.positions
    assert a.success.tolist() == b.success.tolist()
    assert a.reason.tolist() == b.reason.tolist()
    assert a.evaluations.tolist() == b.evaluations.tolist()
    for name in ("drivers", "quaternion", "translation", "points", "coordinates"):
        mine, theirs = getattr(a, name), getattr(b, name)
        np.testing.assert_array_equal(np.isnan(mine), np.isnan(theirs), err_msg=name)
        np.testing.assert_allclose(mine, theirs, rtol=1e-10, atol=1e-11 * size, err_msg=name)
    np.testing.assert_allclose(a.condition, b.condition, rtol=1e-6)
    np.testing.assert_allclose(a.residual, b.residual, atol=1e-14)
    np.testing.assert_allclose(a.state, b.state, rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize("kind", KINDS)
def test_guides_are_the_same(kind: str) -> None:
    """Points, tangents and coordinates, on both nappes and halves; functions and gradients beside the guide."""
    from catalogue.spatial.guided.kernel import guides

    one, number = KINDS[kind], list(KINDS).index(kind)
    draw = np.random.default_rng(3)
    p = np.array([[0.7, 0.4], [0.3, 0.5]])[:, draw.integers(0, 2, 40)]
    u, w = draw.uniform(-3, 3, 40), draw.uniform(0.8, 2, 40) * (1 if one.bounded else draw.choice([-1, 1], 40))
    x, t = one.tangents(u, w, p)
    beside = x + draw.uniform(-0.1, 0.1, x.shape)
    found = np.stack(one.locate(beside, p))
    apex = one.apex(beside, p)
    for j in range(40):
        shape = p[0, j], p[1, j]
        point, *along = guides.chart(number, u[j], w[j], *shape)
        np.testing.assert_allclose(point, x[:, j], atol=1e-14)
        size = 1 if one.conditions == 2 else 2
        np.testing.assert_allclose(along[:size], t[:size, :, j], atol=1e-13)
        np.testing.assert_allclose(guides.locate(number, *beside[:, j], *shape), found[:, j], atol=1e-14)
        np.testing.assert_allclose(guides.apex(number, *beside[:, j], *shape), apex[j], atol=1e-14)
        if kind in ("torus", "helix"):
            value, slope = one.gradients(beside[:, j : j + 1], p[:, j : j + 1])
            for row in range(one.conditions):
                mine = guides.function(number, row == 1, *beside[:, j], *shape)
                np.testing.assert_allclose(mine, [value[row, 0], *slope[row, :, 0]], atol=1e-13)


@pytest.mark.parametrize("name", ["I", "II", "III", "IV", "V", "VI"])
def test_positions_are_measured_the_same(
    spatial: SimpleNamespace, make: Make, tools: SimpleNamespace, name: str
) -> None:
    """What they are conditioned like, which the whole Jacobian tells, where nothing has moved yet."""
    m, start = make(name, 40, kinds=tuple(k for k in KINDS if k not in ("hyperboloid", "circle", "helix", "line")))
    q = tools.driven(m, start)
    at, fast = spatial.solve_positions(m, q, start), compiled.fast(m)
    assert fast
    found = [np.zeros_like(getattr(at, name), order="C") for name in MEASURED]
    compiled.measured(fast, q[:, None], at.state.T[:, None].copy(), at.success.astype(int), found)
    by_name = dict(zip(MEASURED, found, strict=True))
    assert at.success.sum() > 30
    np.testing.assert_allclose(by_name["condition"][at.success], at.condition[at.success], rtol=1e-6)
    np.testing.assert_allclose(by_name["points"][at.success], at.points[at.success], atol=1e-12)


@pytest.mark.parametrize("name", ["I", "II", "III", "IV", "V", "VI"])
def test_a_batch_moves_the_same(
    spatial: SimpleNamespace, make: Make, tools: SimpleNamespace, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Coarse nodes, most of them beyond the end of the motion; some mechanisms cannot even begin."""
    m, start = make(
        name, 150, seed=7, kinds=tuple(k for k in KINDS if k not in ("hyperboloid", "circle", "helix", "line"))
    )
    path = path_of(tools.driven(m, start), 20)
    path[::10] += 20
    one, other = both(monkeypatch, lambda: spatial.follow(m, path, start))
    assert len(set(one.reason)) > 1
    assert (one.reached == 0).any()
    assert (one.reached == 20).any()
    same(one, other)


def test_other_drivers_and_scales_move_the_same(
    spatial: SimpleNamespace, make: Make, tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both coordinates of one point, or one of each of two; lengths in millimetres."""
    for drivers in ([(0, "w"), (2, "u")], [(1, "u"), (1, "w")]):
        m, start = make("IV", 40, scale=1e3)
        m = replace(m, drivers=drivers)
        path = tools.driven(m, start)[:, None] * (1 + np.linspace(0, 0.05, 9)[:, None])
        one, other = both(monkeypatch, partial(spatial.follow, m, path, start))
        assert (one.reached == 9).any()
        same(one, other, 1e3)


def test_a_motion_goes_on_where_there_is_no_room_for_more_nodes(
    spatial: SimpleNamespace, make: Make, tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    m, start = make("II", 40)
    path = tools.driven(m, start)[:, None] + np.linspace(0, 0.7, 60)[:, None]
    monkeypatch.setattr(compiled, "MAX_NODES", 12)
    one, other = both(monkeypatch, lambda: spatial.follow(m, path, start))
    assert one.steps.max() > 10
    same(one, other)


def test_the_edge_of_a_half_ends_the_motion(
    spatial: SimpleNamespace, golden_cases: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiled, "MIN_POSITIONS", 0)
    test_follow.test_the_half_of_a_hyperboloid_ends_at_its_waist(spatial, golden_cases)
    test_follow.test_a_driven_surface_passes_the_waist_in_its_regular_chart(spatial, golden_cases)


@pytest.mark.parametrize("name", ["I", "IV", "VI"])
def test_positions_are_right_to_the_last_digits(
    spatial: SimpleNamespace, make: Make, tools: SimpleNamespace, name: str
) -> None:
    """Against residuals in extended precision."""
    m, start = make(name, 6, kinds=("cylinder", "cone", "hyperboloid:sinh", "torus", "sphere:zpole", "plane"))
    path = tools.driven(m, start)[:, None] + np.linspace(0, 0.1, 60)[:, None]
    moved = spatial.follow(m, path, start)
    q = path / np.moveaxis(spatial.driver_units(m), -1, 0)[:, None]
    for i in range(6):
        fine, lean = Single(m, i, np.longdouble), Single(m, i)
        for j in range(0, moved.reached[i], 7):
            at = moved.positions[i * 60 + j]
            exact = refined(fine, lean, spatial.matrix(at.state[:4])[..., 0], at.state[4:, 0], q[i, j])
            centre = m.guides[0].origin[i]
            apart = (at.points[0] - centre) / m.unit[i] - exact.T.astype(float)
            assert np.abs(apart).max() < 1e-16 * max(50, 20 * at.condition[0])


def test_a_step_in_which_the_drive_turns_back_is_refused() -> None:
    """By the cubic of the drive through both ends of the step, whose slope must stay above the cube of the turn."""
    from catalogue.spatial.native import curve as native

    draw, t, verdicts = np.random.default_rng(6), np.linspace(0, 1, 2001), Counter[bool]()
    for _ in range(400):
        a, b, rise, turn = *draw.uniform(0, 1, 2), draw.uniform(0, 0.5), draw.choice([1e-3, 0.5])
        found = bool(rises(a, b, rise, LIMITS.margin * turn**3))
        assert native.rises(a, b, rise, LIMITS.margin * turn**3) == found
        slope = a * (1 - t) ** 2 + 2 * (3 * rise - a - b) * t * (1 - t) + b * t**2
        assert found == (slope[1:-1].min() >= min(a, b, LIMITS.margin * turn**3))
        verdicts[found] += 1
    assert min(verdicts[True], verdicts[False]) > 50


def test_what_is_no_guide_of_ours_is_left_to_numpy(spatial: SimpleNamespace, make: Make) -> None:
    class Own(Plane):
        name = "plane"

    m, _ = make("III", 3)
    assert compiled.fast(m)
    own = spatial.Guides(Own(), (), m.guides[2].origin, m.guides[2].quaternion)
    assert compiled.fast(spatial.Mechanisms(m.body, [*m.guides[:2], own], m.drivers)) is None


def test_one_set_of_types_is_compiled(spatial: SimpleNamespace, make: Make, tools: SimpleNamespace) -> None:
    """Arrays of another layout would be compiled for anew, for most of a minute."""
    for name in ("I", "V", "VI"):
        m, start = make(name, 6)
        path = path_of(tools.driven(m, start), 20)
        spatial.follow(m, np.asfortranarray(path), start)
        spatial.follow(m[::2], path[::2].tolist(), start[::2])
    kernel = compiled.kernel()
    assert kernel is not None
    assert len(kernel.led.signatures) == len(kernel.measured.signatures) == 1


def test_what_is_not_worth_it_imports_no_numba() -> None:
    code = """
import sys
from catalogue.spatial import Guides, Mechanisms, assemblies, follow
guides = [Guides("circle", (0.5,)), Guides("circle", (0.9,), (1.6, 0.2, 0.3), (2, 2, 1, 0)), Guides("plane")]
m = Mechanisms([[0, 0, 0], [0, 0, 1.745], [1.655, 0, 0.516]], guides, [(0, "u")])
at = assemblies(m, [0.8]).positions[:1]
follow(m, [[0.8], [0.81], [0.82]], at)
assert not [name for name in sys.modules if name.startswith(("numba", "llvmlite"))]
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
