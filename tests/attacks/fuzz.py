"""Hostile input: what is given to functions, in files and on the command line is answered or refused, never a crash.

``python tests/attacks/fuzz.py DATABASE [--cases 100000] [--write]`` tries so many cases on a database, shared by the
targets, prints what came of them and the least case of each that fell; ``--write`` writes ``data/reports/fuzz.md``.
Nothing is searched, drawn or built: what would be begun raises `Begun`, which counts as taken.
"""

# ruff: noqa: E501, N811, PT017  # the table of targets; nothing here is a test by itself

from __future__ import annotations

import contextlib
import io
import json
import math
import operator
import os
import sqlite3
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from decimal import Decimal
from fractions import Fraction
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any
from unittest import mock
from urllib.parse import quote, urlencode

import numpy as np
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

import catalogue
from catalogue import CatalogueError, CircularArc, Linkage, StandStill, StraightLine
from catalogue import spatial as space
from catalogue.find.answers import of_record
from catalogue.guides.codes import FORMAT, code_of, record, remember, text_of
from catalogue.problem.constraints import ConstraintArguments, DwellArguments

OWN = {"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80}
CLOSED = {"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "angle": 60}
LINE = StraightLine(100, 0.5)
#: What a target returns that has refused what it was given, in its own way.
REFUSED = "refused"


class Begun(Exception):
    """Everything was taken, and work would begin."""


#: What begins work: module and name.
WORK = ("find.find searched", "find.prescribed_pivots with_prescribed_pivots", "find.dwells _turning",
        "find.specimens _Search", "populate.fill plan", "populate.collect state", "find.measure straightest",
        "find.measure longest", "find.improve measure", "draw.sheet sheet", "draw.plate plate",
        "spatial.guided.assemblies _Search", "spatial.jointed.mechanism search")  # fmt: skip


@contextlib.contextmanager
def idle() -> Iterator[None]:
    """Let nothing be searched, drawn or built, and what is opened by a relative name lie in a folder of its own."""

    def begin(*_: Any, **__: Any) -> None:
        raise Begun

    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), contextlib.ExitStack() as stack:
        stack.enter_context(mock.patch.dict(os.environ, {"CATALOGUE_ANSWERS": str(Path(folder) / "answers.db")}))
        for place in WORK:
            module, name = place.split()
            found = import_module(f"catalogue.{module}")
            if hasattr(found, name):
                stack.enter_context(mock.patch.object(found, name, begin))
        current = mock.patch.object(import_module("catalogue.populate.collect"), "is_current", return_value=True)
        stack.enter_context(current)
        yield


# -- what is given ----------------------------------------------------------------------------------------------------
NUMBERS = st.one_of(
    st.floats(), st.integers(), st.sampled_from([0, -1, 1, 2, 1e-320, 1e308, 10**400, 2**63, 2**64]),
    st.sampled_from([math.nan, math.inf, Decimal("sNaN"), Decimal("1e9999"), Fraction(1, 3), np.float32(2), np.int8(3)]),
)  # fmt: skip
WORDS = st.one_of(
    st.text(max_size=8),
    st.sampled_from(["", "four-bar", "II.xy", "watt", "size", "150", "nan", "~nosuch/x", "a" * 300, "\0", "a/" * 2100]),
    st.sampled_from(
        ["\ud800", "size=1,transmission=nan", "size>=3", "line", "9" * 400, "-", ".", "/", "s140ke5", "$\\x$"]
    ),
)
SCALARS = st.one_of(NUMBERS, WORDS, st.none(), st.booleans(), st.binary(max_size=4), st.complex_numbers())
ARRAYS = st.sampled_from(
    [np.zeros(0), np.zeros((3, 3)), np.array(["a"]), np.array([1j]), np.ones((1, 2, 2, 3)), np.full((2, 2, 2), np.nan),
     np.array([None]), np.zeros((0, 2, 2, 3)), np.arange(4), np.array(7), np.zeros((2, 2, 2, 2, 3)), np.array("x"), np.array(None),
     np.ma.masked, np.ma.masked_less(np.arange(4.0), 2)]
)  # fmt: skip
ANYTHING = st.recursive(
    st.one_of(SCALARS, ARRAYS, st.sampled_from([object(), int, LINE])),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.tuples(inner, inner), st.dictionaries(WORDS, inner, max_size=3),
        st.sets(st.integers(), max_size=2), st.builds(iter, st.lists(inner, max_size=2)),
    ),
    max_leaves=8,
)  # fmt: skip
PAIR = st.one_of(st.tuples(NUMBERS, NUMBERS), st.tuples(st.floats(-9, 9), st.floats(-9, 9)))
PIVOT = st.one_of(PAIR, st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.sampled_from([0, 1, 1e-310, 2, math.nan])))
PIVOTS = st.one_of(ANYTHING, st.tuples(st.tuples(PIVOT, PIVOT), st.tuples(PIVOT, PIVOT)))
LENGTHS = st.dictionaries(st.sampled_from([*OWN, "angle", "offset", "branch", "sum"]), st.one_of(NUMBERS, ANYTHING))


# -- what is right, or nearly so ---------------------------------------------------------------------------------------
@st.composite
def nearly(draw: st.DrawFn, right: Any, other: Any = SCALARS) -> Any:
    """Return something right; as often as not one part of it is left out, doubled or another thing."""
    given = draw(right)
    return _changed(draw, given, other) if draw(st.booleans()) else given


