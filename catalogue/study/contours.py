"""Contours of a value over the cells of a grid."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from itertools import product

import numpy as np

from ..kinematics.types import Complexes, Floats

Place = tuple[int, int]


def contours(
    values: Mapping[Place, float], kinds: Mapping[Place, Hashable], levels: Sequence[float]
) -> list[Complexes]:
    """Trace the contours of each level.

    The value of a side or corner of a cell is the mean over the cells of its kind that meet there;
    in between the value is linear over triangles.

    Parameters
    ----------
    values : mapping of (column, row) to float
        Values at the centres of cells.
    kinds : mapping of (column, row) to object
        No contour crosses a side between cells of different kinds.
    levels : sequence of float

    Returns
    -------
    list of complex ndarray, shape (segments, 2)
        Ends of the segments of each level, in columns and rows.
    """
    if not values:
        return [np.zeros((0, 2), complex) for _ in levels]
    points, heights = _triangles(values, kinds)
    return [_segments(points, heights - level) for level in levels]


def _triangles(values: Mapping[Place, float], kinds: Mapping[Place, Hashable]) -> tuple[Complexes, Floats]:
    """Divide cells at their centre, sides and corners; return corners and values, (n, 3) each."""
    places = np.array([*values])
    numbers: dict[Hashable, int] = {}
    shape = places.max(0) + 3  # with a margin
    value, kind = np.zeros(shape), np.full(shape, -1)
    i, k = places.T + 1
    value[i, k] = [*values.values()]
    kind[i, k] = [numbers.setdefault(kinds[place], len(numbers)) for place in values]

    def mean(across: int, down: int) -> Floats:
        """Return for every cell the mean value at one of its sides or corners.

        The mean is over the adjacent cells of its kind.
        """
        total, count = np.zeros(len(i)), np.zeros(len(i))
        for a, d in {(0, 0), (across, 0), (0, down), (across, down)}:
            alike = kind[i + a, k + d] == kind[i, k]
            total += np.where(alike, value[i + a, k + d], 0.0)
            count += alike
        return total / count

    here, points, heights = places[:, 0] + 1j * places[:, 1], [], []
    for across, down in product((-1, 1), repeat=2):
        for side in ((across, 0), (0, down)):
            corners = ((0, 0), side, (across, down))
            points.append(np.stack([here + complex(0.5 * a, 0.5 * d) for a, d in corners], axis=1))
            heights.append(np.stack([mean(a, d) for a, d in corners], axis=1))
    return np.concatenate(points), np.concatenate(heights)


def _segments(points: Complexes, heights: Floats) -> Complexes:
    """Return the segments in which triangles are cut at height 0, shape (segments, 2)."""
    below = heights < 0
    cut = below.any(1) & ~below.all(1)
    points, heights, below = points[cut], heights[cut], below[cut]
    lone = np.argmax(below == (below.sum(1) == 1)[:, None], axis=1)  # the only corner on its side of the level
    row = np.arange(len(points))
    one, top = points[row, lone], heights[row, lone]
    ends = []
    for step in (1, 2):
        other, bottom = points[row, (lone + step) % 3], heights[row, (lone + step) % 3]
        ends.append(one + (other - one) * (top / (top - bottom)))
    found = np.stack(ends, axis=1)
    return np.asarray(found[found[:, 0] != found[:, 1]])
