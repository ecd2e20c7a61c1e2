"""The examples of the public names run, and print what they show."""

from __future__ import annotations

import doctest
import inspect
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
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


#: Names without an example: errors, and a type of keywords.
WITHOUT = {"ConstraintArguments"} | {
    one.__name__ for one in PUBLIC if inspect.isclass(one) and issubclass(one, Exception)
}
SHOWN = [one for thing in PUBLIC for one in examples(thing)]
#: Rooms whose examples need neither a database nor files.
ROOMS = ("chains", "curvature_theory", "kinematics", "problem", "series")


def of_room(room: str) -> Iterator[doctest.DocTest]:
    """Yield the examples of all modules of a room."""
    package = import_module(f"catalogue.{room}")
    for found in walk_packages(package.__path__, f"{package.__name__}."):
        module = import_module(found.name)
        yield from (one for one in doctest.DocTestFinder().find(module) if one.examples)


@pytest.mark.parametrize("room", ROOMS)
def test_examples_of_a_room_print_what_they_show(room: str) -> None:
    for example in of_room(room):
        runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
        assert not runner.run(example).failed, example.name


@pytest.mark.slow
@pytest.mark.parametrize("example", SHOWN, ids=lambda one: one.name)
def test_an_example_prints_what_it_shows(example: doctest.DocTest, small_db: Path) -> None:
    with catalogue.open(small_db, build=False) as cat:
        example.globs |= {"cat": cat}
        runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
        assert runner.run(example).failed == 0


def test_every_public_name_has_an_example() -> None:
    assert {thing.__name__ for thing in PUBLIC if not examples(thing)} == WITHOUT


@pytest.mark.parametrize("thing", [one for one in PUBLIC if one.__name__ not in WITHOUT], ids=lambda one: one.__name__)
def test_public_functions_describe_their_parameters(thing: Any) -> None:
    missing = [
        name
        for name, function in functions(thing)
        if {*inspect.signature(function).parameters} - {"self", "cls"}
        and "Parameters\n----------" not in (inspect.getdoc(function) or "")
    ]
    assert missing == []
