"""Solve small linear systems by Gaussian elimination, also for further right sides."""

from __future__ import annotations

from .compiling import compiled, inlined


@compiled
def eliminate(a, m, columns, interchanged):
    """Solve a system of m equations by elimination with row pivoting, in place: `columns` with all
    right sides.

    Return the sign of the determinant.  The solution of a singular system is not finite.  Pivots
    and factors remain in `a` for `substitute`.
    """
    sign = 1.0
    for c in range(m):
        p, most = c, abs(a[c, c])
        for r in range(c + 1, m):
            if abs(a[r, c]) > most:
                p, most = r, abs(a[r, c])
        interchanged[c] = p
        if p != c:
            sign = -sign
            for j in range(c, columns):
                a[c, j], a[p, j] = a[p, j], a[c, j]
        sign *= (a[c, c] > 0) - (a[c, c] < 0)
        inverse = 1 / a[c, c]
        for j in range(c + 1, columns):
            a[c, j] *= inverse
        for r in range(c + 1, m):
            share = a[r, c]
            if share != 0:
                for j in range(c + 1, columns):
                    a[r, j] -= share * a[c, j]
    for c in range(m - 1, 0, -1):
        for r in range(c):
            share = a[r, c]
            if share != 0:
                for j in range(m, columns):
                    a[r, j] -= share * a[c, j]
    return sign


@inlined
def substitute(a, m, interchanged, out):
    """Solve an eliminated system for another right side, in place."""
    for c in range(m):
        out[c], out[interchanged[c]] = out[interchanged[c]], out[c]
        out[c] /= a[c, c]
        for r in range(c + 1, m):
            out[r] -= a[r, c] * out[c]
    for c in range(m - 1, 0, -1):
        for r in range(c):
            out[r] -= a[r, c] * out[c]
