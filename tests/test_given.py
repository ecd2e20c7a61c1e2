"""What somebody gives is read, or refused in one line that names it."""

from __future__ import annotations

from dataclasses import dataclass, make_dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from catalogue.errors import InvalidLinkage, InvalidRequest
from catalogue.given import Stated, array, choice, instance, pair, several, text, whole


@dataclass(frozen=True)
class Stake(Stated):
    name: str
    height: float = 1.0
    number: int = 0


#: A dataclass whose types are no text, as in a module that does not postpone its annotations.
Post = make_dataclass("Post", [("name", str), ("height", float)], bases=(Stated,), frozen=True)


@pytest.mark.parametrize(
    ("given", "shapes"),
    [
        (5, [()]),
        ([1, 2, 3], [(3,)]),
        ([[1, 2, 3]], [(3,), (None, 3)]),
        ([[Fraction(1, 2), 2, 3]], [(..., 3)]),
        (np.ones((4, 2, 2)), [(4, ...)]),
        (np.ones(4), [(4, ...)]),
        (np.ones((2, 7, 8, 3)), [(2, ..., 3)]),
        ([], [(...,)]),
    ],
)
def test_arrays_of_a_shape_are_taken(given: Any, shapes: list[Any]) -> None:
    found = array("x", given, *shapes)
    assert found.dtype == float
    assert np.array_equal(found, np.asarray(given, float))


@pytest.mark.parametrize(
    ("given", "shape", "wanted"),
    [
        ("5", (), "x must be a number, not '5'"),
        (True, (), "x must be a number, not True"),
        ([1j], (None,), "x must be numbers in a row, not [1j]"),
        ([], (None,), "x must be numbers in a row, not of shape (0,)"),
        ([[1], [2, 3]], (...,), "x must be numbers, not [[1], [2, 3]]"),
        ([1, 2], (3,), "x must be 3 numbers, not of shape (2,)"),
        (5, (None, 3), "x must be numbers of shape (n, 3), not of shape ()"),
        (np.ones(3), (3, 3, ...), "x must be numbers of shape (3, 3, ...), not of shape (3,)"),
    ],
)
def test_other_arrays_are_refused_in_words(given: Any, shape: Any, wanted: str) -> None:
    with pytest.raises(InvalidRequest) as caught:
        array("x", given, shape)
    assert str(caught.value) == wanted


def test_an_array_of_terabytes_is_refused() -> None:
    with pytest.raises(InvalidRequest, match="x must be numbers"):
        array("x", np.broadcast_to(0.0, (2**40, 3)))


def test_numbers_that_are_not_finite_pass_unless_finite_ones_are_wanted() -> None:
    assert np.isnan(array("x", [np.nan, 1])[0])
    with pytest.raises(InvalidLinkage, match="x must be finite numbers"):
        array("x", [np.nan, 1], finite=True, wrong=InvalidLinkage)


def test_objects_are_taken_by_their_type() -> None:
    assert instance("x", None, int | None) is None
    assert several("x", iter([1, 2]), int) == (1, 2)
    assert pair("x", [1, "u"], "a point and a name") == (1, "u")
    assert choice("x", "a", ("a", "b")) == "a"
    assert text("x", "α") == "α"
    assert whole("x", 4, 0, 4) == 4


@pytest.mark.parametrize(
    ("read", "wanted"),
    [
        (lambda: instance("x", 5, str | None), "x must be of type str or None, not 5"),
        (lambda: several("x", 5, str), "x must be a sequence, not 5"),  # type: ignore[arg-type]  # what is tried
        (lambda: several("x", [5], str), "each of x must be of type str, not 5"),
        (lambda: pair("x", 5, "a point and a name"), "x must be a point and a name, not 5"),
        (lambda: choice("x", ["a"], ("a", "b")), "x must be one of 'a', 'b', not ['a']"),
        (lambda: text("x", "\ud800"), "x must be one line of printable text, not '\\ud800'"),
        (lambda: whole("x", 5, 0, 4), "x must be at most 4, not 5"),
        (lambda: Stake(5), "Stake.name must be of type str, not 5"),  # type: ignore[arg-type]  # what is tried
        (lambda: Stake("a", "b"), "Stake.height must be a number, not 'b'"),  # type: ignore[arg-type]
        (lambda: Post("a", "b"), "Post.height must be a number, not 'b'"),
        (lambda: Stake("a", 1, -1), "Stake.number must be at least 0, not -1"),
    ],
)
def test_what_is_of_another_type_is_refused_in_words(read: Any, wanted: str) -> None:
    with pytest.raises(InvalidRequest) as caught:
        read()
    assert str(caught.value) == wanted


def test_what_is_stated_is_read() -> None:
    stake = Stake("a", np.float32(2), np.int8(3))  # type: ignore[arg-type]  # what numpy gives
    assert (type(stake.height), type(stake.number)) == (float, int)
