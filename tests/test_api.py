"""What `catalogue` is asked: refused in one line where it cannot be meant, known to a type checker; copies of it."""

from __future__ import annotations

import copy
import math
import pickle
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields
from decimal import Decimal
from fractions import Fraction
from importlib import import_module
from inspect import Parameter, signature
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue import (
    Catalogue,
    CatalogueError,
    CircularArc,
    ConstraintArguments,
    Constraints,
    DatabaseError,
    InvalidLinkage,
    InvalidRequest,
    Linkage,
    PluginError,
    StandStill,
    StraightLine,
)
from catalogue.problem.constraints import DwellArguments

LINE, REST = StraightLine(150, 0.5), StandStill(40, 1, 20)
PIVOTS = [[[-1, 0.6], [0, 0.6]], [[1, -0.6], [0, -0.6]]]

OWN = {"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80}
MINE = catalogue.guide(OWN)

VALUES = {
    "None": None,
    "text": "long",
    "digits": "150",
    "bytes": b"150",
    "empty list": [],
    "three": [1, 2, 3],
    "nested": [[1, 2], [3]],
    "nan": math.nan,
    "inf": math.inf,
    "-inf": -math.inf,
    "huge": 10**400,
    "immense": -(10**5000),
    "complex": 1j,
    "mapping": {},
    "object": object(),
    "True": True,
    "np.True": np.True_,
    "empty array": np.zeros(0),
    "matrix": np.zeros((3, 3)),
    "texts": np.array(["a", "b"]),
    "phasors": np.array([1j, 2, 3, 4]),
}
#: What is taken, of each parameter; all else is refused.
NONE, NOTHING, SWITCH = frozenset[str](), frozenset({"None"}), frozenset({"True", "np.True"})
EMPTY = frozenset({"empty list", "empty array"})
MANY = EMPTY | {"three"}
FIND = {
    **dict.fromkeys(
        (
            "max_size",
            "max_link",
            "min_link",
            "max_ground",
            "min_ground",
            "max_arm",
            "max_travel",
            "min_allowance",
            "min_lift",
        ),
        NOTHING,
    ),
    **dict.fromkeys(("min_drive_angle", "max_drive_angle", "max_rotation", "min_uniformity", "min_advantage"), NOTHING),
    **dict.fromkeys(("fixed_pivots_in", "pivots_in", "swept_in", "fixed_pivots", "moving_pivots", "crank"), NOTHING),
    **dict.fromkeys(("round_to", "per_series"), NOTHING),
    **dict.fromkeys(("pins_only", "slots", "returns", "full_rotation", "refine", "cognates"), SWITCH),
    **dict.fromkeys(("families", "series", "configurations", "keep_out"), EMPTY),
    **dict.fromkeys(("order", "within", "play", "min_transmission", "min_transmission_turn"), NONE),
    **dict.fromkeys(("request", "limit", "effort", "distinct", "rank_by"), NONE),
    "desires": NOTHING | {"mapping"},
    "starts": EMPTY,
}
DWELL = {name: FIND[name] for name in ("request", "limit", "effort", *DwellArguments.__annotations__)}
SPECIMENS = {name: FIND[name] for name in ("request", "limit", "effort", "families", "series")}
SPECIMENS |= {"name": NONE, "rank_by": NONE, "where": NOTHING | {"mapping"}, "special": EMPTY}
SPECIMENS |= {"quiet": SWITCH, "refine": SWITCH | NOTHING}
BUILD = {"count": NOTHING, "seed": NOTHING, "processes": NOTHING, "series": EMPTY, "engine": NONE, "report": NONE}
CLASSIFY = {"linkage": NONE, "tolerance": NOTHING, "plugins": EMPTY}
LINES = dict.fromkeys(("stroke", "deviation", "start", "along"), NONE) | {"unit": NOTHING}


class Searched(Exception):
    """Everything was taken, and work would begin."""


@pytest.fixture
def asked(small: Catalogue, monkeypatch: pytest.MonkeyPatch) -> dict[str, Callable[..., Any]]:
    """Return the questions by their names; none of them searches, draws or writes."""

    def begin(*_: Any, **__: Any) -> None:
        raise Searched

    for place in ("find.find searched", "find.prescribed_pivots with_prescribed_pivots", "find.dwells _turning",
                  "find.specimens _Search", "populate.fill plan", "find.measure straightest", "find.measure longest",
                  "find.improve measure"):  # fmt: skip
        module, name = place.split()
        monkeypatch.setattr(import_module(f"catalogue.{module}"), name, begin)
    monkeypatch.setattr(import_module("catalogue.populate.collect"), "is_current", lambda *_: True)
    return {
        "find": lambda request=LINE, **given: small.find(request, **given),
        "find_dwells": lambda request=REST, **given: small.find_dwells(request, **given),
        "find_in": lambda name="spatial-guidance", request=LINE, **given: small.find_in(name, request, **given),
        "build": small.build,
        "classify": lambda linkage=PIVOTS, **given: catalogue.classify(linkage, **given),
        "curvature": lambda linkage=PIVOTS, branch=None: catalogue.curvature(linkage, branch),
        "Linkage": lambda pivots: Linkage(pivots),
        "lengths": lambda **given: catalogue.classify({"crank": 1, "coupler": 3, "angle": 70} | given),
        "StraightLine": lambda **given: StraightLine(**{"stroke": 150, "deviation": 0.05} | given),
        "CircularArc": lambda **given: CircularArc(**{"stroke": 150, "deviation": 0.05} | given),
        "guide": lambda linkage=PIVOTS, point=(1, 2), unit=None: catalogue.guide(linkage, point, unit=unit),
        "own lengths": lambda **given: catalogue.guide(OWN | given),
        "measure": lambda guides=MINE, **given: catalogue.measure(guides, **{"stroke": 120} | given),
        "within": lambda deviation: catalogue.measure(MINE, deviation=deviation),
        "improve": lambda guide=MINE, request=LINE, **given: catalogue.improve(guide, request, **given),
        "motion": lambda **given: MINE.motion(**given),
        "recall": lambda code: catalogue.recall(code),
        "load": lambda path: catalogue.load(path),
        "StandStill": lambda **given: StandStill(**{"angle": 40, "residual": 1, "swing": 20} | given),
    }


TAKEN: dict[str, dict[str, frozenset[str]]] = {
    "find": FIND,
    "find_dwells": DWELL,
    "find_in": SPECIMENS,
    "build": BUILD,
    "classify": CLASSIFY,
    "curvature": {"linkage": NONE, "branch": NOTHING},
    "Linkage": {"pivots": NONE},
    "lengths": {"crank": MANY, "offset": MANY, "angle": MANY, "branch": EMPTY},
    "StraightLine": LINES,
    "CircularArc": {**LINES, "radius": NOTHING, "angle": NOTHING},
    "guide": {"linkage": NONE, "point": NONE, "unit": NOTHING},
    "own lengths": {"crank": NONE, "along": NONE, "angle": NONE},
    "measure": {
        "guides": NONE,
        "stroke": NONE,
        "deviation": NOTHING,
        "radius": NOTHING,
        "limit": NONE,
        "arc": SWITCH,
    },
    "within": {"deviation": NONE},
    "improve": {
        **dict.fromkeys(("guide", "request", "rank_by", "effort", "within"), NONE),
        "hold": EMPTY,
        "in_place": SWITCH,
    },
    "motion": {"samples": NONE, "points": NOTHING | {"mapping"}, "driver": NOTHING},
    "recall": {"code": NONE},
    "load": {"path": NONE},
    "StandStill": dict.fromkeys(("angle", "residual", "swing", "crank"), NONE) | {"unit": NOTHING},
}


def refusals(what: str, name: str) -> tuple[type[CatalogueError], ...]:
    if name in ("linkage", "pivots") or what in ("lengths", "own lengths"):
        return (InvalidLinkage,)
    return (InvalidRequest, PluginError) if name in ("name", "plugins") else (InvalidRequest,)


def refusal(ask: Callable[[], Any], kinds: tuple[type[CatalogueError], ...]) -> str:
    """Return how a question is refused; an empty text if it is taken."""
    try:
        ask()
    except Searched:
        pass
    except kinds as error:
        return str(error)
    return ""


@pytest.mark.slow
@pytest.mark.parametrize(("what", "name"), [(what, name) for what, names in TAKEN.items() for name in names])
def test_what_cannot_be_meant_is_refused_in_one_line(
    asked: dict[str, Callable[..., Any]], what: str, name: str
) -> None:
    for told, value in VALUES.items():
        said = refusal(lambda value=value: asked[what](**{name: value}), refusals(what, name))  # type: ignore[misc]
        assert (said == "") == (told in TAKEN[what][name]), (told, said)
        assert len(said) < 600
        assert "\n" not in said


def test_every_parameter_is_tried() -> None:
    """`request` is positional; constraints are those that a type checker knows."""
    for method, more, tried in (
        (Catalogue.find, ConstraintArguments, FIND),
        (Catalogue.find_dwells, DwellArguments, DWELL),
        (Catalogue.find_in, None, SPECIMENS),
        (Catalogue.build, None, BUILD),
    ):
        given = [name for name, p in signature(method).parameters.items() if p.kind is not Parameter.VAR_KEYWORD]
        assert {*given[1:], *(more.__annotations__ if more else ())} == {*tried}
    for function in (catalogue.classify, catalogue.curvature, StraightLine, CircularArc, StandStill):
        assert {*signature(function).parameters} == {*TAKEN[function.__name__]}


@pytest.mark.parametrize("number", [np.float32(2), np.int64(2), np.array(2.0), Fraction(2), Decimal(2)], ids=repr)
def test_numbers_of_other_types_are_numbers(number: Any) -> None:
    arc = CircularArc(number, number / 64, number, start=(number, number), along=number)
    assert arc == CircularArc(2, 1 / 32, 2, start=(2, 2), along=2)
    assert {type(x) for x in (arc.stroke, arc.deviation, arc.radius, arc.along, *arc.start)} == {float}
    assert Constraints(max_size=number, min_transmission=number, fixed_pivots_in=[-number, 0, number, 1]).max_size == 2


@pytest.mark.parametrize(
    ("method", "name", "says"),
    [
        ("find", "min_transmision", "did you mean min_transmission?"),
        ("find", "fixed_pivot_in", "did you mean fixed_pivots_in?"),
        ("find", "rankby", "did you mean rank_by?"),
        ("find", "horsepower", "`help(catalogue.Constraints)` lists what there is"),
        ("find_dwells", "efort", "did you mean effort?"),
        ("find_dwells", "famlies", "did you mean families?"),
    ],
)
def test_an_unknown_constraint_gets_the_nearest_name(
    asked: dict[str, Callable[..., Any]], method: str, name: str, says: str
) -> None:
    with pytest.raises(InvalidRequest, match=f"^{re.escape(f'unknown constraint: {name!r}; {says}')}$"):
        asked[method](**{name: 3})


# -- types ------------------------------------------------------------------------------------------------------------
def test_a_type_checker_knows_the_constraints_as_they_are() -> None:
    """All names in both places, and the same types but where a field holds what becomes of what is given."""
    known = ConstraintArguments.__annotations__
    assert {*known} == {field.name for field in fields(Constraints)}
    for field in fields(Constraints):
        told = known[field.name]
        assert field.type in ("Any", getattr(told, "__forward_arg__", told))


#: Lines of code, and what mypy says of each: a part of an error, or of what it reveals.
CHECKED = {
    "box = (0, 0, float('inf'), 9)": "",
    "hall = [(0, 0), (9, 0), (0, 9)]": "",
    "found = cat.find(line, limit=3, min_transmission=40, fixed_pivots_in=box, keep_out=[box, hall])": "",
    "reveal_type(found[0].deviation)": '"float"',
    "reveal_type(found[0].linkage)": '"catalogue.kinematics.linkage.Linkage"',
    "cat.find(line, families='four-bar', crank=[[0, 0], [1, 2]], pivots_in=hall, max_size=None, keep_out=box)": "",
    "cat.find(line, min_transmision=40)": 'Unexpected keyword argument "min_transmision"',
    "cat.find(line, min_transmission='40')": 'Argument "min_transmission" to "find" of "Catalogue" has incompatible',
    "cat.find(line, fixed_pivots_in='here')": 'Argument "fixed_pivots_in" to "find" of "Catalogue" has incompatible',
    "cat.find(line, pins_only='yes')": 'Argument "pins_only" to "find" of "Catalogue" has incompatible',
    "cat.find(line, limit='many')": 'Argument "limit" to "find" of "Catalogue" has incompatible',
    "cat.find('line')": 'Argument 1 to "find" of "Catalogue" has incompatible',
    "cat.find_dwells(catalogue.StandStill(90, 1, 30), order=4, max_size=4)": "",
    "cat.find_dwells(catalogue.StandStill(90, 1, 30), max_arm=4)": 'Unexpected keyword argument "max_arm"',
    "cat.find_in('swings', line, where={'size': (None, 3)})": "",
    "cat.find_in('swings', line, where={'size': 3})": "incompatible",
    "catalogue.CircularArc(100, 0.05, None, start=(1, 2))": "",
    "catalogue.CircularArc(100, None, 0.05)": 'Argument 2 to "CircularArc" has incompatible type',
    "catalogue.classify({'crank': [1, 2], 'coupler': 3, 'angle': 40}).to_pandas()": "",
    "reveal_type(catalogue.curvature([[(0, 0), (1, 0)], [(2, 0), (2, 1)]]).rho0)": "ndarray",
    "catalogue.StraigthLine": 'Module has no attribute "StraigthLine"',
}


@pytest.mark.slow
def test_mypy_finds_wrong_names_and_types(tmp_path: Path) -> None:
    pytest.importorskip("mypy", reason="mypy comes with the test extra")
    root = Path(catalogue.__file__).parents[1]
    if not (root / "pyproject.toml").exists():
        pytest.skip("mypy is configured in a checkout")
    start = ["import catalogue", "cat, line = catalogue.open(), catalogue.StraightLine(150, 0.05)"]
    (file := tmp_path / "asking.py").write_text("\n".join([*start, *CHECKED]))
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--no-error-summary", "--hide-error-context", str(file)],
        cwd=root, capture_output=True, text=True, check=False, timeout=600,
    )  # fmt: skip
    said: dict[int, str] = {}
    for line in done.stdout.splitlines():
        place, text = line.split(":", 2)[1:]
        said.setdefault(int(place), text)
    for number, (code, expected) in enumerate(CHECKED.items(), len(start) + 1):
        text = said.pop(number, "")
        assert expected in text, (code, text)
        assert bool(expected) == bool(text), (code, text)
    assert not said, done.stdout + done.stderr


