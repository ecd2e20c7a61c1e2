"""A circuit with its coupler point, or its mirror image, is left-handed, and both are followed alike."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from catalogue.kinematics.circuits import SWING, circuits
from catalogue.kinematics.handedness import followed, left_handed
from catalogue.kinematics.linkage import FAMILIES, Linkage
from catalogue.kinematics.types import Array

Maker = Callable[..., Linkage]
MIRROR = np.array([1.0, -1.0, 1.0])
PHASES = np.linspace(0.05, 6.2, 40)


def paths(linkage: Linkage, point: Array) -> Array:
    """Return the places (40, k) of coupler points (n,) as their curves are followed."""
    found = circuits(linkage)
    at = point[found.of]
    offset, sense = followed(found, at)
    share = PHASES[:, None] * found.period / (2 * np.pi)
    return np.asarray(found.pose(offset + sense * share).point(at))


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("on_line", [False, True])
def test_curves_of_mirror_images_are_followed_as_images(random_linkages: Maker, family: str, on_line: bool) -> None:
    linkage = random_linkages(family, 40, 17)
    z, finite = linkage.points[..., 1], linkage.finite[..., 1]
    ray = np.where(finite.all(1), z[:, 1] - z[:, 0], np.where(finite[:, 0], z[:, 1], z[:, 0]))
    point = np.where(finite[:, 0], z[:, 0], z[:, 1]) + ray * (0.7 if on_line else 0.3 - 1.1j)
    if family == "oldham":
        point = linkage.points[:, 0, 0] + (0.4 if on_line else 0.2 + 1j) * (
            linkage.points[:, 1, 0] - linkage.points[:, 0, 0]
        )
    image = Linkage(linkage.pivots * MIRROR)
    one, other = paths(linkage, point), paths(image, point.conj())
    if on_line:  # of two circuits, each the image of the other, one is followed backwards
        found, seen = circuits(linkage), circuits(image)
        two = np.bincount(found.of)[found.of] == 2
        there = two & (found.lead != 2)
        assert (left_handed(found, point[found.of]) != left_handed(seen, point.conj()[seen.of]))[there].all()
        one, other = one[:, there], other[:, there]
    assert one.shape[1] or family in ("elliptic-trammel", "oldham", "swinging-block")
    np.testing.assert_allclose(one, other.conj(), rtol=1e-9, atol=1e-9)


def test_a_four_bar_with_a_swinging_crank_is_followed_from_its_other_dead_point() -> None:
    pivots = np.array([[[0.0, 0], [3.0, 1]], [[4, 0], [4.5, 2]]])
    found = circuits(Linkage([pivots, pivots * [1, -1]]))
    single = np.flatnonzero((found.kind == SWING) & (np.bincount(found.of)[found.of] == 1))
    assert len(single) == 2
    offset, sense = followed(found, np.array([1 + 3j, 1 - 3j])[found.of])
    assert sorted(offset[single]) == pytest.approx([0, np.pi])
    assert sense[single].tolist() == [1, 1]


@pytest.mark.parametrize("family", FAMILIES)
def test_place_direction_and_size_change_no_hand(random_linkages: Maker, family: str) -> None:
    linkage = random_linkages(family, 40, 18)
    point = linkage.points[:, 0, 1] + 0.5 - 0.8j
    found = circuits(linkage)
    turned, shift = 2.5 * np.exp(0.7j), 3 - 1j
    moved = linkage.points * np.where(linkage.finite, turned, turned / abs(turned)) + shift * linkage.finite
    pivots = np.stack([moved.real, moved.imag, linkage.pivots[..., 2]], axis=-1)
    seen = circuits(Linkage(pivots))
    hands = left_handed(found, point[found.of]), left_handed(seen, (turned * point + shift)[seen.of])
    assert (hands[0] == hands[1]).all()
    assert 0.2 < hands[0].mean() < 0.8
