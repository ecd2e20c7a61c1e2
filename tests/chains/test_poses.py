from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from catalogue.chains.chain import Chain, chain_of
from catalogue.chains.circuits import circuits
from catalogue.chains.poses import poses
from catalogue.chains.structure import Structure
from catalogue.errors import InvalidLinkage
from catalogue.kinematics.circuits import SWING, TURN
from catalogue.kinematics.circuits import circuits as two_dyads
from catalogue.kinematics.linkage import Linkage
from tests.chains.newton import Loops
from tests.chains.random_chains import KINDS, random_chains


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_chains_close_as_newton_closes_them(kind: str) -> None:
    """400 random chains of ten kinds, all round their circuits, dead points included."""
    chain = random_chains(kind, 40, seed=1)
    found = circuits(chain, len(chain.structure.bars) - 1)
    at = found.poses(found.period * np.linspace(0, 1, 17)[:, None])
    loops = Loops.of(chain)
    here = loops.unknowns(at)
    assert np.isfinite(here).all()
    off = (loops.corrected(here) - here) / loops.scale(here.shape[-1])
    assert np.abs(off).max() < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_no_branch_jumps_between_phases(kind: str) -> None:
    """Newton's method leads from each pose to the next; a step too long for it is halved, at most six times."""
    chain = random_chains(kind, 16, seed=3)
    found = circuits(chain, len(chain.structure.bars) - 1)
    share = np.linspace(0, 1, 129)
    low, high = ((found.phase * (found.kind != 2) + found.period * s[:, None]).ravel() for s in (share[:-1], share[1:]))
    column = np.tile(np.arange(len(chain)), len(share) - 1)
    for _ in range(6):
        some = found[column]
        loops = Loops.of(some.chain)
        start, end = (loops.unknowns(some.poses(s[None])) for s in (low, high))
        turned = end[..., 2::3] - start[..., 2::3]
        end[..., 2::3] -= 2 * np.pi * np.round(turned / (2 * np.pi))
        off = np.abs((loops.continued(start, end) - end) / loops.scale(end.shape[-1])).max(-1)[0]
        far = ~(off < 1e-9)
        if not far.any():
            return
        middle = 0.5 * (low + high)[far]
        low, high = np.append(low[far], middle), np.append(middle, high[far])
        column = np.tile(column[far], 2)
    raise AssertionError(f"{far.sum()} steps lead elsewhere")


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_the_drive_is_where_it_is_asked_for(kind: str) -> None:
    chain = random_chains(kind, 20, seed=4)
    found = circuits(chain, 1)
    s = found.phase + found.period * np.array([[0.0], [0.2], [0.7]])
    loops = Loops.of(chain)
    at = found.poses(s)
    assert np.abs(loops.driven(loops.unknowns(at), at.drive)).max() < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_circuit_passes_the_given_pose(kind: str) -> None:
    chain = random_chains(kind, 20, seed=5)
    at = circuits(chain, 1)
    there = at.poses(at.phase[None])
    for joint in range(len(chain.z)):
        assert np.abs(there.joint(joint)[0] - chain.z[joint]).max() < 1e-12 * chain.size.max()


@pytest.mark.parametrize("kind", KINDS)
def test_poses_move_with_a_similarity(kind: str) -> None:
    chain = random_chains(kind, 10, seed=6)
    turn, shift = 3.7 * np.exp(0.8j), 2 - 5j
    moved = type(chain)(chain.structure, turn * chain.z + shift, chain.u * turn / abs(turn))
    scale = abs(turn) if chain.structure.is_pushed else 1
    drive = np.array([[0.02], [0.05]])
    one, other = poses(chain, drive, chain.branch), poses(moved, scale * drive, moved.branch)
    for joint in range(len(chain.z)):
        np.testing.assert_allclose(other.joint(joint), turn * one.joint(joint) + shift, atol=1e-12 * abs(turn))


