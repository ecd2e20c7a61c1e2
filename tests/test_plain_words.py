"""What the project says is plain: no room gains passages that a stranger has to read twice."""

from __future__ import annotations

from functools import cache

import pytest

from tests import plain_words

counts = cache(plain_words.counts)


def faults(source: str) -> list[str]:
    return [passage.fault for passage in plain_words.passages(source)]


@pytest.mark.slow
@pytest.mark.parametrize("room", plain_words.recorded())
def test_counts_of_a_room_only_fall(room: str) -> None:
    """Lower the record with `python tests/plain_words.py --lower` after rewording."""
    found = counts().get(room, {})
    grown = {fault: (most, found.get(fault, 0)) for fault, most in plain_words.recorded()[room].items()}
    assert {fault: pair for fault, pair in grown.items() if pair[1] > pair[0]} == {}


def test_every_room_is_recorded() -> None:
    assert {plain_words.room(path) for path in plain_words.modules()} <= set(plain_words.recorded())


@pytest.mark.parametrize(
    ("source", "fault"),
    [
        (f'"""{"word " * 17}."""', "long"),
        ('def f():\n    """Return what comes of those that rest."""', "clauses"),
        ('class A:\n    """The same with a slide."""', "leans"),
        ("A, B = 1, f()", "constants"),
        ("x = [1]  # fmt: skip", "skip"),
        (f"# {'word ' * 20}", "wide"),
        (f'"""Do it.\n\n{"word " * 21}\n"""', "wide"),
    ],
)
def test_each_fault_is_found(source: str, fault: str) -> None:
    assert fault in faults(source)


def test_literal_numbers_at_the_head_are_counted() -> None:
    assert faults("A = -2 * 1e-3\nB: int = 4\nC = 'text'\nd = 5\nE = (1, 2)\nF = True") == ["numbers"] * 2


@pytest.mark.parametrize(
    "source", ['"""Solve a system of two circles that meet."""', "A = 1, 2\nB = f()", f"x = '{'a' * 100}'"]
)
def test_plain_passages_have_no_fault(source: str) -> None:
    assert faults(source) == []