def _changed(draw: st.DrawFn, given: Any, other: Any) -> Any:
    if not isinstance(given, dict | list | tuple | bytes) or not given:
        return draw(other)
    how = draw(st.sampled_from(["left out", "doubled", "changed", "changed"]))
    if isinstance(given, dict):
        name = draw(st.sampled_from([*given]))
        if how == "left out":
            return {key: value for key, value in given.items() if key != name}
        return given | ({draw(WORDS): given[name]} if how == "doubled" else {name: _changed(draw, given[name], other)})
    whole: Any = given
    at = draw(st.integers(0, len(whole) - 1))
    part = whole[at : at + 1]
    if how == "changed":
        byte = isinstance(whole, bytes)
        part = draw(st.binary(min_size=1, max_size=2)) if byte else type(whole)([_changed(draw, whole[at], other)])
    return whole[:at] + {"left out": part[:0], "doubled": 2 * part, "changed": part}[how] + whole[at + 1 :]


COORDINATE = st.floats(-9, 9)
POINT = st.lists(COORDINATE, min_size=2, max_size=2)
#: Pivots [[A1, A1*], [A2, A2*]]; of a crank or of a slider the first, of a crank the second.
CRANK = st.lists(POINT, min_size=2, max_size=2)
SLIDER = st.tuples(COORDINATE.map(lambda x: [x, 1.0, 0.0]), POINT.map(lambda z: [*z, 1])).map(list)
RIGHT_PIVOTS = st.tuples(CRANK | SLIDER, CRANK).map(list)
BESIDE = {"along": COORDINATE, "across": COORDINATE}
POSITION = {"angle": st.floats(-360, 360), "branch": st.sampled_from([1, -1])}
RIGHT_LENGTHS = st.one_of(
    st.fixed_dictionaries({"ground": st.floats(200, 240), "crank": st.floats(80, 110), "coupler": st.floats(240, 260), "rocker": st.floats(240, 260)} | BESIDE, optional=POSITION),
    st.fixed_dictionaries({"crank": st.floats(80, 110), "coupler": st.floats(240, 260), "offset": st.floats(-50, 50)} | BESIDE, optional=POSITION),
)  # fmt: skip
#: What is right for a keyword.
KEYWORDS: dict[str, Any] = {
    "stroke": st.floats(1, 500), "deviation": st.floats(0.01, 0.2), "start": st.tuples(COORDINATE, COORDINATE), "along": st.floats(-180, 180),
    "radius": st.floats(300, 1e9), "angle": st.floats(1, 180), "residual": st.floats(0.01, 0.5), "swing": st.floats(1, 90),
    "scale": st.floats(0.1, 9), "shift": COORDINATE, "mirror": st.booleans(), "samples": st.integers(2, 40), "driver": st.integers(0, 2),
    "points": st.dictionaries(st.text(max_size=3), st.tuples(COORDINATE, COORDINATE), max_size=2), "whole": st.booleans(),
    "arc": st.booleans(), "limit": st.integers(1, 40), "rank_by": st.sampled_from(["score", "size", "deviation", {"size": 1, "transmission": 2}]),
    "hold": st.sampled_from(["frame", "crank 1", ["crank 1", "crank 2"]]), "effort": st.integers(1, 3), "in_place": st.booleans(),
    "within": st.floats(0, 9), "per_series": st.integers(1, 9), "distinct": st.floats(0, 0.5), "refine": st.booleans(), "cognates": st.booleans(),
    "round_to": st.sampled_from([0.1, 1.0, None]), "desires": st.just({"size": (100, 300)}), "families": st.just(["four-bar"]),
    "series": st.sampled_from(["II.xy", ["II.xy", "I.GG"]]), "configurations": st.just(["++"]), "order": st.integers(3, 6), "pins_only": st.booleans(),
    "min_transmission": st.floats(0, 60), "max_size": st.floats(100, 1e4), "max_link": st.floats(100, 1e4), "min_link": st.floats(0.1, 30), "min_ground": st.floats(0.1, 30),
    "fixed_pivots_in": st.tuples(st.floats(-999, -9), st.floats(-999, -9), st.floats(9, 999), st.floats(9, 999)),
    "fixed_pivots": st.just([(0, 100), (200, 100)]), "keep_out": st.just([(0, 0, 10, 10)]), "full_rotation": st.booleans(),
    "count": st.integers(1, 9999), "seed": st.integers(0, 99), "processes": st.integers(1, 4), "kind": st.sampled_from(["line", "arc"]),
    "reaches": st.booleans(), "quiet": st.booleans(), "where": st.just({"size": (None, 9.0)}), "name": st.just("spatial-guidance"),
    "request": st.just(LINE), "plugins": st.just([]), "build": st.just(False),
}  # fmt: skip
LINKAGES = st.one_of(PIVOTS, LENGTHS, nearly(RIGHT_PIVOTS | RIGHT_LENGTHS))


def _keywords(names: Any) -> Any:
    """Return a strategy of some keywords: right, or up to two of them hostile."""
    right = st.fixed_dictionaries({}, optional={name: KEYWORDS[name] for name in names if name in KEYWORDS})
    hostile = st.dictionaries(st.sampled_from([*names]), st.one_of(ANYTHING, NUMBERS, PAIR, WORDS), max_size=2)
    return hostile | right | st.builds(operator.or_, right, hostile)


FIND = (*ConstraintArguments.__annotations__, "limit", "rank_by", "per_series", "distinct", "effort", "refine",
        "cognates", "round_to", "desires", "starts")  # fmt: skip
Target = Callable[[catalogue.Catalogue, Any], Any]


def _moved(opened: catalogue.Catalogue, data: Any) -> Any:  # noqa: ARG001  # all targets are called alike
    linkage = Linkage([[[0, 0], [1, 1]], [[3, 0], [2, 2]]])
    return linkage.moved(**data)


