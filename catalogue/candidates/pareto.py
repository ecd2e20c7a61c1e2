"""Order by several criteria at once: first those that no other one beats in all, spread over what can be traded."""

from __future__ import annotations

import numpy as np

from ..kinematics.types import Array


def fronts(values: Array) -> Array:
    """Return the number of the Pareto front of each row, from 1, shape (n,).

    A row dominates another if it is nowhere larger and somewhere smaller.  Front 1 are the rows that none dominates,
    front 2 those that only rows of front 1 dominate, and so on (Goldberg 1989, nondominated sorting).

    Parameters
    ----------
    values : ndarray, shape (n, k)
        Criteria of which less is better; no NaN.
    """
    number = np.zeros(len(values), int)
    left = np.lexsort(values.T[::-1])  # no row is dominated by a later one
    front = 0
    while len(left):
        front += 1
        best: list[int] = []
        held = np.empty((0, values.shape[1]))
        rest: list[int] = []
        for i in left.tolist():
            row = values[i]
            if ((held <= row).all(1) & (held < row).any(1)).any():
                rest.append(i)
            else:
                best.append(i)
                held = np.concatenate([held, row[None]])
        number[best] = front
        left = np.array(rest, dtype=int)
    return number


def spread_order(values: Array, key: Array) -> tuple[Array, Array]:
    """Return an order of the rows, front by front, and the front of each row.

    Within a front the first is the best by the first criterion; each next one is the farthest from those before it,
    criteria measured by their range over the front, so that any beginning of the front covers all of it.

    Parameters
    ----------
    values : ndarray, shape (n, k)
    key : ndarray, shape (n,)
        Decides between equal rows: the order does not depend on how the rows come.
    """
    number = fronts(values)
    order: list[int] = []
    for front in range(1, number.max(initial=0) + 1):
        rows = np.flatnonzero(number == front)
        rows = rows[np.lexsort((key[rows], *values[rows].T[::-1]))]
        low, high = values[rows].min(0), values[rows].max(0)
        place = (values[rows] - low) / np.where(high > low, high - low, 1.0)
        distance, taken = np.full(len(rows), np.inf), 0
        for _ in rows:
            order.append(int(rows[taken]))
            distance = np.minimum(distance, np.abs(place - place[taken]).max(1))
            distance[taken] = -1.0
            taken = int(np.argmax(distance))
    return np.array(order, dtype=int), number
