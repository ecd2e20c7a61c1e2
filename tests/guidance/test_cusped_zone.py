"""Points that run to the pole and back, both branches in one strip or annulus: measured by loops closed otherwise."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np
import pytest
from scipy.optimize import linprog, minimize

import catalogue
from catalogue import Candidate, Catalogue, CircularArc, StraightLine
from catalogue.curvature_theory.leading_error import leading_error_of_pairs
from catalogue.draw.poses import poses
from catalogue.errors import InvalidRequest
from catalogue.guidance.coupler_curve import CouplerCurve, coupler_curve
from catalogue.guidance.cusped_zone import cusped_zone
from catalogue.guidance.minimum_zone import grid
from catalogue.guidance.placement import at_stroke
from catalogue.guidance.trace import trace
from catalogue.plugin.registry import Registry
from catalogue.testing.contact import DIGITS, Dyad, pose
from catalogue.testing.sample import even
from tests.precision import LONG

pytestmark = pytest.mark.slow

REGISTRY = Registry()
MEMBERS = [
    ("III.KK", "four-bar general"),
    ("III.KK", "inverted-slider-crank general"),
    ("III.KK", "four-bar fifth order"),
    ("II.y0", "slider-crank general"),
    ("II.yy", "four-bar general"),
]
each = pytest.mark.parametrize(("code", "key"), MEMBERS)


def returning(code: str, key: str, dtype: Any = float) -> tuple[CouplerCurve, Any, Any]:
    """Return guides of a member whose points rest at the pole, their pairs and orders."""
    series = REGISTRY.get(code)
    sample = even(series, series.member(key)).valid
    (guided,) = [g for g in sample.guided if g.label == "[1]"]
    pole = np.zeros(len(sample.linkage), dtype=complex)
    return coupler_curve(sample.linkage, pole, dtype, pole), guided.pairs, guided.order


def branches(naive: SimpleNamespace, pivots: Any, point: complex, reach: Any) -> Any:
    """Return both branches of a path from its rest to where `reach` of the displacement is 1, or None."""
    loop = naive.Loop(pivots, point)
    for drive in loop.drives:
        found = []
        for sign in (1, -1):
            t = sign * np.linspace(0, 6.0, 40001, dtype=np.longdouble)
            with np.errstate(all="ignore"):
                z = loop.close(drive, t)
                far = reach((z - z[0]).astype(complex))
            end = int(np.argmax(~(far < 1)))
            if not far[end] >= 1:
                break
            share = (1 - float(far[end - 1])) / float(far[end] - far[end - 1])
            last = t[end - 1] + share * (t[end] - t[end - 1])
            found.append(loop.close(drive, last * np.sin(np.linspace(0, np.pi / 2, 2001, dtype=np.longdouble))))
        else:
            return np.concatenate([found[0][::-1], found[1]]).astype(complex)
    return None


def at_dead_point(pivots: Any, tangent: complex, length: float) -> Any:
    """Return points of both branches of the path of the origin, its pole, by Newton's method in 100 digits."""
    dyads = [Dyad(dyad) for dyad in pivots]
    ends = []
    with mp.workdps(DIGITS):
        for sign in (1, -1):
            now, s, step, done = None, mp.mpf(0), mp.mpf("0.04") * sign, []
            while abs(step) > 1e-9:  # up to the end of the window, by halves
                at = pose(dyads, s + step, now)
                if (complex(at[0], at[1]) * np.conj(tangent)).real > length:
                    step /= 2
                    continue
                s, now = s + step, at
                done.append(complex(at[0], at[1]))
            ends.append(done)
    return np.array([0j, *ends[0], *ends[1]])


