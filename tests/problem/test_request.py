"""A request is one value in all its forms: mapping, JSON, TOML, row of a table, options of the command."""

from __future__ import annotations

import io
import math
import pickle
from collections.abc import Callable
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from catalogue import Catalogue, CircularArc, Constraints, InvalidRequest, Request, StraightLine
from catalogue.cli import app
from catalogue.cli.find import whole_request
from catalogue.problem.forms import PATH_NAMES, SPELLINGS
from catalogue.problem.problem import OWN
from catalogue.problem.region import Region

LENGTH = st.floats(1e-3, 1e4)
BOX = st.tuples(st.floats(-900, -1), st.floats(-900, -1), st.floats(1, 900), st.sampled_from([9.5, math.inf]))
TRIANGLE = st.floats(1, 9).map(lambda x: [(0, 0), (x, 0.1), (1, x / 3)])
PATH = st.one_of(
    st.builds(StraightLine, st.floats(1, 500), st.floats(1e-4, 0.01), unit=st.sampled_from([None, "mm", "in"])),
    st.builds(
        lambda radius, angle, at: CircularArc(deviation=1e-3, radius=radius, angle=angle, start=(at, -at), along=at),
        st.floats(10, 500), st.floats(20, 349), st.floats(-90, 90),
    ),
    st.builds(CircularArc, st.floats(1, 500), st.floats(1e-4, 0.01)),
)  # fmt: skip
KEYWORDS = st.fixed_dictionaries(
    {},
    optional={
        "families": st.lists(st.sampled_from(["four-bar", "slider-crank"]), min_size=1, unique=True),
        "series": st.just("III*.KK"),
        "pins_only": st.booleans(),
        "order": st.integers(0, 9),
        "fixed_pivots_in": BOX,
        "pivots_in": TRIANGLE,
        "keep_out": st.lists(st.one_of(BOX, TRIANGLE), max_size=3),
        "crank": st.tuples(*[st.floats(1, 9)] * 3, st.floats(10, 19)),
        "max_size": LENGTH,
        "min_transmission": st.floats(0, 89),
        "min_uniformity": st.floats(0.1, 0.9),
        "play": LENGTH,
        "rank_by": st.sampled_from(["score", "size=2,transmission=1", {"max_arm": 0.1, "size": 0.2, "deviation": 0.4},
                                    ["size", "deviation"]]),
        "desires": st.sampled_from([{"size": (200, 600)}, {"transmission": (60, 20, 2), "travel": (1, 2)}]),
        "limit": st.integers(1, 99),
        "effort": st.integers(0, 9),
        "per_series": st.integers(0, 9),
        "distinct": st.floats(0, 0.9),
        "refine": st.booleans(),
        "round_to": LENGTH,
    },
)  # fmt: skip
REQUEST = st.builds(lambda path, given: Request.of(path, **given), PATH, KEYWORDS)


def through_csv(one: Request) -> Request:
    """Write a request as a row of a table beside one with other columns, and read it."""
    table = pd.DataFrame([one.to_row(), Request.of(StraightLine(1, 0.01), limit=3, pins_only=True).to_row()])
    table.to_csv(file := io.StringIO(), index=False)
    read = pd.read_csv(io.StringIO(file.getvalue()), dtype=str, keep_default_na=False)
    return Request.from_dict({str(name): read[name][0] for name in read})


FORMS: dict[str, Callable[[Request], Request]] = {
    "mapping": lambda one: Request.from_dict(one.to_dict()),
    "JSON": lambda one: Request.from_json(one.to_json()),
    "TOML": lambda one: Request.from_toml(one.to_toml()),
    "row": lambda one: Request.from_dict(one.to_row()),
    "CSV": through_csv,
    "pickle": lambda one: pickle.loads(pickle.dumps(one)),
}


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS)
@settings(max_examples=60, deadline=None)
@given(one=REQUEST)
def test_a_request_is_the_same_after_any_form(form: str, one: Request) -> None:
    again = FORMS[form](one)
    assert again == one
    assert hash(again) == hash(one)
    assert again.to_dict() == one.to_dict()
    assert again.problem == one.problem


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(one=REQUEST)
def test_the_command_reads_a_request_in_toml(tmp_path_factory: pytest.TempPathFactory, one: Request) -> None:
    """But regions that are polygons, which the command has no option for."""
    if any(not region.is_box for name in ("fixed_pivots_in", "pivots_in", "swept_in")
           if (region := getattr(one.constraints, name)) is not None):  # fmt: skip
        one = one.with_(pivots_in=None)
    (file := tmp_path_factory.getbasetemp() / "request.toml").write_text(one.to_toml(), "utf-8")
    find: Any = app.get_command(None, "find")  # type: ignore[arg-type]  # it needs no context
    name = one.to_dict()["path"]
    context = find.get_command(None, name).make_context(name, ["--config", str(file)])
    options = {key: value for key, value in context.params.items()
               if key not in ("format", "explain", "plot", "save", "db", "plugins", "starts", "collection", "where",
                              "special", "force")}  # fmt: skip
    with context.scope(cleanup=False):
        assert whole_request(options, curved=name == "circular-arc") == one


def test_lengths_carry_units_in_texts_and_in_heads() -> None:
    one = Request.from_dict(
        {"stroke": "15cm", "deviation": "0.05mm", "max_size [in]": 10, "pivots_in": "-1in 0 1in 9mm"}
    )
    assert one.path == StraightLine(15, 0.005, unit="cm")
    assert one.constraints.max_size == 25.4
    assert one.constraints.pivots_in == Region.of("pivots_in", (-2.54, 0, 2.54, 0.9))
    assert Request.from_dict({"unit": "mm", "stroke": "6in", "deviation": 0.1}).path.stroke == 152.4