MINE = catalogue.guide(OWN)
#: What is tried, by name: what is given, and to whom.
TARGETS: dict[str, tuple[Any, Target]] = {
    "StraightLine": (_keywords(("stroke", "deviation", "start", "along")),
                     lambda _, k: StraightLine(**{"stroke": 100, "deviation": 0.5} | k)),
    "CircularArc": (_keywords(("stroke", "deviation", "radius", "start", "along")),
                    lambda _, k: CircularArc(**{"stroke": 100, "deviation": 0.5} | k)),
    "between": (st.tuples(ANYTHING | PAIR, ANYTHING | PAIR, NUMBERS | ANYTHING), lambda _, k: StraightLine.between(*k)),
    "StandStill": (_keywords(("angle", "residual", "swing")),
                   lambda _, k: StandStill(**{"angle": 40, "residual": 1, "swing": 20} | k)),
    "Linkage": (PIVOTS, lambda _, k: (Linkage(k).family, Linkage(k).size, repr(Linkage(k)))),
    "Linkage.moved": (_keywords(("scale", "shift", "mirror")), _moved),
    "classify": (LINKAGES, lambda opened, k: opened.classify(k).to_pandas()),
    "classify guided": (ANYTHING | NUMBERS, lambda opened, k: opened.classify([[[0, 0], [1, 1]], [[3, 0], [2, 2]]]).guided(k)),
    "singularity": (ANYTHING | NUMBERS, lambda opened, k: opened.classify([[[0, 0], [1, 1]], [[3, 0], [2, 2]]]).singularity(k)),
    "tolerance": (ANYTHING | NUMBERS | st.floats(0, 1), lambda opened, k: opened.classify(CLOSED, tolerance=k).to_pandas()),
    "curvature": (LINKAGES, lambda _, k: catalogue.curvature(k).reason),
    "curvature branch": (ANYTHING | st.integers(-1, 2), lambda _, k: catalogue.curvature([[[0, 0], [1, 1]], [[3, 0], [2, 2]]], k)),
    "guide": (st.tuples(LINKAGES, ANYTHING | PAIR | st.none()), lambda _, k: _all_of(catalogue.guide(*k))),
    "guide name": (ANYTHING | WORDS, lambda _, k: repr(catalogue.guide(OWN, name=k))),
    "motion": (_keywords(("samples", "points", "driver")), lambda _, k: MINE.motion(**{"samples": 5} | k)),
    "measure": (st.tuples(ANYTHING | st.just(MINE), _keywords(("stroke", "deviation", "arc", "radius", "limit", "series"))),
                lambda _, k: catalogue.measure(k[0], **{"stroke": 120} | k[1])),
    "improve": (st.tuples(ANYTHING | st.just(LINE), _keywords(("hold", "rank_by", "effort", "within", "in_place", *FIND))),
                lambda _, k: catalogue.improve(MINE, k[0], **k[1])),
    "find": (st.tuples(ANYTHING | st.just(LINE), _keywords(FIND)), lambda opened, k: opened.find(k[0], **k[1])),
    "find dwells": (_keywords((*DwellArguments.__annotations__, "limit", "effort")),
                    lambda opened, k: opened.find_dwells(StandStill(40, 1, 20), **k)),
    "find in": (_keywords(("name", "request", "limit", "rank_by", "families", "series", "where", "quiet")),
                lambda opened, k: opened.find_in(**{"name": "spatial-guidance", "request": LINE} | k)),
    "specimen": (_keywords(("name", "number", "stroke")),
                 lambda opened, k: opened.specimen(**{"name": "spatial-guidance", "number": 1} | k)),
    "build": (_keywords(("count", "seed", "processes", "series", "report")), lambda opened, k: opened.build(**k)),
    "build collection": (_keywords(("name", "count", "seed", "report")),
                         lambda opened, k: opened.build_collection(**{"name": "spatial-guidance"} | k)),
    "Catalogue.guide": (ANYTHING | NUMBERS | WORDS, lambda opened, k: opened.guide(k)),
    "guides": (_keywords(("series", "families", "configurations", "kind", "order", "pins_only", "reaches")),
               lambda opened, k: opened.guides(**{"series": "II.xy"} | k)),
    "StoredGuide.at": (st.tuples(NUMBERS | ANYTHING | st.floats(1e-3, 1e3), NUMBERS | ANYTHING | st.none() | st.integers(-7, -1)),
                       lambda opened, k: repr(opened.guide(1).at(*k))),
    "Candidate.path": (ANYTHING | NUMBERS | st.integers(2, 200), lambda opened, k: _first(opened).path(k)),
    "Candidate.motion": (_keywords(("samples", "points", "driver", "whole")), lambda opened, k: _first(opened).motion(**{"samples": 5} | k)),
    "Candidate.plot": (ANYTHING | WORDS | WORDS.map("{}.svg".format), lambda opened, k: _first(opened).plot(k)),
    "Candidate.plot by keyword": (_keywords(("file", "ax", "moving", "unit", "scale")), lambda opened, k: _first(opened).plot(**k)),
    "Candidate.off_nominal": (ANYTHING | NUMBERS | PAIR, lambda opened, k: _first(opened).off_nominal(k)),
    "Candidate.drawn_motion": (_keywords(("samples", "points", "whole")), lambda opened, k: _first(opened).drawn_motion(**{"samples": 5} | k)),
    "open": (_keywords(("path", "plugins", "build", "quiet")), lambda opened, k: _opened(opened, k)),
}  # fmt: skip


def _all_of(one: Any) -> Any:
    return one.lengths, one.circuits, one.dead_points, one.change_points, repr(one)


def _first(opened: catalogue.Catalogue) -> Any:
    if "first" not in vars(opened):
        vars(opened)["first"] = opened.guide(1).at(1.0)
    return vars(opened)["first"]


def _opened(opened: catalogue.Catalogue, given: dict[str, Any]) -> None:
    how: dict[str, Any] = {"path": opened.database.path, "build": False} | given
    with catalogue.open(**how) as other:
        _ = other.registry if "plugins" in given else other.complete


