"""Stored reaches in the order of the least that an answer made of them can cost, page by page."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy import ColumnElement, and_, bindparam, case, func, or_
from sqlalchemy.orm import aliased

from ..guide.reach import LEVELS
from ..linkage import Array
from ..store import Prepared, Reach
from .constraints import Constraints
from .narrow import COLUMNS, DEPTH, basis, conditions, joined, loosest, stretch
from .request import CircularArc, Request

#: Rows of the first page of a stream; each further one is four times as long, up to the longest.
PAGE, LONGEST_PAGE = 16, 512
#: How much longer a stroke of two inflections becomes for a decade of deviation.
DECADE = 10.0 ** (1 / 3)
#: A reach below this part of its level ends for another reason than its deviation.
AMPLE = 0.5
#: Where the least that an answer may cost is taken to lie: so much of the way from its estimate to the floor, which
#: holds for all requests between two levels.  Few answers cost less: see tests/query/test_search.py.  For lines the
#: database estimates coarsely, and with more doubt.
DOUBT = 0.3
COARSE_DOUBT = 0.5
LOOSER = aliased(Reach)
MORE = (
    Reach.min_transmission,
    LOOSER.stroke.label("looser_stroke"),
    LOOSER.size.label("looser_size"),
    LOOSER.deviation.label("looser_deviation"),
    LOOSER.min_transmission.label("looser_angle"),
)

Rows = dict[str, Array]


@dataclass
class Stream:
    """The reaches of one series and level, read up to (floor, guide)."""

    code: str
    level: int
    room: int = PAGE
    floor: float = -np.inf
    guide: int = -1
    ended: bool = False


class Streams:
    """All reaches that may serve a request ranked by balance, of each series and level in the order of their floor.

    Parameters
    ----------
    prepare : callable
        See `catalogue.store.Database.preparing`.
    request, wanted
        What is asked for; of an arc the radius too.
    codes : sequence of str
        The series.
    """

    def __init__(
        self, prepare: Callable[[Any], Prepared], request: Request, wanted: Constraints, codes: list[str]
    ) -> None:
        self._request = request
        rank = {"balance": 1.0}
        top = loosest(request)
        levels = [level for level in LEVELS if top - DEPTH < level <= top]
        self._fixed = {
            level: {"level": level, "least": request.stroke / stretch(request, level, rank), **_shares(request, level)}
            for level in levels
        }
        self._streams = [Stream(code, level) for level in levels for code in codes]
        self._low = -np.inf  # rows of lower estimate have been read
        # values are of the right type, since the select is compiled before it is given any
        below: Any = bindparam("below", 0.0)
        floor: Any = bindparam("floor", 0.0)
        guide: Any = bindparam("guide", 0)
        least: Any = bindparam("least", 0.0) if request.kind == "line" else None
        # where a longer stroke may break a constraint the stored one serves
        self._stays = any(getattr(wanted, name) for name in ("min_transmission", "fixed_pivots_in", "pivots_in"))
        own = Reach.size - Reach.min_transmission / 90
        estimate = _least(func.min(_line(), own) if self._stays else _line(), COARSE_DOUBT)
        rough: list[ColumnElement[bool]] = []
        if isinstance(request, CircularArc) and request.sweep is not None:
            estimate = _least(_arc(request.sweep, Reach.min_transmission / 90), DOUBT)
            within = _arc(request.sweep, Reach.size - Reach.floor)
            rough.append(_least(within, DOUBT) < below)  # decided by the index alone
        select = (
            joined(*COLUMNS, *(MORE if request.kind == "line" else ()), estimate.label("least"), Reach.floor)
            .outerjoin(LOOSER, and_(LOOSER.guide_id == Reach.guide_id, LOOSER.level == Reach.level + 1))
            .where(basis(request, wanted, bindparam("level", 0)), Reach.series == bindparam("code", ""))
            .where(
                Reach.floor >= floor,
                Reach.floor < bindparam("to", 0.0),
                or_(Reach.floor > floor, Reach.guide_id > guide),
            )
            .where(*rough, estimate.between(bindparam("low", 0.0), below))
            .where(*conditions(request, wanted, top, rank, least).values())
            .order_by(Reach.floor, Reach.guide_id)
            .limit(bindparam("room", 0))
        )
        self._select = prepare(select)

    def read(self, to: Mapping[str, float], below: Mapping[str, float]) -> Rows:
        """Return the next page of each stream, up to a floor for each series, of rows that may cost less than `below`.

        What is left out for costing more is not read again before the next `lift`.

        The rows of a guide come once: of a straight line that of the longest stroke, of an arc that of the shortest.
        """
        found = []
        for stream in self._streams:
            limit = to[stream.code]
            if stream.ended or stream.floor >= limit:
                continue
            place = {"code": stream.code, "floor": stream.floor, "guide": stream.guide, "room": stream.room}
            rows = self._select.rows(
                place | self._fixed[stream.level] | {"to": limit, "below": below[stream.code], "low": self._low}
            )
            found += rows
            if len(rows) < stream.room:
                stream.floor = limit
                stream.ended = limit == np.inf
            else:
                stream.guide, stream.floor = rows[-1][0], rows[-1][-1]
                stream.room = min(4 * stream.room, LONGEST_PAGE)
        columns = self._select.columns(found)
        loosest_first = 1 if self._request.kind == "circle" else -1
        order = np.lexsort((loosest_first * columns["level"], columns["id"]))
        first = order[np.flatnonzero(np.diff(columns["id"][order], prepend=-1))]
        kept = {name: values[first] for name, values in columns.items()}
        if self._request.kind == "line":
            kept["least"] = _least_of_lines(kept, self._request, self._stays)
        return kept

    def lift(self, low: float) -> None:
        """Read rows whose estimate is at least `low`, all others having been read."""
        self._low = low
        for stream in self._streams:
            stream.floor, stream.guide, stream.room = -np.inf, -1, PAGE


def _least_of_lines(rows: Rows, request: Request, stays: bool) -> Array:
    """Return what answers may cost at least, shape (n,): the reach and the looser one, weighed by their deviations."""
    with np.errstate(all="ignore"):
        spare = np.maximum(request.relative / np.maximum(rows["deviation"], 1e-16), 1.0)
        decade = np.fmax(rows["looser_deviation"] / np.maximum(rows["deviation"], 1e-16), 1.0)
        decade = np.where(np.isnan(rows["looser_deviation"]), 10.0, decade)
        longer = np.where(np.isnan(rows["looser_stroke"]), DECADE, rows["looser_stroke"] / rows["stroke"])
        part = np.where(decade > 1.001, np.clip(np.log(spare) / np.log(decade), 0.0, 1.0), 0.0)
        # the looser one is the same, for want of transmission: the stroke may still grow with the tolerance
        same = (longer < 1.001) & (rows["deviation"] > AMPLE * 10.0 ** rows["level"])
        grown = np.where(same, np.cbrt(spare), np.maximum(longer, 1.0) ** part)
        grown = np.where(rows["level"] == loosest(request), grown, 1.0)
        size = np.fmax(np.maximum(rows["size"] / grown, 1.0), np.where(same, np.nan, rows["looser_size"]))
        share = np.where(longer > 1.001, (grown - 1) / (longer - 1), 0.0)
        loss = share * np.nan_to_num(rows["min_transmission"] - rows["looser_angle"])
    estimate = size - (rows["min_transmission"] - loss) / 90
    if stays:
        estimate = np.minimum(estimate, rows["size"] - rows["min_transmission"] / 90)
    return np.asarray(estimate - DOUBT * np.maximum(estimate - rows["floor"], 0.0))


def _shares(request: Request, level: int) -> dict[str, float]:
    """Return how far the request lies from one level to the next looser one: in decades, and in size."""
    share = min(max(math.log10(request.relative) - level, 0.0), 1.0) if level == loosest(request) else 0.0
    return {"looser": 10.0 ** (level + 1), "share": share, "part": (1 - DECADE**-share) / (1 - 1 / DECADE)}


def _least(estimate: ColumnElement[float], doubt: float) -> ColumnElement[float]:
    return (1 - doubt) * estimate + doubt * Reach.floor


def _line() -> ColumnElement[float]:
    """Return the balance of the longest stroke within the tolerance, between this reach and the next looser one.

    The linkage keeps its size while the stroke grows, until the path is as large.
    """
    looser: Any = bindparam("looser", 0.0)
    ample = func.coalesce(LOOSER.deviation < AMPLE * looser, Reach.deviation < 0.1 * AMPLE * looser)
    part: Any = case((ample, 1.0), else_=bindparam("part", 0.0))
    share: Any = case((ample, 1.0), else_=bindparam("share", 0.0))
    longer = func.coalesce(Reach.stroke / LOOSER.stroke, 1 / DECADE)
    size = func.max(1.0, func.coalesce(LOOSER.size, 1.0), Reach.size * (1 + part * (longer - 1)))
    angle = Reach.min_transmission + share * (
        func.coalesce(LOOSER.min_transmission, Reach.min_transmission) - Reach.min_transmission
    )
    balance: ColumnElement[float] = size - angle / 90
    return balance


def _arc(sweep: float, angle: ColumnElement[float]) -> ColumnElement[float]:
    """Return the balance of an arc that is shorter than the stored one: the path shrinks, the pivots stay."""
    factor = Reach.sweep / sweep
    return func.max(1.0, 1 + (Reach.size - 1) * factor, Reach.spread * factor) - angle