# -- copies -----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))], ids=["copy", "deep", "pickle"]
)
def test_a_copy_of_a_catalogue_asks_the_same_file(small: Catalogue, copied: Callable[[Catalogue], Catalogue]) -> None:
    assert small.registry.series  # which cannot be pickled
    with copied(small) as other:
        assert other is not small
        assert repr(other) == repr(small)
        assert other.complete
        assert other.guide(1).series == small.guide(1).series
        assert [*other.registry.series] == [*small.registry.series]
    assert small.complete


def test_a_pickled_catalogue_does_not_make_a_file_that_is_gone(tmp_path: Path) -> None:
    with catalogue.open(tmp_path / "new.db", build=False) as made:
        kept = pickle.dumps(made)
    (tmp_path / "new.db").unlink()
    with pytest.raises(DatabaseError, match=r"new\.db does not exist: run `catalogue build` first"):
        pickle.loads(kept)
    assert not (tmp_path / "new.db").exists()


@pytest.mark.slow
# -- one's own lists --------------------------------------------------------------------------------------------------
def test_lists_and_lengths_are_taken_where_linkages_are(small: Catalogue) -> None:
    bars = {"ground": 4, "crank": 2.4, "coupler": 2, "rocker": 2.4, "angle": 65.3756}
    linkage = Linkage.of(bars)
    for given in (bars, linkage, linkage.pivots, linkage.pivots[0].tolist(), linkage.pivots[..., :2].tolist()):
        assert catalogue.classify(given, tolerance=1e-5)[0].series == ["I.GG"]
        assert small.classify(given, tolerance=1e-5)[0].series == ["I.GG"]
        np.testing.assert_array_equal(catalogue.curvature(given).pole, catalogue.curvature(linkage).pole)


@pytest.mark.parametrize("name", ["fixed_pivots_in", "pivots_in", "swept_in", "keep_out"])
def test_half_planes_are_regions_and_what_is_turned_or_no_number_is_not(
    asked: dict[str, Callable[..., Any]], name: str
) -> None:
    with pytest.raises(Searched):
        asked["find"](**{name: (-math.inf, 0, math.inf, math.inf)})
    for box, says in (((3, 0, 1, 1), "turned inside out"), ((0, 0, 1, math.nan), "not a number")):
        with pytest.raises(InvalidRequest, match=f"^{name} .*{says}"):
            asked["find"](**{name: box})