# -- files ------------------------------------------------------------------------------------------------------------
CELL = st.one_of(st.floats(-9, 9).map(repr), st.sampled_from(["", "x", "nan", "9" * 400, "1,5", '"', "\0", "\ufeff", "1e400", "A1", "crank"]), st.text(max_size=3), st.builds("a".__mul__, st.just(140_000)))  # fmt: skip
CSV = st.builds(
    lambda rows, by, end: end.join(by.join(row) for row in rows),
    st.lists(st.one_of(st.lists(CELL, max_size=14), st.lists(st.floats(-9, 9).map(repr), min_size=8, max_size=8)), max_size=4),
    st.sampled_from([",", ";", "\t", ", "]), st.sampled_from(["\n", "\r\n", "\r"]),
)  # fmt: skip
JSON_VALUE = st.recursive(
    st.one_of(st.floats(-9, 9).map(repr), st.sampled_from(["null", "true", "NaN", "9" * 400, "9" * 5000, '"a"', '"\\ud800"', "1e400", "{}", "[]", "[" * 3000])),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4).map(lambda parts: f"[{','.join(parts)}]"),
        st.dictionaries(st.sampled_from([*OWN, "pivots", "point", "guided", "x", "y", "angle", "answers", "format"]), inner, max_size=5)
        .map(lambda held: "{" + ",".join(f'"{k}":{v}' for k, v in held.items()) + "}"),
    ),
    max_leaves=16,
)  # fmt: skip
SAVED = JSON_VALUE.map(lambda one: f'{{"format":"{FORMAT}","answers":[{one}]}}')
TEXTS = st.one_of(CSV, JSON_VALUE, SAVED, st.text()).map(lambda text: text.encode("utf-8", "surrogatepass"))

#: What a JSON file can hold in the place of something else.
PLAIN = st.one_of(
    st.floats(),
    st.integers(),
    st.sampled_from([10**400, 2**63]),
    WORDS,
    st.none(),
    st.booleans(),
    st.lists(st.floats(), max_size=2),
)
#: Records of answers of the catalogue that is attacked, see `attack`.
RECORDS: list[dict[str, Any]] = []
RECORD = st.deferred(lambda: st.sampled_from(RECORDS))
SAVED_AGAIN = st.fixed_dictionaries(
    {"format": st.just(FORMAT), "version": st.just("0"), "answers": st.lists(RECORD, max_size=2)}
)
GUIDED = st.fixed_dictionaries({"pivots": RIGHT_PIVOTS}, optional={"point": POINT, "guided": POINT})
RIGHT_JSON = st.one_of(
    RIGHT_PIVOTS,
    GUIDED,
    RIGHT_LENGTHS,
    SAVED_AGAIN,
    st.lists(RIGHT_PIVOTS | GUIDED | RIGHT_LENGTHS, min_size=1, max_size=3),
)
#: Lines of numbers, with a guided point or without; a heading with lines below it.
LINES = st.lists(
    st.sampled_from([8, 10, 10, 12, 14]).flatmap(lambda n: st.lists(COORDINATE, min_size=n, max_size=n)),
    min_size=1,
    max_size=3,
)
HEADED = st.lists(RIGHT_LENGTHS, min_size=1, max_size=3).map(
    lambda held: [[*held[0]], *([*one.values()] for one in held if [*one] == [*held[0]])]
)


def _json(given: Any) -> bytes:
    return json.dumps(given).encode()


def _sheet(rows: list[Any], end: str) -> bytes:
    return end.join(",".join(map(str, row)) for row in rows if isinstance(row, list)).encode("utf-8", "surrogatepass")


FILES = st.one_of(
    TEXTS, st.binary(max_size=64), nearly(nearly(RIGHT_JSON, PLAIN).map(_json), st.binary(max_size=64)),
    nearly(st.builds(_sheet, nearly(LINES | HEADED, CELL), st.sampled_from(["\n", "\r\n"])), st.binary(max_size=64)),
)  # fmt: skip


def _read(opened: catalogue.Catalogue, content: bytes) -> str:
    from catalogue.cli.reading import read_linkages
    from catalogue.cli.references import guides

    def told() -> None:
        for one in guides("given.csv", None, lambda: opened):
            assert one.lengths

    Path("given.csv").write_bytes(content)
    ways = (lambda: catalogue.curvature(read_linkages("given.csv")), lambda: _used(catalogue.load("given.csv")), told)
    taken = [_taken(way) for way in ways]
    return "answered" if any(taken) else REFUSED


def _taken(way: Callable[[], Any]) -> bool:
    """Return whether something is answered; how it is refused is looked at."""
    try:
        way()
    except CatalogueError as error:
        _look_at(error)
        return False
    return True


def _used(answers: list[Any]) -> None:
    """Use answers that were read."""
    for one in answers:
        assert repr(one)
        json.dumps(one.to_dict(), allow_nan=False)
        assert one.lengths
        one.motion(samples=3)


def _loaded(_: catalogue.Catalogue, given: Any) -> None:
    if isinstance(given, bytes):
        Path("given.json").write_bytes(given)
    _used(catalogue.load("given.json" if isinstance(given, bytes) else given))


def _recalled(_: catalogue.Catalogue, given: Any) -> None:
    code = given
    if isinstance(given, bytes):  # in the place of what is kept
        code = remember([MINE])[0]
        with contextlib.closing(sqlite3.connect(os.environ["CATALOGUE_ANSWERS"], isolation_level=None)) as file:
            file.execute("UPDATE answer SET record = ? WHERE code = ?", (given.decode(errors="replace"), code))
    try:
        _used([catalogue.recall(code)])
    finally:
        Path(os.environ["CATALOGUE_ANSWERS"]).unlink(missing_ok=True)


