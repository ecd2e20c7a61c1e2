"""Tasks of a study in a worker: answer a request, compute the costs of given answers.

A worker has its own copy of the catalogue, identified by its digest, and only reads it.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..api import Catalogue
from ..candidates.batch import with_allowance
from ..candidates.feasibility import cost
from ..engines import Begin
from ..errors import CatalogueError, DatabaseError
from ..find.answers import candidate_of
from ..find.find import find
from ..find.starts import start_batch
from ..folders import replacing, user_folder
from ..guides.candidate import Candidate
from ..guides.codes import code_of, record, text_of
from ..problem.problem import Request
from ..store import Database
from ..store.digest import content_digest

_OPEN: list[Catalogue] = []


@dataclass(frozen=True)
class Done:
    """Result of a task, as texts and numbers."""

    records: tuple[str, ...] = ()  #: answers, best first
    reason: str | None = None
    #: alternative sets of relaxations: option, value, requested value
    advice: tuple[tuple[tuple[str, str, str], ...], ...] = ()
    cost: float | None = None  #: cost of the best answer
    seconds: float = 0.0
    failed: bool = False

    @property
    def codes(self) -> list[str]:
        """Codes of the answers."""
        return [code_of(text) for text in self.records]


def begin(catalogue: Catalogue) -> Begin:
    """Return the preparation of a worker that queries this catalogue, or a copy of it."""
    path = catalogue.database.path
    return Begin(_open, (str(path), content_digest(path), tuple(catalogue.plugin_folders)))


def copy_of(digest: str) -> Path:
    """Return the path of a catalogue that was sent to this machine."""
    return user_folder() / "copies" / f"{digest}.db"


def holds(path: str, digest: str) -> bool:
    """Tell whether this machine has a catalogue of this digest."""
    return _place(path, digest) is not None


def receive(digest: str, content: bytes) -> None:
    """Store a catalogue that was sent."""
    place = copy_of(digest)
    place.parent.mkdir(parents=True, exist_ok=True)
    with replacing(place) as part:
        part.write(content)


def _place(path: str, digest: str) -> Path | None:
    places = (Path(path), copy_of(digest))
    return next((one for one in places if one.is_file() and content_digest(one) == digest), None)


def _open(path: str, digest: str, plugins: Sequence[str]) -> None:
    place = _place(path, digest)
    if place is None:
        raise DatabaseError(f"{path} is not on this machine, or of another content: start the study again to send it")
    _OPEN[:] = [Catalogue(Database.open(place, create=False, writable=False), plugins)]


def answer(text: str, starts: Sequence[str], *, warm: bool, follow: bool, advise: bool) -> Done:
    """Answer a request.

    Parameters
    ----------
    text : str
        The request as JSON.
    starts : sequence of str
        Records of answers to start from.
    warm : bool
        Whether the starts answer a tighter request.
    follow : bool
        Whether to omit the search where the starts suffice.
    advise : bool
        Whether to compute advice for an empty result.
    """
    clock = time.process_time()
    try:
        request = Request.from_json(text)
        guides = tuple(candidate_of(one) for one in starts)
        found = find(_OPEN[0], request, guides, warm=warm, follow=follow)
        if len(found):
            records = tuple(text_of(record(one)) for one in found)
            return Done(records, cost=found.cost, seconds=time.process_time() - clock)
        if not advise:
            return Done(reason="no guide found", seconds=time.process_time() - clock)
        advice = found.explanation.advice()
    except CatalogueError as error:
        return Done(reason=str(error), seconds=time.process_time() - clock)
    offers = tuple(tuple((one.option, one.value, one.asked) for one in offer) for offer in advice.alternatives)
    return Done(reason=advice.reason, advice=offers, seconds=time.process_time() - clock)


def costs(text: str, records: Sequence[str]) -> list[float]:
    """Compute the costs of answers by the ranking of another request; infinite if unknown."""
    return [float(one) for one in _costs(Request.from_json(text), [candidate_of(one) for one in records])]


def _costs(request: Request, guides: Sequence[Candidate]) -> Any:
    problem = request.problem
    found = start_batch(problem, guides)
    if len(found) < len(guides):  # one cannot be placed along the path
        return np.concatenate([_costs(request, [one]) for one in guides]) if len(guides) > 1 else np.full(1, np.inf)
    if problem.needs_allowance or problem.constraints.play:
        found = with_allowance(problem, found)  # the allowance of a search is rough
    values = cost(problem, found)
    return np.where(np.isfinite(values), values, np.inf)


def request_texts(requests: Sequence[Request]) -> list[str]:
    """Return requests as JSON, which identifies them in a file."""
    return [json.dumps(json.loads(one.to_json()), sort_keys=True) for one in requests]
