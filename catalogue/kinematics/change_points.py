"""Change points: two branches of the motion cross; K and the discriminant of the chart vanish like t and t^2."""

from __future__ import annotations

import numpy as np

from .charts import J2, G, H, K, N
from .types import Array


def at_change(forms: Array, circle: Array, origin: Array, pole: Array, change: Array) -> tuple[Array, Array]:
    """Divide K by t where the linkage is at a change point, and return the sign of the root with the wanted pole."""
    k = forms[K]
    forms = forms.copy()
    forms[K] = np.where(change, np.stack([k[1], k[2], np.zeros_like(k[0])]), k)
    h, _, n, _, _, b_x, b_y = forms[:, 0]
    best = np.full(len(pole), np.inf)
    branch = np.zeros(len(pole), dtype=forms.dtype)
    with np.errstate(all="ignore"):
        for sign in (1.0, -1.0):
            q = crossing(forms, circle, np.full(len(pole), sign, dtype=forms.dtype))
            y = (q * (b_y - 1j * b_x) - h * (b_x + 1j * b_y)) / n
            off = np.abs(origin + 0.5j * y - pole)  # the pole is where y + 2 i (z - o) vanishes
            nearer = change & (off < best)
            best, branch = np.where(nearer, off, best), np.where(nearer, sign, branch)
    return forms, branch


def crossed(forms: Array, scale: Array) -> Array:
    """Return where the circle's constant vanishes too: with K = 0 alone the rays are parallel, not one, shape (n,)."""
    h, g, n, j2 = forms[H, 0], forms[G, 0], forms[N, 0], forms[J2, 0]
    return np.asarray(np.abs(g * n - j2 * h) <= 1e-9 * (np.abs(g * n) + np.abs(j2 * h)) + 1e-10 * scale**2)


def divided_constant(forms: Array) -> Array:
    """Coefficients of  (g N - 2 J h)/t  at a change point, where it has no constant term, shape (3, n)."""
    h, g, n, j2 = forms[H], forms[G], forms[N], forms[J2]
    return np.stack(
        [
            g[0] * n[1] + g[1] * n[0] - j2[0] * h[1] - j2[1] * h[0],
            g[0] * n[2] + g[1] * n[1] - j2[1] * h[1] - j2[2] * h[0],
            g[1] * n[2] - j2[2] * h[1],
        ]
    )


def crossing(forms: Array, circle: Array, branch: Array) -> Array:
    """Return q at t = 0 of linkages at a change point, shape (n,)."""
    return root_of(forms[H, 0], forms[K, 0], divided_constant(forms)[0], circle, branch)


def root_of(h: Array, k: Array, divided: Array, circle: Array, branch: Array) -> Array:
    """Return q of linkages at a change point, all divided by t as far as it goes."""
    mixed = circle * h * h + divided
    with np.errstate(all="ignore"):
        root = branch * np.sqrt(np.where(circle > 0, k * k - mixed, k * k))
        other = np.where(circle > 0, k - root, np.nan)
        return np.asarray(np.where(k * branch < 0, other, mixed / (k + root)))