TARGETS["files"] = (FILES, _read)
TARGETS["load"] = (ANYTHING | WORDS | nearly(SAVED_AGAIN, PLAIN).map(_json), _loaded)
TARGETS["recall"] = (ANYTHING | WORDS | nearly(nearly(RECORD, PLAIN).map(_json)), _recalled)


# -- the command ------------------------------------------------------------------------------------------------------
def _options() -> dict[tuple[str, ...], list[str]]:
    """Return the flags of each command."""
    from catalogue.cli import FIND as finding
    from catalogue.cli import app

    found: dict[tuple[str, ...], Any] = {
        (name,): app.get_command(None, name)  # type: ignore[arg-type]
        for name in app.modules
        if name != "serve"  # does not end; `page` is what it is asked
    }
    found |= {("find", name): finding.get_command(None, name) for name in finding.modules}  # type: ignore
    return {name: [f for p in one.params for f in p.opts if f[:2] == "--"] for name, one in found.items() if one}


#: What a system can hand to a program: no text with NUL.
ARGUMENT = st.one_of(WORDS, st.floats().map(repr), st.integers().map(str)).filter(lambda text: "\0" not in text)
ARGV = st.sampled_from([*_options().items()]).flatmap(
    lambda command: st.tuples(
        st.just(command[0]),
        st.lists(st.one_of(st.sampled_from(command[1]), ARGUMENT), max_size=5),
        st.lists(ARGUMENT, max_size=2),
    )
)


def _commanded(opened: catalogue.Catalogue, given: Any) -> None:
    from catalogue.cli import main

    name, options, arguments = given
    usual = ["--stroke", "100", "--deviation", "0.5"] if name[0] == "find" and name[1] != "dwell" else []
    argv = ["catalogue", *name, *usual, *(str(one) for one in (*options, *arguments))]
    told, shown = io.StringIO(), io.StringIO()
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        mock.patch.object(sys, "argv", argv),
        mock.patch.object(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"0,0,1,1,3,0,2,2,1,1\n"))),
        mock.patch.dict(os.environ, {"CATALOGUE_DB": str(opened.database.path)}),
        contextlib.redirect_stdout(shown),
        contextlib.redirect_stderr(told),
    ):
        try:
            main()
        except SystemExit as end:
            assert end.code in (0, 1, 2, 3, 4, 5, 6), (end.code, told.getvalue())
            said = told.getvalue() + (shown.getvalue() if name == ("doctor",) else "")  # it is asked what is wrong
            assert not end.code or said, "an error without a word"
            assert len(told.getvalue()) < 3000


TARGETS["command line"] = (ARGV, _commanded)


# -- the page ---------------------------------------------------------------------------------------------------------
PLACE = st.one_of(
    st.sampled_from(["/", "/answers", "/compare", "/own", "/own/measured", "/gallery", "/guide/1", "/guide/watt/dxf"]),
    st.builds("/guide/{}".format, WORDS), st.builds("/guide/{}/{}".format, WORDS, WORDS), WORDS.map("/{}".format),
)  # fmt: skip
FIELDS = ("kind", "stroke", "deviation", "radius", "from", "to", "max-size", "min-transmission", "family", "series",
          "rank-by", "unit", "stage", "pick", "linkage", "x", "y", "fixed-pivots-in", "full-rotation")  # fmt: skip
GIVEN = st.one_of(
    WORDS, st.floats().map(repr), st.sampled_from(["line", "arc", "40", "0.5", "in", "draft", "refined"]), JSON_VALUE
)
#: Characters of an address that the client sends.
LONGEST = 60_000
ADDRESS = st.tuples(PLACE, st.lists(st.tuples(st.sampled_from(FIELDS) | WORDS, GIVEN), max_size=5))


def _asked(opened: catalogue.Catalogue, given: Any) -> None:
    from starlette.testclient import TestClient

    from catalogue.cli.serve import wish_form
    from catalogue.web.application import application
    from catalogue.web.desk import Thread

    place, fields = given
    form = wish_form(tuple(opened.registry.series))
    page = application(Path(opened.database.path), form, tokens=["token"], make=Thread)
    where = f"{quote(place, errors='surrogatepass')}?{urlencode(fields, errors='surrogatepass')}"[:LONGEST]
    with TestClient(page, base_url="http://127.0.0.1", follow_redirects=False) as client:
        client.get("/?token=token")
        answer = client.get(where)
    assert answer.status_code in (200, 303, 307, 400, 403, 404, 414, 501, 503), (answer.status_code, answer.text)


TARGETS["page"] = (ADDRESS, _asked)
#: Past the digest, which would refuse each record that is nearly right.
TARGETS["record"] = (
    nearly(RECORD, PLAIN),
    lambda opened, given: of_record({k: v for k, v in given.items() if k != "code"} if isinstance(given, dict) else given,
                                    opened.registry.collection),
)  # fmt: skip


# -- mechanisms in space ----------------------------------------------------------------------------------------------
#: What is called, with what is right for it.
Call = tuple[Callable[..., Any], dict[str, Any]]