def narrowest_of_radius(path: Any, radius: float, centre: complex) -> float:
    """Return half the width of the narrowest annulus of a mean radius, by linear programs from a first centre on."""
    centre -= (centre - path[len(path) // 2]) * (1 - radius / abs(centre - path[len(path) // 2]))
    for _ in range(6):
        away = path - centre
        normal = away / np.abs(away)
        rows = np.stack([normal.real, normal.imag, np.ones(len(path))], axis=1)
        off = np.abs(away) - radius
        unit = float(np.abs(off).max())
        off = off / unit
        found = linprog(
            [0, 0, 1],
            A_ub=np.concatenate([[-1, -1, -1] * rows, [1, 1, -1] * rows]),
            b_ub=np.concatenate([-off, off]),
            bounds=[(None, None)] * 2 + [(0, None)],
        )
        assert found.x is not None
        step = unit * found.x
        centre += complex(step[0], step[1])
    return float(np.abs(np.abs(path - centre) - radius).max())


def narrowest(path: Any, radius: float, centre: complex) -> float:
    """Return half the width of the narrowest annulus of a path, by the simplex method over its centre."""

    def width(at: Any) -> float:
        away = np.abs(path - complex(*at))
        return float(0.5 * (away.max() - away.min()))

    out = centre - path[len(path) // 2]
    starts = (centre + part * out for part in (-0.2, -0.1, 0.0, 0.1, 0.25))
    how = {"xatol": 1e-12 * radius, "fatol": 1e-14 * radius, "maxiter": 4000}
    simplex: Any = minimize
    return min(float(simplex(width, [z.real, z.imag], method="Nelder-Mead", options=how).fun) for z in starts)


@pytest.mark.parametrize("key", ["four-bar general", "four-bar fifth order"])
def test_deviation_is_that_of_the_narrowest_annulus(key: str) -> None:
    """Of any radius: that of least squares gives up to an eighth more."""
    guides, _, _ = returning("III.KK", key)
    guides = guides[guides.extent.min(0) > 0.3][:12]
    found = trace(guides, 0.6 * np.minimum(guides.extent.min(0), 1.0), circle=True, split=True)
    u, v = guides.path.window(found.low, found.high, np.sin(np.linspace(-np.pi / 2, np.pi / 2, 1201)))
    paths = guides.point + (u + 1j * v) * guides.tangent
    fit, seen = found.fit, 0
    for i in np.flatnonzero(fit.deviation < 0.02 * fit.stroke)[:5]:
        radius, half = 1 / float(fit.curvature[i]), 0.5 * float(fit.stroke[i])
        up = 1j * fit.along[i] * np.copysign(np.sqrt(max(radius**2 - half**2, 0.0)), radius)
        best = narrowest(paths[:, i], abs(radius), fit.start[i] + half * fit.along[i] + up)
        assert fit.deviation[i] == pytest.approx(best, rel=2e-3)
        seen += 1
    assert seen > 2


@pytest.mark.parametrize(("code", "key"), MEMBERS[1:4])
def test_deviation_is_that_of_both_branches(naive: SimpleNamespace, code: str, key: str) -> None:
    guides, pairs, _ = returning(code, key)
    assert guides.cusp.all()
    circle = bool(pairs[0, 0, 2] != 0)
    half = 0.5 * np.minimum(guides.extent.min(0), 0.6)
    found = trace(guides, half, circle=circle, split=True)
    seen = 0
    for i in np.flatnonzero(found.relative < 0.02)[:12]:
        tangent, length = guides.tangent[i], half[i]
        pivots = guides.linkage.pivots[i]
        if circle:
            path = branches(naive, pivots, 0j, lambda z, a=tangent, h=length: (z * np.conj(a)).real / h)
        else:
            path = at_dead_point(pivots, tangent, length)
        if path is None:  # the coupler does not turn all the way
            continue
        seen += 1
        if circle:
            middle = found.fit.start[i] + 1j * found.fit.along[i] / found.fit.curvature[i]
            want = narrowest_of_radius(path, 1 / abs(found.fit.curvature[i]), complex(middle))
        else:
            along, scale = path * np.conj(tangent), np.abs((path * np.conj(tangent)).imag).max()
            want = naive.narrowest_strip(along.real, along.imag / scale, scale)
        assert found.fit.deviation[i] == pytest.approx(want, rel=3e-3), i
    assert seen >= 4


@each
def test_deviation_tends_to_its_law(code: str, key: str) -> None:
    """A u^(5/2) on the branches; beside the u^3 of order 5 the next term fades slowly, like the root of the stroke."""
    guides, pairs, order = returning(code, key, np.longdouble)
    law = leading_error_of_pairs(guides.linkage, pairs, order=order, pole=np.zeros(len(guides), dtype=complex))
    assert law.cusp.all()
    off = []
    for stroke in (1e-2, 1e-4):
        half = np.full(len(guides), stroke, dtype=LONG)
        found = trace(guides, half, circle=bool(pairs[0, 0, 2] != 0), split=True)
        off.append(float(np.nanmedian(np.abs(found.fit.deviation / law.held(stroke) - 1))))
    assert off[1] < (0.02 if order[0] == 4 else 0.5)
    assert off[1] < 0.5 * off[0]


def test_points_that_rest_are_told_from_those_that_run() -> None:
    """Both in one batch, each as if alone."""
    guides, *_ = returning("III.KK", "four-bar general")
    linkage = guides.linkage[np.arange(20)]
    point = np.where(np.arange(20) % 2 == 0, 0, 0.4 + 0.5j)
    mixed = coupler_curve(linkage, point)
    np.testing.assert_array_equal(mixed.cusp, np.arange(20) % 2 == 0)
    half = 0.4 * mixed.extent.min(0)
    found = trace(mixed, half, circle=True, split=False)
    for i in range(20):
        alone = trace(mixed[i : i + 1], half[i : i + 1], circle=True, split=False)
        np.testing.assert_allclose(found.fit.deviation[i], alone.fit.deviation[0], rtol=1e-9)
    for bend in (None, 0.5):  # of the nominal, which is laid about points that run
        together = at_stroke(mixed, 0.3, circle=True, curvature=None if bend is None else np.full(20, bend))
        assert np.isfinite(together.fit.deviation[::2]).any()
        assert np.isfinite(together.fit.deviation[1::2]).any()
        for i in range(20):
            one = None if bend is None else np.full(1, bend)
            alone = at_stroke(mixed[i : i + 1], 0.3, circle=True, curvature=one)
            for name in ("deviation", "stroke", "curvature"):
                many, single = getattr(together.fit, name)[i], getattr(alone.fit, name)[0]
                np.testing.assert_allclose(float(many), float(single), rtol=1e-7, atol=1e-15)


# -- stored and found -------------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def held(once: Callable[..., Path]) -> Iterator[Catalogue]:
    """The catalogue of the series that have such guides."""

    def build(path: Path) -> None:
        with catalogue.open(path, build=False) as opened:
            opened.build(count=1000, series=["III.KK", "II.y0", "II.yy"], processes=2)

    with catalogue.open(once("returning.db", build), build=False) as opened:
        yield opened


def measured(naive: SimpleNamespace, c: Candidate) -> float:
    """Return the deviation of a candidate from an arc of its radius, its path closed another way."""
    assert c.radius is not None
    path = branches(naive, c.pivots, complex(*c.guided), lambda z: np.abs(z) / c.stroke)
    assert path is not None
    depth = np.sqrt(c.radius**2 - 0.25 * c.stroke**2)
    return narrowest_of_radius(path, c.radius, 0.5 * c.stroke - 1j * depth)


@pytest.mark.parametrize("radius", [60.0])
def test_returning_guides_are_found_and_are_what_they_say(
    held: Catalogue, naive: SimpleNamespace, radius: float
) -> None:
    request = CircularArc(30, 0.4, radius)
    found = held.find(request, returns=True, limit=6)
    assert found
    for c in found:
        assert c.deviation <= 0.4
        assert c.radius == radius
        assert c.gap is c.alternations is None  # what is not refined is not certified
        rest = complex(*c.guided)
        assert min(abs(rest), abs(rest - 30)) < 1e-9
        assert measured(naive, c) == pytest.approx(c.deviation, rel=2e-2)
        path = c.path()
        assert np.hypot(*(path[0] - path[-1])) < 4 * c.deviation
        assert path[25, 1] > 0  # it bulges to +y
        drawn = poses(c)  # from its end to the rest and back
        assert np.abs(drawn.guided - rest).min() < 0.02 * c.stroke
        assert abs(drawn.guided[0] - drawn.guided[-1]) < 4 * c.deviation
        assert np.abs(drawn.guided[0] - rest) == pytest.approx(c.stroke, rel=0.02)
        assert "<animateTransform" in (c._repr_html_() or "")
    others = held.find(request, refine=False, limit=50)
    assert len(others) > 10
    assert not {c.id for c in found} & {c.id for c in others}


def test_returning_guides_use_the_tolerance_whatever_it_is(held: Catalogue) -> None:
    """They are as small as it allows, though none is refined."""
    sizes = []
    for deviation in (0.02, 0.05, 0.2):
        found = held.find(CircularArc(30, deviation), returns=True, rank_by="size", per_series=0, distinct=0)
        assert found
        for c in found:
            assert c.deviation <= deviation
        assert found[0].deviation > 0.97 * deviation
        sizes.append(found[0].size)
    assert sizes == sorted(sizes, reverse=True)


def test_returning_guides_meet_constraints(held: Catalogue) -> None:
    request = CircularArc(30, 0.3, 60)
    wishes: list[dict[str, Any]] = [
        {"families": ["inverted-slider-crank"]},
        {"order": 5},
        {"min_transmission": 40.0},
        {"max_size": 100.0},
    ]
    for wish in wishes:
        for c in held.find(request, returns=True, limit=5, **wish):
            assert c.family in wish.get("families", [c.family])
            assert c.order >= wish.get("order", 0)
            assert c.min_transmission >= wish.get("min_transmission", 0)
            assert c.size <= wish.get("max_size", np.inf)
    inside = held.find(request, returns=True, fixed_pivots_in=(-60, -120, 60, 60))
    assert inside
    for c in inside:
        for (x, y, w), _ in c.pivots:
            assert not w or (-60 <= x <= 60 and -120 <= y <= 60)


def test_slots_and_returns_exclude_one_another(held: Catalogue) -> None:
    with pytest.raises(InvalidRequest, match="slots and returns exclude one another"):
        held.find(StraightLine(10, 0.1), slots=True, returns=True)


def test_points_that_return_are_scored_without_an_allowance(held: Catalogue) -> None:
    found = held.find(CircularArc(30, 0.3), returns=True, limit=5)
    assert all(c.allowance is None for c in found)
    for c in found:
        short = [(length - 1.5) / 6 for length in (c.min_link or np.inf, c.max_ground or np.inf)]
        slide = 2 * (1 - (c.travel or 0.0) / 30)  # 1 at half the stroke, 0 at all of it
        shares = [(180 - c.size) / 150, (c.min_transmission - 15) / 45, *short, slide]
        assert c.score == pytest.approx(100 * np.prod(np.clip(shares, 0, 1)) ** (1 / 5), rel=1e-6)
    assert (found[0].score or 0) > 0


def test_allowance_and_play_do_not_go_with_points_that_return(held: Catalogue) -> None:
    wishes: list[dict[str, Any]] = [{"min_allowance": 0.01}, {"play": 0.01}]
    for wish in wishes:
        with pytest.raises(InvalidRequest, match=f"{next(iter(wish))} does not go with returns"):
            held.find(CircularArc(30, 0.3), returns=True, **wish)


def test_a_stored_returning_guide_is_shown_and_drawn(held: Catalogue, tmp_path: Path) -> None:
    c = held.find(CircularArc(30, 0.3, 60), returns=True)[0]
    assert c.id is not None
    guide = held.guide(c.id)
    assert guide.returns
    assert guide.kind == "return-circle"
    laid = guide.at(30)
    assert laid.deviation / 30 <= 1e-2
    laid.plot(tmp_path / "guide.png")
    assert (tmp_path / "guide.png").stat().st_size > 10_000


@pytest.mark.parametrize("circle", [False, True])
@pytest.mark.parametrize("exponent", [-60, 60])
def test_both_branches_are_as_wide_in_any_unit(circle: bool, exponent: int) -> None:
    """In powers of two, which round nothing; of branches that are as far from the cusp as one another."""
    t = grid(32).nodes
    u, v = t**2, 0.01 * t**3 + 0.02 * t**4 - (0.2 * t**4 if circle else 0)
    unit = 2.0**exponent
    here, there = (cusped_zone(s * u[:, None], s * v[:, None], circle, grid(32)) for s in (1.0, unit))
    assert 0.005 < here.deviation[0] < 0.02
    assert there.deviation[0] == pytest.approx(here.deviation[0] * unit, rel=1e-9, abs=0)
