"""Answer several requests in one process, each from the answers to tighter ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from ..errors import InvalidRequest, quoted
from ..guides.results import Found
from ..problem.order import Order, takes_starts
from ..problem.problem import Request
from .find import find

if TYPE_CHECKING:
    from .opened import Opened


class WarmStarts(NamedTuple):
    """Numbers of answers to tighter requests that serve as starts."""

    neighbours: int = 3  #: number of nearest tighter requests whose answers are starts
    each: int = 3  #: number of answers from each of them but the first, which gives all


WARM = WarmStarts()


def find_many(catalogue: Opened, requests: Sequence[Request]) -> list[Found]:
    """Answer requests, tighter ones first; see `catalogue.Catalogue.find_many`.

    The answers are those of the first round of a study.
    """
    if wrong := [one for one in requests if not isinstance(one, Request)]:
        raise InvalidRequest(f"find_many wants Request objects, not {quoted(wrong[0])}")
    asked = [*dict.fromkeys(requests)]
    found: dict[Request, Found] = {}
    order = Order.of(asked)
    explored = order.explored()
    for index, _, nearest in order.tighter():
        request = asked[index]
        near = [found[asked[i]] for i in nearest[: WARM.neighbours]] if takes_starts(request) else []
        starts = [one for place, each in enumerate(near) for one in each[: WARM.each if place else None]]
        found[request] = find(catalogue, request, tuple(starts), warm=bool(starts), follow=index not in explored)
    return [found[request] for request in requests]
