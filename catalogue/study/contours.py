"""Contours of a value over the cells of a grid."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from itertools import product

Place = tuple[int, int]
#: A place on the grid, and the height of the value over the contour there.
Point = tuple[complex, float]


def contours(
    values: Mapping[Place, float], kinds: Mapping[Place, Hashable], level: float
) -> list[tuple[complex, complex]]:
    """Return the segments of one contour.

    The value of a side or corner of a cell is the mean over the cells of its kind that meet there;
    in between the value is linear over triangles.

    Parameters
    ----------
    values : mapping of (column, row) to float
        Values at the centres of cells.
    kinds : mapping of (column, row) to object
        No contour crosses a side between cells of different kinds.
    level : float

    Returns
    -------
    list of (complex, complex)
        Ends, in columns and rows.
    """
    found = []
    for place in values:
        for triangle in _triangles(place, values, kinds, level):
            sides = zip(triangle, (*triangle[1:], triangle[0]), strict=True)
            ends = [_crossing(one, other) for one, other in sides if (one[1] < 0) != (other[1] < 0)]
            if ends and ends[0] != ends[1]:
                found.append((ends[0], ends[1]))
    return found


def _triangles(
    place: Place, values: Mapping[Place, float], kinds: Mapping[Place, Hashable], level: float
) -> Iterator[tuple[Point, Point, Point]]:
    """Yield the triangles between the centre, the sides and the corners of a cell."""
    i, k = place

    def at(across: int, down: int) -> Point:
        meeting = {(i, k), (i + across, k), (i, k + down), (i + across, k + down)}
        heights = [values[one] for one in sorted(meeting) if one in values and kinds[one] == kinds[place]]
        return complex(i + 0.5 * across, k + 0.5 * down), sum(heights) / len(heights) - level

    for across, down in product((-1, 1), repeat=2):
        yield at(0, 0), at(across, 0), at(across, down)
        yield at(0, 0), at(across, down), at(0, down)


def _crossing(one: Point, other: Point) -> complex:
    return one[0] + (other[0] - one[0]) * one[1] / (one[1] - other[1])
