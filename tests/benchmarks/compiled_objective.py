"""The plain objective of `jobs` for a population at once, compiled by numba; where numba is missing there is none.

Only for the jobs that bound links, ground, arm and transmission angle of a guide of a straight line.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jobs import FIXED, POSITIONS, TURN, Array, Job

BOUNDED = {"max_link", "max_ground", "max_arm", "min_transmission", "fixed_pivots"}
ANGLES = np.exp(1j * np.linspace(-TURN, TURN, POSITIONS))


def compiled(job: Job) -> Callable[[Array], Array] | None:
    """Return the objective of vectors x (p, n), compiled; None where it is not written, or numba is missing."""
    if job.request.kind != "line" or job.constraints.keys() - BOUNDED:
        return None
    try:
        from numba import njit
    except ImportError:
        return None
    c = job.constraints
    most = np.array([c.get(name, np.inf) for name in ("max_link", "max_ground", "max_arm")])
    sine, fixed = np.sin(np.radians(c.get("min_transmission", 0.0))), bool(job.fixed)
    kernel = njit(_deviations, error_model="numpy")
    (x0, y0), (x1, y1) = FIXED

    def objective(x: Array) -> Array:
        z = np.zeros((x.shape[1], 5), complex)
        if fixed:
            z[:, 0], z[:, 2] = complex(x0, y0), complex(x1, y1)
            z[:, 1], z[:, 3], z[:, 4] = x[0] + 1j * x[1], x[2] + 1j * x[3], 0.5 + 1j * x[4]
        else:
            z[:, :4] = (x[0::2] + 1j * x[1::2]).T
        return np.asarray(kernel(z, ANGLES, most, sine, fixed))

    objective(np.full((len(job.bounds), 1), 0.5))  # compiles
    return objective


def _deviations(z: Array, turns: Array, most: Array, least_sine: float, fixed: bool) -> Array:
    """Return the deviations with penalties of four-bars: z (n, 5) has both dyads and the guided point."""
    n, count, middle = len(z), len(turns), len(turns) // 2
    out, w, sines = np.empty(n), np.empty(count, np.complex128), np.empty(count)
    for i in range(n):
        a, m, b, k, point = z[i]
        r, s, side = abs(k - m), abs(k - b), np.sign((np.conj(b - m) * (k - m)).imag)
        for j in range(count):
            first = a + (m - a) * turns[j]
            base = b - first
            far = abs(base)
            along = (far * far + r * r - s * s) / (2 * far)
            square = r * r - along * along
            if square < 0 or r == 0:
                w[j] = np.nan
                continue
            second = first + (along + 1j * side * np.sqrt(square)) * base / far
            w[j] = first + (second - first) / (k - m) * (point - m)
            sines[j] = abs((np.conj(second - first) * (second - b)).imag) / (r * s)
        tangent = w[middle + 1] - w[middle - 1]
        if not (fixed or abs(tangent) > 0):
            out[i] = 10.0
            continue
        for j in range(count):
            w[j] = w[j] - 0.5 if fixed else (w[j] - point) * np.conj(tangent) / abs(tangent)
        way = 1.0 if w[middle + 1].real > w[middle - 1].real else -1.0
        low = high = middle
        while low > 0 and abs(w[low - 1].real) <= 0.5 and way * (w[low].real - w[low - 1].real) > 0:
            low -= 1
        while high < count - 1 and abs(w[high + 1].real) <= 0.5 and way * (w[high + 1].real - w[high].real) > 0:
            high += 1
        reach = abs(w[high].real - w[low].real)
        if not reach > 0.95:
            out[i] = 10.0 - reach
            continue
        u, v = w[low : high + 1].real, w[low : high + 1].imag
        if fixed:
            deviation = np.abs(v).max()
        else:
            du, dv = u - u.mean(), v - v.mean()
            off = dv - du * ((du * dv).sum() / (du * du).sum())
            deviation = 0.5 * (off.max() - off.min())
        deviation += max(0.0, max(abs(m - a), s, r) - most[0])
        deviation += max(0.0, abs(a - b) - most[1]) + max(0.0, min(abs(m - point), abs(k - point)) - most[2])
        out[i] = deviation + max(0.0, least_sine - sines[low : high + 1].min())
    return out
