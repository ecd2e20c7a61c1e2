"""Stored reaches in the order of what they promise, page by page."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy import INTEGER, bindparam, case, cast, column, func, literal_column, or_, select

from ..linkage import Array
from ..store import Prepared, Reach
from .conditions import basis, conditions, stretch
from .constraints import Constraints
from .narrow import COLUMNS, joined
from .promise import depth, levels, may_promise, promised, shape
from .request import Request

#: Rows of the first page of a stream; each further one is four times as long, up to the longest.
PAGE, LONGEST_PAGE = 12, 768
#: Cells of size [strokes] and transmission angle [deg] in which reaches are alike, if answers are at a distance of 1;
#: fine ones, where the best of a cell often fails what others may meet.
CELL, FINE_CELL = (1.25, 150.0), (0.15, 18.0)
#: Where fewer of the rows of a page than this part serve, cells become fine.
POOR = 0.7

Rows = dict[str, Array]


@dataclass
class Stream:
    """The reaches of one series, read up to (promise, guide)."""

    room: int = PAGE
    edge: float = -np.inf
    guide: int = -1


class Streams:
    """All reaches that may serve a request ranked by balance, of each series in the order of their promise.

    Parameters
    ----------
    prepare : callable
        See `catalogue.store.Database.preparing`.
    request, wanted
        What is asked for; of an arc the radius too.
    codes : sequence of str
        The series.
    distinct : float
        How far apart answers are that are not alike.  Of the reaches of a series that are about as large and transmit
        about as well only the most promising one is read; 0: all are.
    fine : bool
        Whether that means nearly the same.
    """

    def __init__(
        self,
        prepare: Callable[[Any], Prepared],
        request: Request,
        wanted: Constraints,
        codes: list[str],
        distinct: float = 0.0,
        fine: bool = False,
    ) -> None:
        self._streams = {code: Stream() for code in codes}
        self._distinct, self._fine = distinct, fine
        self.gave = False  # whether the last page held anything
        rank, some, promise = {"balance": 1.0}, levels(request, depth(wanted)), promised(request, wanted)
        least = None
        if request.kind == "line":
            shrunk = {level: request.stroke / stretch(request, level, rank) for level in some}
            least = case(shrunk, value=Reach.level)
        tests = conditions(request, wanted, some[0], rank, least)
        by_index = [tests.pop(name) for name in ("min_transmission",) if name in tests]
        row = literal_column("reach.rowid", INTEGER).label("row")
        # values are of the right type, since the select is compiled before it is given any
        below: Any = bindparam("below", 0.0)
        edge: Any = bindparam("edge", 0.0)
        guide: Any = bindparam("guide", 0)
        page = (
            select(row, Reach.guide_id, (func.min(promise) if distinct else promise).label("promise"))
            .where(basis(request, wanted, some), Reach.series == bindparam("code", ""), Reach.floor < below, *by_index)
            .where(may_promise(request, below))
            .where(promise.between(edge, below), or_(Reach.guide_id > guide, promise > edge))
            .order_by("promise", Reach.guide_id)
            .limit(bindparam("room", 0))
        )
        if distinct:  # SQLite gives the row of the minimum
            by_size: Any = bindparam("by_size", 0.0)
            by_angle: Any = bindparam("by_angle", 0.0)
            cells = zip(shape(request), (by_size, by_angle), strict=True)
            page = page.group_by(*(cast(value / step, INTEGER) for value, step in cells))
        self._page = prepare(page)
        picked = func.json_each(bindparam("picked", "")).table_valued(column("key", INTEGER), column("value", INTEGER))
        self._look = prepare(
            joined(*COLUMNS, picked.c.key.label("place")).join(picked, row == picked.c.value).where(*tests.values())
        )

    def read(self, below: Mapping[str, float], room: Mapping[str, int] | None = None, enough: int = 0) -> Rows:
        """Return the next page of some series, of rows that promise less than `below`, those that meet the conditions
        on what is stored.

        The rows of a guide come once: that of the longest stroke.  Once there are `enough`, counting no more of a
        series than there is `room` for, those that follow are read only as far as they promise less than these.
        """
        found: list[tuple[Any, ...]] = []
        counted: list[float] = []
        by_size, by_angle = (self._distinct * step for step in (FINE_CELL if self._fine else CELL))
        for code, limit in below.items():
            stream = self._streams[code]
            if 0 < enough <= len(counted):
                limit = min(limit, sorted(counted)[enough - 1])
            if stream.edge >= limit:
                continue
            place = {"code": code, "below": limit, "edge": stream.edge, "guide": stream.guide, "room": stream.room}
            rows = self._page.rows(place | {"by_size": by_size, "by_angle": by_angle})
            found += rows
            counted += [promise for *_, promise in rows[: room[code] if room else None]]
            if len(rows) < stream.room:
                stream.edge, stream.guide = limit, -1
            else:
                _, stream.guide, stream.edge = rows[-1]
                stream.room = min(4 * stream.room, LONGEST_PAGE)
        self.gave = bool(found)
        columns = self._look.columns(self._look.rows({"picked": json.dumps([row for row, _, _ in found])}))
        columns["promise"] = np.array([promise for _, _, promise in found])[columns.pop("place")]
        self.served(len(columns["promise"]), len(found))
        order = np.lexsort((-columns["level"], columns["id"]))
        return {name: values[order[_first(columns["id"][order])]] for name, values in columns.items()}

    def served(self, number: int, of: int) -> None:
        """Take note of how many rows of how many serve.  If too few, all are read again, in fine cells."""
        if number < POOR * of:
            self.closer()

    def closer(self) -> bool:
        """Begin anew, in fine cells; return False if they are."""
        coarse = self._distinct > 0 and not self._fine
        if coarse:
            self._fine = True
            self._streams = {code: Stream(2 * PAGE) for code in self._streams}
        return coarse


def _first(values: Array) -> Array:
    """Return where a new value begins."""
    return np.flatnonzero(np.diff(values, prepend=-1))
