"""A sample of the mechanisms in space that the attack leads through their dead points and back."""

from __future__ import annotations

import numpy as np
import pytest

from catalogue.spatial import Travel
from tests.attacks.spatial_folds import attacked, discriminant, drawn


@pytest.mark.slow
@pytest.mark.parametrize(("sort", "n"), [("RSSR", 40), ("RSCR", 10), ("five links", 6)])
def test_no_circuit_changes_its_branch_on_the_way_back(sort: str, n: int) -> None:
    found = attacked(sort, n, 77)
    assert found["mechanisms"] == n
    assert found["dead points"] > n
    assert (found["jumped"], found["other folds"], found["false folds"]) == (0, 0, 0)


@pytest.mark.parametrize(("seed", "number"), [(1, 9), (2, 158)])
def test_a_step_that_ends_on_another_branch_is_refused(seed: int, number: int) -> None:
    """Of the first 800 of the attack these once went over to a branch that nearly meets their own."""
    mechanism, drive, numbers = drawn("RSSR", 800, np.random.default_rng(seed))
    circuit = mechanism.one(number).circuit(drive)
    assert circuit.closed
    assert max(abs(discriminant(numbers, number, v)) for v in circuit.dead_points) < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(("sort", "seed", "number"), [("five links", 6, 7), ("RSCR", 3, 55)])
def test_dead_points_close_together_are_not_stepped_over(sort: str, seed: int, number: int) -> None:
    """The drive turns back twice in a part of the circuit that once was a single step."""
    mechanism, drive, _ = drawn(sort, 100, np.random.default_rng(seed))
    circuit = mechanism.circuits(drive)[number]
    turns = np.diff(np.sign(np.diff(circuit.motion(4001).drive)))
    assert len(circuit.dead_points) == np.count_nonzero(turns) == 4
    if isinstance(drive, Travel):
        drive = Travel("body", drive.point[number], drive.along[number])
    sweep = mechanism.one(number).sweep(drive, np.linspace(min(circuit.limits) - 1, max(circuit.limits) + 1, 101))
    assert sweep.ends == (((pytest.approx(circuit.dead_points[-1]), "dead point"),
                           (pytest.approx(circuit.dead_points[0]), "dead point")),)  # fmt: skip


def test_the_discriminant_vanishes_at_dead_points_and_nowhere_else() -> None:
    """The check itself can fail: a hundredth of a radian beside a dead point it does."""
    mechanism, drive, numbers = drawn("RSSR", 6, np.random.default_rng(3))
    values = [(i, v) for i, c in enumerate(mechanism.circuits(drive)) for v in c.dead_points]
    assert len(values) >= 4
    assert max(abs(discriminant(numbers, i, v)) for i, v in values) < 1e-9
    assert min(abs(discriminant(numbers, i, v + 0.01)) for i, v in values) > 1e-6
