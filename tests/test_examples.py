"""The examples of the public names run, and print what they show."""

from __future__ import annotations

import doctest
import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import catalogue

PUBLIC = [getattr(catalogue, name) for name in catalogue.__all__ if name != "__version__"]


def examples(thing: Any) -> list[doctest.DocTest]:
    """Return the examples in the docstrings of a public class with its methods, or of a function."""
    finder = doctest.DocTestFinder(exclude_empty=True)
    return [one for one in finder.find(thing, thing.__name__) if one.examples]


def functions(thing: Any) -> Iterator[tuple[str, Any]]:
    """Yield the public functions of a name: itself, or the methods that its class defines."""
    if not inspect.isclass(thing):
        yield thing.__name__, thing
        return
    for name, member in vars(thing).items():
        function = getattr(member, "__func__", member)
        if not name.startswith("_") and inspect.isfunction(function):
            yield f"{thing.__name__}.{name}", function


SHOWN = [one for thing in PUBLIC for one in examples(thing)]


@pytest.mark.parametrize("example", SHOWN, ids=lambda one: one.name)
def test_an_example_prints_what_it_shows(example: doctest.DocTest, small_db: Path) -> None:
    with catalogue.open(small_db, build=False) as cat:
        example.globs |= {"cat": cat}
        runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
        assert runner.run(example).failed == 0
