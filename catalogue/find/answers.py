"""Restore answers from codes and files: exactly the same mechanism, checked by measuring it."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import fields
from os import PathLike
from pathlib import Path
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Any, get_args, get_origin

from .. import __version__
from ..errors import InvalidRequest, quoted
from ..foreign_code import NAME
from ..given import field_types, number, positive, switch, whole
from ..given import text as printable
from ..guides.candidate import Candidate
from ..guides.chain_stretch import ChainStretch
from ..guides.codes import CODES, FORMAT, code_of, is_code, stored_record, text_of
from ..guides.dwell import DwellCandidate
from ..guides.own_chain import OwnChain
from ..guides.own_guide import OwnGuide
from ..guides.placed import PlacedGuide
from ..kinematics.linkage import Linkage
from ..problem.path import consistent_arc, point
from ..units import millimetres, unit_or_none

if TYPE_CHECKING:
    from ..collections.results import CollectionCandidate
    from ..collections.spec import Collection

#: Fields that hold names from plugins, or None.
NAMES = ("family", "series", "configuration", "nearest_series")

Answer = Any  # a Candidate, Stretch, OwnGuide, DwellCandidate, OwnChain, ChainStretch or CollectionCandidate


def recall(code: str, collection: Callable[[str], Collection] | None = None) -> Answer:
    """Restore an answer by its code.

    Parameters
    ----------
    code : str
        Code of the answer, as every table shows it.
    collection : callable, optional
        Returns a collection by name, such as ``cat.registry.collection``; for answers from
        collections.

    Returns
    -------
    Candidate, Stretch, OwnGuide, DwellCandidate or CollectionCandidate

    Raises
    ------
    InvalidRequest
        If no answer with this code is stored here, or the file of answers cannot be read.

    Examples
    --------
    >>> from catalogue import StraightLine, recall
    >>> found = cat.find(StraightLine(stroke=150, deviation=0.5), limit=1, refine=False)
    >>> (code,) = found.remember()
    >>> recall(code) == found[0]
    True
    """
    if not isinstance(code, str) or not is_code(code):
        raise InvalidRequest(
            f"{quoted(code)} is no code of an answer: these have {CODES.length} letters and digits or more"
        )
    found = stored_record(code)
    if found is None:
        raise InvalidRequest(
            f"no answer has the code {code} here: the last {CODES.kept} of this user on this machine are kept; "
            "`find --save FILE` keeps answers for good, --share DIR in a folder for others"
        )
    try:
        held = json.loads(found)
    except (TypeError, ValueError, RecursionError):
        raise InvalidRequest(f"the answer {code} is damaged: what is kept of it is no JSON") from None
    return answer({**held, "code": code} if isinstance(held, dict) else held, collection)


def load(path: str | Path, collection: Callable[[str], Collection] | None = None) -> list[Answer]:
    """Read answers from a file of `Results.save` or ``find --save``.

    Parameters
    ----------
    path : path
    collection : callable, optional
        Returns a collection by name, such as ``cat.registry.collection``; for answers from
        collections.

    Returns
    -------
    list of Candidate, Stretch, OwnGuide, DwellCandidate or CollectionCandidate

    Raises
    ------
    InvalidRequest
        If the file cannot be read, or holds no answers.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> from catalogue import StraightLine, load
    >>> found = cat.find(StraightLine(stroke=150, deviation=0.5), limit=2, refine=False)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "answers.json")
    ...     found.save(file)
    ...     load(file) == list(found)
    True
    """
    if not isinstance(path, str | PathLike):
        raise InvalidRequest(f"load wants the path of a file, not {quoted(path)}")
    try:
        held = json.loads(Path(path).read_text("utf-8-sig"))
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidRequest(f"cannot read {path}: {error}") from None
    if not is_saved(held):
        raise InvalidRequest(f"{path} is no file of answers: `find --save FILE` writes one")
    return [answer(one, collection) for one in held["answers"]]


def is_saved(held: Any) -> bool:
    """Tell whether the content of a JSON file is a list of saved answers."""
    return isinstance(held, dict) and held.get("format") == FORMAT and isinstance(held.get("answers"), list)


def candidate_of(text: str) -> Candidate:
    """Restore a candidate from the text of its record, for a start: it is not measured again.

    Raises
    ------
    InvalidRequest
        If the record is damaged.
    """
    try:
        held = json.loads(text)
        if held.pop("kind") != "Candidate":
            raise InvalidRequest("it is no answer of a find")
        one: Candidate = _check_types(Candidate(**held))
    except (LookupError, TypeError, ValueError, ArithmeticError, AttributeError) as error:
        raise InvalidRequest(f"an answer is damaged, or of another version than {__version__}: {error}") from None
    return one


def answer(held: dict[str, Any], collection: Callable[[str], Collection] | None = None) -> Answer:
    """Restore an answer from a record with its code.

    Raises
    ------
    InvalidRequest
        If the code is missing or does not match; see also `of_record`.
    """
    if not isinstance(held, dict):
        raise InvalidRequest(f"an answer is damaged: it is no record, but {quoted(held)}")
    values = dict(held)
    code = values.pop("code", None)
    if not isinstance(code, str) or not is_code(code):
        raise InvalidRequest("an answer is damaged: it has no code to tell whether it was changed; save it anew")
    if code != code_of(text_of(values), len(code)):
        raise InvalidRequest(f"an answer is damaged: it is not that of its code {quoted(code)}, it was changed")
    return of_record(values, collection)


def of_record(held: dict[str, Any], collection: Callable[[str], Collection] | None = None) -> Answer:
    """Restore an answer from a record, and check it by measuring its mechanism.

    Raises
    ------
    InvalidRequest
        If the record is invalid, or disagrees with the measurement.
    """
    from ..guides.stretch import Stretch
    from . import measured_again

    kinds: dict[str, Any] = {
        c.__name__: c for c in (Candidate, Stretch, OwnGuide, DwellCandidate, OwnChain, ChainStretch)
    }
    try:
        values = dict(held)
        kind = values.pop("kind", None)
        if kind == "CollectionCandidate":
            return _of_collection(values, collection)
        if "_window" in values:
            values["_window"] = tuple(values["_window"])
        if kind not in kinds:
            raise InvalidRequest(f"{quoted(kind)} is no kind of answer")
        one = _check_types(kinds[kind](**values))
        measured_again.check(one)
        return one
    except (LookupError, TypeError, ValueError, ArithmeticError) as error:
        raise InvalidRequest(f"an answer is damaged, or of another version than {__version__}: {error}") from None


def _check_types(one: Answer) -> Answer:
    """Check the types of the fields of an answer; `ValueError` for a wrong one."""
    for name, declared in field_types(type(one)).items():  # type: ignore[arg-type]  # a class can be hashed
        value = getattr(one, name)
        choices = get_args(declared) if isinstance(declared, UnionType) else ()
        if value is None and NoneType in choices:
            continue
        kind = next((choice for choice in choices if choice is not NoneType), declared)
        if name in ("stroke", "radius"):
            positive(name, value)
        elif kind is int:
            whole(name, value, 0)
        elif name == "unit":
            millimetres(value)
        elif kind is float:
            if not math.isfinite(number(name, value)):
                raise InvalidRequest(f"{name} must be finite, not {quoted(value)}")
        elif kind is str:
            printable(name, value)
            if name in NAMES and value and not NAME.fullmatch(value):
                raise InvalidRequest(f"{name} must be a name, not {quoted(value)}")
        elif kind is bool:
            switch(name, value)
        elif name in ("guided", "pole", "start", "joint", "pivot"):
            point(name, value)
        elif get_origin(kind) is list and not isinstance(value, list):
            raise InvalidRequest(f"{name} must be a list, not {quoted(value)}")
    if isinstance(one, PlacedGuide):
        Linkage(one.pivots)
    if isinstance(one, OwnChain):
        _ = one.read  # fails unless the data describe a mechanism
    if isinstance(one, Candidate) and one.arc_angle is not None:
        consistent_arc(one.stroke, positive("radius", one.radius), one.arc_angle)
    return one


def _of_collection(values: dict[str, Any], collection: Callable[[str], Collection] | None) -> CollectionCandidate:
    from ..collections.results import CollectionCandidate
    from .specimens import checked

    if collection is None:
        raise InvalidRequest("this answer is of a collection: ask an open catalogue for it")
    own = ("unit", "start", "along", "reverse", "over")
    named = {f.name: values[f.name] for f in fields(CollectionCandidate) if f.name not in own}
    x, y = point("start", values.get("start", (0.0, 0.0)))
    named |= {"start": (x, y), "along": number("along", values.get("along", 0.0))}
    named |= {name: switch(name, values.get(name, False)) for name in ("reverse", "over")}
    named |= {
        "unit": unit_or_none(values.get("unit")),
        "collection": collection(values["collection"]),
        "special": tuple(values["special"]),
    }
    return checked(CollectionCandidate(**named))
