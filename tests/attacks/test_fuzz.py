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
    ("load", "\ud800"),
    ("recall", b'{kind": "OwnGuide"}'),
    ("open", {"path": 7}),
    ("files", b"[" * 100_000),
    ("files", b"9" * 5000),
    ("files", b'{"format":"mechanism-catalogue answers","answers":[' + b"9" * 5000 + b"]}"),
    ("files", b'[[[{"x":1},1],[1,1]]]'),
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
    FUZZ.attack(idle, name, 40 if name in ("files", "command line") else 15)