@cache
def _space() -> tuple[dict[str, Call], st.SearchStrategy[Any]]:
    """Return calls by name, and odd arguments. The first call sweeps, so numba may compile for a minute."""
    crank_rocker: list[Any] = [space.Revolute("crank", (0, 0, 0), axis=(0, 0, 1)), space.Revolute("rocker", (40, 0, 10), axis=(0, 1, 0)),
                    space.Link("crank", (10, 0, 0), "rocker", (40, 5, 40), name="rod")]  # fmt: skip
    machine, crank_angle = space.Mechanism(crank_rocker), space.Joint("crank")
    turn = machine.sweep(crank_angle, [0.0, 0.1, 0.2])
    on_circle = space.OnGuide("rocker", (1, 0, 0), "circle", (1.0,))
    wheel = space.Wheel("rocker", (40, 5, 40), (0, 1, 0), 5.0)
    read: dict[str, Any] = {
        "name": "rocker",
        "reading": lambda motion: motion.joint("rocker"),
        "over": space.Sweep(crank_angle, [0.0, 0.1]),
    }
    body = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    guided_body = space.Mechanisms(
        body, [space.Guides("circle", (1.0,)), space.Guides("circle", (1.0,), (1, 0, 0)), space.Guides("cylinder", (1.0,), (0, 1, 0))],
        [(0, "u")],
    )  # fmt: skip
    near = np.array([[0.0, np.nan], [0.0, np.nan], [0.0, 0.0]])
    at_start = space.solve_positions(guided_body, [0.0], near)

    def _with(element: Any) -> Callable[..., Any]:
        """Return what makes a mechanism with an element, or moves one by a scalar."""
        if element in (space.Joint, space.Travel, space.Length, space.Angle, space.GuideCoordinate):
            return lambda **k: machine.sweep(element(**k), [0.0, 0.1])
        return lambda **k: space.Mechanism([*crank_rocker, element(**k)]).mobility

    def _fitted(searched: bool = True, **given: Any) -> None:
        """Fit by what is given; as many starts and steps as somebody asks for are only begun."""
        right: dict[str, Any] = {
            "mechanism": machine,
            "targets": [space.Target(**read)],
            "boxes": [space.Box("rod.to", 1.0)],
        }
        fitting = import_module("catalogue.spatial.fitting.fit")
        with contextlib.nullcontext() if searched else mock.patch.object(fitting, "Search", side_effect=Begun):
            space.fit(**{**right, "starts": 1, "steps": 2, **given})

    # what is called, with what is right for it
    calls: dict[str, Call] = {
        "Guides": (space.Guides, {"kind": ["torus", "sphere"], "parameters": [[3.0, 1.0]], "origin": (0, 0, 0), "quaternion": (1, 0, 0, 0)}),
        "Mechanisms": (space.Mechanisms, {"body": body, "guides": guided_body.guides, "drivers": [(0, "u")], "formulation": "pose"}),
        "matrix": (space.matrix, {"q": [[1.0], [0], [0], [0]]}),
        "quaternion": (space.quaternion, {"r": np.eye(3)[..., None].tolist()}),
        "solve_positions": (space.solve_positions, {"mechanisms": guided_body, "drivers": [0.0], "start": near.tolist()}),
        "guided assemblies": (space.assemblies, {"mechanisms": guided_body, "drivers": [0.0], "hits": 5, "most": 128, "seed": 1, "method": "elimination"}),
        "follow": (lambda i, **k: space.follow(**k).node(i), {"i": 0, "mechanisms": guided_body, "path": [[0.0], [0.1]], "start": at_start}),
        "jets": (space.jets, {"mechanisms": guided_body, "positions": at_start, "rates": [[1.0, 0.0]]}),
        "Mechanism": (space.Mechanism, {"elements": crank_rocker, "unit": "mm"}),
        "Link": (_with(space.Link), {"a": "rocker", "from_": (41, 0, 10), "b": "ground", "to": (1, 2, 3), "name": "leg"}),
        "Spherical": (_with(space.Spherical), {"body": "arm", "at": (1, 2, 3), "on": "rocker", "name": "ball"}),
        "Revolute": (_with(space.Revolute), {"body": "arm", "at": (1, 2, 3), "axis": (1, 0, 0), "to": None, "on": "rocker", "name": "pin"}),
        "Revolute through": (_with(space.Revolute), {"body": "arm", "at": (1, 2, 3), "to": (2, 2, 3), "on": "rocker"}),
        "Screw": (_with(space.Screw), {"body": "nut", "at": (1, 2, 3), "axis": (1, 0, 0), "lead": 2.0, "on": "rocker"}),
        "Prismatic": (_with(space.Prismatic), {"body": "slide", "axis": (1, 0, 0), "at": (1, 2, 3), "on": "rocker", "name": "rail"}),
        "Cylindrical": (_with(space.Cylindrical), {"body": "slide", "at": (1, 2, 3), "axis": (1, 0, 0), "on": "rocker", "name": "bush"}),
        "OnGuide": (_with(space.OnGuide), {"body": "arm", "at": (1, 0, 0), "guide": "circle", "parameters": (1.0,), "origin": (0, 0, 0),
                                           "quaternion": (1, 0, 0, 0), "on": "rocker", "name": "ring"}),
        "KeepAngle": (_with(space.KeepAngle), {"a": "rocker", "axis_a": (1, 0, 0), "b": "ground", "axis_b": (0, 1, 0), "name": "cross"}),
        "Joint": (_with(space.Joint), {"body": "crank", "index": 0}),
        "Travel": (_with(space.Travel), {"body": "rocker", "point": (40, 5, 40), "along": "x"}),
        "Length": (_with(space.Length), {"a": "crank", "from_": (10, 0, 0), "b": "ground", "to": (1, 9, 3)}),
        "Length of": (_with(space.Length), {"link": "rod"}),
        "Angle": (_with(space.Angle), {"body": "crank", "direction": (1, 0, 0), "about": (0, 0, 1)}),
        "GuideCoordinate": (_with(space.GuideCoordinate), {"guide": "ring", "coordinate": "u"}),
        "sweep": (machine.sweep, {"drive": crank_angle, "values": [0.0, 0.1], "hold": (), "grid": False}),
        "sweep by several": (lambda angle, **k: machine.sweep({crank_angle: angle}, **k), {"angle": [0.0, 0.1], "hold": {}, "grid": True}),
        "Sum": (_with(space.Sum), {"parts": (crank_angle,), "weights": (2.0,)}),
        "value": (turn.value, {"scalar": crank_angle}),
        "ratio": (turn.ratio, {"scalar": crank_angle, "moving": crank_angle, "still": ()}),
        "by": (turn.by, {"scalar": crank_angle}),
        "motion in time": (turn.in_time, {"rates": [[1.0], [0.0]]}),
        "system": (machine.system, {}),
        "circuit": (lambda count, **k: machine.circuit(**k).motion(count), {"count": 9, "drive": crank_angle, "hold": ()}),
        "circuits": (machine.circuits, {"drive": crank_angle, "hold": ()}),
        "assemblies": (machine.assemblies, {"drive": crank_angle, "value": 0.1, "hold": (), "hits": 2, "most": 128, "seed": 1}),
        "one": (machine.one, {"i": 0}),
        "plot": (machine.plot, {"file": None, "labels": True, "title": ""}),
        "motion plot": (turn.plot, {"file": None, "wheel": wheel, "points": {"end": ("rocker", (40, 5, 40))}, "labels": True, "title": ""}),
        "plot_curves": (turn.plot_curves, {"table": space.transmission(turn, "rocker"), "file": None}),
        "series": (turn.series, {"order": 2}),
        "rows": (turn.rows, {"reading": [0.0, 1.0, 2.0]}),
        "each": (lambda value: turn.each(value, "a point"), {"value": (1, 2, 3)}),
        "carries": (turn.carries, {"b": 1}),
        "point": (turn.point, {"body": "rocker", "at": (1, 2, 3), "order": 1}),
        "direction": (turn.direction, {"body": "rocker", "vector": (1, 2, 3), "order": 1}),
        "rotation": (turn.rotation, {"body": "rocker"}),
        "spin": (turn.spin, {"body": "rocker", "order": 1}),
        "joint": (turn.joint, {"body": "rocker", "index": 0, "order": 1}),
        "in_time": (space.in_time, {"reduced": [[1.0, 2.0, 3.0]], "rates": [1.0, 0.0]}),
        "Wheel": (lambda **k: space.kinematics(turn, space.Wheel(**k)), {"carrier": "rocker", "centre": (40, 5, 40), "axis": (0, 1, 0), "radius": 5.0}),
        "kinematics": (space.kinematics, {"motion": turn, "wheel": wheel, "steer": None, "spring": ()}),
        "axle": (lambda wheelbase: space.axle(turn, wheel, space.Wheel("rocker", (40, -5, 40), (0, 1, 0), 5.0), None, wheelbase), {"wheelbase": 100.0}),
        "anti_dive": (space.anti_dive, {"support_angle": [1.0, 2.0], "wheelbase": 2000.0, "height": 500.0, "share": 0.6}),
        "links": (space.links, {"guide": on_circle}),
        "links of": (lambda **k: space.links(space.OnGuide(**k)), {"body": "arm", "at": (1, 0, 0), "guide": "circle", "parameters": (1.0,), "origin": (0, 0, 0), "quaternion": (1, 0, 0, 0)}),
        "transmission": (space.transmission, {"motion": turn, "output": "rocker", "link": "rod"}),
        "reactions": (space.reactions, {"motion": turn, "loads": [space.Load("rocker", (1, 0, 0), (40, 5, 40))]}),
        "Load": (lambda **k: space.reactions(turn, [space.Load(**k)]), {"body": "rocker", "force": (1, 0, 0), "at": (1, 2, 3), "moment": (0, 0, 1)}),
        "sensitivities": (space.sensitivities, {"motion": turn, "reading": read["reading"]}),
        "link_length": (space.link_length, {"motion": turn, "link": "rod"}),
        "off_line": (space.off_line, {"points": [[1.0, 2, 3]], "at": (0, 0, 0), "along": (1, 0, 0)}),
        "off_circle": (space.off_circle, {"points": [[1.0, 2, 3]], "centre": (0, 0, 0), "axis": (1, 0, 0), "radius": 2.0}),
        "Sweep": (space.Sweep, {"drive": crank_angle, "values": [0.0, 0.1], "hold": ()}),
        "Target": (lambda **k: _fitted(targets=[space.Target(**read | k)]), {"value": [0.0, 0.1], "tolerance": 0.1, "offset": False, "unit": "rad", **read}),
        "Bound": (lambda **k: _fitted(bounds=[space.Bound(**read | k)]), {"least": -1.0, "most": 1.0, "tolerance": 0.1, "unit": "rad", **read}),
        "Box": (lambda **k: _fitted(boxes=[space.Box(**k)]), {"points": ["rod.to"], "half": (1.0, 0, 1), "mirror": ""}),
        "fit": (lambda **k: _fitted(searched=False, **k), {"mechanism": machine, "targets": [space.Target(**read)], "boxes": [space.Box("rod.to", 1.0)], "bounds": (), "starts": 1, "steps": 2, "seed": 1}),
        "space load": (space.load, {"file": "no.toml"}),
    }  # fmt: skip
    odd = st.sampled_from([crank_angle, machine, turn, wheel, on_circle, guided_body, at_start, guided_body.guides[0], len, float, lambda: 0, lambda x: x])  # fmt: skip
    return calls, odd


