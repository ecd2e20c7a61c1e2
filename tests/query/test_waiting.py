"""What waits to be traced comes by its promise, each guide once."""

from __future__ import annotations

from typing import Any

import numpy as np

from catalogue.query.waiting import Waiting


def rows(*given: tuple[int, str, float]) -> dict[str, np.ndarray[Any, Any]]:
    ids, series, promise = zip(*given, strict=True) if given else ((), (), ())
    return {
        "id": np.array(ids, dtype=int), "series": np.array(series, dtype=object),
        "promise": np.array(promise, dtype=float),
    }  # fmt: skip


ENTRY, ROOM = {"a": np.inf, "b": 0.6}, {"a": 2, "b": 5}


def test_the_best_come_first_with_room_for_each_series() -> None:
    waiting = Waiting()
    assert waiting.short(ENTRY, ROOM) == ["a", "b"]
    waiting.add(rows((1, "a", 0.3), (2, "a", 0.1), (3, "b", 0.2), (4, "a", 0.2), (5, "b", 0.7)))
    assert waiting.short(ENTRY, ROOM) == ["b"]
    chosen = waiting.promising(ENTRY, ROOM, 10)
    assert waiting.take(chosen)["id"].tolist() == [2, 3, 4]
    assert waiting.take(waiting.promising(ENTRY, ROOM, 10))["id"].tolist() == [1]
    assert len(waiting.promising(ENTRY, ROOM, 10)) == 0


def test_a_guide_is_taken_once_and_nothing_may_come() -> None:
    waiting = Waiting()
    waiting.add(rows())
    waiting.add(rows((1, "a", 0.3)))
    waiting.add(rows((1, "a", 0.1), (2, "a", 0.2)))
    waiting.add(rows())
    assert waiting.take(waiting.promising(ENTRY, ROOM, 1))["id"].tolist() == [2]
    waiting.add(rows((2, "a", 0.0)))
    assert waiting.take(waiting.promising(ENTRY, ROOM, 9))["id"].tolist() == [1]
