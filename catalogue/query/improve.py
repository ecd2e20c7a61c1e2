"""What is made of answers that were found: refined ones, cognates, ones of round lengths."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..guide.place import at_stroke
from ..guide.span import span
from ..linkage import Array
from .constraints import Constraints
from .lay import Answers, laid, together
from .ranking import price
from .request import Request

#: Answers that are refined, per unit of effort.
REFINED = 20


def improved(
    found: Answers, request: Request, wanted: Constraints, rank: dict[str, float], effort: int, **more: Any
) -> Answers:
    """Return refined answers; what each had for a deviation stands in the row ``unrefined``, how good it is in ``gap``
    and ``alternations``.  More: what the `Task` says besides."""
    from ..refine import Task, certified, refined
    from ..refine.refine import ROUNDS

    others = {name: weight for name, weight in rank.items() if name != "deviation"}
    others = {name: weight / sum(others.values()) for name, weight in others.items()}

    def besides(some: Answers) -> Array:
        return price(some, request, others) if others else np.zeros(len(some.point))

    before = found.traced.fit.deviation.astype(float)
    task = Task(request, wanted, besides, others, **more)
    found, ceiling = refined(found, task, ROUNDS + effort.bit_length() - 1)
    seal = certified(found, task, ceiling)
    rows = found.rows | {"unrefined": before, "gap": seal.gap, "alternations": seal.alternations}
    return replace(found, rows=rows)


def strayed(found: Answers, wanted: Constraints) -> Answers:
    """Return answers with how far play strays their paths in the row ``stray``; infinite for points that return."""
    if not wanted.play:
        return found
    from ..refine.sensitivity import sensitivity

    guides = span(found.linkage, found.point, pole=found.pole)
    stray = np.where(guides.cusp, np.inf, 2 * wanted.play * sensitivity(guides, found.traced).rms)
    return replace(found, rows=found.rows | {"stray": stray})


def with_cognates(found: Answers, good: Array, request: Request, wanted: Constraints) -> tuple[Answers, Array]:
    """Return answers and the cognates of all that are straight enough, and which of them meet all constraints."""
    from ..cognates import cognates

    straight = np.flatnonzero(found.traced.fit.deviation <= request.deviation)
    linkage, which, number = cognates(found.linkage[straight], found.point[straight])
    found.rows["cognate"] = np.zeros(len(found.point), dtype=int)
    if not len(linkage):
        return found, good
    which = straight[which]
    guides = span(linkage, found.point[which], pole=found.pole[which])
    traced = at_stroke(guides, request.stroke, circle=request.kind == "circle", nodes=16, extend=False)
    rows = {name: values[which] for name, values in found.rows.items()} | {"cognate": number}
    more, checks = laid(request, wanted, rows, guides, traced)
    return together(found, more), np.concatenate([good, np.logical_and.reduce(list(checks.values()))])


def with_round_lengths(found: Answers, step: float, request: Request, wanted: Constraints) -> tuple[Answers, Array]:
    """Return answers with lengths that are multiples of a step, and which of them meet all constraints."""
    from ..dimensions import rounded

    linkage, point, made = rounded(found.linkage, found.point, step)
    rows = {name: values[made] for name, values in found.rows.items()}
    guides = span(linkage, point, pole=found.pole[made])
    traced = at_stroke(guides, request.stroke, circle=request.kind == "circle", nodes=16, extend=False)
    fit = replace(traced.fit, stroke=np.full(len(point), request.stroke))  # not to be scaled by what rounding leaves
    answers, checks = laid(request, wanted, rows, guides, replace(traced, fit=fit))
    return answers, np.logical_and.reduce(list(checks.values()))
