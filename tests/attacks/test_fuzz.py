"""A sample of what `fuzz.py` tries, and every case that once fell."""

from __future__ import annotations

import math
import runpy
from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue

FUZZ = SimpleNamespace(**runpy.run_path(str(Path(__file__).with_name("fuzz.py"))))


@pytest.fixture(scope="module")
def idle(small: Catalogue) -> Iterator[Catalogue]:
    """Return a catalogue that searches, draws and builds nothing."""
    assert small.registry.series
    with FUZZ.idle():
        yield small


#: The record of an answer, but for its stroke, its pole, the start of its path and the cranks that turn.
ANSWER = (
    b'{"kind":"Candidate","id":1,"family":"four-bar","series":"IV*.l","configuration":"opposite","order":4,"stroke":%b,'
    b'"deviation":9.7e-5,"radius":null,"size":3.4,"max_link":1.7,"max_ground":3.4,"max_arm":1.0,"min_transmission":74.3,'
    b'"pivots":[[[-0.5778,0.8994,1.0],[-0.3679,-0.5372,1.0]],[[1.1640,-2.0046,1.0],[1.3740,-0.5680,1.0]]],'
    b'"guided":[0.5,0.0],"driver":1,"drive_angle":38.1,"time_ratio":null,"uniformity":0.76,"advantage":0.9,"rotation":9.5,'
    b'"min_link":1.45,"min_transmission_turn":null,"allowance":0.047,"sensitivity_rms":1.06,"expected":9.7e-5,"score":85.0,'
    b'"front":null,"nearest":null,"gap":null,"alternations":null,"cognate":null,"along":0.0,'
    b'"pole":%b,"start":%b,"rotates":%b}'
)
#: What fell, shrunk: target, what was given.
FELL: list[tuple[str, Any]] = [
    ("Linkage", [None, np.array(7)]),
    ("Linkage.moved", {"scale": ""}),
    ("Linkage.moved", {"shift": [1, 2, 3]}),
    ("classify guided", []),
    ("classify guided", "1"),
    ("classify guided", -(2**63) - 1),
    ("singularity", "x"),
    ("singularity", [1, 2, 3]),
    ("guide name", np.zeros(0)),
    ("guide name", 7),
    ("Catalogue.guide", math.inf),
    ("Catalogue.guide", "\n"),
    ("Catalogue.guide", "\ud800"),
    ("Catalogue.guide", [1]),
    ("guides", {"kind": 0.0}),
    ("guides", {"kind": (0.0, 0.0)}),
    ("guides", {"series": "\ud800"}),
    ("guides", {"reaches": "yes"}),
    ("find in", {"name": "\n"}),
    ("StoredGuide.at", (1.0, Decimal("sNaN"))),
    ("Candidate.path", "x"),
    ("Candidate.path", 10**400),
    ("Candidate.plot", []),
    ("between", ((0.0, 4.5e-240), (1.8e84, 0.0), 1.0)),
    ("find", (FUZZ.LINE, {"series": np.array("x")})),
    ("find", (FUZZ.LINE, {"families": np.array("x"), "keep_out": [1, 2, 3, 4]})),
    ("find", (FUZZ.LINE, {"keep_out": np.array(7)})),
    ("find", (FUZZ.LINE, {"starts": np.ma.masked})),
    ("guides", {"configurations": np.array("x")}),
    ("guides", {"kind": np.array("line")}),
    ("measure", (FUZZ.MINE, {"series": 5})),
    ("specimen", {"stroke": "x"}),
    ("Candidate.off_nominal", "x"),
    ("Candidate.off_nominal", []),
    ("Candidate.plot by keyword", {"ax": 5}),
    ("Candidate.plot by keyword", {"file": "a.svg", "moving": np.zeros(3)}),
    ("Candidate.drawn_motion", {"whole": np.zeros(3)}),
    ("load", "\ud800"),
    ("recall", b'{kind": "OwnGuide"}'),
    ("recall", ANSWER % (b"1.0", b"null", b"[0.0]", b"[]")),
    ("recall", ANSWER % (b"1.0", b"0.0", b"[0.0, 0.0]", b"[]")),
    ("recall", ANSWER % (b"1.0", b"[0.0]", b"[0.0, 0.0]", b"[]")),
    ("recall", ANSWER % (b"1.0", b"null", b"[0.0, 0.0]", b"7")),
    ("recall", ANSWER % (b"0.0", b"null", b"[0.0, 0.0]", b"[]")),
    ("recall", ANSWER % (b"2.0", b"null", b"[0.0, 0.0]", b"[]")),
    ("open", {"path": 7}),
    ("open", {"build": np.zeros(0)}),
    ("files", b"[" * 100_000),
    ("files", b"9" * 5000),
    ("files", b'{"format":"mechanism-catalogue answers","answers":[' + b"9" * 5000 + b"]}"),
    ("files", b'[[[{"x":1},1],[1,1]]]'),
    ("space", ("Mechanism", {"elements": 5})),
    ("space", ("Mechanism", {"elements": np.broadcast_to(0.0, (2**40, 3))})),
    ("space", ("Guides", {"kind": "sphere", "parameters": "x"})),
    ("space", ("Guides", {"parameters": 5.0})),
    ("space", ("Guides", {"origin": np.zeros((3, 3))})),
    ("space", ("Mechanisms", {"drivers": [5]})),
    ("space", ("Mechanisms", {"guides": [], "body": np.zeros((0, 3))})),
    ("space", ("sweep", {"drive": "x"})),
    ("space", ("sweep", {"hold": 5})),
    ("space", ("assemblies", {"value": "x"})),
    ("space", ("circuit", {"count": [[]]})),
    ("space", ("one", {"i": 5})),
    ("space", ("Screw", {"lead": Decimal("sNaN")})),
    ("space", ("KeepAngle", {"axis_a": (1, 0, -5e183)})),
    ("space", ("Travel", {"point": [[1, 2], [3]]})),
    ("space", ("matrix", {"q": 5})),
    ("space", ("quaternion", {"r": [1j]})),
    ("space", ("follow", {"i": 9})),
    ("space", ("jets", {"positions": None})),
    ("space", ("jets", {"rates": np.ones((1, 200))})),
    ("space", ("point", {"order": -1})),
    ("space", ("spin", {"order": 0})),
    ("space", ("rows", {"reading": [[1.0], {}]})),
    ("space", ("plot", {"title": "$\\x$"})),
    ("space", ("motion plot", {"points": {"end": ("rocker", "rocker", (1, 2, 3))}})),
    ("space", ("in_time", {"rates": 5.0})),
    ("space", ("anti_dive", {"height": "x"})),
    ("space", ("off_line", {"along": (0, 0, 0)})),
    ("space", ("off_circle", {"radius": None})),
    ("space", ("sensitivities", {"reading": len})),
    ("space", ("reactions", {"loads": 5})),
    ("space", ("Target", {"value": 1e308})),
    ("space", ("fit", {"boxes": ["rod.to"]})),
    ("space", ("Box", {"points": np.broadcast_to(0.0, (2**40, 3))})),
    ("space", ("Box", {"points": np.array(7)})),
    ("space", ("space load", {"file": 5})),
    ("space files", b'{"drive": {"crank": {"kind": []}}, "spherical": [{"body": "a", "at": [0, 0, 0]}]}'),
    ("command line", (("doctor",), ["--db"], [""])),
    ("command line", (("doctor",), [], [""])),
    ("command line", (("show",), [], ["a" * 5000])),
    ("command line", (("show",), [], ["\ud800"])),
    ("command line", (("plate",), ["--out", "\ud800"], [])),
]


@pytest.mark.parametrize(("name", "data"), FELL, ids=[f"{name} {k}" for k, (name, _) in enumerate(FELL)])
def test_what_fell_once_holds(idle: Catalogue, name: str, data: Any) -> None:
    assert FUZZ.tried(idle, name, data) in ("refused", "answered")


@pytest.mark.slow
@pytest.mark.parametrize("name", FUZZ.TARGETS)
def test_hostile_input_is_answered_or_refused(idle: Catalogue, name: str) -> None:
    FUZZ.attack(idle, name, 20 if name in ("files", "command line", "space") else 8)
