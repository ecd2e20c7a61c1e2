"""Twenty mechanisms of all six classes that were solved in 50 digits: positions, derivatives, assemblies, folds."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

#: Error of a derivative, relative to its largest component: position, velocity, acceleration, third, fourth.
TOLERANCE = (1e-12, 1e-11, 1e-10, 1e-9, 1e-9)
Cases = list[SimpleNamespace]


def off(found: Any, expected: Any) -> float:
    """Return the largest difference, relative to the largest number."""
    return float(np.abs(found - expected).max() / max(np.abs(expected).max(), 1e-300))


def test_every_case_is_there_and_solved(golden_cases: Cases) -> None:
    assert len(golden_cases) == 20
    assert [c.id for c in golden_cases if not c.at.success[0]] == []
    assert {c.mechanism.name for c in golden_cases} == {"I", "II", "III", "IV", "V", "VI"}


def test_points_and_their_derivatives(golden_cases: Cases, tools: SimpleNamespace) -> None:
    for c in golden_cases:
        expected = tools.numbers(c.case["solution"]["points"])
        assert np.abs(c.at.points[0] - expected[:, 0]).max() < TOLERANCE[0] * c.mechanism.diameter[0], c.id
        for k in range(1, 5):
            assert off(c.jets.points[0, :, k], expected[:, k]) < TOLERANCE[k], (c.id, k)


def test_angular_velocity_and_acceleration(golden_cases: Cases, tools: SimpleNamespace) -> None:
    for c in golden_cases:
        for k, name in enumerate(("omega", "alpha", "alpha_dot")):
            assert off(c.jets.spin[0, k], tools.numbers(c.case["solution"][name])) < TOLERANCE[k + 1], (c.id, name)


def test_rotation_and_translation(golden_cases: Cases, spatial: SimpleNamespace, tools: SimpleNamespace) -> None:
    for c in golden_cases:
        expected = c.case["solution"]
        rotation = spatial.matrix(c.at.quaternion.T)[..., 0]
        assert np.abs(rotation - tools.numbers(expected["R"])).max() < 1e-12, c.id
        shift = c.at.translation[0] - tools.numbers(expected["t"])
        assert np.abs(shift).max() < 1e-12 * c.mechanism.diameter[0], c.id


def test_coordinates_up_to_the_double_covers_of_their_charts(
    golden_cases: Cases, spatial: SimpleNamespace, tools: SimpleNamespace
) -> None:
    """A polar plane and a sphere have two (u, w) for a point: u may differ by pi, and w then by its sign or pi - w."""
    for c in golden_cases:
        for i, guide in enumerate(c.case["guides"]):
            kind = spatial.KINDS[tools.kind_name(guide)]
            for axis, name in enumerate("uw"):
                if c.case["solution"][name][i] is not None:
                    expected, found = tools.numbers(c.case["solution"][name][i]), c.jets.coordinates[0, i, axis]
                    unit = c.mechanism.diameter[0] if name in kind.lengths else 1.0
                    value = np.abs if name in kind.lengths else lambda v: np.abs(np.sin(v))
                    assert abs(value(found[0]) - value(expected[0])) < 1e-12 * unit, (c.id, i, name)
                    sign = -1 if name == "w" and np.abs(found[1:] + expected[1:]).max() < unit * 1e-6 else 1
                    error = np.abs(sign * found[1:] - expected[1:]).max()
                    assert error < 1e-10 * max(unit, np.abs(expected[1:]).max()), (c.id, i, name)


def test_reduced_derivatives_are_those_by_the_driver(
    golden_cases: Cases, spatial: SimpleNamespace, tools: SimpleNamespace
) -> None:
    for c in golden_cases:
        if c.mechanism.freedom == 1:
            reduced = spatial.jets(c.mechanism, c.at, [[1.0, 0, 0, 0]]).coordinates[0]
            for i, u in enumerate(c.case["geometric"]["u"]):
                expected = tools.numbers(u)[1:]
                assert np.abs(reduced[i, 0, 1:] - expected).max() < 1e-10 * max(1, np.abs(expected).max()), (c.id, i)


@pytest.mark.slow
def test_all_assemblies_and_no_other(golden_cases: Cases, spatial: SimpleNamespace, tools: SimpleNamespace) -> None:
    for c in golden_cases:
        found = spatial.assemblies(c.mechanism, c.q[:, 0])
        assert found.complete == [c.mechanism.name in ("III", "V") and c.mechanism.drivers[0][0] == 0], c.id
        expected = tools.numbers(c.case["modes"]["points"])
        assert found.count == [len(expected)], c.id
        apart = np.abs(expected[:, None] - found.positions.points).max((2, 3))
        assert apart.min(1).max() < 1e-12 * c.mechanism.diameter[0], c.id
        assert found.certified.all(), c.id
        assert ((found.hits >= 5) | found.complete[found.mechanism]).all(), c.id


@pytest.mark.slow
def test_workspace_of_two_degrees_of_freedom(
    golden_cases: Cases, spatial: SimpleNamespace, tools: SimpleNamespace
) -> None:
    """The number of assemblies on a grid of driver values, every second one of 24 x 24."""
    (c,) = [c for c in golden_cases if "workspace" in c.case]
    expected = tools.numbers(c.case["workspace"]["count"])[::2, ::2].ravel().astype(int)
    angle = np.radians(-180 + 30.0 * np.arange(12))
    grid = np.stack(np.meshgrid(angle, angle, indexing="ij"), axis=-1).reshape(-1, 2)
    found = spatial.assemblies(c.mechanism[np.zeros(len(grid), int)], grid, hits=4, most=896)
    np.testing.assert_array_equal(found.count, expected)


@pytest.mark.slow
@pytest.mark.parametrize("way", [1, -1])
def test_the_motion_ends_at_the_next_fold(golden_cases: Cases, spatial: SimpleNamespace, way: int) -> None:
    met = 0
    for c in golden_cases:
        folds = c.case.get("folds", c.case.get("circuit_through_start"))
        if folds:
            q = c.q[0, 0]
            ended = spatial.follow(c.mechanism, np.linspace(q, q + way * 6.2, 120)[:, None], c.at)
            values = np.array([float(f["q"]) for f in folds["folds"]])
            if ended.reason[0] == "turning point":
                assert np.abs(values - ended.end_drivers[0, 0]).min() < 1e-12, c.id
                met += 1
            else:
                assert ended.reason[0] == "", c.id
                assert c.id == "III-altmann", c.id  # on one of its two circuits without folds
    assert met == 9


@pytest.mark.slow
def test_mixed_batches_give_what_single_mechanisms_give(spatial: SimpleNamespace, golden_cases: Cases) -> None:
    """All golden mechanisms of a class with the same drivers as one batch, with guides of all kinds."""
    by: dict[Any, list[SimpleNamespace]] = {}
    for c in golden_cases:
        by.setdefault((c.mechanism.name, c.mechanism.drivers), []).append(c)
    for (_, drivers), group in by.items():
        guides = []
        for slot in zip(*(c.mechanism.guides for c in group), strict=True):
            shapes = [np.r_[g.parameters[0], np.ones(2)][:2] for g in slot]
            placed = (np.stack([getattr(g, k)[0] for g in slot]) for k in ("origin", "quaternion"))
            guides.append(spatial.Guides([g.kinds[0] for g in slot], np.stack(shapes), *placed))
        batch = spatial.Mechanisms(np.stack([c.mechanism.body[0] for c in group]), guides, drivers)
        start = np.stack([c.at.coordinates[0] * (1 + 1e-4) for c in group])
        at = spatial.solve_positions(batch, np.stack([c.q[:, 0] for c in group]), start)
        rates = np.stack([c.q[:, 1:] for c in group])
        moving = spatial.jets(batch, at, rates)
        for i, c in enumerate(group):
            assert np.abs(at.points[i] - c.at.points[0]).max() < 1e-13 * c.mechanism.diameter[0], c.id
            np.testing.assert_allclose(
                moving.points[i], c.jets.points[0], rtol=1e-9, atol=1e-9 * c.mechanism.diameter[0]
            )
