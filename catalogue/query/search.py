"""Find the best answers by tracing few: the most promising first, until no other one promises to be among them.

Of every stored reach the least is known that an answer made of it is likely to cost (see `catalogue.query.streams`).
Reaches are read and traced in the order of that; when the least of the next one is worse than the worst answer that
would be given, so are those that follow.  That least is an estimate, not a bound: now and then an answer is missed that
costs a little less than one that is given, which the tests measure.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..linkage import Array
from ..store import Database
from .constraints import Constraints
from .lay import Answers, together
from .narrow import LEAST, held
from .request import Request
from .streams import Rows, Streams

#: Part of the size by which the least may err besides: a longer window has another middle, where pivots stand nearer.
SLACK = 0.01
#: Balance up to which streams are read at first; then up to a multiple of it, and so on, to the last.
CEILING, STEP, LAST_CEILING = 0.75, 2.0, 32.0
#: Reaches that are traced at once: at first, then a third more each time, up to the most.
BATCH, LARGEST_BATCH = 96, 256

Measured = Callable[[Rows], tuple[Answers, Array, Array]]


@dataclass
class Standing:
    """The prices of the answers found so far, by series.

    Attributes
    ----------
    limit, per_series : int
        How many answers are wanted, and how many of one series while there are others.
    """

    limit: int
    per_series: int
    prices: dict[str, list[float]] = field(default_factory=dict)

    def add(self, series: Array, prices: Array) -> None:
        """Take in further answers."""
        for code, price in zip(series.tolist(), prices.tolist(), strict=True):
            self.prices.setdefault(code, []).append(price)
        for code in set(series.tolist()):
            self.prices[code].sort()

    def entry(self) -> tuple[float, dict[str, float]]:
        """Return below which price an answer of any series would be given, and of those that have had their share."""
        firsts = sorted(price for of in self.prices.values() for price in of[: self.per_series])
        full = {code: of[self.per_series - 1] for code, of in self.prices.items() if len(of) >= self.per_series}
        if len(firsts) >= self.limit:
            worst = firsts[self.limit - 1]
            return worst, {code: min(price, worst) for code, price in full.items()}
        rest = sorted(price for of in self.prices.values() for price in of[self.per_series :])
        room = self.limit - len(firsts)
        last = rest[room - 1] if len(rest) >= room else np.inf
        return np.inf, {code: max(price, last) for code, price in full.items()}


def search(
    database: Database,
    request: Request,
    wanted: Constraints,
    measured: Measured,
    *,
    limit: int,
    per_series: int,
    count: int,
) -> tuple[Answers | None, Array, bool]:
    """Trace the reaches that may be among the best answers.

    Parameters
    ----------
    measured : callable
        Traces rows; returns the answers, which of them satisfy everything, and their prices.
    limit, per_series : int
        How many answers are wanted, and how many of one series while there are others (0: no bound).
    count : int
        About how many reaches are traced at most, in equal shares of the series.

    Returns
    -------
    found : Answers or None
        All that were traced.
    good : ndarray of bool, shape (n,)
    certain : bool
        Whether nothing that was not traced promises to be among the best; else the shares were used up.
    """
    codes = held(database, wanted)
    share = max(count // max(len(codes), 1), LEAST)
    standing = Standing(limit, per_series or limit)
    spent = dict.fromkeys(codes, 0)
    parts: list[Answers] = []
    passed: list[Array] = [np.zeros(0, bool)]
    seen: set[int] = set()
    ceiling, batch, most = CEILING, BATCH, standing.per_series + 8
    with database.preparing() as prepare:
        streams = Streams(prepare, request, wanted, codes)
        pending: Rows = {}
        while True:
            usual, full = standing.entry()
            entry = {code: _lifted(full.get(code, usual)) if spent[code] < share else -np.inf for code in codes}
            room = {code: min(most, share - spent[code]) for code in codes}
            below = {code: min(price, ceiling) for code, price in entry.items()}
            new = streams.read(_wanted(pending, below, room), below)
            fresh = np.array([i not in seen for i in new["id"].tolist()], bool)
            seen.update(new["id"].tolist())
            pending = _joined(pending, {name: values[fresh] for name, values in new.items()})
            chosen = _promising(pending["least"], pending["series"], entry, room, batch)
            if len(chosen) < batch:  # to read is cheaper than to trace
                if len(new["id"]):
                    continue
                if ceiling < min(max(entry.values(), default=0.0), LAST_CEILING):
                    streams.lift(ceiling)
                    ceiling *= STEP
                    continue
                if not len(chosen):
                    break
            rows = {name: values[chosen] for name, values in pending.items()}
            pending = {name: np.delete(values, chosen, axis=0) for name, values in pending.items()}
            found, good, prices = measured(rows)
            parts.append(found)
            passed.append(good)
            standing.add(rows["series"][good], prices[good])
            for code in rows["series"].tolist():
                spent[code] += 1
            batch, most = min(batch * 4 // 3, LARGEST_BATCH), 4 * most
    good = np.concatenate(passed)
    whole = parts[0] if parts else None
    for part in parts[1:]:
        whole = together(whole, part) if whole else part
    return whole, good, all(n < share for n in spent.values())


def _lifted(price: float) -> float:
    """Return a price with the slack of bounds added; the size is at most the balance and one."""
    return price + SLACK * (max(price, 0.0) + 1.0)


def _wanted(pending: Rows, below: dict[str, float], room: dict[str, int]) -> dict[str, float]:
    """Return up to which floor each series is to be read: not beyond as many candidates as there is room for."""
    to = dict(below)
    if pending:
        for code, number in room.items():
            least = pending["least"][pending["series"] == code]
            if len(least) >= number > 0:
                to[code] = min(below[code], float(np.partition(least, number - 1)[number - 1]))
    return to


def _promising(least: Array, series: Array, entry: dict[str, float], room: dict[str, int], batch: int) -> Array:
    """Return which to trace next, at most `batch`: those that could be answers, the best first."""
    chosen: list[int] = []
    left = dict(room)
    for i in np.argsort(least, kind="stable").tolist():
        code = series[i]
        if least[i] < entry[code] and left[code] > 0:
            left[code] -= 1
            chosen.append(i)
            if len(chosen) == batch:
                break
    return np.array(chosen, dtype=int)


def _joined(one: Rows, two: Rows) -> Rows:
    if not one or not len(two["id"]):
        return one or two
    return {name: np.concatenate([one[name], values]) for name, values in two.items()} if len(one["id"]) else two
