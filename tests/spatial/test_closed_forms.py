"""Mechanisms with a closed form: RSSR and RSSP, Cardan joint, trammel, Bennett, a planar four-bar embedded in space."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.motion import CRANK_1, motion
from catalogue.spatial.guided.meeting import curve_and_sphere

Cases = list[SimpleNamespace]


def by_id(golden_cases: Cases, name: str) -> SimpleNamespace:
    (c,) = [c for c in golden_cases if c.id == name]
    return c


@pytest.mark.slow
@pytest.mark.parametrize("name", ["III-rssr-plane", "III-altmann", "III-altmann-8"])
def test_two_circles_obey_the_input_output_equation_of_the_rssr(
    spatial: SimpleNamespace, golden_cases: Cases, name: str
) -> None:
    """A cos u2 + B sin u2 + C = 0 along the motion, and u2 from its closed form."""
    c = by_id(golden_cases, name)
    m, q = c.mechanism, c.q[0, 0]
    moved = spatial.follow(m, np.linspace(q, q - 0.8, 41)[:, None], c.at)
    r = moved.reached[0]
    assert r > 5
    at = moved.positions[:r]
    frame, o = spatial.matrix(m.guides[1].quaternion.T)[..., 0], m.guides[1].origin[0]
    radius, d = m.guides[1].parameters[0, 0], np.linalg.norm(m.body[0, 1] - m.body[0, 0])
    shift = o - at.points[:, 0]
    a, b = 2 * radius * shift @ frame[:, 0], 2 * radius * shift @ frame[:, 1]
    e = (shift**2).sum(1) + radius**2 - d**2
    both = np.arctan2(b, a) + np.array([[1], [-1]]) * np.arccos(-e / np.hypot(a, b))
    off = np.abs(np.angle(np.exp(1j * (both - at.coordinates[:, 1, 0]))))
    assert off.min(0).max() < 1e-12


def test_a_circle_and_a_line_obey_the_quadratic_of_the_rssp(spatial: SimpleNamespace) -> None:
    body = np.array([[0, 0, 0], [0, 0, 1.6], [0.9, 0, 0.4]])
    guides = [spatial.Guides("circle", 0.5 * np.ones(1)), spatial.Guides("line", (), (1.2, 0.2, 0.4), (3, 1, 0, 2)),
              spatial.Guides("sphere", np.ones(1), (0.3, 1.0, 0.2))]  # fmt: skip
    m = spatial.Mechanisms(body, guides, [(0, "u")])
    found = spatial.assemblies(m, [0.7])
    assert found.count[0] == 4
    along = spatial.matrix(guides[1].quaternion.T)[:, 2, 0]
    for at in (found.positions[[i]] for i in range(4)):
        d = guides[1].origin[0] - at.points[0, 0]
        root = np.sqrt((d @ along) ** 2 - d @ d + 1.6**2)
        assert np.abs(-d @ along + np.array([root, -root]) - at.coordinates[0, 1, 0]).min() < 1e-14


def test_cardan_joint_over_a_full_turn(spatial: SimpleNamespace, golden_cases: Cases) -> None:
    """tan u2 = -cot u1 / cos(beta), and the angular velocity ratio."""
    c = by_id(golden_cases, "III-hooke")
    q = np.linspace(0.5, 0.5 + 2 * np.pi, 181)
    moved = spatial.follow(c.mechanism, q[:, None], c.at)
    assert moved.reason[0] == ""
    at, many = moved.positions, c.mechanism[np.zeros(len(q), int)]
    cos = 0.8  # of the angle of the shafts, tan = 3/4
    u = at.coordinates[:, 1, 0]
    assert np.abs(np.sin(u) * np.sin(q) * cos + np.cos(u) * np.cos(q)).max() < 1e-14
    rate = spatial.jets(many, at, [[1.0]]).coordinates[:, 1, 0, 1]
    np.testing.assert_allclose(rate, cos / (1 - (np.sin(q) * 0.6) ** 2), rtol=1e-12)


def test_trammel_between_its_dead_points(spatial: SimpleNamespace, golden_cases: Cases) -> None:
    c = by_id(golden_cases, "III-trammel")
    q = np.linspace(1.2, 2.4, 101)
    moved = spatial.follow(c.mechanism, q[:, None], c.at)
    r = moved.reached[0]
    at = moved.positions[:r]
    np.testing.assert_allclose(at.coordinates[:, 1, 0], np.sqrt(4 - q[:r] ** 2), atol=1e-14)
    assert moved.reason[0] == "turning point"
    assert abs(moved.end_drivers[0, 0] - 2) < 1e-14
    assert q[r - 1] < 2 < q[r]


def test_a_parallelogram_stops_at_its_branch_point(spatial: SimpleNamespace) -> None:
    """In line at u1 = 0, where the motions with parallel and with crossed cranks meet; before, u2 = u1."""
    guides = [spatial.Guides("circle", (0.7,)), spatial.Guides("circle", (0.7,), (1.5, 0, 0)), spatial.Guides("plane")]
    m = spatial.Mechanisms([[0, 0, 0], [1.5, 0, 0], [0.4, 0.9, 0]], guides, [(0, "u")])
    start = [[0.8, np.nan], [0.8, np.nan], [np.arctan2(1.4, 0.9), np.hypot(1.4, 0.9)]]
    moved = spatial.follow(m, np.linspace(0.8, -0.8, 80)[:, None], start)
    at = moved.positions[: moved.reached[0]]
    assert moved.reached[0] == 40
    assert np.abs(at.coordinates[:, 1, 0] - at.drivers[:, 0]).max() < 1e-12
    assert moved.reason[0] == "branch point"
    assert abs(moved.end_drivers[0, 0]) < 1e-4


@pytest.mark.slow
def test_a_planar_four_bar_in_space_moves_as_the_planar_kernel_says(spatial: SimpleNamespace) -> None:
    """Two circles and, as third guide, the plane of motion: tilted and shifted in space, crank 1 driving."""
    draw = np.random.default_rng(4)
    n, steps = 40, 24
    pivots = np.ones((n, 2, 2, 3))
    pivots[..., :2] = draw.normal(size=(n, 2, 2, 2))
    linkage = Linkage(pivots)
    moving = motion(linkage, CRANK_1)
    z = linkage.points
    other = draw.normal(size=n) + 1j * draw.normal(size=n)
    t = np.clip(moving.interval[1], 0, 0.2) * 0.98 * np.linspace(0, 1, steps)[:, None]

    def placed(p: Any) -> Any:
        x, y = moving.point(p)(t)
        return p + x + 1j * y

    planar = np.stack([placed(p) for p in (z[:, 0, 1], z[:, 1, 1], other)], axis=-1)
    turn, shift = draw.normal(size=(n, 4)), draw.normal(size=(n, 3))
    rotation = np.moveaxis(spatial.matrix(turn.T), -1, 0)

    def embedded(p: Any) -> Any:
        return shift + np.einsum("nij,jn->ni", rotation, np.stack([p.real, p.imag, 0 * p.real]))

    body = np.stack([np.stack([p.real, p.imag, 0 * p.real], axis=-1) for p in (z[:, 0, 1], z[:, 1, 1], other)], axis=1)
    guides = [
        spatial.Guides("circle", np.abs(z[:, i, 1] - z[:, i, 0])[:, None], embedded(z[:, i, 0]), turn) for i in (0, 1)
    ]
    guides.append(spatial.Guides("plane:cartesian", (), shift, turn))
    m = spatial.Mechanisms(body, guides, [(0, "u")])
    crank = z[:, 0, 1] - z[:, 0, 0]
    other_crank = z[:, 1, 1] - z[:, 1, 0]
    rough = np.full((n, 3, 2), np.nan)
    rough[:, 0, 0], rough[:, 1, 0] = np.angle(crank), np.angle(other_crank)
    rough[:, 2] = np.stack([other.real, other.imag], axis=1)
    path = np.angle(crank) + 2 * np.arctan(t)
    moved = spatial.follow(m, path.T[..., None], rough)
    assert (moved.reason == "").mean() > 0.9
    points = moved.positions.points.reshape(n, steps, 3, 3)
    for i in range(3):
        expected = np.stack([embedded(planar[j, :, i]) for j in range(steps)], axis=1)
        error = np.abs(points[:, :, i] - expected).max((1, 2)) / m.diameter
        assert np.nanmax(np.where(moved.reason == "", error, np.nan)) < 1e-12


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e6])
def test_a_sphere_that_just_touches_an_ellipse_meets_it_once_a_larger_one_twice_in_any_unit(unit: float) -> None:
    draw = np.random.default_rng(6)
    centre, first, second = draw.normal(size=(3, 3, 20))

    def curve(s: Any) -> Any:
        return np.cos(s) * first + np.sin(s) * second

    def far(s: float, k: int) -> float:
        return float(np.linalg.norm((curve(s) - centre)[:, k]))

    nearest = []
    for k in range(20):
        s = min(np.linspace(0, 2 * np.pi, 400), key=lambda s: far(s, k))
        nearest.append(minimize_scalar(far, bounds=(s - 0.02, s + 0.02), args=(k,), options={"xatol": 1e-9}).fun)
    for larger, roots, double in ((-1e-9, 0, False), (0.0, 1, True), (1e-9, 2, False)):
        radius = unit * np.array(nearest) * (1 + larger)
        found, plain = curve_and_sphere(lambda s: unit * curve(s), unit * centre, radius, np.full(20, 5 * unit))
        assert plain.all()
        np.testing.assert_array_equal(np.isfinite(found.at).sum(0), roots)
        np.testing.assert_array_equal(found.double.any(0), double)
        for k in range(20):
            for s in found.at[np.isfinite(found.at[:, k]), k]:
                assert unit * far(s, k) == pytest.approx(radius[k], rel=1e-12)


def test_a_helix_meets_a_sphere_wherever_a_fine_walk_passes_its_surface() -> None:
    """Over many turns, of axes and middles that lie anywhere; of the 20 some meet the sphere more than six times."""
    draw = np.random.default_rng(2)
    turn = np.linalg.qr(draw.normal(size=(20, 3, 3)))[0].transpose(1, 2, 0)
    first, second = turn[:, 0], turn[:, 1]
    along = turn[:, 2] * draw.uniform(0.05, 0.3, 20)
    begin, centre, radius = *draw.normal(size=(2, 3, 20)), draw.uniform(0.8, 3, 20)

    def curve(s: Any) -> Any:
        return begin + np.cos(s) * first + np.sin(s) * second + s * along

    found, plain = curve_and_sphere(curve, centre, radius, np.full(20, 10.0))
    assert plain.all()
    walk = np.linspace(-120, 120, 120_001)
    counts = []
    for k in range(20):
        v, a = begin[:, k] - centre[:, k], along[:, k]
        far = (
            v @ v + 1 + 2 * np.cos(walk) * (v @ first[:, k]) + 2 * np.sin(walk) * (v @ second[:, k])
            + walk * (2 * (v @ a) + walk * (a @ a))
        )  # fmt: skip
        passed = np.flatnonzero(np.diff(far > radius[k] ** 2))
        at = np.sort(found.at[np.isfinite(found.at[:, k]), k])
        np.testing.assert_allclose(at, walk[passed], atol=2.1e-3)
        counts.append(len(at))
    assert max(counts) > 6
