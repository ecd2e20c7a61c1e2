"""How far drawn curves are from true ones."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

Array = Any
#: Longest segment in which the nearest one is sought [parts of the length], and how many near ends are looked at.
SHORT, NEAR = 1 / 4000, 6


def nearest_segment(places: Array, line: Array) -> tuple[Array, Array]:
    """Return the nearest segments of a polyline (n,) to places (m,), and their distances: of those at the nearest
    vertices, long ones being divided first."""
    length = np.abs(np.diff(line))
    pieces = np.maximum(1, np.ceil(length / (SHORT * length.sum())).astype(int))
    of = np.repeat(np.arange(len(pieces)), pieces)
    share = (np.arange(len(of)) - np.repeat(np.cumsum(pieces) - pieces, pieces)) / pieces[of]
    fine = np.append(line[of] + share * np.diff(line)[of], line[-1])
    _, ends = cKDTree(np.stack([fine.real, fine.imag], 1)).query(
        np.stack([places.real, places.imag], 1), min(NEAR, len(fine))
    )
    some = np.clip(np.concatenate([ends - 1, ends], axis=1), 0, len(of) - 1)
    start, chord = fine[:-1][some], np.diff(fine)[some]
    away = places[:, None] - start
    along = (away * chord.conj()).real / np.where(chord == 0, 1, np.abs(chord) ** 2)
    off = np.abs(away - np.clip(along, 0, 1) * chord)
    best = off.argmin(1)
    row = np.arange(len(places))
    return of[some[row, best]], off[row, best]


def nearest(places: Array, line: Array) -> Array:
    """Return the distances of places (m,) from a polyline (n,), shape (m,)."""
    return nearest_segment(places, line)[1]


def apart(one: Array, other: Array) -> float:
    """Return the largest distance of a vertex of either of two polylines from the other one."""
    return float(max(nearest(one, other).max(), nearest(other, one).max()))


def spline(degree: int, knots: Array, control: Array, u: Array) -> Array:
    """Return the places of a spline at parameters (m,), by de Boor's recursion."""
    k = np.clip(np.searchsorted(knots, u, side="right") - 1, degree, len(control) - 1)
    d = [control[k - degree + j] for j in range(degree + 1)]
    for r in range(1, degree + 1):
        for j in range(degree, r - 1, -1):
            low, high = knots[k - degree + j], knots[k + 1 + j - r]
            d[j] = d[j - 1] + (u - low) / (high - low) * (d[j] - d[j - 1])
    return d[degree]


def off_spline(degree: int, knots: Array, control: Array, places: Array) -> float:
    """Return the largest distance of places (m,) from a spline: about the nearest chord of fine samples, by thirds."""
    u = np.unique(np.concatenate([a + (b - a) * np.linspace(0, 1, 9) for a, b in pairwise(knots)]))
    near, _ = nearest_segment(places, spline(degree, knots, control, u))
    low, high = u[np.maximum(near - 1, 0)], u[np.minimum(near + 2, len(u) - 1)]
    for _ in range(40):
        left, right = low + (high - low) / 3, high - (high - low) / 3
        nearer = np.abs(spline(degree, knots, control, left) - places) < np.abs(
            spline(degree, knots, control, right) - places
        )
        low, high = np.where(nearer, low, left), np.where(nearer, right, high)
    return float(np.abs(spline(degree, knots, control, 0.5 * (low + high)) - places).max())