ODD = st.one_of(
    ANYTHING, NUMBERS, WORDS,
    st.sampled_from([np.broadcast_to(0.0, (2**40, 3)), np.broadcast_to(0.0, 2**40), np.zeros((0, 3)), np.ones((2, 3)), np.ones((3, 3), bool),
                     np.array([[1e308, -1e308, 0]]), [1e200, 0, 0], [1e-200, 0, 0], [Fraction(1, 2)] * 3, [Decimal(1)] * 3, (x for x in "abc")]),
    st.deferred(lambda: _space()[1]),
)  # fmt: skip


@st.composite
def _called(draw: st.DrawFn) -> tuple[str, dict[str, Any]]:
    """Return a call with up to two hostile arguments, or with nearly right ones."""
    calls, _ = _space()
    name = draw(st.sampled_from([*calls]))
    right = calls[name][1]
    some = draw(st.lists(st.sampled_from([*right]), max_size=2, unique=True)) if right else []
    return name, right | {one: draw(ODD | nearly(st.just(right[one]), ODD)) for one in some}


def _in_space(_: catalogue.Catalogue, given: Any) -> None:
    name, arguments = given
    function, right = _space()[0][name]
    function(**right | arguments)


SPACE_FILE = {
    "unit": "mm", "revolute": [{"body": "crank", "at": [0, 0, 0], "axis": [0, 0, 1]}, {"body": "rocker", "at": [40, 0, 10], "axis": [0, 1, 0]}],
    "link": [{"name": "rod", "a": "crank", "from": [10, 0, 0], "b": "rocker", "to": [40, 5, 40]}],
    "drive": {"crank": {"kind": "joint", "body": "crank"}}, "transmission": {"output": "rocker", "link": "rod"},
    "point": [{"body": "rocker", "at": [40, 5, 40], "name": "end"}],
    "wheel": {"carrier": "rocker", "centre": [40, 5, 40], "axis": [0, 1, 0], "radius": 5.0, "steer": ""}, "title": "",
    "fit": {"sweep": {"turn": {"drive": "crank", "from": 0.0, "to": 5.0, "steps": 3, "hold": []}}, "box": [{"points": ["rod.to"], "half": [1, 0, 1], "mirror": ""}],
            "target": [{"read": "rocker [deg]", "over": "turn", "value": 0.0, "tolerance": 0.1, "offset": False},
                       {"point": "end", "circle": {"centre": [0, 0, 0], "axis": [0, 0, 1], "radius": 9.0}, "over": "turn"}],
            "bound": [{"length": "rod", "least": 1.0, "most": 99.0, "over": "turn"}]},
}  # fmt: skip


