"""Order requests from tighter to looser ones.

Requests that differ in more than bounds cannot be compared.  Requests that can be compared form a
group of points: one coordinate for each bound, larger where it is looser.  A request is tighter
than another if none of its coordinates is larger.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..kinematics.types import Array, Floats
from ..quantities import BOUNDS
from .constraints import PRESCRIBED, REGIONS, Constraints
from .problem import Request

#: Upper bounds: larger is looser.
_UPPER = tuple(name for name, row in BOUNDS.items() if row.is_upper)
#: Lower bounds: smaller is looser.
_LOWER = (*(name for name, row in BOUNDS.items() if not row.is_upper), "order")
#: Switches: off is looser.
_SWITCHES = ("pins_only", "full_rotation")
_SORTS = ("families", "series", "configurations")
_COMPARED = (*_UPPER, *_LOWER, *_SWITCHES, *_SORTS, *REGIONS, "keep_out")


@dataclass(frozen=True)
class Order:
    """Requests as points, by groups.

    Attributes
    ----------
    groups : list of ndarray of int
        Indices of the requests of each group, tighter ones first.
    points : list of ndarray, shape (group, k)
        Their coordinates: ranks among the values of the group.
    """

    groups: list[Array]
    points: list[Array]

    @classmethod
    def of(cls, requests: Sequence[Request]) -> Order:
        """Divide requests into groups and sort each.

        Parameters
        ----------
        requests : sequence of Request
            All different.
        """
        members: defaultdict[Request, list[int]] = defaultdict(list)
        for index, request in enumerate(requests):
            members[_group(request)].append(index)
        groups, points = [], []
        for group in members.values():
            found = _ranks(_coordinates([requests[i] for i in group]))
            sequence = np.lexsort([np.arange(len(group)), found.sum(1)])
            groups.append(np.array(group)[sequence])
            points.append(found[sequence])
        return cls(groups, points)

    def tighter(self) -> Iterator[tuple[int, Array, Array]]:
        """Yield each request with all tighter ones, and with its direct neighbours among them.

        Yields
        ------
        index : int
        tighter, nearest : ndarray of int
            Indices. No other request lies between a request and those of `nearest`; these are
            sorted by the number of steps, closest first.
        """
        for group, points in zip(self.groups, self.points, strict=True):
            for place, point in enumerate(points):
                below = np.flatnonzero((points[:place] <= point).all(1))
                left, chosen = below, []
                while len(left):
                    last = left[-1]  # with the largest sum of ranks: no request lies between
                    chosen.append(last)
                    left = left[~(points[left] <= points[last]).all(1)]
                near = np.array(chosen, int)
                near = near[np.argsort((point - points[near]).sum(1), kind="stable")] if len(near) else near
                yield int(group[place]), group[below], group[near]

    def explored(self) -> set[int]:
        """Return the indices of the requests with every second value of each bound."""
        found: set[int] = set()
        for group, points in zip(self.groups, self.points, strict=True):
            found.update(group[((points.max(0) - points) % 2 == 0).all(1)].tolist())
        return found

    def looser(self, some: set[int]) -> Iterator[tuple[int, Array]]:
        """Yield each of some requests with all looser ones.

        Yields
        ------
        index : int
        looser : ndarray of int
            Indices, nearest first.
        """
        for group, points in zip(self.groups, self.points, strict=True):
            for place in np.flatnonzero(np.isin(group, [*some])):
                above = place + 1 + np.flatnonzero((points[place + 1 :] >= points[place]).all(1))
                yield int(group[place]), group[above]


def _group(request: Request) -> Request:
    """Return a request without the compared bounds, and with any deviation permitted."""
    wanted = request.constraints
    loose = {name: getattr(Constraints, name) for name in _COMPARED if not _is_polygon(wanted, name)}
    path = replace(request.path, deviation=1e-3 * request.path.extent)
    return replace(request, path=path, constraints=replace(wanted, **loose))


def _is_polygon(wanted: Constraints, name: str) -> bool:
    return name in REGIONS and (region := getattr(wanted, name)) is not None and not region.is_box


def _coordinates(requests: Sequence[Request]) -> Floats:
    """Return the bounds of requests as coordinates, larger where looser, shape (n, k)."""
    columns: list[Iterable[float]] = [[one.path.deviation for one in requests]]
    wanted = [one.constraints for one in requests]
    columns += [[math.inf if (v := getattr(one, name)) is None else v for one in wanted] for name in _UPPER]
    columns += [[-(getattr(one, name) or 0.0) for one in wanted] for name in _LOWER]
    columns += [[-float(getattr(one, name)) for one in wanted] for name in _SWITCHES]
    for name in _SORTS:
        given = [getattr(one, name) for one in wanted]
        columns.append([float(not one) for one in given])
        columns += [[float(not one or each in one) for one in given] for each in {n: 0 for one in given for n in one}]
    for name in REGIONS:
        boxes = [None if _is_polygon(one, name) else getattr(one, name) for one in wanted]
        for side, sign in enumerate((-1, -1, 1, 1)):
            columns.append([math.inf if box is None else sign * box.box[side] for box in boxes])
    zones = {zone: 0 for one in wanted for zone in one.keep_out}
    columns += [[-float(zone in one.keep_out) for one in wanted] for zone in zones]
    return np.array([list(column) for column in columns], float).T


def _ranks(values: Floats) -> Array:
    """Return the ranks of values in each column that varies, shape (n, k)."""
    ranks = [np.unique(column, return_inverse=True)[1] for column in values.T if (column != column[0]).any()]
    return np.array(ranks, int).T if ranks else np.zeros((len(values), 1), int)


def takes_starts(request: Request) -> bool:
    """Tell whether answers to other requests may be starts of this one."""
    wanted = request.constraints
    return not (wanted.slots or wanted.returns or any(getattr(wanted, name) is not None for name in PRESCRIBED))
