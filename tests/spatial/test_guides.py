# ruff: noqa: ARG005  (formulas of one shape, some of which do not use every coordinate)
"""Guides: charts against implicit equations, derivatives against Table I and 40 digits, and a kind of one's own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np
import pytest

from catalogue.errors import InvalidLinkage

ALL = ["cylinder", "cone", "hyperboloid", "hyperboloid:sinh", "hyperboloid:axial", "hyperboloid:ruled", "torus",
       "sphere", "sphere:zpole", "plane", "plane:cartesian", "circle", "helix", "line"]  # fmt: skip
#: Table I by hand: points X(u, w) of a chart with mpmath's functions.
TABLE: dict[str, Any] = {
    "cylinder": lambda u, w, r: (r * mp.cos(u), r * mp.sin(u), w),
    "cone": lambda u, w, d: (w * mp.cos(u), w * mp.sin(u), w * mp.cot(d)),
    "hyperboloid": lambda u, w, m, n: (w * mp.cos(u), w * mp.sin(u), n / m * mp.sqrt(w * w - m * m)),
    "hyperboloid:sinh": lambda u, w, m, n: (m * mp.cosh(w) * mp.cos(u), m * mp.cosh(w) * mp.sin(u), n * mp.sinh(w)),
    "hyperboloid:axial": lambda u, w, m, n: (*(m * mp.sqrt(1 + w * w / n**2) * f(u) for f in (mp.cos, mp.sin)), w),
    "hyperboloid:ruled": lambda u, w, m, n: (
        m * (mp.cos(u) - w * mp.sin(u)),
        m * (mp.sin(u) + w * mp.cos(u)),
        n * w,
    ),
    "torus": lambda u, w, p, r: ((p + r * mp.sin(w)) * mp.cos(u), (p + r * mp.sin(w)) * mp.sin(u), r * mp.cos(w)),
    "sphere": lambda u, w, r: (-r * mp.cos(u) * mp.cos(w), r * mp.sin(w), r * mp.sin(u) * mp.cos(w)),
    "sphere:zpole": lambda u, w, r: (r * mp.cos(u) * mp.cos(w), r * mp.sin(u) * mp.cos(w), r * mp.sin(w)),
    "plane": lambda u, w: (w * mp.cos(u), w * mp.sin(u), mp.mpf(0)),
    "plane:cartesian": lambda u, w: (u, w, mp.mpf(0)),
    "circle": lambda u, w, r: (r * mp.cos(u), r * mp.sin(u), mp.mpf(0)),
    "helix": lambda u, w, r, h: (r * mp.cos(u), r * mp.sin(u), h * u),
    "line": lambda u, w: (mp.mpf(0), mp.mpf(0), u),
}
#: Table I, implicit, in X, Y, Z and the parameters.
IMPLICIT: dict[str, Any] = {
    "cylinder": lambda x, y, z, r: [x * x + y * y - r * r],
    "cone": lambda x, y, z, d: [x * x + y * y - (z * np.tan(d)) ** 2],
    "hyperboloid": lambda x, y, z, m, n: [n * n * (x * x + y * y) - m * m * z * z - (m * n) ** 2],
    "torus": lambda x, y, z, p, r: [(x * x + y * y + z * z + p * p - r * r) ** 2 - 4 * p * p * (x * x + y * y)],
    "sphere": lambda x, y, z, r: [x * x + y * y + z * z - r * r],
    "plane": lambda x, y, z: [z],
    "circle": lambda x, y, z, r: [x * x + y * y - r * r, z],
    "helix": lambda x, y, z, r, h: [x - r * np.cos(z / h), y - r * np.sin(z / h)],
    "line": lambda x, y, z: [x, y],
}
N = 50


def sample(kind: Any, seed: int = 1) -> tuple[Any, Any, Any]:
    """Return u, w (n,) and parameters (k, n)."""
    draw = np.random.default_rng(seed)
    p = draw.uniform(0.3, 0.7, (2, N)) + np.array([[0.5], [0]])
    w = draw.uniform(-1.4, 1.4, N)
    w = np.abs(w) + 1.3 if kind.bounded else w
    return draw.uniform(-3, 3, N), w, p[: len(kind.parameters)]


@pytest.mark.parametrize("name", ALL)
def test_points_tangents_and_curvatures_are_those_of_the_table(spatial: SimpleNamespace, name: str) -> None:
    kind = spatial.KINDS[name]
    u, w, p = sample(kind)
    x, t = kind.tangents(u, w, p)
    second = kind.curvatures(u, w, p)
    partials = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    with mp.workdps(40):
        for i in range(5):
            for axis in range(3):

                def f(a: Any, b: Any, axis: int = axis, i: int = i) -> Any:
                    return TABLE[name](a, b, *(mp.mpf(v) for v in p[:, i]))[axis]

                exact = [mp.diff(f, (mp.mpf(u[i]), mp.mpf(w[i])), k) if any(k) else f(mp.mpf(u[i]), mp.mpf(w[i]))
                         for k in partials]  # fmt: skip
                found = [x[axis, i], t[0, axis, i], t[1, axis, i], *second[:, axis, i]]
                for a, b in zip(found, exact, strict=True):
                    assert abs(a - b) < 2e-14 * (1 + abs(b)), (name, i, axis)


@pytest.mark.parametrize("name", ALL)
def test_points_lie_on_the_surface_and_are_found_again(spatial: SimpleNamespace, name: str) -> None:
    kind = spatial.KINDS[name]
    u, w, p = sample(kind)
    x = np.stack(np.broadcast_arrays(*kind.point(u, w, p), u))[:3]
    values, gradients = kind.gradients(x, p)
    assert np.abs(values / np.linalg.norm(gradients, axis=1)).max() < 4e-15
    for f in IMPLICIT[name.partition(":")[0]](*x, *p):
        assert np.abs(f).max() < 1e-13
    again = kind.locate(x, p)
    again = again[0], np.zeros(N) if kind.conditions == 2 else again[1]
    np.testing.assert_allclose(np.stack(np.broadcast_arrays(*kind.point(*again, p), u))[:3], x, atol=3e-15)


@pytest.mark.parametrize("name", ALL)
def test_gradients_are_normal_and_proportional_to_those_of_the_table(spatial: SimpleNamespace, name: str) -> None:
    kind = spatial.KINDS[name]
    u, w, p = sample(kind)
    x, t = kind.tangents(u, w, p)
    _, g = kind.gradients(x, p)
    for normal in g / np.linalg.norm(g, axis=1, keepdims=True):
        for along in t[: 3 - kind.conditions]:
            assert np.abs((normal * along).sum(0)).max() < 1e-14 * max(1, np.abs(along).max())
    table = IMPLICIT[name.partition(":")[0]]
    by_axis = [table(*(x[i] + (1e-20j if i == axis else 0j) for i in range(3)), *p) for axis in range(3)]
    for j, mine in enumerate(g):
        theirs = np.stack([np.imag(f[j]) for f in by_axis])  # by complex steps, which do not cancel
        np.testing.assert_allclose(
            mine / np.linalg.norm(mine, axis=0), theirs / np.linalg.norm(theirs, axis=0), atol=1e-12
        )


def test_regular_charts_are_the_same_surface(spatial: SimpleNamespace) -> None:
    for one, other in (("hyperboloid", "hyperboloid:sinh"), ("hyperboloid:axial", "hyperboloid:ruled"),
                       ("sphere", "sphere:zpole"), ("plane", "plane:cartesian")):  # fmt: skip
        first, second = spatial.KINDS[one], spatial.KINDS[other]
        u, w, p = sample(first)
        x = np.stack(np.broadcast_arrays(*first.point(u, w, p), u))[:3]
        again = np.stack(np.broadcast_arrays(*second.point(*second.locate(x, p), p), u))[:3]
        np.testing.assert_allclose(again, x, atol=2e-15)


def test_charts_of_the_hyperboloid_are_regular_at_its_waist(spatial: SimpleNamespace) -> None:
    p, zero = np.array([[0.5], [0.9]]), np.zeros(1)
    for name in ("hyperboloid:sinh", "hyperboloid:axial", "hyperboloid:ruled"):
        _, t = spatial.KINDS[name].tangents(zero, zero, p)
        assert np.linalg.norm(np.cross(t[0, :, 0], t[1, :, 0])) >= 0.45 * (1 - 1e-12) / (0.9 if "axial" in name else 1)
    _, t = spatial.KINDS["hyperboloid"].tangents(zero, np.array([0.5]), p)
    assert np.isinf(t[1, 2, 0])
    assert np.isnan(spatial.KINDS["hyperboloid"].locate(np.array([[0.6], [0], [-0.3]]), p)).all()


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9])
def test_a_torus_loses_no_digit_as_it_closes(spatial: SimpleNamespace, gap: float) -> None:
    """Points of the inner equator, r -> p: distance to first order, where the expanded quartic cancels."""
    p = np.array([[1.0], [1 - gap]])
    x = np.stack(spatial.KINDS["torus"].point(np.linspace(0, 6, 9), np.full(9, -np.pi / 2), p))
    value, gradient = spatial.KINDS["torus"].gradients(x, np.broadcast_to(p, (2, 9)))
    assert np.abs(value[0] / np.linalg.norm(gradient[0], axis=0)).max() < 5e-16


@pytest.mark.parametrize(
    ("kind", "parameters"),
    [("cylinder", -1), ("cone", 2.0), ("cone", 0), ("torus", (1, 0)), ("hyperboloid", (0, 1)), ("helix", (1, 0)),
     ("sphere", np.nan), ("circle", np.inf)],
)  # fmt: skip
def test_parameters_out_of_their_domain_are_refused(spatial: SimpleNamespace, kind: str, parameters: Any) -> None:
    with pytest.raises(InvalidLinkage, match=rf"guide 0 is no {kind}"):
        spatial.Guides(kind, np.atleast_1d(parameters))


def test_an_unknown_kind_is_refused_and_the_known_ones_are_named(spatial: SimpleNamespace) -> None:
    with pytest.raises(InvalidLinkage, match=r"no guide 'sadle'; there are cylinder, cone"):
        spatial.Guides("sadle")


def bowl(spatial: SimpleNamespace) -> Any:
    """Return a surface of one's own that is no quadric: a wavy paraboloid."""

    class Bowl(spatial.Kind):  # type: ignore[misc,name-defined]  # of the plugin, which is loaded by its path
        name, parameters, lengths, spans = "bowl", ("R",), ("R", "u", "w"), (None, None)

        def point(self, u: Any, w: Any, p: Any) -> Any:
            return u, w, (u * u + w * w) / (2 * p[0]) + p[0] * np.sin(u / p[0]) / 4

        def implicit(self, x: Any, p: Any) -> Any:
            return (x[2] - (x[0] * x[0] + x[1] * x[1]) / (2 * p[0]) - p[0] * np.sin(x[0] / p[0]) / 4,)

        def locate(self, x: Any, p: Any) -> Any:  # noqa: ARG002, other guides need it
            return x[0], x[1]

    return Bowl()