def _space_file(_: catalogue.Catalogue, content: bytes) -> None:
    Path("space.toml").write_bytes(content)
    job = space.load("space.toml")
    motion = job.mechanism.sweep(job.drive("crank"), [0.0, 0.1])
    job.table(motion)
    job.plot(motion, "space.svg")
    import_module("catalogue.spatial.fitting.files").fit_file(job, starts=1, steps=2)


TARGETS["space"] = (_called(), _in_space)
TARGETS["space files"] = (
    nearly(nearly(nearly(st.just(SPACE_FILE), PLAIN), PLAIN).map(_json), st.binary(max_size=8)),
    _space_file,
)


def _look_at(error: CatalogueError) -> None:
    """Look at how something is refused."""
    said = str(error)
    assert said, error
    assert "\n" not in said, said
    assert len(said) < 10_000, said  # a name that is too long is quoted


# -- runs -------------------------------------------------------------------------------------------------------------
def tried(opened: catalogue.Catalogue, name: str, data: Any) -> str:
    """Return whether a case is answered or refused; what is neither is raised."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if TARGETS[name][1](opened, data) is REFUSED:
                return "refused"
    except Begun:
        pass
    except CatalogueError as error:
        _look_at(error)
        return "refused"
    return "answered"


def sealed(held: dict[str, Any]) -> dict[str, Any]:
    """Return a record with its code."""
    return {"code": code_of(text_of(held)), **held}


def attack(opened: catalogue.Catalogue, name: str, cases: int, *, number: int = 0) -> Counter[str]:
    """Try a target so many times; the least case that is neither answered nor refused is raised."""
    count: Counter[str] = Counter()
    RECORDS[:] = [sealed(record(MINE)), sealed(record(_first(opened)))]

    @seed(number)
    @settings(max_examples=cases, deadline=None, database=None, suppress_health_check=[*HealthCheck])
    @given(TARGETS[name][0])
    def case(data: Any) -> None:
        count[tried(opened, name, data)] += 1

    case()
    return count


def main() -> None:
    """Try all targets, print a table and what fell."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
    from measuring import arguments, table, title

    parser = arguments()
    parser.add_argument("database", type=Path)
    parser.add_argument("--cases", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--write", action="store_true")
    asked = parser.parse_args()
    # files, command lines, addresses and all calls of space are the widest ways in: each gets as much as six functions
    wide = ("files", "command line", "page", "space")
    share = {name: 6 if name in wide else 1 for name in asked.only or TARGETS}
    rows: list[list[Any]] = []
    fallen: list[str] = []
    with catalogue.open(asked.database, build=False) as opened:
        assert opened.registry.series
        for name, weight in share.items():
            count: Counter[str] = Counter()
            try:
                with idle():
                    count = attack(opened, name, -(-asked.cases * weight // sum(share.values())), number=asked.seed)
            except Exception as error:  # or several of them
                fallen.append(name)
                lines = traceback.format_exception(error)
                print(f"--- {name}\n{''.join(lines)[-3000:]}", file=sys.stderr, flush=True)
            rows.append([name, count.total(), count["answered"], count["refused"], int(name in fallen)])
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        title("What becomes of hostile input")
        print("Cases that Hypothesis made, by what they were given to.  Answered: taken, up to where work would begin.\n"
              "Refused: one line of a documented class.  Fell: targets for which anything else happened.\n")  # fmt: skip
        total: list[Any] = [sum(row[k] for row in rows) for k in range(1, 5)]
        table(["target", "cases", "answered", "refused", "fell"], [*rows, ["all", *total]])
    print(out.getvalue())
    if asked.write:
        (Path(__file__).parents[2] / "data" / "reports" / "fuzz.md").write_text(out.getvalue(), "utf-8")
    sys.exit(bool(fallen))


if __name__ == "__main__":
    main()
