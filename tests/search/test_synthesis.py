"""Starts made to measure touch the path to second order, measured on their finite motion."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue import CircularArc, StraightLine
from catalogue.kinematics.types import Array
from catalogue.problem.constraints import Constraints
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking
from catalogue.search.synthesis import LONGEST, SHORTEST, allowed, drawn, driven, starts, straightest, summit

LINE, ARC, ANY = StraightLine(1, 1e-3), CircularArc(1, 1e-3, 0.8), CircularArc(1, 1e-3)


def asked(request: Any, **wanted: Any) -> Problem:
    return Problem.of(request, Constraints(**wanted), Ranking())


@pytest.mark.parametrize("family", ["four-bar", "slider-crank"])
@pytest.mark.parametrize(("request_", "radius"), [(LINE, np.inf), (ARC, 0.8)], ids=["line", "arc"])
def test_the_path_has_the_tangent_and_curvature_asked_for(
    naive: SimpleNamespace, request_: Any, radius: float, family: str
) -> None:
    """Central differences of the loop closed in 50 digits, a crank or the coupler turning."""
    problem = asked(request_)
    point = complex(0.5, 0.0 if radius == np.inf else np.sqrt(radius**2) - np.sqrt(radius**2 - 0.25))
    bend = np.full(60, -1 / radius)
    np.testing.assert_allclose(summit(bend), point, atol=1e-15)
    pivots = drawn(problem, family, bend, np.random.default_rng(7))
    pivots = pivots[np.isfinite(pivots).all(axis=(1, 2, 3))][:24]
    assert len(pivots) == 24
    h = naive.mp.mpf(10) ** -8
    with naive.mp.workdps(50):
        for one in pivots:
            loop = naive.Loop(one, point, exact=True)
            low, here, high = (loop.close("crank", t) for t in (-h, 0 * h, h))
            speed, bend = (high - low) / (2 * h), (high - 2 * here + low) / h**2
            turn = speed / abs(speed)
            curvature = float((turn.conjugate() * bend).imag / abs(speed) ** 2) * float(np.sign(float(turn.real)))
            assert float(abs(turn.imag)) < 1e-6
            assert curvature == pytest.approx(-1 / radius, abs=1e-5)


@pytest.mark.parametrize("family", ["four-bar", "slider-crank"])
def test_fixed_pivots_stand_in_the_box_and_links_are_in_proportion(family: str) -> None:
    for name in ("fixed_pivots_in", "pivots_in", "swept_in"):
        problem = asked(LINE, **{name: (0.2, -0.9, 0.7, -0.2)})
        z = drawn(problem, family, np.zeros(400), np.random.default_rng(1))
        z = z[np.isfinite(z).all(axis=(1, 2, 3))]
        assert len(z) > 20
        fixed = z[:, :, 0][z[:, :, 0, 2] == 1]
        assert (fixed[:, 0] >= 0.2).all()
        assert (fixed[:, 0] <= 0.7).all()
        assert (fixed[:, 1] >= -0.9).all()
        assert (fixed[:, 1] <= -0.2).all()
    cranks = np.linalg.norm((z[:, 0, 1] - z[:, 0, 0])[:, :2], axis=1)
    couplers = np.linalg.norm((z[:, 1, 1] - z[:, 0, 1])[:, :2], axis=1)
    for length in (cranks, couplers):
        assert (length > SHORTEST).all()
        assert (length < LONGEST).all()


@pytest.mark.parametrize("request_", [LINE, ARC, ANY], ids=["line", "arc", "any arc"])
def test_some_starts_reach_over_the_stroke(request_: Any) -> None:
    found = starts(asked(request_), "four-bar", 400, np.random.default_rng(2))
    assert found is not None
    assert set(found.linkage.family) == {"four-bar"}
    assert set(found.origin.series) == {"general"}
    assert (found.origin.id == -1).all()
    assert np.isfinite(found.deviation).sum() > 30
    assert np.nanmin(found.deviation) < 0.01


def scatter(poses: Any, z: Any) -> Any:
    """Root mean square distance from the line of total least squares, over that along it, by singular values."""
    shift, turn = poses
    path = shift + turn * z
    path = path - path.mean()
    along, across = np.linalg.svd(np.stack([path.real, path.imag]), compute_uv=False)
    return across / along


def test_the_point_that_runs_along_a_line_is_found() -> None:
    draw = np.random.default_rng(4)
    point: Array = draw.normal(size=6) + 1j * draw.normal(size=6)
    turn = np.exp(1j * np.cumsum(draw.uniform(0.1, 0.4, (9, 6)), axis=0))
    way = np.linspace(-1, 1, 9)[:, None]  # along the x axis, as far from it as one likes
    least, found = straightest(way + 0.3j * np.arange(6) - turn * point, turn)
    np.testing.assert_allclose(found, point, atol=1e-3)
    assert (least < 1e-3).all()


@pytest.mark.slow
def test_no_point_of_the_plane_runs_straighter_than_the_straightest() -> None:
    """Against a thousand others about it, near and far, each measured by itself."""
    draw = np.random.default_rng(5)
    t = np.linspace(-1, 1, 15)[:, None]
    shift: Array = t * (draw.normal(size=12) + 1j * draw.normal(size=12)) + t * t * (1 + 0.3j * draw.normal(size=12))
    turn = np.exp(1j * (t * draw.uniform(0.2, 2, 12) + 0.4 * t * t))
    least, point = straightest(shift, turn)
    for i in range(12):
        poses = shift[:, i], turn[:, i]
        assert scatter(poses, point[i]) == pytest.approx(least[i], rel=1e-3)
        away = 10 ** draw.uniform(-4, 1, 1000) * np.exp(2j * np.pi * draw.random(1000))
        assert min(scatter(poses, point[i] + d) for d in away) > least[i] * (1 - 1e-6)


@pytest.mark.slow
def test_a_crank_turns_fully_and_as_far_as_asked_along_the_path(naive: SimpleNamespace) -> None:
    """The loop closed by circles and lines at 400 angles of the crank, from its pivots alone."""
    problem = asked(StraightLine(1, 0.05), full_rotation=True, min_drive_angle=120.0)
    found = driven(problem, 200, np.random.default_rng(6))
    assert found is not None
    assert set(found.linkage.family) == {"four-bar"}
    good = np.flatnonzero(found.deviation < 0.02)
    assert len(good) > 20
    for i in good[:12]:
        loop = naive.Loop(found.linkage.pivots[i], complex(found.point[i]))
        turn = np.array([complex(loop.close("crank", a)) for a in np.linspace(-np.pi, np.pi, 401)])
        assert np.isfinite(turn).all(), "the crank turns fully"
        assert turn[0] == pytest.approx(turn[-1], abs=1e-9)
        over = turn[np.abs(np.linspace(-np.pi, np.pi, 401)) <= np.radians(70)]
        inside = over[(over.real > 0.02) & (over.real < 0.98)]
        assert np.ptp(inside.imag) < 0.05
        assert found.measures.drive_angle[i] == pytest.approx(120, abs=15)


def test_only_straight_paths_are_driven() -> None:
    assert driven(asked(ARC, full_rotation=True), 50, np.random.default_rng(7)) is None


@pytest.mark.parametrize(
    ("wanted", "made"),
    [
        ({}, ["four-bar", "slider-crank"]),
        ({"pins_only": True}, ["four-bar"]),
        ({"families": ["slider-crank"]}, ["slider-crank"]),
        ({"families": ["slider-crank"], "pins_only": True}, []),
        ({"families": ["elliptic-trammel"]}, []),
        ({"series": ["II.xy"]}, []),
        ({"order": 4}, []),
        ({"slots": True}, []),
    ],
)
def test_only_what_is_asked_for_is_made(wanted: dict[str, Any], made: list[str]) -> None:
    assert allowed(asked(LINE, **wanted)) == made