def test_options_of_the_command_are_names_too() -> None:
    one = Request.from_dict({"stroke": 150, "deviation": 0.05, "family": "four-bar, slider-crank", "min-transmission":
                             "0.7rad", "pareto": "size,deviation", "desire": ["size=200:600"]})  # fmt: skip
    assert one.constraints == Constraints(["four-bar", "slider-crank"], min_transmission=math.degrees(0.7))
    assert one.rank_by == ("size", "deviation")
    assert one.desires == (("size", (200.0, 600.0)),)
    assert Request.from_dict({"from": [1, 1], "to": [1, 3], "deviation": 0.01}).path.stroke == 2


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"stroke": 150}, "needs a deviation"),
        ({"deviation": 1}, "needs a stroke"),
        ({"stroke": 150, "deviation": 0.05, "max_sise": 3}, "did you mean max_size?"),
        ({"stroke": 150, "deviation": 0.05, "strok": 3}, "did you mean stroke?"),
        ({"stroke": "long", "deviation": 0.05}, "no length"),
        ({"stroke": 150, "deviation": 0.05, "max_size [ell]": 3}, "no unit 'ell'"),
        ({"stroke": 150, "deviation": 0.05, "pins_only": "perhaps"}, "pins_only must be true or false"),
        ({"stroke": 150, "deviation": 0.05, "limit": "many"}, "limit must be a number"),
        ({"stroke": 150, "deviation": 0.05, "limit": 2.5}, "limit must be a whole number"),
        ({"stroke": 150, "deviation": 0.05, "path": "spiral"}, "path must be one of"),
        ({"stroke": 150, "deviation": 0.05, "path": "straight-line", "radius": 3}, "has no radius"),
        ({"stroke": 150, "deviation": 0.05, "family": "four-bar", "families": "oldham"}, "families is given twice"),
        ({"stroke": 150, "deviation": 0.05, "keep_out": "1 2 3"}, "keep_out must be"),
        ({"stroke": 150, "deviation": 0.05, "rank_by": "beauty"}, "cannot rank by beauty"),
        ([], "must be a mapping"),
    ],
)
def test_what_is_no_request_is_told_in_one_line(given: Any, says: str) -> None:
    with pytest.raises(InvalidRequest, match=says) as told:
        Request.from_dict(given)
    assert "\n" not in str(told.value)


NAMES = [*PATH_NAMES, *SPELLINGS, *OWN, *(field.name for field in fields(Constraints))]
ODD = [
    True,
    3,
    -1.5,
    10**400,
    math.inf,
    "long",
    "80mm",
    "1 2 3",
    b"3",
    [],
    [1, 2],
    [[1, 2], 3],
    {},
    {"size": 3},
    object(),
]


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(st.dictionaries(st.sampled_from(NAMES), st.sampled_from(ODD), max_size=3))
def test_odd_values_are_refused_as_requests(said: dict[str, Any]) -> None:
    with suppress(InvalidRequest):
        assert Request.from_dict({"stroke": 150, "deviation": 0.05, **said}).to_dict()


@pytest.mark.parametrize(("read", "text"), [(Request.from_json, "{"), (Request.from_json, "[1]"),
                                            (Request.from_toml, "stroke = ")])  # fmt: skip
def test_damaged_texts_are_told(read: Callable[[str], Request], text: str) -> None:
    with pytest.raises(InvalidRequest):
        read(text)


def test_a_request_is_changed_by_name() -> None:
    line = Request.of(StraightLine(150, 0.05), max_size=400, limit=3)
    changed = line.with_(deviation=0.1, max_size=500, rank_by="size")
    assert (changed.path.deviation, changed.constraints.max_size, changed.rank_by, changed.limit) == (
        0.1,
        500,
        "size",
        3,
    )
    with pytest.raises(InvalidRequest, match="did you mean max_size"):
        line.with_(max_sise=3)
    wide = Request.of(CircularArc(deviation=0.1, radius=50, angle=270))
    assert wide.with_(radius=100).path == CircularArc(deviation=0.1, radius=100, angle=270)
    narrow = Request.of(CircularArc(50, 0.1, 50))
    assert narrow.with_(stroke=60).path == CircularArc(60, 0.1, 50)
    assert Request.of(CircularArc(50, 0.1)).with_(stroke=60).path == CircularArc(60, 0.1)


@pytest.mark.slow
def test_requests_are_equal_by_what_they_ask(small: Catalogue) -> None:
    one = Request.of(StraightLine(150, 0.5), families=["four-bar"], rank_by="size=1,transmission=1", limit=2)
    assert one == Request.of(
        StraightLine(150.0, 0.5), families="four-bar", rank_by={"transmission": 3, "size": 3}, limit=2
    )
    assert one != one.with_(limit=3)
    found = small.find(one)
    assert found == small.find(one.path, families=["four-bar"], rank_by="size=1,transmission=1", limit=2)
    assert found.request == one
    with pytest.raises(InvalidRequest, match="limit stands in the request already"):
        small.find(one, limit=4)
    with pytest.raises(InvalidRequest, match="max_size stands in the request already"):
        small.find(one, max_size=4)


def test_a_request_file_is_found_by_the_command(tmp_path: Path) -> None:
    """A path of another kind than the command is refused."""
    (file := tmp_path / "arc.toml").write_text(Request.of(CircularArc(50, 0.1, 50)).to_toml())
    find: Any = app.get_command(None, "find")  # type: ignore[arg-type]  # it needs no context
    with pytest.raises(InvalidRequest, match="path is 'circular-arc', but the command is `find straight-line`"):
        find.get_command(None, "straight-line").make_context("straight-line", ["--config", str(file)])
