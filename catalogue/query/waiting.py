"""Reaches that were read and wait to be traced."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..linkage import Array
from .streams import Rows


class Waiting:
    """What was read from the database and not yet traced."""

    def __init__(self) -> None:
        self._rows: Rows = {}
        self._seen: set[int] = set()

    def add(self, new: Rows) -> None:
        """Take in rows; those of guides that were here before are left out."""
        fresh = np.flatnonzero([i not in self._seen for i in new["id"].tolist()])
        self._seen.update(new["id"].tolist())
        new = {name: values[fresh] for name, values in new.items()}
        if not self._rows or not len(self._rows["id"]):
            self._rows = new if len(fresh) or not self._rows else self._rows
        elif len(fresh):
            self._rows = {name: np.concatenate([self._rows[name], values]) for name, values in new.items()}

    def short(self, entry: Mapping[str, float], room: Mapping[str, int]) -> list[str]:
        """Return the series of which fewer rows below their entry are here than there is room for."""
        if not self._rows:
            return list(room)
        some = self._rows["series"][self._below(entry)].tolist()
        return [code for code, number in room.items() if some.count(code) < number]

    def promising(self, entry: Mapping[str, float], room: Mapping[str, int], batch: int) -> Array:
        """Return which to trace next, at most `batch`: those that promise to be below the entry of their series, the
        best first, no more of a series than there is room for."""
        series, below = self._rows["series"].tolist(), self._below(entry)
        left, chosen = dict(room), []
        for i in np.argsort(self._rows["promise"], kind="stable").tolist():
            if below[i] and left[series[i]] > 0:
                left[series[i]] -= 1
                chosen.append(i)
                if len(chosen) == batch:
                    break
        return np.array(chosen, dtype=int)

    def take(self, chosen: Array) -> Rows:
        """Return rows and let go of them."""
        rows = {name: values[chosen] for name, values in self._rows.items()}
        self._rows = {name: np.delete(values, chosen, axis=0) for name, values in self._rows.items()}
        return rows

    def _below(self, entry: Mapping[str, float]) -> Array:
        return self._rows["promise"] < np.array([entry[code] for code in self._rows["series"].tolist()])