def ellipsoid(spatial: SimpleNamespace) -> Any:
    """Return a quadric of one's own."""

    class Ellipsoid(spatial.Quadric):  # type: ignore[misc,name-defined]  # of the plugin as well
        name, parameters, lengths = "ellipsoid", ("a", "b", "c"), ("a", "b", "c")
        spans = (np.pi, np.pi / 2)

        def point(self, u: Any, w: Any, p: Any) -> Any:
            return p[0] * np.cos(w) * np.cos(u), p[1] * np.cos(w) * np.sin(u), p[2] * np.sin(w)

        def quadrics(self, p: Any) -> Any:
            return spatial.rows(p.shape[1], {"a": p[0] ** -2, "b": p[1] ** -2, "c": p[2] ** -2, "e": -1})

        def locate(self, x: Any, p: Any) -> Any:
            return np.arctan2(x[1] / p[1], x[0] / p[0]), np.arctan2(x[2] / p[2], np.hypot(x[0] / p[0], x[1] / p[1]))

    return Ellipsoid()


@pytest.mark.parametrize("driver", [(0, "w"), (1, "w"), (2, "u")])
def test_kinds_of_ones_own_guide_a_body_like_the_others(spatial: SimpleNamespace, driver: Any) -> None:
    """An ellipsoid, a wavy bowl, driven or not, next to built-in kinds: derivatives against neighbouring positions."""
    place = [((1.5, 0.1, 0.2), (2, 1, 0, 0)), ((0.4, 1.6, -0.3), (2, 0, 1, 0)), ((-0.7, 0.8, 0.9), (3, 1, 1, 0)),
             ((0.6, -0.9, 0.7), (1, 0, 0, 1)), ((0.1, 0.2, -0.4), (1, 2, 0, 0))]  # fmt: skip
    guides = [
        spatial.Guides(kind, p, *at)
        for (kind, p), at in zip(
            [(ellipsoid(spatial), (1.0, 1.3, 0.8)), (bowl(spatial), (1.1,)), ("cylinder", (0.7,)),
             ("torus", (1.0, 0.4)), ("sphere", (1.2,))],
            place,
            strict=True,
        )
    ]  # fmt: skip
    coordinates = np.array([[0.4, 0.5], [0.3, -0.6], [0.7, 0.2], [1.1, 0.6], [0.5, 0.4]])
    world = []
    for g, (u, w) in zip(guides, coordinates, strict=True):
        ((kind, _, p),) = g.each()
        local = np.array([float(np.squeeze(v)) for v in kind.point(np.array([u]), np.array([w]), p)])
        world.append(g.origin[0] + spatial.matrix(g.quaternion.T)[..., 0] @ local)
    m = spatial.Mechanisms(np.array(world), guides, [driver])
    q, h = coordinates[driver[0], "uw".index(driver[1])], 1e-4
    at = [spatial.solve_positions(m, [q + k * h], coordinates) for k in range(-2, 3)]
    assert all(a.success[0] for a in at)
    moving = spatial.jets(m, at[2], [[1.0, 0, 0]])
    first = (at[0].points - 8 * at[1].points + 8 * at[3].points - at[4].points) / (12 * h)
    second = (-at[0].points + 16 * at[1].points - 30 * at[2].points + 16 * at[3].points - at[4].points) / (12 * h * h)
    assert np.abs(moving.points[:, :, 1] - first).max() < 1e-6 * np.abs(first).max()
    assert np.abs(moving.points[:, :, 2] - second).max() < 1e-4 * np.abs(second).max()
    np.testing.assert_allclose(at[2].coordinates[0], coordinates, atol=1e-12)
