"""Motion of random mechanisms: there and back, at every scale, to its end and not beyond; what is refused, and why."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue.errors import InvalidLinkage, InvalidRequest

Make = Callable[..., tuple[Any, Any]]
ENDS = {"", "turning point"}


def path_of(q: Any, nodes: int, seed: int = 5) -> Any:
    """Return straight paths of 1 rad in each driver, either way, shape (n, nodes, k)."""
    way = np.random.default_rng(seed).choice([-1.0, 1.0], q.shape)
    return q[:, None] + np.linspace(0, 1, nodes)[:, None] * way[:, None]


def points(motion: Any, nodes: int) -> Any:
    return motion.positions.points.reshape(-1, nodes, *motion.positions.points.shape[1:])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["I", "II", "III", "IV", "V", "VI"])
def test_no_motion_changes_its_branch_unseen(
    spatial: SimpleNamespace, make: Make, tools: SimpleNamespace, name: str
) -> None:
    """1,667 random mechanisms of each class, 20 coarse nodes, and back: where they came from, or they say otherwise."""
    n, nodes = 1667, 20
    m, start = make(name, n)
    path = path_of(tools.driven(m, start), nodes)
    there = spatial.follow(m, path, start)
    assert set(there.reason) <= ENDS
    assert there.positions.success.reshape(n, nodes).sum(1).tolist() == there.reached.tolist()
    assert np.isfinite(points(there, nodes)[np.arange(nodes) < there.reached[:, None]]).all()
    assert np.isnan(points(there, nodes)[np.arange(nodes) >= there.reached[:, None]]).all()
    assert there.positions.residual[there.positions.success].max() < 1e-14
    last = there.positions[np.arange(n) * nodes + there.reached - 1]
    back = np.maximum(there.reached[:, None] - 1 - np.arange(nodes), 0)
    again = spatial.follow(m, np.take_along_axis(path, back[..., None], 1), last)
    apart = np.abs(points(again, nodes)[:, -1] - points(there, nodes)[:, 0]).max((1, 2)) / m.diameter
    assert (apart < 1e-9).all(), np.flatnonzero(~(apart < 1e-9))


@pytest.mark.slow
def test_a_turning_point_is_one(spatial: SimpleNamespace, make: Make, tools: SimpleNamespace) -> None:
    """Just before it there are two assemblies near each other, just after it neither; the rates grow like the root."""
    m, start = make("II", 60)
    q = tools.driven(m, start)
    path = path_of(q, 30)
    moved = spatial.follow(m, path, start)
    ended = np.flatnonzero((moved.reason == "turning point") & (moved.reached > 2))
    assert len(ended) > 20
    some, at = m[ended], moved.positions[ended * 30 + moved.reached[ended] - 1]
    end, way = moved.end_drivers[ended], np.sign(path[ended, 1] - path[ended, 0])
    near = [spatial.follow(some, np.stack([at.drivers, end - way * d], axis=1), at) for d in (1e-6, 1e-8)]
    assert all((m.reason == "").all() for m in near)
    kappa = [m.node(1).condition for m in near]
    assert np.all(np.abs(np.log10(kappa[1] / kappa[0]) - 1) < 0.2)
    beyond = spatial.solve_positions(some, end + way * 1e-6, near[1].node(1))
    assert not beyond.success.any() or (np.abs(beyond.points - at.points).max((1, 2))[beyond.success] > 1e-2).all()
    assert (beyond.reason == "past a dead point").mean() > 0.8


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e6])
def test_scale_changes_nothing(spatial: SimpleNamespace, make: Make, tools: SimpleNamespace, scale: float) -> None:
    one, start = make("I", 100)
    other, placed = make("I", 100, scale=scale)
    path = path_of(tools.driven(one, start), 10)
    a, b = spatial.follow(one, path, start), spatial.follow(other, path, placed)
    assert a.reason.tolist() == b.reason.tolist()
    assert a.reached.tolist() == b.reached.tolist()
    off = np.abs(b.positions.points / scale - a.positions.points)[a.positions.success]
    assert off.max() < 1e-11
    x, y = (spatial.jets(m, m_at.node(0), [[1.0, 0]]) for m, m_at in ((one, a), (other, b)))
    np.testing.assert_allclose(y.spin, x.spin, rtol=1e-9, atol=1e-9 * np.abs(x.spin).max())
    np.testing.assert_allclose(b.positions.condition, a.positions.condition, rtol=1e-6)


@pytest.mark.slow
def test_path_of_two_drivers_turns_corners(spatial: SimpleNamespace, make: Make, tools: SimpleNamespace) -> None:
    """Around a small square and home."""
    m, start = make("IV", 200)
    q = tools.driven(m, start)
    square = 0.004 * np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]])
    moved = spatial.follow(m, q[:, None] + square, start)
    whole = moved.reason == ""
    assert whole.mean() > 0.8
    assert set(moved.reason) <= ENDS
    first, last = moved.node(0).points[whole], moved.node(4).points[whole]
    assert np.abs(first - last).max() < 1e-9


def test_the_half_of_a_hyperboloid_ends_at_its_waist(spatial: SimpleNamespace, golden_cases: Any) -> None:
    (c,) = [c for c in golden_cases if c.id == "IV-pla-pla-con-hyp"]
    half = spatial.Guides("hyperboloid", c.mechanism.guides[3].parameters, c.mechanism.guides[3].origin,
                          c.mechanism.guides[3].quaternion)  # fmt: skip
    m = spatial.Mechanisms(c.mechanism.body, [*c.mechanism.guides[:3], half], c.mechanism.drivers)
    path = np.stack([np.linspace(0.8, 0.79, 6), np.full(6, -0.5)], axis=1)
    at = spatial.solve_positions(m, path[0], c.at)
    assert at.success[0]
    moved = spatial.follow(m, path, at)
    assert moved.reason[0] == "off the edge of a guide"
    assert spatial.follow(c.mechanism, path, c.at).reason[0] == ""  # the chart with sinh has no edge there


def test_a_driven_surface_passes_the_waist_in_its_regular_chart(spatial: SimpleNamespace, golden_cases: Any) -> None:
    """Driven through u, w = m cosh of the inner chart: the point arrives at the waist and is not lost before."""
    (c,) = [c for c in golden_cases if c.id == "VI-sph-cyl-tor"]
    m = c.mechanism
    guide = spatial.Guides("hyperboloid:sinh", (0.4, 0.6), (0, 0, 0), (1, 0, 0, 0))
    kind = guide.kinds[0]
    w = 0.01
    local = np.array([float(v[0]) for v in kind.point(np.array([0.3]), np.array([w]), guide.parameters.T)])
    place = c.at.points[0, 2] - local
    at = [*c.at.coordinates[0, :2], [0.3, w]]
    whole = spatial.Mechanisms(
        m.body, [*m.guides[:2], spatial.Guides("hyperboloid:sinh", (0.4, 0.6), place)], m.drivers
    )
    half = spatial.Mechanisms(m.body, [*m.guides[:2], spatial.Guides("hyperboloid", (0.4, 0.6), place)], m.drivers)
    table = [*c.at.coordinates[0, :2], [0.3, 0.4 * np.cosh(w)]]
    here = spatial.solve_positions(whole, [*c.q[:2, 0], 0.3], at)
    rate = spatial.jets(whole, here, [[0.0], [0.0], [1.0]]).coordinates[0, 2, 1, 1]
    path = np.array([*c.q[:2, 0], 0.3]) - np.linspace(0, 2 * w / rate, 41)[:, None] * [[0, 0, 1.0]]
    through = spatial.follow(whole, path, at)
    assert through.reason[0] == ""
    assert through.node(40).coordinates[0, 2, 1] < 0
    ended = spatial.follow(half, path, table)
    assert ended.reason[0] == "off the edge of a guide"
    assert 10 < ended.reached[0] < 30
    assert ended.positions[: ended.reached[0]].coordinates[:, 2, 1].min() >= 0.4


def test_the_apex_of_a_cone_is_named(spatial: SimpleNamespace) -> None:
    guides = [spatial.Guides("circle", (0.5,)), spatial.Guides("circle", (0.9,), (1.6, 0.2, 0.3), (2, 2, 1, 0))]
    free = spatial.Mechanisms(
        [[0, 0, 0], [0, 0, 1.745], [1.655, 0, 0.516]], [*guides, spatial.Guides("plane")], [(0, "u")]
    )
    at = spatial.assemblies(free, [0.8]).positions
    cone = spatial.Guides("cone", (0.6,), at.points[0, 2])
    m = spatial.Mechanisms(free.body, [*guides, cone], [(0, "u")])
    found = spatial.solve_positions(m, [0.8], at[:1])
    assert not found.success[0]
    assert found.reason[0] == "at the apex of a guide"


def test_positions_without_an_assembly_are_not_reported(spatial: SimpleNamespace, golden_cases: Any) -> None:
    (c,) = [c for c in golden_cases if c.id == "III-trammel"]
    at = spatial.solve_positions(c.mechanism, [2.5], c.at)
    assert not at.success[0]
    assert at.reason[0] == "past a dead point"
    assert at.residual[0] > 0.01
    assert spatial.solve_positions(c.mechanism, [np.nan], c.at).reason[0] == "driver is not finite"


def test_series_are_the_coincidences_of_points(spatial: SimpleNamespace, make: Make) -> None:
    expected = {"I": "1.11111", "II": "1.2111", "III": "1.221", "IV": "2.1111", "V": "2.211", "VI": "3.111"}
    for name, tag in expected.items():
        assert set(make(name, 5)[0].series) == {tag}
    m, _ = make("I", 3)
    body = m.body.copy()
    body[0, 4] = body[0, 0]
    body[1, 4], body[1, 3] = body[1, 1], body[1, 0]
    assert spatial.Mechanisms(body, m.guides, m.drivers).series.tolist() == ["1.2111", "1.221", "1.11111"]


@pytest.mark.parametrize("separation", [1e-3, 1e-5, 1e-8, 0.0])
def test_a_curve_is_the_limit_of_two_points_on_two_surfaces(
    spatial: SimpleNamespace, golden_cases: Any, separation: float
) -> None:
    """Class II with a circle as class I, cylinder and plane, their points A1, A5 apart: the error is the separation."""
    (c,) = [c for c in golden_cases if c.id == "II-circle-cyl-tor-pla"]
    m = c.mechanism
    body = np.concatenate([m.body[0], m.body[0, :1] + np.array([0, 0, separation])])
    circle = m.guides[0]
    place = circle.origin, circle.quaternion
    guides = [spatial.Guides("cylinder", circle.parameters, *place), *m.guides[1:], spatial.Guides("plane", (), *place)]
    five = spatial.Mechanisms(body, guides, [(0, "u")])
    assert five.series[0] == ("1.2111" if separation < 1e-12 else "1.11111")
    start = np.concatenate([c.at.coordinates[0], [[c.at.coordinates[0, 0, 0], 0.5]]])
    start[0, 1] = 0
    at = spatial.solve_positions(five, c.q[:, 0], start)
    assert at.success[0]
    assert np.abs(at.points[0, :4] - c.at.points[0]).max() < 4 * separation + 1e-14
    assert at.condition[0] < 40
    moving = spatial.jets(five, at, c.q[:, 1:])
    assert np.abs(moving.points[0, :4, 1] - c.jets.points[0, :, 1]).max() < 100 * separation + 1e-12


@pytest.mark.parametrize(
    ("change", "error", "match"),
    [
        ({"drivers": []}, InvalidRequest, "wants 1 different drivers"),
        ({"drivers": [(0, "w")]}, InvalidRequest, "no coordinate w of point 0"),
        ({"drivers": [(7, "u")]}, InvalidRequest, "no coordinate u of point 7"),
        ({"body": [[0, 0, 0], [1, 0, 0]]}, InvalidLinkage, r"body must be numbers of shape \(3, 3\)"),
        ({"body": [[0, 0, 0], [1, 0, 0], [np.nan, 1, 0]]}, InvalidLinkage, "not finite"),
    ],
)
def test_wrong_mechanisms_are_refused(
    spatial: SimpleNamespace, golden_cases: Any, change: dict[str, Any], error: type[Exception], match: str
) -> None:
    m = golden_cases[0].mechanism
    fields = {"body": m.body[0], "guides": m.guides, "drivers": m.drivers, **change}
    with pytest.raises(error, match=match):
        spatial.Mechanisms(**fields)


def test_wrong_requests_are_refused(spatial: SimpleNamespace, golden_cases: Any) -> None:
    c = golden_cases[0]
    with pytest.raises(InvalidLinkage, match="none of the six classes"):
        spatial.Mechanisms(c.mechanism.body[0][:2], c.mechanism.guides[:2], [(0, "u")])
    with pytest.raises(InvalidRequest, match="driver values must be of shape"):
        spatial.solve_positions(c.mechanism, [1.0, 2.0], c.at)
    with pytest.raises(InvalidRequest, match="rough coordinates must be of shape"):
        spatial.solve_positions(c.mechanism, [1.0], np.zeros((5, 2)))
    with pytest.raises(InvalidRequest, match=r"path must be finite numbers of shape \(n, 1\)"):
        spatial.follow(c.mechanism, [1.0, 2.0], c.at)
    with pytest.raises(InvalidRequest, match="finite"):
        spatial.follow(c.mechanism, [[1.0], [np.inf]], c.at)
    with pytest.raises(InvalidRequest, match="rates must be finite"):
        spatial.jets(c.mechanism, c.at, [[np.nan]])


@pytest.mark.slow
def test_loading_the_catalogue_does_not_load_the_solver() -> None:
    import subprocess
    import sys

    code = (
        "import sys; from catalogue.plugin.registry import Registry; r = Registry();"
        "print([x.error for x in r.records if x.name == 'spatial_guidance'],"
        "[m for m in sys.modules if 'spatial_guidance' in m and '.' in m or 'catalogue.spatial' in m])"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.split("\n")[0] == "[''] []"


@pytest.mark.slow
def test_no_position_changes_its_assembly_unseen(spatial: SimpleNamespace, make: Make, tools: SimpleNamespace) -> None:
    """Far from known positions: what is found is what small steps lead to, all else is refused with a reason."""
    m, start = make("III", 300)
    q = tools.driven(m, start)
    at = spatial.solve_positions(m, q, start)
    far = spatial.solve_positions(m, q + 1.5, at)
    steps = spatial.follow(m, q[:, None] + np.linspace(0, 1.5, 40)[:, None], at)
    assert 20 < far.success.sum() < 280
    assert (far.success == (steps.reached == 40)).mean() > 0.99
    both = far.success & (steps.reached == 40)
    assert np.abs(far.points - steps.node(39).points)[both].max() < 1e-9
    assert (far.reason[~far.success] != "").all()
