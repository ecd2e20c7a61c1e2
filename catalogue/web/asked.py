"""What is asked of a catalogue, in a process that has it open: searches, guides, own linkages, the gallery.

Every function here runs in a worker, takes and returns what can be pickled, and raises a `CatalogueError` that is told
to the user as it is.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..api import Catalogue
from ..find.answers import recall
from ..problem.request import Request
from ..store import Database
from .cards import Card, card, drawing, variety

if TYPE_CHECKING:
    from ..find.explain import Advice

_OPEN: list[Catalogue] = []


def begin(path: Path, plugins: Sequence[str], patience: int) -> None:
    """Open the catalogue, only to be read, in this process; `patience`: by how much it lets others go first."""
    for name in ("OMP", "OPENBLAS", "MKL"):
        os.environ.setdefault(f"{name}_NUM_THREADS", "1")
    if patience and hasattr(os, "nice"):
        os.nice(patience)
    _OPEN[:] = [Catalogue(Database.open(path, create=False, writable=False), plugins)]


def opened() -> Catalogue:
    """Return the catalogue of this process."""
    return _OPEN[0]


def in_words(code: str) -> str:
    """Return a series in words; none of one that no plugin brings."""
    series = opened().registry.series.get(code)
    return "" if series is None else str(series.title)


@dataclass(frozen=True)
class Answers:
    """Answers to a wish: a card of each kind first, the others after; what would give some where there are none."""

    first: tuple[Card, ...]
    others: tuple[Card, ...]
    count: int  #: of all, also of those that first answers leave out
    refined: bool
    advice: Advice | None  #: why there are none


def search(request: Request, keywords: dict[str, Any], *, refined: bool) -> Answers:
    """Return the answers to a wish: refined ones with their codes; or, at once, the best stored guide of each kind as
    it is, which is not kept."""
    catalogue = opened()
    starts = [recall(code, catalogue.registry.collection) for code in keywords.get("starts", ())]
    found = catalogue.find(request, **{**keywords, "starts": starts}, refine=refined)
    codes = found.remember() if refined else [""] * len(found)
    first, others = variety([*zip(found, codes, strict=True)], [(one.family, one.series) for one in found])
    cards = [
        [card(one, code, drawing(one), in_words(one.series)) for one, code in part]
        for part in (first, others if refined else [])
    ]
    advice = found.explanation.advice() if refined and not found else None
    return Answers(tuple(cards[0]), tuple(cards[1]), len(found), refined, advice)
