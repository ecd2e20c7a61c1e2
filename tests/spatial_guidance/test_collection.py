"""The collection: verified guides, measured again by another solver, classified, drawn, and loaded only when needed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib import import_module
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares, minimize
from sqlalchemy import select

import catalogue
from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.collections.goal import Goal
from catalogue.collections.results import CollectionCandidate
from catalogue.guides.codes import code_of, record, text_of
from catalogue.plugin.registry import Registry
from catalogue.populate.collect import collect
from catalogue.store import SpecimenRow
from catalogue.testing import CollectionContract
from tests.precision import SWITCHED

BESIDE = pytest.mark.skipif(SWITCHED, reason="what another process computes, with its own long double, is compared")
COLLECTION = Registry().collection("spatial-guidance")


class TestContract(CollectionContract):
    """Of collections."""

    collection = COLLECTION
    count = 4


@pytest.fixture(scope="module")
def modules() -> SimpleNamespace:
    """Return modules of the plugin."""
    package = COLLECTION.draw.__module__.partition(".")[0]
    names = ("draw", "measures", "minimum_zone", "picture", "plain_data", "refine", "straightest_point")
    return SimpleNamespace(**{name: import_module(f"{package}.collection.{name}") for name in names})


@pytest.fixture(scope="module")
def cat(once: Callable[..., Path]) -> Iterator[Catalogue]:
    """Return a catalogue with small blocks of each class, built once for all workers."""

    def build(path: Path) -> None:
        with catalogue.open(path, build=False) as opened:
            collection = opened.registry.collection("spatial-guidance")
            version = opened.registry.provider(collection.name).version
            collect(opened.database, replace(collection, block=32), version, count=6)

    with catalogue.open(once("spatial.db", build), build=False) as opened:
        yield opened


# -- by another route -------------------------------------------------------------------------------------------------
def rotation(q: Any) -> Any:
    s, x, y, z = np.asarray(q) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - s * z), 2 * (x * z + s * y)],
            [2 * (x * y + s * z), 1 - 2 * (x * x + z * z), 2 * (y * z - s * x)],
            [2 * (x * z - s * y), 2 * (y * z + s * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def on_guide(guide: dict[str, Any], u: float, w: float) -> Any:
    """Return the point of a guide at (u, w), written out from Table I and the definitions of the curves."""
    s, c, d = guide["shape"], np.cos(u), np.sin(u)
    curves: dict[str, Callable[[], Any]] = {
        "cylinder": lambda: (s["R"] * c, s["R"] * d, w),
        "cone": lambda: (w * c, w * d, w / np.tan(s["delta"])),
        "hyperboloid:sinh": lambda: (s["m"] * np.cosh(w) * c, s["m"] * np.cosh(w) * d, s["n"] * np.sinh(w)),
        "torus": lambda: ((s["p"] + s["r"] * np.sin(w)) * c, (s["p"] + s["r"] * np.sin(w)) * d, s["r"] * np.cos(w)),
        "sphere": lambda: (-s["R"] * c * np.cos(w), s["R"] * np.sin(w), s["R"] * d * np.cos(w)),
        "plane": lambda: (w * c, w * d, 0.0),
        "circle": lambda: (s["R"] * c, s["R"] * d, 0.0),
        "helix": lambda: (s["R"] * c, s["R"] * d, s["h"] * u),
        "line": lambda: (0.0, 0.0, u),
    }
    return np.array(guide["origin"]) + rotation(guide["quaternion"]) @ curves[guide["kind"]]()


def independent_path(p: dict[str, Any], count: int) -> Any:
    """Return the path of the guided point, shape (count, 3): closure equations for quaternion, translation and all
    coordinates, solved by scipy from one position to the next."""
    body, first, last = np.array(p["body"]), np.array(p["path"][0]), np.array(p["path"][1])
    driven = {(i, "uw".index(k)): j for j, (i, k) in enumerate(p["drivers"])}
    start = np.array([[np.nan if v is None else v for v in row] for row in p["start"]], float)
    free = [(i, a) for i in range(len(body)) for a in (0, 1) if (i, a) not in driven and not np.isnan(start[i, a])]
    size = np.linalg.norm(body[:, None] - body, axis=2).max()

    def placed(x: Any, q: Any) -> Any:
        coordinates = np.zeros((len(body), 2))
        for (i, a), value in zip(free, x[7:], strict=True):
            coordinates[i, a] = value
        for (i, a), j in driven.items():
            coordinates[i, a] = q[j]
        return np.array([on_guide(g, u, w) for g, (u, w) in zip(p["guides"], coordinates, strict=True)])

    def closure(x: Any, q: Any) -> Any:
        gaps = (placed(x, q) - x[4:7] - body @ rotation(x[:4]).T) / size
        return np.append(gaps.ravel(), x[:4] @ x[:4] - 1)

    guess = np.concatenate([np.zeros(7), [start[i, a] for i, a in free]])
    world = placed(guess, first)
    to, of = world - world.mean(0), body - body.mean(0)
    left, _, right = np.linalg.svd(to.T @ of)
    turn = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    w = np.sqrt(max(1 + np.trace(turn), 0)) / 2
    if w < 0.05:  # nearly half a turn: the axis is the eigenvector
        value, vector = np.linalg.eigh(turn + turn.T)
        guess[1:4] = vector[:, value.argmax()]
    else:
        guess[:4] = [
            w,
            *(np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 4 / w),
        ]
    guess[4:7] = world.mean(0) - turn @ body.mean(0)
    x, before = guess, guess
    points: list[Any] = []
    for share in np.linspace(0, 1, count):
        q = first + share * (last - first)
        ahead = x + (x - before) if points else x
        for _ in range(3):
            found = least_squares(closure, ahead, args=(q,), method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
            ahead = found.x
        assert np.abs(found.fun).max() < 1e-9
        before, x = x if points else found.x, found.x
        points.append(x[4:7] + rotation(x[:4]) @ np.array(p["point"]))
    return np.array(points)


def cylinder(x: Any, stroke: float) -> float:
    """Return the radius of the narrowest cylinder about a path that runs along +x, by quadratic programmes."""

    def distances(v: Any) -> Any:
        along = np.array([1, v[2], v[3]]) / np.sqrt(1 + v[2] ** 2 + v[3] ** 2)
        arm = x / stroke - [0, v[0], v[1]]
        return np.sqrt(((arm - np.outer(arm @ along, along)) ** 2).sum(1))

    return stroke * _least(distances, 4)


def torus(x: Any, stroke: float, radius: float, free: bool = True) -> float:
    """Return the radius of the narrowest torus about an arc from (0, 0, 0) to (stroke, 0, 0) in the plane z = 0."""
    r = radius / stroke

    def distances(v: Any) -> Any:
        centre = np.array([0.5, -np.sqrt(r**2 - 0.25), 0]) + v[:3]
        normal = np.array([v[3], v[4], 1]) / np.sqrt(1 + v[3] ** 2 + v[4] ** 2)
        d = x / stroke - centre
        h = d @ normal
        return np.hypot(np.sqrt(np.maximum((d * d).sum(1) - h * h, 0)) - r - (v[5] if free else 0), h)

    return stroke * _least(distances, 6 if free else 5)


def _least(distances: Any, n: int) -> float:
    """Return the least maximum: a bound t is made small, in units of the first one, under the distances squared."""
    unit = distances(np.zeros(n)).max()
    bound: Any = {"type": "ineq", "fun": lambda v: v[-1] ** 2 - (distances(unit * v[:-1]) / unit) ** 2}

    def last(v: Any) -> Any:
        return v[-1]

    found = minimize(last, np.append(np.zeros(n), 1.0), method="SLSQP", constraints=[bound],
                     options={"ftol": 1e-10, "maxiter": 300})  # fmt: skip
    return float(distances(unit * found.x[:-1]).max())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("family", "request_"),
    [*zip(COLLECTION.families, 3 * [StraightLine(20, 0.4), CircularArc(20, 0.4)], strict=True)],
    ids=[*COLLECTION.families],
)
def test_deviations_are_those_of_an_independent_solution(cat: Catalogue, family: str, request_: Any) -> None:
    found = cat.find_in("spatial-guidance", request_, families=[family], rank_by="size", limit=1)
    assert len(found) == 1
    for piece in found:
        x = independent_path(dict(piece.parameters), 81)
        assert np.abs(x[0]).max() < 2 * piece.deviation
        assert np.abs(x[-1] - [20, 0, 0]).max() < 2 * piece.deviation
        if piece.radius is None:
            again = cylinder(x, 20)
        else:
            assert x[40, 1] > 0  # it bulges to +y
            again = torus(x, 20, piece.radius)
        assert again == pytest.approx(piece.deviation, rel=5e-3)


@pytest.mark.slow
def test_a_given_radius_is_followed(cat: Catalogue) -> None:
    for piece in cat.find_in("spatial-guidance", CircularArc(20, 0.5, 15), limit=2):
        assert piece.radius == 15
        x = independent_path(dict(piece.parameters), 101)
        assert torus(x, 20, 15, free=False) == pytest.approx(piece.deviation, rel=5e-3)
        assert piece.deviation <= 0.5
    assert cat.find_in("spatial-guidance", CircularArc(20, 0.5, 15), limit=1)


@pytest.mark.slow
# -- fits -------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("sweep", [0.3, 1.0, 2.2])
def test_fits_do_not_depend_on_where_a_path_lies(modules: SimpleNamespace, sweep: float) -> None:
    rng = np.random.default_rng(8)
    t = np.cos(np.pi * np.arange(161) / 160)[::-1]
    wave = 0.004 * sweep * np.array([np.polynomial.chebyshev.chebval(t, rng.normal(size=7)) for _ in range(2)])
    at = t * sweep / 2
    arc = np.stack([(1 + wave[0]) * np.sin(at), (1 + wave[0]) * np.cos(at), wave[1]], axis=1)
    turn = rotation(rng.normal(size=4))
    both = np.stack([arc, 70 * arc @ turn.T + [3, 4, 5]])
    for fit in (modules.minimum_zone.circle(both), modules.minimum_zone.line(both)):
        assert fit.deviation[1] == pytest.approx(70 * fit.deviation[0], rel=2e-3)
        assert (fit.bound <= fit.deviation * (1 + 1e-6)).all()
        np.testing.assert_allclose(
            fit.axes @ np.swapaxes(fit.axes, 1, 2), np.broadcast_to(np.eye(3), (2, 3, 3)), atol=1e-12
        )
    fit = modules.minimum_zone.circle(both)
    assert fit.bound[0] > 0.99 * fit.deviation[0]
    wide = modules.minimum_zone.circle(both, 1.05 * fit.radius)
    np.testing.assert_allclose(wide.radius, 1.05 * fit.radius)
    assert (wide.deviation >= fit.deviation * (1 - 1e-3)).all()


@pytest.mark.slow
def test_hardly_ever_is_a_circle_nearer_than_the_one_that_is_found(modules: SimpleNamespace) -> None:
    """By the bound of duality, of rough arcs read at even steps as those that are drawn."""
    rng, t = np.random.default_rng(9), np.linspace(-1, 1, 49)
    wave = np.polynomial.chebyshev.chebval(t, 10 ** rng.uniform(-3, -2, 200) * rng.normal(size=(7, 2, 200)))
    angle = np.outer(rng.uniform(0.15, 1, 200), t)
    out = 1 + wave[0]
    arcs = np.stack([out * np.sin(angle), out * np.cos(angle), wave[1]], axis=2)
    for fit in (modules.minimum_zone.circle(arcs), modules.minimum_zone.circle(arcs, np.ones(200))):
        assert (fit.bound <= fit.deviation * (1 + 1e-6)).all()
        assert (fit.bound > 0.99 * fit.deviation).mean() > 0.9


def test_exact_lines_and_circles_are_exact(modules: SimpleNamespace) -> None:
    s = np.linspace(0, 1, 65)
    straight = 3.0 + np.outer(s, [1.0, 2.0, -2.0])
    assert modules.minimum_zone.line(straight[None]).deviation[0] < 1e-14
    assert modules.minimum_zone.line(straight[None]).stroke[0] == pytest.approx(3, rel=1e-14)
    turn = rotation([1, 2, 3, 4])
    round_ = np.stack([np.cos(s), np.sin(s), 0 * s], axis=1) @ turn.T * 5 + 7
    fit = modules.minimum_zone.circle(round_[None])
    assert fit.deviation[0] < 1e-13
    assert fit.radius[0] == pytest.approx(5, rel=1e-12)


# -- the straightest point --------------------------------------------------------------------------------------------
def about_z(angle: Any) -> Any:
    """Return matrices (..., 3, 3) of rotations about the z axis."""
    c, s, nought = np.cos(angle), np.sin(angle), 0 * angle
    return np.moveaxis(np.array([[c, -s, nought], [s, c, nought], [nought, nought, nought + 1]]), (0, 1), (-2, -1))


def running_straight(modules: SimpleNamespace, at: Any, way: Any, size: float) -> tuple[Any, Any]:
    """Return poses of bodies that turn to and fro about z while one point of each, `at` (n, 3), runs straight on, in
    directions `way` (n,) of the plane z = 0."""
    along = np.stack([way.real, way.imag, 0 * way.real], axis=1)
    share = np.linspace(-1, 1, modules.straightest_point.POINT_SEARCH.whole + 1)
    turn = np.repeat(about_z(0.4 * np.sin(3 * share))[None], len(way), axis=0)
    return turn, size * share[:, None] * along[:, None] - np.einsum("nkij,nj->nki", turn, at)


@pytest.mark.slow
def test_a_point_that_is_found_is_as_straight_as_is_said_and_no_other_of_a_grid_is_straighter(
    modules: SimpleNamespace,
) -> None:
    sought, rng = modules.straightest_point, np.random.default_rng(5)
    n, size, share = 3, 2.0, np.linspace(-1, 1, modules.straightest_point.POINT_SEARCH.whole + 1)
    turn = np.array([[rotation([1, *(s * axis)]) for s in share] for axis in rng.normal(size=(n, 3))])
    shift = np.array([np.polynomial.polynomial.polyval(share, c).T for c in rng.normal(size=(n, 4, 3))])
    none, flat = np.full((n, 1, 3), np.nan), np.zeros(n, bool)
    grid = size * np.array(list(product((-1, -0.5, 0, 0.5, 1), repeat=3)))
    for kind, gap in sought.GAPS.items():
        found = sought.best(turn, shift, kind, np.zeros((n, 3)), np.full(n, size), none, flat)
        for (length, every), (point, first, value) in zip(sought.WINDOWS, found, strict=True):
            for k in range(n):

                def off(
                    z: Any, begin: int, k: int = k, step: int = length // sought.POINT_SEARCH.part, gap: Any = gap
                ) -> float:
                    nodes = begin + step * np.arange(sought.POINT_SEARCH.part + 1)
                    x = shift[k, nodes] + turn[k, nodes] @ z
                    return (
                        float(gap(x))
                        if np.linalg.norm(x[-1] - x[0]) > sought.POINT_SEARCH.least_stroke * size
                        else np.inf
                    )

                assert value[k] == pytest.approx(off(point[k], first[k]), rel=1e-9)
                tried = [off(z, f) for z in grid for f in range(0, sought.POINT_SEARCH.whole - length + 1, every)]
                assert value[k] <= min(tried) * (1 + 1e-12)


def test_a_point_that_is_found_keeps_clear_of_those_that_guides_lead(modules: SimpleNamespace) -> None:
    """The straightest stands beside the one that is led along a line; above and below it, where all do as it does."""
    sought, size, way = modules.straightest_point, 3.0, np.exp(0.5j * np.pi * np.arange(4))
    led = np.tile([0.3, -0.2, 0.1], (4, 1))
    turn, shift = running_straight(modules, led, way, size)
    for flat in (True, False):
        found = sought.best(turn, shift, "line", led + 0.01, np.full(4, size), led[:, None], np.full(4, flat))
        for point, _, value in found:
            away = np.linalg.norm((point - led)[:, : 2 if flat else 3], axis=1)
            assert np.isfinite(value).all()
            assert (away >= sought.POINT_SEARCH.clearance * size * (1 - 1e-12)).all()
            if flat:
                assert away.max() < 1.02 * sought.POINT_SEARCH.clearance * size
            else:
                assert value.max() < 1e-6


def test_a_point_that_is_found_is_not_far_from_the_body(modules: SimpleNamespace) -> None:
    """The straightest is farther off than is looked."""
    sought, size, way = modules.straightest_point, 3.0, np.exp(0.25j * np.pi * np.arange(8))
    at = 3 * size * np.stack([way.real, way.imag, 0 * way.real], axis=1)
    turn, shift = running_straight(modules, at, way, size)
    none, flat = np.full((8, 1, 3), np.nan), np.ones(8, bool)
    for point, _, _ in sought.best(turn, shift, "line", np.zeros((8, 3)), np.full(8, size), none, flat):
        away = np.linalg.norm(point, axis=1)
        assert (away <= sought.POINT_SEARCH.farthest * size).all()
        assert away.max() > 0.9 * sought.POINT_SEARCH.farthest * size


# -- classes ----------------------------------------------------------------------------------------------------------
def special(parameters: dict[str, Any]) -> set[str]:
    return set(COLLECTION.classify(parameters).special)


@pytest.mark.slow
def test_well_known_mechanisms_are_named(cat: Catalogue) -> None:
    row = SpecimenRow
    stored = cat.database.read(select(row.family, row.configuration, row.parameters))
    seen: dict[str, set[str]] = {}
    for family, configuration, text in zip(*stored.values(), strict=True):
        for name in special(json.loads(text)):
            seen.setdefault(name, set()).add(f"{family} {configuration}")
    assert seen["5-SS"] == {"I sphere sphere sphere sphere sphere"}
    assert seen["Altmann"] == {"III circle circle cylinder"}
    assert seen["RS-3SS"] == {"II circle sphere sphere sphere"}
    assert {name.partition(" ")[0] for name in seen["RSSR"]} == {"III"}
    assert "III circle circle plane" in seen["planar"]
    assert "III circle circle sphere" in seen["spherical"]


@pytest.mark.slow
def test_planar_and_spherical_ones_move_like_that(modules: SimpleNamespace) -> None:
    """Planar: all axes of rotation are parallel.  Spherical: one point of the body stands still."""
    rng = np.random.default_rng(4)
    seen = {"planar": 0, "spherical": 0}
    for family, count in (("III", 60), ("I", 40)):
        drawn = [dict(s.parameters) for s in COLLECTION.draw(family, rng, count)]
        moved = modules.measures.run(modules.plain_data.strokes(drawn))
        for p, turn, points in zip(drawn, moved.rotation, moved.points, strict=True):
            relative = np.einsum("sij,kj->sik", turn, turn[0])
            axes = np.array([[r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]] for r in relative[1:]])
            parallel = np.linalg.svd(axes, compute_uv=False)[1] < 1e-9 * np.linalg.norm(axes)
            body, names = np.array(p["body"]), special(p)
            rows = np.concatenate([np.concatenate([r, -np.eye(3)], axis=1) for r in turn])
            right = -np.concatenate([q[0] - r @ body[0] for q, r in zip(points, turn, strict=True)])
            fixed, *_ = np.linalg.lstsq(rows, right, rcond=None)
            stands = np.abs(rows @ fixed - right).max() < 1e-8 * np.ptp(body)
            assert ("planar" in names) == parallel, names
            assert ("spherical" in names) == (stands and not parallel), names
            for name in seen:
                seen[name] += name in names
    assert seen["planar"] > 3
    assert seen["spherical"] > 10


@pytest.mark.slow
@pytest.mark.parametrize("family", ["II", "V"])
def test_few_mechanisms_guide_many_points(family: str) -> None:
    drawn = COLLECTION.draw(family, np.random.default_rng(1), 2)
    assert len(drawn) >= 2
    for s in drawn:
        assert s.family == family
        assert 0 < s.deviation <= 0.05


@pytest.mark.slow
def test_series_are_drawn_as_declared(cat: Catalogue) -> None:
    row = SpecimenRow
    drawn = cat.database.read(select(row.family, row.series).distinct())
    series = set(zip(drawn["family"], drawn["series"], strict=True))
    assert series == {(family, code) for family, codes in COLLECTION.families.items() for code in codes}


# -- drawing, loading -------------------------------------------------------------------------------------------------
@pytest.mark.slow
@pytest.mark.parametrize("family", ["I", "III", "VI"])
def test_a_drawing_shows_guides_body_and_path(cat: Catalogue, family: str, tmp_path: Path) -> None:
    piece = cat.find_in("spatial-guidance", CircularArc(5, 0.1), families=[family], limit=1)[0]
    figure = piece.plot(tmp_path / "piece.svg")
    text = (tmp_path / "piece.svg").read_text("utf-8")
    assert text.startswith("<?xml")
    piece.plot(tmp_path / "again.svg")
    assert (tmp_path / "again.svg").read_text("utf-8") == text
    (axes,) = figure.axes
    surfaces = [c for c in axes.collections if type(c).__name__ == "Poly3DCollection"]
    curves = sum(name in ("circle", "helix", "line") for name in piece.configuration.split())
    assert len(surfaces) == len(piece.configuration.split()) - curves
    assert all(s.get_alpha() < 0.5 for s in surfaces)


@pytest.mark.parametrize("family", ["I", "III", "V"])
def test_mechanisms_are_drawn_assembled(modules: SimpleNamespace, family: str) -> None:
    """Each point of a body is where its guide has it, by the definitions of the guides."""
    m, at, _ = modules.draw.mechanisms(family, np.random.default_rng(1), 120)
    for i, guides in enumerate(m.guides):
        for kind, where, _ in guides.each():
            for k in where.tolist():
                one = {
                    "kind": kind.name, "origin": guides.origin[k], "quaternion": guides.quaternion[k],
                    "shape": dict(zip(kind.parameters, guides.parameters[k].tolist(), strict=False)),
                }  # fmt: skip
                np.testing.assert_allclose(on_guide(one, *at[k, i]), m.body[k, i], atol=1e-12)


@pytest.mark.slow
def test_what_is_larger_over_its_stroke_than_is_stored_is_left_out(
    modules: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    every = COLLECTION.draw("III", np.random.default_rng(3), 4)
    sizes = sorted(one.metrics["size"] for one in every)
    most = sizes[len(sizes) // 2]
    monkeypatch.setattr(modules.draw, "DRAWING", modules.draw.DRAWING._replace(size=most))
    fewer = COLLECTION.draw("III", np.random.default_rng(3), 4)
    assert sorted(one.metrics["size"] for one in fewer) == [size for size in sizes if size <= most]


@pytest.mark.slow
@pytest.mark.parametrize("family", ["I", "III", "V"])
def test_a_drawing_is_seen_from_where_stroke_and_surfaces_are_seen_best(modules: SimpleNamespace, family: str) -> None:
    """By differences along the surfaces: the worst of how far each faces who looks, and how long the stroke is seen."""
    for specimen in COLLECTION.draw(family, np.random.default_rng(3), 2)[:5]:
        p = dict(specimen.parameters)
        start = np.array([[np.nan if v is None else v for v in row] for row in p["start"]], float)
        normals = []
        for guide, (u, w) in zip(p["guides"], start, strict=True):
            if guide["kind"] not in ("circle", "helix", "line"):
                one = on_guide(guide, u + 1e-6, w) - on_guide(guide, u - 1e-6, w)
                other = on_guide(guide, u, w + 1e-6) - on_guide(guide, u, w - 1e-6)
                normals.append(np.cross(one, other) / np.linalg.norm(np.cross(one, other)))

        def worst(azimuth: float, normals: list[Any] = normals) -> float:
            at, tip = np.radians([azimuth, modules.picture.ELEVATION])
            eye = np.array([np.cos(tip) * np.cos(at), np.cos(tip) * np.sin(at), np.sin(tip)])
            return float(min([np.linalg.norm(np.cross((1, 0, 0), eye)) - 0.4, *(abs(n @ eye) for n in normals)]))

        chosen = modules.picture._azimuth(modules.plain_data.strokes([p]), start)
        assert worst(chosen) == pytest.approx(max(map(worst, modules.picture.AZIMUTHS)), abs=1e-6)


@pytest.mark.slow
def test_curves_are_drawn_as_far_as_points_of_the_body_run_on_them(modules: SimpleNamespace) -> None:
    drawn = COLLECTION.draw("III", np.random.default_rng(3), 4)
    s = max(drawn, key=lambda one: one.metrics["rotation"])
    (m,) = COLLECTION.measure([s.parameters], StraightLine(100, 10) if s.kind == "line" else CircularArc(100, 10))
    where = s.family, s.series, s.configuration, ()
    piece = CollectionCandidate(1, COLLECTION, *where, 100.0, m.deviation, m.radius, dict(m.metrics), m.parameters)
    (axes,) = piece.plot().axes
    curves = [np.transpose(line.get_data_3d()) for line in axes.lines if line.get_color() == modules.picture.CURVE]
    kinds = [guide["kind"] for guide in m.parameters["guides"]]
    run = [i for i, kind in enumerate(kinds) if kind in ("circle", "helix", "line")]
    assert len(curves) == len(run) == 2
    points = modules.measures.run(modules.plain_data.strokes([dict(m.parameters)])).points[0]
    for curve, i in zip(curves, run, strict=True):
        step = np.linalg.norm(np.diff(curve, axis=0), axis=1).max()
        off = np.linalg.norm(points[:, i, None] - curve, axis=2).min(1)
        assert off.max() <= 0.51 * step


@pytest.mark.parametrize("arc", [False, True])
def test_the_nominal_that_is_drawn_runs_along_the_path(modules: SimpleNamespace, arc: bool) -> None:
    """Nowhere farther than the deviation, somewhat longer than the path, which is a wave off an oblique line or arc."""
    s, turn, wave = np.linspace(-1, 1, 41), rotation([1, 2, 3, 4]), 1e-2
    bent = (1 + wave * np.cos(9 * s)) * np.exp(0.6j * s) if arc else s + 1j * wave * np.cos(9 * s)
    path = np.stack([bent.real, bent.imag, wave * np.sin(7 * s)], axis=1) @ turn.T + [3, 4, 5]
    drawn: list[Any] = []
    ax = SimpleNamespace(plot=lambda *x, **_: drawn.append(np.transpose(x)))
    fit = getattr(modules.minimum_zone, "circle" if arc else "line")(path[None])
    modules.picture._nominal(ax, fit, path)
    (nominal,) = drawn
    one, along = nominal[:-1], np.diff(nominal, axis=0)
    share = ((path[:, None] - one) * along).sum(2) / (along**2).sum(1)
    foot = one + np.clip(share, 0, 1)[..., None] * along
    sag = (along**2).sum(1).max() / 8
    assert np.linalg.norm(path[:, None] - foot, axis=2).min(1).max() < fit.deviation[0] + sag < 1.5 * wave
    way = path[-1] - path[0]
    assert ((nominal[0] - path[0]) @ way) < 0 < ((nominal[-1] - path[-1]) @ way)


@pytest.mark.slow
@pytest.mark.parametrize("family", ["I", "III", "V"])
@pytest.mark.parametrize("given", [False, True])
def test_the_arc_that_is_drawn_is_the_one_that_the_deviation_is_measured_from(
    modules: SimpleNamespace, family: str, given: bool
) -> None:
    """Of a radius that is free, or 5 % larger: no point of the path is farther from it than the deviation told."""
    s = next(s for s in COLLECTION.draw(family, np.random.default_rng(3), 3) if s.kind == "circle")
    (free,) = COLLECTION.measure([s.parameters], CircularArc(100, 10))
    assert free.radius
    (m,) = COLLECTION.measure([s.parameters], CircularArc(100, 10, 1.05 * free.radius)) if given else (free,)
    where = s.family, s.series, s.configuration, ()
    piece = CollectionCandidate(1, COLLECTION, *where, 100.0, m.deviation, m.radius, dict(m.metrics), m.parameters)
    (axes,) = piece.plot().axes
    (nominal,) = [np.transpose(one.get_data_3d()) for one in axes.lines if one.get_linestyle() == "--"]
    centre, normal, radius = modules.minimum_zone.through(nominal[0], nominal[40], nominal[-1])
    assert radius == pytest.approx(m.radius, rel=1e-9)
    np.testing.assert_allclose(np.linalg.norm(nominal - centre, axis=1), radius, rtol=1e-9)
    path = modules.measures.run(modules.plain_data.strokes([dict(m.parameters)])).path[0] - centre
    height = path @ normal
    off = np.hypot(np.linalg.norm(path - height[:, None] * normal, axis=1) - radius, height)
    assert off.max() == pytest.approx(m.deviation, rel=2e-3)


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return an environment in which a new process imports the catalogue that is tested here."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith("CATALOGUE_")}
    return {
        **kept,
        "PYTHONPATH": str(Path(catalogue.__file__).parents[1]),
        "HOME": str(tmp_path_factory.mktemp("home")),
    }


def imported(code: str, environment: dict[str, str]) -> list[str]:
    """Return the modules that a process has imported when it has run the code."""
    command = [sys.executable, "-c", f"{code}\nimport sys; print(*sys.modules)"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.split()


@pytest.mark.slow
def test_a_planar_request_imports_nothing_of_it(small_db: Path, environment: dict[str, str]) -> None:
    find = "cat.find(catalogue.StraightLine(150, 0.5), limit=1)"
    names = imported(f"import catalogue\nwith catalogue.open({str(small_db)!r}) as cat: {find}", environment)
    assert "catalogue.api" in names
    assert [
        n
        for n in names
        if "plugin" in n or "spatial" in n or n.endswith((".collection", ".collect", ".collected", ".find_in"))
    ] == []


@pytest.mark.slow
def test_plugins_are_loaded_without_it_until_a_collection_is_asked_for(environment: dict[str, str]) -> None:
    loading = "from catalogue.plugin.registry import Registry; registry = Registry(); registry.get('II.xy')"
    names = [n for n in imported(loading, environment) if "spatial" in n]
    assert len(names) == 1  # the package, which is light
    asked = imported(f"{loading}; registry.collections", environment)
    assert f"{names[0]}.collection.measures" in asked
    assert not [n for n in asked if n.startswith("matplotlib")]


@pytest.mark.slow
@BESIDE
def test_the_command_answers(cat: Catalogue, environment: dict[str, str]) -> None:
    command = [sys.executable, "-m", "catalogue", "find", "straight-line", "--stroke", "1", "--deviation", "0.01",
               "--collection", "spatial-guidance", "--where", "range>=0.5", "--limit", "3", "--format", "json",
               "--db", str(cat.database.path)]  # fmt: skip
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=240)
    told = [line for line in done.stderr.splitlines() if not line.endswith(" ...")]  # how far it is
    assert (done.returncode, told) == (0, [])
    rows = json.loads(done.stdout)
    assert len(rows) == 3
    assert all(row.pop("code") for row in rows)
    assert all(row["deviation"] <= 0.01 and row["range"] >= 0.5 for row in rows)
    same = cat.find_in("spatial-guidance", StraightLine(1, 0.01), where={"range": (0.5, None)}, limit=3)
    assert rows == json.loads(same.to_json())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["RS-3SS", "RSSR", "spherical"])
def test_special_ones_are_those_that_are_classified_so_and_the_best_of_them(cat: Catalogue, name: str) -> None:
    request = StraightLine(1, 0.05)
    found = cat.find_in("spatial-guidance", request, special=[name], limit=3)
    rows = cat.database.read(select(SpecimenRow.deviation, SpecimenRow.parameters).where(SpecimenRow.kind == "line"))
    stored = zip(rows["deviation"].tolist(), cat.database.objects(rows["parameters"]), strict=True)
    expected = sorted(d for d, p in stored if name in COLLECTION.classify(p).special)
    assert all(name in piece.special for piece in found)
    assert len(found) == min(3, len(expected))
    np.testing.assert_allclose([piece.deviation for piece in found], expected[:3], rtol=2e-3)


@pytest.mark.slow
def test_an_unknown_special_mechanism_is_refused_with_those_that_there_are(cat: Catalogue) -> None:
    with pytest.raises(catalogue.errors.InvalidRequest, match="there is no special 'RSSS'; there are 5-SS, RS-3SS"):
        cat.find_in("spatial-guidance", StraightLine(1, 0.05), special=["RSSS"])


@pytest.mark.slow
@pytest.mark.parametrize("family", ["I", "V"])
def test_a_guide_is_moved_to_another_radius(family: str) -> None:
    """It deviates less than half as much from an arc a twentieth flatter than its own."""
    s = next(s for s in COLLECTION.draw(family, np.random.default_rng(3), 3) if s.kind == "circle")
    (own,) = COLLECTION.measure([s.parameters], CircularArc(100, 5))
    assert own.radius is not None and COLLECTION.refine is not None  # noqa: PT018
    wish = CircularArc(100, 5, radius=1.05 * own.radius)
    [moved] = COLLECTION.refine([s.parameters], wish, Goal())
    assert moved is not None
    before, after = COLLECTION.measure([s.parameters, moved], wish)
    assert after.deviation < 0.5 * before.deviation


def test_steps_to_an_arc_of_given_radius_do_not_depend_on_where_its_chord_points(modules: SimpleNamespace) -> None:
    rng = np.random.default_rng(8)
    turns = np.linspace(0.0, 0.6, 65)
    circle = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=-1)
    path = circle + 1e-4 * rng.normal(size=(3, 1, 3)) * np.sin(turns * rng.uniform(1, 9, (3, 1)))[..., None]
    wish = CircularArc(1, 1e-2, radius=1.01)
    steps = []
    for axes in (np.eye(3), np.linalg.qr(rng.normal(size=(3, 3)))[0]):
        motion = modules.measures.Motion("", np.eye(3), path, np.ones(3), path @ axes.T, np.zeros(3))
        steps.append(modules.refine._steps(motion, wish))
    np.testing.assert_allclose(steps[1], steps[0], rtol=1e-5, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("wish", [StraightLine(100, 5), CircularArc(100, 2, radius=150)])
def test_refined_answers_deviate_less_and_are_what_they_were(cat: Catalogue, wish: Any) -> None:
    """Verified anew on the finite motion, by whoever asks for it."""
    bounds = {"size": (None, 2500.0), "range": (0.3, None)}
    stored = {c.id: c for c in cat.find_in("spatial-guidance", wish, limit=3, where=bounds)}
    found = cat.find_in("spatial-guidance", wish, limit=3, where=bounds, refine=True)
    assert [c.deviation for c in found] == sorted(c.deviation for c in found)
    assert {c.id for c in found} == set(stored)
    for one in found:
        before = stored[one.id]
        assert one.deviation <= before.deviation
        assert (one.family, one.series) == (before.family, before.series)
        assert set(before.special) <= set(one.special)
        assert one.metrics["size"] <= min(2500.0, 1.051 * before.metrics["size"])
        assert one.metrics["range"] >= 0.3
        [again] = COLLECTION.measure([one.parameters], wish)
        assert again.deviation == pytest.approx(one.deviation, rel=2e-3, abs=1e-9)
    assert sum(c.deviation < 0.9 * stored[c.id].deviation for c in found) >= 1


@pytest.mark.slow
@BESIDE
def test_a_specimen_is_shown_by_its_id(cat: Catalogue, environment: dict[str, str], tmp_path: Path) -> None:
    [one] = cat.find_in("spatial-guidance", StraightLine(100, 5), limit=1)
    show = [sys.executable, "-m", "catalogue", "show", "--db", str(cat.database.path), "--stroke", "100"]
    done = subprocess.run(
        [*show, f"spatial-guidance:{one.id}", "--format", "json", "--plot", str(tmp_path / "one.svg")],
        env=environment, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0
    shown = cat.specimen("spatial-guidance", one.id, 100)
    assert json.loads(done.stdout) == {"code": code_of(text_of(record(shown))), **shown.to_dict()}
    assert shown.series == one.series
    assert shown.deviation == pytest.approx(one.deviation, rel=1e-6)
    assert (tmp_path / "one.svg").stat().st_size > 1000
    done = subprocess.run(
        [*show, "spatial-guidance:99999999"], env=environment, capture_output=True, text=True, timeout=120
    )
    assert (done.returncode, done.stdout) != (0, "")
    assert "has no specimen 99999999" in done.stderr
