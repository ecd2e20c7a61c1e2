"""How far a guide forgives the scatter of its pivots: many machines are drawn and followed; nothing is of `catalogue`.

Every coordinate of the finite pivots and of the guided point is off by independent normal numbers.  The nominal, a
line, an arc of given radius, or any, is placed anew for each machine.  The allowance is the standard deviation with
which 95 of 100 stay within the tolerance; at most a hundredth of the shortest link.
"""

from __future__ import annotations

import numpy as np
from independent import SLIDE, SLIDER, Array, Guides, best_driver, walk

#: Part of the machines that keep the tolerance.
KEPT = 0.95
#: Machines drawn for a final figure, which is known to about one per cent; stations along their paths.
DRAWS, STATIONS = 6000, 25
#: Largest allowance, over the shortest link.
LARGEST = 0.01
#: Steps of the secant method to the allowance; exchanges of a best fit.
STEPS, EXCHANGES = 8, 8


def scattered(g: Guides, scatter: Array | float, draws: Array) -> Guides:
    """Return n guides with their pivots and points moved, (n * r,) of (n,), by normal numbers (10, r) times scatter."""

    def moved(z: Array, i: int) -> Array:
        by = np.asarray(scatter)[..., None] * (draws[2 * i] + 1j * draws[2 * i + 1])
        return np.asarray((z[:, None] + by).ravel())

    def held(z: Array) -> Array:
        return np.repeat(z, draws.shape[1])

    c = held(g.c) if g.family == SLIDER else moved(g.c, 2)
    d = held(g.d) if g.family == SLIDE else moved(g.d, 3)
    return Guides(moved(g.a, 0), moved(g.b, 1), c, d, moved(g.p, 4), g.family)


def deviations(g: Guides, radius: float | None, stations: int = STATIONS) -> Array:
    """Return the deviations of n guides, driven by their first crank, from x = 0 to x = 1; NaN where one fails.

    Parameters
    ----------
    radius : float or None
        0 for a line, None for an arc of any radius.
    """
    path = walk(g, stations).poses.p
    if radius == 0:
        return fitted(path.imag, np.stack([np.ones_like(path.real), path.real]))
    if radius is None:  # through both ends and the middle, then the best one near it
        first, middle, last = path[0], path[len(path) // 2], path[-1]
        p, q = middle - first, last - first
        with np.errstate(all="ignore"):
            centre = first + 1j * (np.abs(p) ** 2 * q - np.abs(q) ** 2 * p) / (2 * (p * q.conj()).imag)
        own = np.abs(first - centre)
    else:
        half = 0.5 * (path[-1] - path[0])
        bulge = 1j * half / np.abs(half)
        own = np.full(path.shape[1], radius)
        centre = path[0] + half - bulge * np.sqrt(own**2 - np.abs(half) ** 2)
    ray = path - centre
    far = np.abs(ray)
    with np.errstate(all="ignore"):
        ray = ray / far
    basis = [ray.real, ray.imag, *([np.ones_like(far)] if radius is None else [])]
    return fitted(far - own, np.stack(basis))


def fitted(error: Array, basis: Array) -> Array:
    """Return the largest distances of errors (m, n) from their best fits by basis functions (k, m, n), by exchange."""
    k, (m, n) = len(basis), error.shape
    at = np.repeat(np.linspace(0, m - 1, k + 1).round().astype(int)[:, None], n, axis=1)
    column, sign = np.arange(n), (-1.0) ** np.arange(k + 1)
    with np.errstate(all="ignore"):
        rest = error
        for _ in range(EXCHANGES):
            rows = np.concatenate([basis[:, at, column], np.broadcast_to(sign[:, None], (1, k + 1, n))])
            matrix = np.moveaxis(rows, (2, 1, 0), (0, 1, 2))
            good = np.isfinite(matrix).all((1, 2)) & np.isfinite(error).all(0)
            good[good] = np.abs(np.linalg.det(matrix[good])) > 1e-300
            found = np.full((n, k + 1), np.nan)
            found[good] = np.linalg.solve(matrix[good], error[at, column].T[good][..., None])[..., 0]
            rest = error - (basis * found.T[:k, None]).sum(0)
            at = _exchanged(rest, at)
    return np.asarray(np.abs(rest).max(0))


def _exchanged(rest: Array, at: Array) -> Array:
    """Return the stations (k + 1, n) with the worst one in the place of the neighbour with its sign."""
    column = np.arange(rest.shape[1])
    worst = np.argmax(np.nan_to_num(np.abs(rest)), axis=0)
    signs = np.sign(rest[at, column])
    own = np.sign(rest[worst, column])
    place = (at < worst).sum(0)  # how many are before it
    last = len(at) - 1
    left, right = np.clip(place - 1, 0, last), np.clip(place, 0, last)
    out = at.copy()
    same_left = (place > 0) & (signs[left, column] == own)
    same_right = (place <= last) & (signs[right, column] == own)
    use = np.where(same_left, left, np.where(same_right, right, -1))
    inner = use >= 0
    out[use[inner], column[inner]] = worst[inner]
    before = ~inner & (place == 0)  # push the last one out
    out[:, before] = np.concatenate([worst[None, before], at[:-1, before]])
    after = ~inner & (place > last)
    out[:, after] = np.concatenate([at[1:, after], worst[None, after]])
    return np.sort(out, axis=0)


def strayed(g: Guides, scatter: Array | float, radius: float | None, draws: Array, stations: int = STATIONS) -> Array:
    """Return the deviations (n,) that 95 of 100 machines keep at a scatter; machines that fail count as the worst."""
    all_ = deviations(scattered(g, scatter, draws), radius, stations).reshape(len(g.p), -1)
    return np.quantile(np.where(np.isnan(all_), 1.0, all_), KEPT, axis=1)


def allowance(g: Guides, tolerance: float, radius: float | None, draws: int = DRAWS) -> float:
    """Return the allowance of one guide for a tolerance, in strokes; negative where that is not kept at all."""
    g = best_driver(g)
    normal = np.random.default_rng(7).normal(size=(10, draws))
    own = float(deviations(g, radius, 2 * STATIONS)[0])
    most = LARGEST * min(float(link[0]) for link in g.links)
    if not own < tolerance:
        return min(tolerance - own, 0.0)
    low, scatter, high = 0.0, min(0.1 * (tolerance - own), most), most
    value = own
    for _ in range(STEPS):
        value = float(strayed(g, scatter, radius, normal)[0])
        if value > tolerance:
            high = scatter
        elif scatter >= most:
            return most
        else:
            low = scatter
        if abs(value - tolerance) < 1e-4 * tolerance:
            break
        ahead = scatter * (tolerance - own) / max(value - own, 1e-12)
        scatter = min(ahead, most) if low < ahead < high or ahead >= most == high else 0.5 * (low + high)
    return scatter
