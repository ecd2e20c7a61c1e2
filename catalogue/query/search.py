"""Find the best answers by tracing few: the most promising first, until no other one promises to be among them.

Of every stored reach it is known what an answer made of it is likely to cost (see `catalogue.query.promise`).  Reaches
are read and traced in the order of that; when the next one promises to be worse than the worst answer that would be
given, so do those that follow.  A promise is an estimate, not a bound: now and then an answer is missed that costs a
little less than one that is given, which the tests measure.
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
from .waiting import Waiting

#: Balance up to which streams are read at first; then up to a multiple of it, and so on, to the last.
CEILING, STEP, LAST_CEILING = {"line": 0.75, "circle": 1.125}, 1.5, 32.0
#: Reaches that are traced at once at most: two for each answer at first, then a third more each time.
LARGEST_BATCH = 256

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

    @property
    def count(self) -> int:
        """How many answers there are."""
        return sum(len(of) for of in self.prices.values())

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
    distinct: float,
    fine: bool,
    count: int,
) -> tuple[Answers | None, Array, bool]:
    """Trace the reaches that may be among the best answers.

    Parameters
    ----------
    measured : callable
        Traces rows; returns the answers, which of them satisfy everything, and their prices.
    limit, per_series : int
        How many answers are wanted, and how many of one series while there are others (0: no bound).
    distinct : float
        How far apart answers are that are not alike; 0: no matter.
    fine : bool
        Whether to look at more that may be alike.
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
    standing = Standing(limit, per_series or limit)
    parts: list[Answers] = []
    passed: list[Array] = [np.zeros(0, bool)]
    ceiling, batch, most = CEILING[request.kind], min(2 * limit, LARGEST_BATCH), standing.per_series * 3 // 2
    with database.preparing() as prepare:
        codes = held(lambda select: prepare(select).read(), wanted)
        share, spent = max(count // max(len(codes), 1), LEAST), dict.fromkeys(codes, 0)
        streams, waiting = Streams(prepare, request, wanted, codes, distinct, fine), Waiting()
        while True:
            usual, full = standing.entry()
            entry = {code: full.get(code, usual) if spent[code] < share else -np.inf for code in codes}
            room = {code: min(most, share - spent[code]) for code in codes}
            below = {code: min(entry[code], ceiling) for code in waiting.short(entry, room)}
            waiting.add(streams.read(below, room, batch))
            chosen = waiting.promising(entry, room, batch)
            if len(chosen) < batch:  # to read is cheaper than to trace
                if streams.gave:
                    continue
                if ceiling < min(max(entry.values(), default=0.0), LAST_CEILING):
                    ceiling *= STEP
                    continue
                if not len(chosen):
                    if standing.count < limit and streams.closer():
                        ceiling = CEILING[request.kind]
                        continue
                    break
            rows = waiting.take(chosen)
            found, good, prices = measured(rows)
            parts.append(found)
            passed.append(good)
            streams.served(int(good.sum()), len(good))
            standing.add(rows["series"][good], prices[good])
            for code in rows["series"].tolist():
                spent[code] += 1
            batch, most = min(batch * 4 // 3, LARGEST_BATCH), 4 * most
    good = np.concatenate(passed)
    whole = parts[0] if parts else None
    for part in parts[1:]:
        whole = together(whole, part) if whole else part
    return whole, good, all(n < share for n in spent.values())
