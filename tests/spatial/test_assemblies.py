# ruff: noqa: ARG002  (a kind need not use every argument of its formulas)
"""Assemblies by closed elimination: none is missed, none invented; what has no closed form says so."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue.errors import InvalidRequest
from catalogue.spatial import Kind
from tests.spatial import exhaustive

Make = Callable[..., tuple[Any, Any]]
Cases = list[SimpleNamespace]


def counted(spatial: SimpleNamespace, make: Make, tools: SimpleNamespace, name: str, n: int, seed: int) -> None:
    m, start = make(name, n, seed)
    q = tools.driven(m, start)
    found = spatial.assemblies(m, q)
    assert found.complete.all()
    assert found.even.all()
    assert found.positions.success.all()
    assert found.positions.residual.max() < 1e-14
    assert found.count.tolist() == [exhaustive.count(m, q, i) for i in range(n)]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["III", "V"])
def test_elimination_finds_what_an_exhaustive_search_finds(
    spatial: SimpleNamespace, make: Make, tools: SimpleNamespace, name: str
) -> None:
    counted(spatial, make, tools, name, 6, 1)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["III", "V"])
def test_elimination_finds_what_an_exhaustive_search_finds_in_200_mechanisms(
    spatial: SimpleNamespace, make: Make, tools: SimpleNamespace, name: str
) -> None:
    counted(spatial, make, tools, name, 200, 17)


@pytest.mark.slow
def test_elimination_keeps_what_random_starts_find(
    spatial: SimpleNamespace, make: Make, tools: SimpleNamespace
) -> None:
    """Of classes III, V and VI in every chart, also with both coordinates of a surface driven."""
    kinds = ("cylinder", "cone", "hyperboloid:sinh", "hyperboloid:axial", "hyperboloid:ruled", "torus", "sphere",
             "sphere:zpole", "plane", "plane:cartesian")  # fmt: skip
    for name, drivers in (
        ("III", [(0, "u")]), ("III", [(1, "u")]), ("V", [(1, "w"), (0, "u")]), ("V", [(1, "u"), (1, "w")]),
        ("V", [(0, "u"), (2, "u")]), ("VI", [(0, "u"), (0, "w"), (2, "u")]),
    ):  # fmt: skip
        m, start = make(name, 20, 9, kinds=kinds)
        m = spatial.Mechanisms(m.body, m.guides, drivers)
        q = tools.driven(m, start)
        found = spatial.assemblies(m, q)
        other = spatial.assemblies(m, q, hits=2, method="multi-start")
        assert found.complete.all()
        assert not other.complete.any()
        assert (other.starts > other.fruitless).all()
        for i in range(20):
            mine, theirs = (f.positions.points[f.mechanism == i] for f in (found, other))
            apart = np.abs(theirs[:, None] - mine).max((2, 3)).min(1, initial=np.inf)
            assert apart.max(initial=0) < 1e-8, (name, i)


def test_near_assemblies_are_told_apart_and_those_that_coincide_are_double(
    spatial: SimpleNamespace, golden_cases: Cases
) -> None:
    """The trammel, whose second point is at +-sqrt(4 - q^2): none, double and two on either side of the dead point."""
    (c,) = [c for c in golden_cases if c.id == "III-trammel"]
    q = np.array([[2 + 1e-9], [2.0], [2 - 1e-9], [1.0]])
    found = spatial.assemblies(c.mechanism[np.zeros(4, int)], q)
    assert found.count.tolist() == [0, 2, 4, 4]
    assert [found.double[found.mechanism == i].tolist() for i in (1, 2, 3)] == [[True] * 2, [False] * 4, [False] * 4]
    assert found.even.all()
    assert found.complete.all()
    assert found.certified.tolist() == [False] * 2 + [True] * 8  # a double root is none that Newton's method is sure of
    gap = np.ptp(found.positions.coordinates[found.mechanism == 2, 1, 0])
    assert abs(gap / (2 * np.sqrt(4 - q[2, 0] ** 2)) - 1) < 1e-6


def test_known_roots_of_trigonometric_polynomials(spatial: SimpleNamespace) -> None:
    """Four roots that were chosen, two of them near each other or double; a fifth of them, none at all."""
    draw = np.random.default_rng(2)
    roots = np.sort(draw.uniform(-3, 3, (4, 300)), axis=0)
    gap = np.repeat([1e-3, 1e-5, 0.0], 100)
    roots[1] = roots[0] + gap
    angles = 2 * np.pi / 5 * np.arange(5)
    f = np.prod(np.sin((angles[:, None, None] - roots) / 2), axis=1)
    waves = np.stack([np.ones(5), *(g(k * angles) for k in (1, 2) for g in (np.cos, np.sin))])
    c = np.array([1, 2, 2, 2, 2])[:, None] / 5 * (waves @ f)
    found = spatial.trigonometric(c, 32 * 2.2e-16 * np.abs(c).sum(0))
    number = np.isfinite(found.at).sum(0)
    at = np.where(np.isfinite(found.at), np.remainder(found.at + np.pi, 2 * np.pi) - np.pi, 9)
    apart = np.abs(np.sort(at, axis=0)[:4] - roots)
    plain = np.minimum(roots[2] - roots[1], np.minimum(roots[3] - roots[2], 6.28 + roots[0] - roots[3])) > 0.05
    assert (number + found.double.sum(0))[plain].tolist() == [4] * plain.sum()
    assert (number[plain] == np.where(gap[plain] > 0, 4, 3)).all()
    assert apart[:, plain & (gap > 0)].max() < 1e-8
    c[0] += 10 * np.abs(c).sum(0)
    assert not np.isfinite(spatial.trigonometric(c, np.zeros(300)).at).any()


class Blob(Kind):
    """A surface of degree 4 that is no torus."""

    name = "blob"

    def point(self, u: Any, w: Any, p: Any) -> Any:
        r = (np.cos(w) ** 4 * (np.cos(u) ** 4 + np.sin(u) ** 4) + np.sin(w) ** 4) ** -0.25
        return r * np.cos(w) * np.cos(u), r * np.cos(w) * np.sin(u), r * np.sin(w)

    def implicit(self, x: Any, p: Any) -> Any:
        return (x[0] ** 4 + x[1] ** 4 + x[2] ** 4 - 1,)

    def locate(self, x: Any, p: Any) -> Any:
        return np.arctan2(x[1], x[0]), np.arctan2(x[2], np.hypot(x[0], x[1]))


class Egg(Blob):
    """An ellipsoid by its own name: a quadric that does not say so."""

    name = "egg"

    def point(self, u: Any, w: Any, p: Any) -> Any:
        return 1.2 * np.cos(w) * np.cos(u), np.cos(w) * np.sin(u), 0.8 * np.sin(w)

    def implicit(self, x: Any, p: Any) -> Any:
        return ((x[0] / 1.2) ** 2 + x[1] ** 2 + (x[2] / 0.8) ** 2 - 1,)


def body_on(spatial: SimpleNamespace, second: Any, third: Any) -> Any:
    """A body whose first point is at the origin when its driver is 0."""
    body = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.3, 0.9, 0.0)]
    first = spatial.Guides("line", (), (0, 0, 0), (3.0, 1.0, 0.0, 0.5))
    return spatial.Mechanisms(body, [first, second, third], [(0, "u")])


@pytest.mark.slow
def test_what_has_no_closed_form_says_why_and_is_sought_from_random_starts(spatial: SimpleNamespace) -> None:
    circle = spatial.Guides("circle", [0.8], (0.7, 0.1, 0.4), (1.0, 0.4, 0.1, 0.2))
    sphere = spatial.Guides("sphere", [0.6], (0.5, 0.7, 0.4))
    cases = {
        "third point": body_on(spatial, circle, spatial.Guides(Blob(), (), (1.0, 0.7, 0.4))),
        "second point": body_on(spatial, spatial.Guides("helix", [0.8, 0.0048]), sphere),
        "no point": spatial.Mechanisms(
            [(0, 0, 0), (1, 0, 0), (0.3, 0.9, 0)], [spatial.Guides("line"), circle, sphere], [(2, "u")]
        ),
    }
    for word, m in cases.items():
        found = spatial.assemblies(m, [0.0], most=256)
        assert not found.complete[0]
        assert word in str(found.reason[0])
        assert found.starts[0] >= 128
        assert found.count[0] > 0 or word == "second point"  # a thread so fine that no start comes to its end
    own = spatial.assemblies(body_on(spatial, circle, spatial.Guides(Egg(), (), (1.0, 0.7, 0.4))), [0.0])
    assert own.complete[0]
    assert own.count[0] == spatial.assemblies(
        body_on(spatial, circle, spatial.Guides(Egg(), (), (1.0, 0.7, 0.4))), [0.0], method="multi-start"
    ).count[0]  # fmt: skip


def test_a_body_that_moves_while_its_drivers_stand_still_is_named(spatial: SimpleNamespace) -> None:
    """The second point's circle is about the first point, at the body's distance."""
    m = body_on(spatial, spatial.Guides("circle", [1.0]), spatial.Guides("sphere", [0.6], (0.5, 0.7, 0.4)))
    found = spatial.assemblies(m, [0.0])
    assert not found.complete[0]
    assert "stand still" in str(found.reason[0])
    ring = body_on(
        spatial, spatial.Guides("circle", [0.8], (1.0, 0.8, 0.0)), spatial.Guides("sphere", [np.hypot(0.3, 0.9)])
    )
    assert "stand still" in str(spatial.assemblies(ring, [0.0]).reason[0])


def test_a_method_that_is_not_there_is_refused(spatial: SimpleNamespace, golden_cases: Cases) -> None:
    with pytest.raises(InvalidRequest, match="not 'homotopy'"):
        spatial.assemblies(golden_cases[0].mechanism, golden_cases[0].q[:, 0], method="homotopy")
