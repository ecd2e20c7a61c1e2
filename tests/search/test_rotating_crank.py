"""Cranks of starts made to measure turn fully, and the coupler point runs as straight as any."""

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
from catalogue.search.draws import MAX_LINK, MIN_LINK
from catalogue.search.rotating_crank import starts, straightest

ARC = CircularArc(1, 1e-3, 0.8)


def asked(request: Any, **wanted: Any) -> Problem:
    return Problem.of(request, Constraints(**wanted), Ranking())


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
    found = starts(problem, 200, np.random.default_rng(6))
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


def test_links_and_arms_of_starts_are_in_proportion() -> None:
    problem = asked(StraightLine(1, 0.05), full_rotation=True, max_link=0.3)  # which few of them have
    found = starts(problem, 60, np.random.default_rng(2))
    assert found is not None
    z = found.linkage.points
    links = np.abs(z[:, 1] - z[:, 0]).max(1)
    arms = np.abs(z[:, :, 1] - found.point[:, None]).min(1)
    assert np.maximum(links, arms).max() < MAX_LINK
    assert min(arms.min(), np.abs(z[:, 0, 1] - z[:, 0, 0]).min()) > MIN_LINK


def test_only_straight_paths_are_starts() -> None:
    assert starts(asked(ARC, full_rotation=True), 50, np.random.default_rng(7)) is None
