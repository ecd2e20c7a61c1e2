"""Questions to a catalogue within a worker process: searches and words for series.

Functions here take and return picklable objects, and raise `CatalogueError` with a text for the
user.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..api import Catalogue
from ..engines import Begin
from ..find.answers import recall
from ..problem.problem import Request
from ..store import Database
from .cards import Card, card, drawing, variety

if TYPE_CHECKING:
    from ..find.explain import Advice

_OPEN: list[Catalogue] = []
#: Stages: the best stored guide of each kind, the first answers of a search, its last ones.
STAGES = ("draft", "early", "refined")


def begin(path: Path, plugins: Sequence[str]) -> Begin:
    """Return the preparation of a worker that answers from a catalogue."""
    return Begin(_open, (path, tuple(plugins)))


def _open(path: Path, plugins: Sequence[str]) -> None:
    """Open the catalogue read-only in this process."""
    _OPEN[:] = [Catalogue(Database.open(path, create=False, writable=False), plugins)]


def opened() -> Catalogue:
    """Return the open catalogue of this process."""
    return _OPEN[0]


def in_words(code: str) -> str:
    """Return the title of a series; an empty text for an unknown one."""
    series = opened().registry.series.get(code)
    return "" if series is None else str(series.title)


@dataclass(frozen=True)
class Answers:
    """Answers to a request: one card of each kind, then the others; or advice if there are none."""

    first: tuple[Card, ...]
    others: tuple[Card, ...]
    count: int  #: number of all answers, including those not shown at first
    stage: str  #: one of `STAGES`
    advice: Advice | None  #: reason for an empty result, and relaxations

    @property
    def refined(self) -> bool:
        """Whether these are the last answers."""
        return self.stage == STAGES[-1]


def search(request: Request, starts: Sequence[str], *, stage: str) -> Answers:
    """Answer a request, up to a stage."""
    catalogue, last = opened(), stage == STAGES[-1]
    guides = [recall(code, catalogue.registry.collection) for code in starts]
    wanted = request.with_(effort=0) if stage == "early" else request.with_(refine=last)
    found = catalogue.find(wanted, starts=guides)
    codes = found.remember() if last else [""] * len(found)
    first, others = variety([*zip(found, codes, strict=True)], [(one.family, one.series) for one in found])
    cards = [
        [card(one, code, drawing(one), in_words(one.series)) for one, code in part]
        for part in (first, others if last else [])
    ]
    advice = found.explanation.advice() if last and not found else None
    return Answers(tuple(cards[0]), tuple(cards[1]), len(found), stage, advice)
