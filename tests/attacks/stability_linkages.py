"""Linkages that are stiff or extreme, for `stability.py`."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from catalogue.kinematics.linkage import FAMILIES, PR, RR, Linkage
from catalogue.kinematics.types import Array, Mask
from tests.attacks.stability_reference import numbers_of
from tests.benchmarks.degenerations import dead_point

#: A stress: inputs (n, 10) and which pivots are finite (n, 2, 2).
Stressed = tuple[Array, Mask]


def plain(n: int, family: str = "four-bar", seed: int = 1) -> Stressed:
    """Return random linkages of size 2 or so, clear of everything singular."""
    draw, kinds = np.random.default_rng(seed), FAMILIES[family]
    pivots = np.ones((60 * n, 2, 2, 3))
    pivots[..., :2] = draw.normal(size=(60 * n, 2, 2, 2))
    for i, kind in enumerate(kinds):
        if kind != RR:
            pivots[:, i, 0 if kind == PR else 1, 2] = 0
    linkage, _ = Linkage.valid(pivots)
    z, ray = linkage.points, linkage.rays
    apart = np.abs(z[:, :, 0] - z[:, :, 1])
    clear = (np.abs((ray[:, 0].conj() * ray[:, 1]).imag) > 0.3) & (apart > 0.4).all(1)
    linkage = linkage[np.flatnonzero(clear)[:n]]
    assert len(linkage) == n
    return numbers_of(linkage, draw.normal(size=(n, 2)) @ [1, 1j]), linkage.finite


def _four_bars(n: int, change: Callable[[Array, Any], Array], seed: int = 2) -> Stressed:
    inputs, finite = plain(n, seed=seed)
    z = inputs[:, ::2] + 1j * inputs[:, 1::2]
    z = change(z.copy(), np.random.default_rng(seed))
    return np.stack([z.real, z.imag], axis=2).reshape(n, 10), finite


def of_dead_point(near: float, n: int) -> Stressed:
    """Coupler and second crank nearly in line: the first crank cannot drive."""

    def change(z: Array, _: Any) -> Array:
        way = (z[:, 3] - z[:, 1]) / np.abs(z[:, 3] - z[:, 1])
        z[:, 3] = z[:, 2] + np.abs(z[:, 3] - z[:, 2]) * way * np.exp(1j * near)
        return z

    return _four_bars(n, change)


def of_parallel(near: float, n: int) -> Stressed:
    """Cranks nearly parallel: the coupler cannot drive, the pole is far."""

    def change(z: Array, _: Any) -> Array:
        way = (z[:, 1] - z[:, 0]) / np.abs(z[:, 1] - z[:, 0])
        z[:, 3] = z[:, 2] + np.abs(z[:, 3] - z[:, 2]) * way * np.exp(1j * near)
        return z

    return _four_bars(n, change)


def of_change_point(near: float, n: int) -> Stressed:
    pivots = dead_point(near, np.random.default_rng(3), n)
    return numbers_of(Linkage(pivots), np.full(n, 0.7 - 0.4j)), np.ones((n, 2, 2), bool)


def of_short(which: tuple[int, int], near: float, n: int) -> Stressed:
    """Two pivots nearly coincide: crank (0, 1), frame (0, 2), coupler (1, 3)."""

    def change(z: Array, _: Any) -> Array:
        one, other = which
        z[:, other] = z[:, one] + near * (z[:, other] - z[:, one])
        return z

    return _four_bars(n, change)


def scaled(scale: float, n: int, family: str = "four-bar") -> Stressed:
    inputs, finite = plain(n, family)
    length = np.repeat(np.concatenate([finite.reshape(n, 4), np.ones((n, 1), bool)], 1), 2, axis=1)
    return np.where(length, scale * inputs, inputs), finite


def offset(away: float, n: int, family: str = "four-bar") -> Stressed:
    inputs, finite = plain(n, family)
    length = np.repeat(np.concatenate([finite.reshape(n, 4), np.ones((n, 1), bool)], 1), 2, axis=1)
    return np.where(length, inputs + away, inputs), finite


STRESSES: dict[str, Callable[[int], Stressed]] = {
    **{f"random {family}": partial(plain, family=family) for family in FAMILIES},
    **{f"dead point, {e:.0e} rad": partial(of_dead_point, e) for e in (1e-3, 1e-6, 1e-9, 1e-12)},
    **{f"parallel cranks, {e:.0e} rad": partial(of_parallel, e) for e in (1e-3, 1e-6, 1e-9, 1e-12)},
    **{f"change point, {e:.0e} rad": partial(of_change_point, e) for e in (1e-3, 1e-6)},
    **{f"crank shorter, {e:.0e}": partial(of_short, (0, 1), e) for e in (1e-3, 1e-6, 1e-9)},
    **{f"frame shorter, {e:.0e}": partial(of_short, (0, 2), e) for e in (1e-3, 1e-6, 1e-9)},
    **{f"coupler shorter, {e:.0e}": partial(of_short, (1, 3), e) for e in (1e-3, 1e-6, 1e-9)},
    **{f"coordinates {e:.0e}": partial(scaled, e) for e in (1e-150, 1e-60, 1e60, 1e150)},
    **{f"slider-crank, coordinates {e:.0e}": partial(scaled, e, family="slider-crank") for e in (1e-150, 1e150)},
    **{f"offset {e:.0e} sizes": partial(offset, e) for e in (1e4, 1e8)},
    **{f"inverted, offset {e:.0e} sizes": partial(offset, e, family="inverted-slider-crank") for e in (1e8,)},
}  # fmt: skip
