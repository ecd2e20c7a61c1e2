"""What names a guide on the command line: a file, a code of an answer, a stored guide, a named design."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InvalidRequest

if TYPE_CHECKING:
    from ..api import Catalogue
    from ..find.placed import PlacedGuide

#: What stands where a guide is wanted, and its help.
REFERENCE = "FILE|-|CODE|ID|NAME"
HELP = (
    "Linkages in JSON or CSV with their guided points, or answers saved by `find --save`; - reads standard input. Or "
    "an answer by its code, a stored guide by its number, a named design."
)


def guides(
    reference: str, point: tuple[float, float] | None, opened: Callable[[], Catalogue], stroke: float | None = None
) -> list[PlacedGuide]:
    """Return the guides that a reference names; the catalogue is opened only if it is needed.  A stored guide or a
    named design is laid along a path of the stroke that is given.

    Raises
    ------
    InvalidRequest, InvalidLinkage
        If it names none, a linkage comes without a guided point, or a stroke is given for what has its own.
    """
    found = answers(reference, opened, stroke)
    if found is None:
        found = _own(reference, point)
    for one in found:
        if not hasattr(one, "pivots"):
            raise InvalidRequest(f"{reference} is no planar guide: it can be shown, not measured")
    return found


def resolve(
    reference: str,
    point: tuple[float, float] | None,
    db: Path | None,
    plugins: Sequence[str],
    stroke: float | None = None,
) -> list[PlacedGuide]:
    """Return the guides that a reference names, from a catalogue that is opened only if it is needed; see `guides`."""
    from ..api import open

    with ExitStack() as stack:
        return guides(reference, point, cache(lambda: stack.enter_context(open(db, plugins=plugins))), stroke)


def answers(reference: str, opened: Callable[[], Catalogue], stroke: float | None = None) -> list[Any] | None:
    """Return the answers that a reference names, None if it is a file of linkages; see `guides`."""
    from ..find.answers import answer, is_saved, recall
    from .reading import read_text

    def collection(name: str) -> Any:
        return opened().registry.collection(name)

    if stroke is not None and (reference == "-" or is_answer(reference)):
        raise InvalidRequest(f"{reference} stands where it is: only a stored guide or a named design takes a stroke")
    if reference == "-":
        return None
    if _is_file(reference):
        text = read_text(reference)
        try:
            held = json.loads(text) if text.lstrip()[:1] == "{" else None
        except (ValueError, RecursionError):
            held = None
        return [answer(one, collection) for one in held["answers"]] if held and is_saved(held) else None
    if is_answer(reference):
        return [recall(reference, collection)]
    catalogue = opened()
    guide = catalogue.guide(reference)
    if guide.name is None:
        return [guide.at(1.0 if stroke is None else stroke)]
    from ..find.stored import as_published
    from ..series.named_guides import named_guides

    design = named_guides()[guide.name]
    return [as_published(design, guide, design.stroke if stroke is None else stroke)]


def keep(one: Any) -> None:
    """Keep a guide under the code that stands on what is drawn and written of it, if answers can be kept at all."""
    from ..find.answers import remember

    with suppress(InvalidRequest):
        remember([one])


def is_answer(reference: str) -> bool:
    """Return whether a reference is a file, or may be the code of an answer."""
    from ..find.codes import is_code

    return _is_file(reference) or (not reference.isdigit() and not _is_design(reference) and is_code(reference))


def _own(reference: str, point: tuple[float, float] | None) -> list[Any]:
    import numpy as np

    from ..find.own_guide import OwnGuide
    from .reading import linkages_of, read_rows
    from .units import unit

    rows = read_rows(reference)
    linkage, points = linkages_of(rows)
    chosen = None if point is None else unit()  # of a point that is given
    missing = np.flatnonzero(np.isnan(points))
    if len(missing) and point is None:
        raise InvalidRequest(
            f"{rows[missing[0]].place} has no guided point: give `x` and `y`, or `along` and `across` beside link "
            "lengths, or --point X Y"
        )
    found = [
        OwnGuide(pivots, [z.real, z.imag], unit=row.unit).in_unit(chosen)
        for pivots, z, row in zip(linkage.pivots.tolist(), points.tolist(), rows, strict=True)
    ]
    return found if point is None else [replace(one, guided=[*point]) for one in found]


def _is_file(reference: str) -> bool:
    path = Path(reference)
    with suppress(OSError):  # a name that no file can have
        return path.suffix != "" or len(path.parts) > 1 or path.is_file()
    return False


def _is_design(reference: str) -> bool:
    from ..series.named_guides import named_guides

    return reference in named_guides()
