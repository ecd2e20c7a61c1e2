from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from catalogue.chains.circuits import circuits
from catalogue.chains.poses import Poses
from catalogue.chains.rates import rates, slopes
from tests.chains.newton import STEP, Loops
from tests.chains.random_chains import KINDS, random_chains

#: Condition number above which a pose is too near to a dead point for eight digits.
CONDITIONED = 1e4


def setting(kind: str) -> tuple[Poses, Loops, Any, Any, Any]:
    """Return poses, equations, unknowns, Jacobian with the drive held, and which poses are well conditioned."""
    chain = random_chains(kind, 50, seed=2)
    found = circuits(chain, 1)
    at = found.poses(found.phase + found.period * np.array([[0.0], [0.13], [0.37], [0.71]]))
    loops = Loops.of(chain)
    q = loops.unknowns(at)
    matrix = loops.jacobian(lambda q: equations(loops, q, at.drive), q)
    good = np.linalg.cond(matrix) < CONDITIONED
    assert good.mean() > 0.7
    return at, loops, q, matrix, good


def equations(loops: Loops, q: Any, drive: Any) -> Any:
    return np.concatenate([loops.closing(q), loops.driven(q, drive)[..., None]], -1)


def solved(matrix: Any, right: Any) -> Any:
    return -np.linalg.solve(matrix, right[..., None])[..., 0]


def of_origin(at: Poses, loops: Loops, move: Any, spin: Any) -> Any:
    """Return velocities of bars as those of the unknowns."""
    found = []
    for bar in loops.moving:
        there = move[bar] - 1j * spin[bar] * at.turn[bar] * at.origin[bar]
        found += [there.real, there.imag, spin[bar]]
    return np.stack(found, -1)


def agree(ours: Any, theirs: Any, good: Any, within: float) -> None:
    scale = 1 + np.abs(theirs).max(-1, keepdims=True)
    assert np.abs((ours - theirs) / scale)[good].max() < within


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_velocities_and_accelerations_solve_the_differentiated_equations(kind: str) -> None:
    at, loops, q, matrix, good = setting(kind)
    found = rates(at)
    by_drive = equations(loops, q + 0j, at.drive + 1j * STEP).imag / STEP
    velocity = solved(matrix, by_drive)
    agree(of_origin(at, loops, found.velocity, found.omega), velocity, good, 1e-8)
    step = 2e-3 / (1 + np.abs(velocity).max(-1, keepdims=True))
    ahead = [equations(loops, q + k * step * velocity, at.drive + k * step[..., 0]) for k in (-2, -1, 0, 1, 2)]
    second = sum(w * f for w, f in zip((-1, 16, -30, 16, -1), ahead, strict=True)) / (12 * step**2)
    ours = []
    for bar in loops.moving:
        twist = 1j * found.alpha[bar] - found.omega[bar] ** 2
        there = found.acceleration[bar] - twist * at.turn[bar] * at.origin[bar]
        ours += [there.real, there.imag, found.alpha[bar]]
    acceleration = solved(matrix, second)
    scale = 1 + np.abs(acceleration).max(-1, keepdims=True) + np.abs(velocity).max(-1, keepdims=True) ** 2
    assert np.abs((np.stack(ours, -1) - acceleration) / scale)[good].max() < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_by_the_reference_pose_are_those_of_a_complex_step(kind: str) -> None:
    at, loops, q, matrix, good = setting(kind)
    found, places = slopes(at), len(at.chain.z)
    for k in range(found.spin.shape[1]):
        moved = Loops(at.chain, loops.x + 0j, loops.y + 0j, loops.angle + 0j)
        if k < 2 * places:
            (moved.x if k % 2 == 0 else moved.y)[k // 2] += 1j * STEP
        else:
            moved.angle[k - 2 * places] += 1j * STEP
        expected = solved(matrix, equations(moved, q + 0j, at.drive + 0j).imag / STEP)
        agree(of_origin(at, loops, found.move[:, k], found.spin[:, k]), expected, good, 1e-8)


def test_derivatives_of_a_joint_are_those_of_its_bar_and_its_own() -> None:
    chain = random_chains("Watt I", 5, seed=8)
    at = circuits(chain, 1).poses(np.full((1, 5), 0.4))
    found, joint = slopes(at), chain.structure.joints.index("F")
    total = found.of_joint(joint)
    # all joints shifted alike shift the joint
    np.testing.assert_allclose(total[: 2 * len(chain.z) : 2].sum(0), 1, atol=1e-9)
    np.testing.assert_allclose(total[1 : 2 * len(chain.z) : 2].sum(0), 1j, atol=1e-9)


@pytest.mark.slow
def test_rates_are_unknown_at_a_dead_point() -> None:
    chain = random_chains("Watt I", 50, seed=9)
    found = circuits(chain, 1)[np.flatnonzero(circuits(chain, 1).kind == 1)]
    at_end = rates(found.poses(np.zeros((1, len(found)))))
    inside = rates(found.poses(np.full((1, len(found)), 0.3)))
    assert np.isfinite(inside.omega).all()
    assert (np.isnan(at_end.omega).any(0) | (np.abs(at_end.omega).max(0) > 1e6)).all()
