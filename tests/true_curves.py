"""Random linkages of every family and Grashof type, and their true coupler curves, by circles and lines alone."""

from __future__ import annotations

from typing import Any

import numpy as np

import catalogue
from catalogue.guides.own_guide import OwnGuide
from tests.naive import ways_round

Array = Any
#: Nearly-equal triple rocker of which even samples saw two straight lines.
ROCKER = [[[4.1, 3.75], [1.244, 0.196]], [[0.165, 1.322], [-2.32, -2.293]]]
POINT = -2.591 + 1.657j
#: Samples of a true curve at first; it is sampled anew where they are farther apart, or it is
#: farther from their chords, than these parts of its extent.
FIRST, FAR, BENT = 2001, 4e-3, 2e-6


def four_bar(lengths: Any, point: complex) -> OwnGuide:
    """Return a four-bar of given lengths: ground, crank, coupler, rocker."""
    named = dict(zip(("ground", "crank", "coupler", "rocker"), map(float, lengths), strict=True))
    return catalogue.guide({**named, "along": point.real, "across": point.imag})


def rockers() -> list[OwnGuide]:
    """Return sixteen nearly-equal triple rockers, the first four with frames longer by 0, 0.03, 0.1, 0.3."""
    made = []
    for longer in (0.0, 0.03, 0.1, 0.3):
        (a, a_star), (b, b_star) = ROCKER
        along = complex(*b) - complex(*a)
        moved = complex(*b) + longer * along / abs(along)
        made.append(catalogue.guide([[a, a_star], [[moved.real, moved.imag], b_star]], (POINT.real, POINT.imag)))
    rng = np.random.default_rng(43)
    while len(made) < 16:
        lengths = 4 * (1 + rng.normal(0, 0.05, 4))
        least, most = min(lengths), max(lengths)
        if least + most > 0.5 * sum(lengths) * (1 + 1e-4):  # no link turns fully
            made.append(four_bar(lengths, complex(*rng.normal(0, 3, 2))))
    return made


def random_linkages(count: int, seed: int) -> list[OwnGuide]:
    """Return linkages of six families in turn, every third four-bar within 1e-2 to 1e-6 of a change point, every fourth
    linkage with a cusp: a point that is at rest in the given position."""
    rng = np.random.default_rng(seed)
    made: list[OwnGuide] = []
    while len(made) < count:
        k = len(made)
        z = rng.normal(0, 1, (2, 2, 2))
        pivots = np.concatenate([z, np.ones((2, 2, 1))], axis=2)
        family = k % 9
        angle = rng.uniform(0, 2 * np.pi, 2)
        ends = {3: [(1, 0)], 4: [(1, 1)], 5: [(0, 0), (1, 1)], 6: [(0, 0), (1, 0)], 7: [(0, 1), (1, 1)]}.get(family, [])
        for which, (i, j) in enumerate(ends):
            pivots[i, j] = [np.cos(angle[which]), np.sin(angle[which]), 0]
        if family == 2 or family == 8:  # lengths that nearly add up
            a, b, c = rng.uniform(1, 3, 3)
            near = 10.0 ** -rng.uniform(2, 6) * rng.choice([-1, 1])
            ground, crank, coupler, rocker = [(a + b + c, a, b, c), (a + b - c, c, a, b), (c, a, b, a + c - b)][
                k // 9 % 3
            ]
            lengths = np.array([ground * (1 + near), crank, coupler, rocker])
            if lengths.min() < 0.2:
                rng.uniform()
                continue
            point = complex(*rng.normal(0, 2, 2))
            try:
                made.append(four_bar(lengths, point))
            except catalogue.errors.CatalogueError:
                continue
            continue
        point = complex(*rng.normal(0, 1.5, 2))
        if k % 4 == 0 and not ends:  # the pole: where both cranks' lines meet
            (a, a_star), (b, b_star) = (pivots[i, :, 0] + 1j * pivots[i, :, 1] for i in (0, 1))
            u, v = a_star - a, b_star - b
            point = a + u * ((b - a).conjugate() * v).imag / (u.conjugate() * v).imag
            if abs(point) > 20:
                rng.uniform()
                continue
        made.append(catalogue.guide(pivots.tolist(), (point.real, point.imag)))
    return made


def true_curve(guide: OwnGuide) -> Array:
    """Return the whole coupler curve of the circuit on which a linkage is given, so densely that its chords are off by
    about a millionth of its extent, however fast it runs."""
    point = complex(*guide.guided)
    ways = ways_round(np.array(guide.pivots, float), point)
    best = None
    for way, _ in ways:
        z = _dense(way)
        home = np.nanmin(np.abs(z - point))
        if best is None or home < best[0]:
            best = home, z
    assert best is not None
    return best[1][np.isfinite(best[1])]


def _dense(way: Any) -> Array:
    s = np.linspace(0, 2 * np.pi, FIRST)
    lines = np.concatenate(
        [k * np.pi / 2 + np.pi * 2.0 ** -np.arange(3, 48) * side for k in range(5) for side in (-1, 1)]
    )
    s = np.unique(np.append(s, lines[(lines > 0) & (lines < 2 * np.pi)]))
    z = way(s)
    extent = np.nanmax(np.abs(z - z[np.isfinite(z)][0]))
    todo = np.ones(len(s) - 1, bool)
    for _ in range(45):
        which = np.flatnonzero(todo & (np.diff(s) > 1e-14))
        middle = 0.5 * (s[which] + s[which + 1])
        chord, between = z[which + 1] - z[which], way(middle)
        off = np.abs(((between - z[which]) * chord.conj()).imag) / np.maximum(np.abs(chord), 1e-300)
        wide = (np.nan_to_num(np.abs(chord)) > FAR * extent) | (np.nan_to_num(off) > BENT * extent)
        if not wide.any():
            break
        s, z = np.insert(s, which[wide] + 1, middle[wide]), np.insert(z, which[wide] + 1, between[wide])
        todo = np.zeros(len(s) - 1, bool)
        fresh = which[wide] + np.arange(wide.sum())
        todo[fresh] = todo[fresh + 1] = True
    return z
