"""The form says what the command says, and reads an address as the command reads its line."""

from __future__ import annotations

import shlex
from dataclasses import fields
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import catalogue
from catalogue import Request
from catalogue.cli import app
from catalogue.cli.serve import asked, wish_form
from catalogue.find.explain import Relaxation
from catalogue.find.names import SINGULAR
from catalogue.problem.constraints import Constraints
from catalogue.web.wish import Form, WishError

WITHOUT_SERIES = wish_form(())
LINE = [("path", "straight-line"), ("stroke", "150"), ("deviation", "0.05")]


def test_every_constraint_has_a_field(form: Form) -> None:
    names = {SINGULAR.get(one.name, one.name) for one in fields(Constraints)}
    assert names <= {*form.fields}


def test_every_field_stands_once(form: Form) -> None:
    grouped = [one.name for group in form.groups.values() for one in group]
    assert len(grouped) == len({*grouped})
    first = {*form.fields} - {*grouped}
    assert first == {"min_transmission", "max_size", "fixed_pivots_in", "pins_only"}


def test_fields_have_the_words_of_the_options(form: Form) -> None:
    find: Any = app.get_command(None, "find")  # type: ignore[arg-type]  # it needs no context
    options = {one.name: one.help for name in form.commands for one in find.get_command(None, name).params}
    assert {name: field.help for name, field in form.fields.items()} == {name: options[name] for name in form.fields}


def test_an_address_is_read_as_the_command_reads_its_line(form: Form) -> None:
    wish = form.wish(
        [*LINE, ("max_size", " 400 "), ("fixed_pivots_in", "-300, -50, 300, 200"), ("family", "four-bar"),
         ("family", "slider-crank"), ("pins_only", "1"), ("keep_out", "0,0,10,20\n5 5 6 6"), ("max_link", ""),
         ("desires", "size=2:4"), ("min_transmission", "40")]
    )  # fmt: skip
    assert wish.request == Request.of(
        catalogue.StraightLine(150, 0.05, unit="mm"), max_size=400, fixed_pivots_in=(-300, -50, 300, 200),
        families=("four-bar", "slider-crank"), pins_only=True, keep_out=[(0, 0, 10, 20), (5, 5, 6, 6)],
        min_transmission=40, desires={"size": (2, 4)},
    )  # fmt: skip
    assert wish.starts == ()


def test_the_line_in_a_shell_gives_the_same_wish(form: Form) -> None:
    wish = form.wish([("path", "circular-arc"), ("stroke", "100"), ("deviation", "0.05"), ("radius", "90"),
                      ("fixed_pivots_in", "-inf 0 0 inf"), ("full_rotation", "1")])  # fmt: skip
    words = shlex.split(wish.line)
    assert words[:3] == ["catalogue", "find", "circular-arc"]
    find: Any = app.get_command(None, "find")  # type: ignore[arg-type]  # it needs no context
    context = find.get_command(None, "circular-arc").make_context("circular-arc", words[3:])
    assert context.params["radius"] == 90
    assert context.params["fixed_pivots_in"] == (float("-inf"), 0, 0, float("inf"))
    assert context.params["full_rotation"] is True


def test_the_same_wish_is_the_same_request(form: Form) -> None:
    one = form.wish([*LINE, ("max_size", "400"), ("min_transmission", "40")]).request
    other = form.wish([("min_transmission", "40.0"), ("max_size", "4e2"), ("unit", "mm"), ("pick", "watt"), *LINE])
    assert one == other.request
    assert hash(one) == hash(other.request)
    assert one != form.wish([*LINE, ("max_size", "401"), ("min_transmission", "40")]).request
    inches = form.wish([*LINE, ("max_size", "400"), ("min_transmission", "40"), ("unit", "in")]).request
    assert inches != one
    assert (one.path.unit, inches.path.unit) == ("mm", "in")


def test_lengths_of_a_wish_are_in_the_unit_of_the_page(form: Form) -> None:
    wish = form.wish([("stroke", '14"'), ("deviation", "0.5"), ("unit", "mm")])
    assert (wish.request.path.stroke, wish.request.path.unit) == (355.6, "mm")
    assert wish.line.endswith("--unit mm")
    assert form.wish([("stroke", "14"), ("deviation", "0.5"), ("unit", "ell")]).request.path.unit == "mm"


