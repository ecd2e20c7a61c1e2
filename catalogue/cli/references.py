"""Resolve references to guides: a file, the code of an answer, a stored guide, a named design."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InvalidLinkage, InvalidRequest

if TYPE_CHECKING:
    from ..api import Catalogue
    from ..guides.own_chain import OwnChain

#: Placeholder of a reference in the usage line.
REFERENCE = "FILE|-|CODE|ID|NAME"
#: Help of a reference.
HELP = (
    "File of linkages with guided points (JSON or CSV), or of answers (`find --save`); - reads standard input. Or the "
    "code of an answer, the number of a stored guide, the name of a design such as watt."
)


def guides(
    reference: str,
    point: tuple[float, float] | None,
    opened: Callable[[], Catalogue],
    stroke: float | None = None,
    *,
    chains: bool = False,
) -> list[Any]:
    """Resolve a reference to guides.

    Parameters
    ----------
    reference : str
    point : tuple of float, optional
        Guided point of linkages from a file [length].
    opened : callable
        Opens the catalogue; called only if needed.
    stroke : float, optional
        Stroke of a stored guide or a named design [length].
    chains : bool
        Whether mechanisms of many bars are accepted.

    Raises
    ------
    InvalidRequest, InvalidLinkage
        If the reference names none, a linkage has no guided point, or a stroke is given for a guide
        that has its own.
    """
    from ..guides.own_chain import OwnChain

    found = answers(reference, opened, stroke)
    if found is None:
        found = _linkages_of_file(reference, point)
    if chains:
        from ..find.specimens import stretch_of

        found = [stretch_of(one) if hasattr(one, "collection") else one for one in found]
    for one in found:
        if isinstance(one, OwnChain) and chains:
            continue
        if isinstance(one, OwnChain):
            raise InvalidRequest(f"{reference} is a mechanism of many bars: here a linkage of two dyads is wanted")
        if not hasattr(one, "pivots"):
            raise InvalidRequest(f"{reference} is no planar guide: it can be shown, not measured")
    return found


def resolve(
    reference: str,
    point: tuple[float, float] | None,
    db: Path | None,
    plugins: Sequence[str],
    stroke: float | None = None,
    *,
    chains: bool = False,
) -> list[Any]:
    """Resolve a reference to guides, opening the catalogue only if needed; see `guides`."""
    from ..api import open

    with ExitStack() as stack:
        opened = cache(lambda: stack.enter_context(open(db, plugins=plugins)))
        return guides(reference, point, opened, stroke, chains=chains)


def answers(reference: str, opened: Callable[[], Catalogue], stroke: float | None = None) -> list[Any] | None:
    """Resolve a reference to answers; None for a file of linkages.  See `guides`."""
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
    from ..series.named_guides import named_guide

    design = named_guide(guide.name)
    if design is None:
        return [guide.at(1.0 if stroke is None else stroke)]
    from ..find.stored import as_published

    return [as_published(design, guide, design.stroke if stroke is None else stroke)]


def keep(one: Any) -> None:
    """Store a guide under the code on its drawings, if the answers file is writable."""
    from ..guides.codes import remember

    with suppress(InvalidRequest):
        remember([one])


def is_answer(reference: str) -> bool:
    """Tell whether a reference is a file or a possible code of an answer."""
    from ..guides.codes import is_code

    return _is_file(reference) or (not reference.isdigit() and not _is_design(reference) and is_code(reference))


def _linkages_of_file(reference: str, point: tuple[float, float] | None) -> list[Any]:
    import numpy as np

    from ..guides.own_guide import OwnGuide
    from .reading import chains_in, linkages_of, read_rows, read_text
    from .units import unit

    content = read_text(reference)
    if chains := chains_in(content, reference):
        return _own_chains(chains, reference, point)
    rows = read_rows(reference, content)
    linkage, points = linkages_of(rows)
    chosen = None if point is None else unit()  # a point on the command line is in the unit of output
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


def _own_chains(
    chains: Sequence[Mapping[str, Any]], reference: str, point: tuple[float, float] | None
) -> list[OwnChain]:
    from ..guides.own_chain import OwnChain

    if point is not None:
        raise InvalidRequest(f"{reference} is a mechanism of many bars: it names its guided joint by `point`")
    found = []
    for number, one in enumerate(chains, 1):
        place = reference if len(chains) == 1 else f"{reference}, mechanism {number}"
        if not isinstance(one, dict) or "bars" not in one:
            raise InvalidRequest(f"{place} has no `bars`: mechanisms of many bars stand in a file of their own")
        try:
            found.append(OwnChain.of(one))
        except (InvalidLinkage, InvalidRequest) as error:
            raise type(error)(f"{place}: {error}") from None
    return found


def _is_file(reference: str) -> bool:
    path = Path(reference)
    with suppress(OSError):  # an impossible file name
        return path.suffix != "" or len(path.parts) > 1 or path.is_file()
    return False


def _is_design(reference: str) -> bool:
    from ..series.named_guides import is_named

    return is_named(reference)
