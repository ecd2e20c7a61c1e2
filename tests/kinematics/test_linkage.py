"""Linkages: what they are, what they must not be, and what can be made of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catalogue.errors import InvalidLinkage
from catalogue.kinematics.from_lengths import from_lengths
from catalogue.kinematics.linkage import FAMILIES, PR, RP, RR, Linkage, faults
from catalogue.kinematics.types import Array

Maker = Callable[..., Linkage]
CRANK: Any = [[0, 0, 1], [1, 2, 1]]
OTHER: Any = [[4, 0, 1], [3, 1, 1]]
SLIDER: Any = [[0, 1, 0], [3, 1, 1]]
SLIDE: Any = [[4, 0, 1], [1, 1, 0]]
SWAPPED = {
    "four-bar": "four-bar",
    "slider-crank": "inverted-slider-crank",
    "inverted-slider-crank": "slider-crank",
    "swinging-block": "swinging-block",
    "elliptic-trammel": "oldham",
    "oldham": "elliptic-trammel",
}
every_family = pytest.mark.parametrize("family", FAMILIES)
seeds = st.integers(0, 2**32 - 1)
scales = st.tuples(st.floats(-3, 3), st.floats(-np.pi, np.pi)).map(lambda v: 10 ** v[0] * np.exp(1j * v[1]))
shifts = st.complex_numbers(max_magnitude=1e3)


@pytest.mark.parametrize(
    ("first", "second", "family"),
    [
        (CRANK, OTHER, "four-bar"),
        (CRANK, SLIDER, "slider-crank"),
        (CRANK, SLIDE, "inverted-slider-crank"),
        ([[1, 0, 0], [0, 0, 1]], SLIDE, "swinging-block"),
        ([[1, 0, 0], [0, 0, 1]], SLIDER, "elliptic-trammel"),
        ([[0, 0, 1], [1, 0, 0]], SLIDE, "oldham"),
    ],
)
def test_zeros_of_w_name_the_family_in_either_order(first: Any, second: Any, family: str) -> None:
    both = Linkage([[first, second], [second, first]])
    assert both.family.tolist() == [family, family]
    assert sorted(both.dyads[0]) == sorted(FAMILIES[family])
    assert both.dyads[1].tolist() == both.dyads[0, ::-1].tolist()
    assert both.finite.tolist() == [[[w != 0 for *_, w in dyad] for dyad in pair] for pair in both.pivots.tolist()]


@pytest.mark.slow
@every_family
@given(seed=seeds, factor=st.floats(1e-6, 1e6), negative=st.booleans())
def test_scale_of_homogeneous_coordinates_is_irrelevant(
    random_linkages: Maker, family: str, seed: int, factor: float, negative: bool
) -> None:
    linkage = random_linkages(family, 1, seed)
    factors = np.random.default_rng(seed).uniform(0.5, 2, size=(1, 2, 2, 1)) * (-factor if negative else factor)
    again = Linkage(linkage.pivots * factors)
    assert again.family == linkage.family
    # the two directions of a line are one point at infinity
    sign = np.where(linkage.finite | (not negative), 1, -1)[..., None] * [1, 1, 0] + [0, 0, 1]
    np.testing.assert_allclose(again.pivots * sign, linkage.pivots, rtol=1e-15, atol=1e-15)


BOTH_AT_INFINITY = [[1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("first", "second", "message"),
    [
        ([[np.nan, 0, 1], [1, 2, 1]], OTHER, "a pivot has a NaN or infinite coordinate"),
        ([[0, 0, 1], [np.inf, 2, 1]], OTHER, "a pivot has a NaN or infinite coordinate"),
        ([[0, 0, 1], [1, 2, -np.inf]], OTHER, "a pivot has a NaN or infinite coordinate"),
        (CRANK, [[0, 0, 0], [3, 1, 1]], r"a pivot is \(0, 0, 0\), which is no point"),
        (CRANK, [[4, 0, 1], [1, 0, 1e-310]], "a pivot is so far out that its coordinates overflow"),
        (CRANK, [[1e308, 1.7e308, 0], [3, 1, 1]], "a pivot is so far out that its coordinates overflow"),
        (CRANK, [[3e152, 0, 1], [3, 1, 1]], r"a pivot is farther out than 1e\+152: choose another unit of length"),
        (
            [[0, 0, 1], [1e-154, 0, 1]],
            [[0, 2e-154, 1], [3e-154, 1e-154, 1]],
            "it is smaller than 1e-152: choose another",
        ),
        (CRANK, BOTH_AT_INFINITY, "a dyad has both pivots at infinity"),
        (CRANK, [[4, 0, 1], [4, 0, 1]], "the two pivots of a crank coincide"),
        ([[8, 0, 2], [4, 1e-13, 1]], CRANK, "the two pivots of a crank coincide"),
        (CRANK, [[0, 0, 2], [3, 1, 1]], "the two fixed pivots coincide"),
        (CRANK, [[4, 0, 1], [1, 2, 1]], "the two moving pivots coincide"),
        (CRANK, [[1, 0, 0], [1, 2, 1]], "the two moving pivots coincide"),
        (CRANK, [[0, 0, 1], [1, 0, 0]], "the two fixed pivots coincide"),
        (SLIDER, [[0, -3, 0], [1, 2, 1]], r"the two fixed pivots at infinity coincide \(parallel lines\)"),
        (SLIDE, [[1, 2, 1], [2, 2, 0]], r"the two moving pivots at infinity coincide \(parallel lines\)"),
    ],
)
def test_a_faulty_linkage_is_refused_with_its_place_and_its_fault(first: Any, second: Any, message: str) -> None:
    good = [CRANK, OTHER]
    with pytest.raises(InvalidLinkage, match=f"^linkage 1: {message}"):
        Linkage([good, [first, second], good])
    with pytest.raises(InvalidLinkage, match=f"^linkage 0: {message}.*and 1 more"):
        Linkage([[first, second], good, [second, first]])


@pytest.mark.parametrize("shape", [(2, 3), (2, 2), (2, 2, 1), (3, 2, 2, 4), (1, 1, 2, 2, 3), ()])
def test_a_wrong_shape_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(InvalidLinkage, match=r"pivots must have shape \(2, 2, 3\) or \(n, 2, 2, 3\)"):
        Linkage(np.ones(shape))


@pytest.mark.parametrize("pivots", ["abc", [[1, 2], [3]], [[[[1j] * 3] * 2] * 2], [[CRANK, None]]])
def test_what_is_no_array_of_numbers_is_refused(pivots: Any) -> None:
    with pytest.raises(InvalidLinkage, match="pivots must be numbers in an array"):
        Linkage(pivots)


@pytest.mark.parametrize("wide", [list, tuple, np.array])
def test_two_coordinates_are_a_finite_pivot(wide: Callable[[Any], Any]) -> None:
    plain = Linkage([[CRANK, OTHER]]).pivots
    short = [[pivot[:2] for pivot in dyad] for dyad in (CRANK, OTHER)]
    np.testing.assert_array_equal(Linkage(wide(short)).pivots, plain)
    np.testing.assert_array_equal(Linkage(wide([short, short])).pivots, np.concatenate([plain, plain]))


def test_a_pivot_at_infinity_stands_among_pivots_of_two_coordinates() -> None:
    mixed: Any = [[[0, 0], [1, 2]], [[0, 1, 0], (3, 1)]]
    np.testing.assert_array_equal(Linkage(mixed).pivots, Linkage([CRANK, SLIDER]).pivots)


def test_linkages_are_given_as_such_by_pivots_or_by_lengths() -> None:
    bars = {"ground": 4, "crank": 2.4, "coupler": 2, "rocker": 2.4, "angle": [60, 70]}
    made = Linkage.of(bars)
    assert Linkage.of(made) is made
    np.testing.assert_array_equal(made.pivots, from_lengths(bars).pivots)
    np.testing.assert_array_equal(Linkage.of(made.pivots.tolist()).pivots, made.pivots)


def test_pivots_apart_by_more_than_rounding_are_accepted() -> None:
    for apart in (1e-6, 1e-11):
        assert faults(np.array([[CRANK, [[4, 0, 1], [4 + apart, 0, 1]]]], dtype=float)) == ""
        assert faults(np.array([[SLIDE, [[1, 2, 1], [1, 1 + apart, 0]]]], dtype=float)) == ""


def test_the_valid_ones_are_picked_out() -> None:
    pivots = np.array([[CRANK, OTHER], [CRANK, CRANK], [SLIDER, CRANK], [CRANK, BOTH_AT_INFINITY]], dtype=float)
    linkage, mask = Linkage.valid(pivots)
    assert mask.tolist() == [True, False, True, False]
    assert linkage.family.tolist() == ["four-bar", "slider-crank"]
    np.testing.assert_array_equal(linkage.pivots, pivots[mask])


@pytest.mark.slow
@every_family
@given(seed=seeds)
def test_inversion_is_an_involution_and_exchanges_the_families(random_linkages: Maker, family: str, seed: int) -> None:
    linkage = random_linkages(family, 3, seed)
    inverse = linkage.inverted()
    assert set(inverse.family) == {SWAPPED[family]}
    np.testing.assert_array_equal(inverse.pivots[:, :, 0], linkage.pivots[:, :, 1])
    np.testing.assert_array_equal(inverse.inverted().pivots, linkage.pivots)
    np.testing.assert_array_equal(inverse.size, linkage.size)


def _line(fixed: complex, moving: complex, kind: int) -> complex:
    return moving - fixed if kind == RR else fixed if kind == PR else moving


@pytest.mark.slow
@every_family
@given(seed=seeds, scale=scales, shift=shifts, mirror=st.booleans())
def test_a_similarity_keeps_family_proportions_and_angles(
    random_linkages: Maker, family: str, seed: int, scale: complex, shift: complex, mirror: bool
) -> None:
    linkage = random_linkages(family, 2, seed)
    moved = linkage.moved(scale, shift, mirror)
    assert moved.family.tolist() == linkage.family.tolist()
    reach = abs(shift) + abs(scale)
    np.testing.assert_allclose(moved.size, abs(scale) * linkage.size, atol=1e-13 * reach)
    for i in range(2):
        expected = scale * np.where(mirror, linkage.points[i].conj(), linkage.points[i]) + shift
        finite = linkage.finite[i]
        np.testing.assert_allclose(moved.points[i][finite], expected[finite], atol=1e-13 * reach)
        np.testing.assert_allclose(np.abs(moved.points[i][~finite]), 1, rtol=1e-14)
        for j in range(2):
            ray = _line(linkage.points[i, j, 0], linkage.points[i, j, 1], linkage.dyads[i, j])
            carried = scale * (ray.conjugate() if mirror else ray)
            blur = 1e-12 * (1 + reach / abs(carried))
            assert abs(carried / abs(carried) - moved.rays[i, j]) < blur


@pytest.mark.slow
@every_family
@given(seed=seeds, scale=scales, shift=shifts, mirror=st.booleans())
def test_a_similarity_is_undone_by_its_inverse(
    random_linkages: Maker, family: str, seed: int, scale: complex, shift: complex, mirror: bool
) -> None:
    linkage = random_linkages(family, 1, seed)
    back = 1 / (scale.conjugate() if mirror else scale)
    undo = -back * (shift.conjugate() if mirror else shift)
    again = linkage.moved(scale, shift, mirror).moved(back, undo, mirror)
    np.testing.assert_allclose(again.pivots, linkage.pivots, atol=1e-14 * (10 + abs(undo)))


def test_each_linkage_takes_its_own_similarity() -> None:
    three = Linkage([[CRANK, SLIDER]] * 3).moved([1, 2j, 3], [0, 1, 1j], [False, True, False])
    singly = [Linkage([CRANK, SLIDER]).moved(*v) for v in ((1, 0, False), (2j, 1, True), (3, 1j, False))]
    np.testing.assert_array_equal(three.pivots, np.concatenate([one.pivots for one in singly]))


@pytest.mark.parametrize(("scale", "shift"), [(0, 0), (np.nan, 0), (1, np.inf), ([1, 0], 0)])
def test_a_similarity_must_be_one(scale: Any, shift: Any) -> None:
    with pytest.raises(InvalidLinkage, match="a finite shift and a finite scale other than zero"):
        Linkage([[CRANK, OTHER]] * 2).moved(scale, shift)


def test_size_is_the_diameter_of_the_finite_pivots() -> None:
    found = Linkage([[CRANK, OTHER], [CRANK, SLIDER], [SLIDE, [[1, 2, 1], [1, 0, 0]]]]).size
    np.testing.assert_allclose(found, [4, np.sqrt(10), np.sqrt(13)], rtol=1e-15)


def test_a_batch_is_indexed_like_an_array() -> None:
    pivots = np.array([[CRANK, OTHER], [CRANK, SLIDER], [CRANK, SLIDE]], dtype=float)
    batch = Linkage(pivots)

    def same(linkage: Linkage, expected: Array) -> None:
        np.testing.assert_allclose(linkage.pivots[..., 2], expected[..., 2])
        np.testing.assert_array_equal(linkage.dyads, Linkage(expected).dyads)

    assert len(batch) == 3
    same(batch[1], pivots[1:2])
    same(batch[-1], pivots[2:])
    same(batch[:2], pivots[:2])
    same(batch[[2, 0]], pivots[[2, 0]])
    same(batch[np.array([True, False, True])], pivots[[0, 2]])
    assert [one.family[0] for one in batch] == batch.family.tolist()
    assert len(batch[[]]) == 0
    with pytest.raises(IndexError):
        batch[3]


def test_an_empty_batch_is_a_batch() -> None:
    empty = Linkage(np.zeros((0, 2, 2, 3)))
    assert len(empty) == 0
    assert empty.family.shape == (0,)
    assert repr(empty) == "<Linkage: empty>"
    assert len(empty.inverted().moved(2)) == 0


def test_the_repr_counts_the_families() -> None:
    assert repr(Linkage([[CRANK, OTHER], [CRANK, SLIDER], [OTHER, CRANK]])) == "<Linkage: 2 four-bar, 1 slider-crank>"


@pytest.mark.parametrize("make", [lambda x: x, Linkage.inverted, lambda x: x.moved(2), lambda x: x[:1]])
def test_pivots_cannot_be_overwritten(make: Callable[[Linkage], Linkage]) -> None:
    linkage = make(Linkage([CRANK, OTHER]))
    with pytest.raises(ValueError, match="read-only"):
        linkage.pivots[0, 0, 0, 0] = 7


def test_the_given_array_is_copied() -> None:
    pivots = np.array([CRANK, OTHER], dtype=float)
    linkage = Linkage(pivots)
    pivots[:] = 0
    assert linkage.pivots[0, 0, 1].tolist() == [1, 2, 1]


def test_kinds_are_told_by_infinity_alone() -> None:
    pivots: Any = [[[1e9, 0, 1], [1, 2, 1]], [[4, 0, 1e-9], [3, 1, 1]]]
    far = Linkage(pivots)
    assert far.dyads.tolist() == [[RR, RR]]
    assert Linkage([[[1e9, 0, 0], [1, 2, 1]], SLIDE]).dyads.tolist() == [[PR, RP]]