#: Values of fields, of which some are equal in Python, empty, or nothing.
VALUES = {
    "per_series": ("0", "1", "12"), "round_to": ("1", "2"), "distinct": ("0", "0.0", "0.02", "1"), "order": ("0", "1"),
    "within": ("0",), "play": ("0", "1"), "along": ("0", "1", "-0.0"), "min_transmission": ("0", "1"),
    "limit": ("1", "12"), "effort": ("1",), "pins_only": ("1",), "slots": ("1",), "cognates": ("1",),
    "family": ("four-bar", "oldham"), "series": ("IV.l",), "fixed_pivots_in": ("0 0 1 1", "-1 0 1 1"),
    "keep_out": ("0,0,1,1", "0,0,1,2"), "desires": ("size=2:4", "size=2:5"), "rank_by": ("size", "score"),
}  # fmt: skip
SAID = st.dictionaries(st.sampled_from(sorted(VALUES)), st.integers(0, 2)).map(
    lambda said: [(name, VALUES[name][k % len(VALUES[name])]) for name, k in said.items()]
)


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(SAID)
def test_a_wish_and_its_line_in_a_shell_are_one_request(said: list[tuple[str, str]]) -> None:
    wish = WITHOUT_SERIES.wish([*LINE, *said])
    assert WITHOUT_SERIES.wish([*said[::-1], *LINE]).request == wish.request
    find: Any = app.get_command(None, "find")  # type: ignore[arg-type]  # it needs no context
    context = find.get_command(None, "straight-line").make_context("straight-line", shlex.split(wish.line)[3:])
    given = {name: value for name, value in context.params.items() if name in WITHOUT_SERIES.fields}
    with context.scope(cleanup=False):
        assert asked("straight-line", given) == (wish.request, ())


def test_requests_tell_many_zones_apart_to_the_last_digit(form: Form) -> None:
    polygon = [f"{k / 7},{k * k / 7}" for k in range(60)]
    requests = set()
    for last in ("1", "1.0000000000000002", "2"):
        requests.add(form.wish([*LINE, ("keep_out", ",".join([*polygon[:-1], f"{last},3"]))]).request)
    assert len(requests) == 3


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("stroke", "abc", "no length"),
        ("stroke", "-1", "above zero"),
        ("stroke", "", "how long the path is"),
        ("deviation", "", "Missing"),
        ("deviation", "50", "no guidance"),
        ("max_size", "nan", "above zero"),
        ("fixed_pivots_in", "1 2 3", "4 numbers are wanted, X0 Y0 X1 Y1, not 3"),
        ("fixed_pivots_in", "3 0 1 1", "inside out"),
        ("min_transmission", "100", "between 0 and 90"),
        ("effort", "9", "at most 4"),
        ("limit", "1000", "at most 48"),
        ("keep_out", "1,2,3", "keep-out"),
        ("radius", "10", "no radius"),
        ("desires", "size", "no length"),
        ("max_link", "9" * 3000, "longer than"),
    ],
)
def test_what_is_wrong_is_said_at_its_field(form: Form, field: str, value: str, words: str) -> None:
    with pytest.raises(WishError, match=words) as caught:
        form.wish([*(pair for pair in LINE if pair[0] != field), (field, value)])
    assert caught.value.field == field
    assert "\n" not in str(caught.value)


def test_a_name_that_is_no_field_is_refused(form: Form) -> None:
    with pytest.raises(WishError, match="no field 'max_sise'"):
        form.wish([*LINE, ("max_sise", "3")])
    with pytest.raises(WishError, match="no path 'spiral'"):
        form.wish([("path", "spiral")])


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(sorted(WITHOUT_SERIES.fields)), st.text(max_size=12)), max_size=4))
def test_no_address_gets_through_unread(said: list[tuple[str, str]]) -> None:
    told = ""
    try:
        assert WITHOUT_SERIES.wish([*LINE, *said]).request.path.stroke > 0
    except WishError as error:
        told = str(error)
    assert "\n" not in told


def test_advice_becomes_an_address(form: Form) -> None:
    asked = [*LINE, ("max_size", "100"), ("fixed_pivots_in", "0 0 1 1"), ("pins_only", "1"), ("unit", "cm")]
    relaxations = [Relaxation("--max-size", "210.5", "100"), Relaxation("--fixed-pivots-in", "-5 -6 7 8.5")]
    said = form.relaxed(asked, relaxations)
    assert dict(said) == {"path": "straight-line", "stroke": "150", "deviation": "0.05", "pins_only": "1",
                          "unit": "cm", "max_size": "210.5", "fixed_pivots_in": "-5 -6 7 8.5"}  # fmt: skip
    assert form.wish(said).request.constraints.max_size == 210.5
    assert "pins_only" not in dict(form.relaxed(asked, [Relaxation("--pins-only")]))