FAMILIES: dict[str, Any] = {
    "four-bar": [[[0, 0, 1], [1, 0.2, 1]], [[4, 0, 1], [3, 2, 1]]],
    "rocker": [[[0, 0, 1], [0, 3, 1]], [[4, 0, 1], [2, 3, 1]]],
    "crank-rocker": [[[0, 0, 1], [0, 1, 1]], [[4, 0, 1], [3.5, 3, 1]]],
    "slider-crank": [[[0, 0, 1], [1, 0.2, 1]], [[0.2, 1, 0], [3, 1, 1]]],
    "inverted-slider-crank": [[[0, 0, 1], [1, 0.2, 1]], [[3, 0.2, 1], [0.3, 1, 0]]],
}


@pytest.mark.parametrize("name", FAMILIES)
def test_two_dyads_move_as_their_closed_form(name: str) -> None:
    linkage, point = Linkage([FAMILIES[name]]), np.array([2 + 1j])
    known, chain = two_dyads(linkage)[:1], chain_of(linkage, point)
    found = circuits(chain, chain.structure.number("coupler"))
    assert found.kind[0] == known.kind[0]
    s = np.linspace(0, 2 * np.pi, 65)[:, None]
    # the chain starts with a growing angle of its crank, the linkage perhaps with one that falls
    ahead = 1.0 if known.kind[0] == TURN else np.sign(known.half[0] * np.sin(known.phase[0]))
    there = known.phase + ahead * (s - found.phase) * known.period / found.period
    np.testing.assert_allclose(found.pose(s).point(point), known.pose(there).point(point), atol=1e-13)


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("off", [0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3, 0.03])
def test_no_digits_are_lost_at_a_dead_point(name: str, off: float) -> None:
    linkage, point = Linkage([FAMILIES[name]]), np.array([2 + 1j])
    known, chain = two_dyads(linkage)[:1], chain_of(linkage, point)
    found = circuits(chain, chain.structure.number("coupler"))
    if known.kind[0] != SWING:
        return
    s = np.array([[np.pi - off], [np.pi + off], [off], [2 * np.pi - off]])
    there = known.phase + np.sign(known.half[0] * np.sin(known.phase[0])) * (s - found.phase)
    np.testing.assert_allclose(found.pose(s).point(point), known.pose(there).point(point), atol=1e-13)


def test_a_parallelogram_stays_one_through_its_change_points() -> None:
    linkage = Linkage(np.array([[[0, 0, 1], [0.3, 0.9, 1]], [[4, 0, 1], [4.3, 0.9, 1]]]))
    chain = chain_of(linkage, np.array([2 + 3j]))
    found = circuits(chain, 2)
    assert found.kind[0] == TURN
    assert found.period[0] == pytest.approx(2 * np.pi)
    points = found.bounds[np.isfinite(found.bounds)]
    near = (points[:-1, None] + np.array([0, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2])).ravel()
    s = np.concatenate([np.linspace(0, 2 * np.pi, 50), near])
    turn = found.poses(s[:, None]).turn[2]
    assert np.abs(turn - 1).max() < 1e-13


def test_two_parallelograms_one_after_the_other_stay_parallel() -> None:
    """The second one passes its change points where the first one does."""
    bars = {"frame": "AD", "crank": "AB", "coupler": "BC", "rocker": "CDG", "rod": "GH", "last": "HK"}
    structure = Structure.of(bars | {"frame": "ADK"}, drive="crank")
    joints = {"A": 0, "D": 4, "B": 1j, "C": 4 + 1j, "G": 4 + 1j, "K": 7, "H": 7 + 1j}
    chain = Chain.of(structure, {**joints, "G": 4 + 1.5j, "H": 7 + 1.5j})
    found = circuits(chain, 2)
    assert found.kind[0] == TURN
    turn = found.poses(np.linspace(0, 2 * np.pi, 361)[:, None]).turn
    assert np.abs(turn[[2, 4]] - 1).max() < 1e-12


def test_families_that_no_crank_drives_are_no_chains() -> None:
    trammel = Linkage(np.array([[[1, 0, 0], [0, 1, 1]], [[0, 1, 0], [1, 0, 1]]]))
    with pytest.raises(InvalidLinkage, match="whose first dyad is a crank"):
        chain_of(trammel, np.zeros(1, complex))
