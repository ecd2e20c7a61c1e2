"""Lengths, transmission angles and the conditions of Grashof with their derivatives by the pivots.

Coordinates are those of `derivatives`.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..linkage import PR, RP, RR, Array, Linkage
from ..motion import Motion
from ..query.lay import Answers
from .derivatives import COUNT, Swayed

#: Value of an inequality that does not concern a linkage.
FAR = -1e3

#: Values (n,) or (m, n), and their derivatives, one more axis of 10.
Row = tuple[Array, Array]


def chosen(where: Array, one: Row, two: Row) -> Row:
    """Return `one` where a mask (n,) says so, else `two`."""
    return np.where(where, one[0], two[0]), np.where(where[:, None], one[1], two[1])


def apart(one: Array, i: int, other: Array, j: int) -> Row:
    """Distance of two points and its derivatives; 0 ... 3 pivots, 4 the guided point, 5 a point that stays."""
    by = np.zeros((len(one), COUNT + 2))
    between = one - other
    with np.errstate(all="ignore"):
        unit = between / np.abs(between)
    for k, sign in ((i, 1), (j, -1)):
        by[:, 2 * k] += sign * unit.real
        by[:, 2 * k + 1] += sign * unit.imag
    return np.abs(between), by[:, :COUNT]


def transmission(linkage: Linkage, moving: Motion, t: Array, by: Swayed | None, least: Array) -> Iterator[Row]:
    """Sine of the bound less that of the transmission angle in each position, the better crank driving."""
    d, x = moving.pose(t)
    turn = 1 + x
    z, kind = linkage.points, linkage.dyads
    d = d - x * moving.origin

    def own(i: int, j: int, value: Array) -> Array:
        """Return the derivatives of a pivot by its own coordinates, times a value (m, n)."""
        out = np.zeros((*value.shape, COUNT), dtype=complex)
        out[..., 4 * i + 2 * j], out[..., 4 * i + 2 * j + 1] = value, 1j * value
        return out

    def carried(i: int, shift: bool) -> Row:
        """Return where a moving pivot (or a direction that the coupler carries) is, with derivatives."""
        at = turn * z[:, i, 1]
        slope = np.zeros((*t.shape, COUNT), dtype=complex)
        if by is not None:
            slope = own(i, 1, turn) + 1j * at[..., None] * by.angle + (by.shift if shift else 0)
        return at + d if shift else at, slope

    still = np.ones(t.shape)
    found: list[tuple[Array, Row]] = []
    for driver in (0, 1):
        other = 1 - driver
        moving_pivot, fixed = carried(other, True), (still * z[:, other, 0], own(other, 0, still))
        crank = moving_pivot[0] - fixed[0], moving_pivot[1] - fixed[1]
        slide = kind[:, other] == RP
        ray = chosen(kind[:, other] == RR, crank, chosen(slide, carried(other, False), fixed))
        contact = chosen(slide, fixed, moving_pivot)
        driving = carried(driver, True)
        arm = contact[0] - driving[0], contact[1] - driving[1]
        arm = chosen(kind[:, driver] == RP, carried(driver, False), arm)
        with np.errstate(all="ignore"):
            (p, dp), (q, dq) = ((v / np.abs(v), g / np.abs(v)[..., None]) for v, g in (arm, ray))
            sine = (p.conj() * q).imag
            slope = (dp.conj() * q[..., None] + p.conj()[..., None] * dq).imag
            slope -= sine[..., None] * ((dp.conj() * p[..., None]).real + (dq.conj() * q[..., None]).real)
        possible = (kind[:, driver] == RR) | (kind != RR).all(1)
        worst = np.where(possible, np.abs(sine).min(0), -1.0)
        sign = np.sign(sine.sum(0))
        found.append((worst, (sign * sine, sign[:, None] * slope)))
    (first, one), (second, two) = found
    bound = np.where(np.isfinite(least), np.sin(np.radians(np.clip(least, 0, 90))), FAR)
    for sine, slope in zip(*chosen(~(second > first), one, two), strict=True):
        yield bound - sine, -slope


def turning(now: Answers, links: list[Row], ground: Row, stroke: float) -> Iterator[Row]:
    """What keeps the crank that turns fully from jamming, in strokes: the conditions of Grashof.

    Crank a, ground g, coupler b, other crank c: a + g <= b + c and |a - g| >= |b - c|; a slider at the offset e has
    a + |e| <= b, a slide at the distance h of its line from its moving pivot |g - a| >= h.
    """
    linkage = now.linkage
    z, kind, n = linkage.points, linkage.dyads, len(now.point)
    first = (now.measures.rotates.astype(int) & 1).astype(bool)

    def plus(*terms: tuple[Array | float, Row]) -> Row:
        return np.asarray(sum(f * v for f, (v, _) in terms)), np.asarray(
            sum((f * np.ones(n))[:, None] * g for f, (_, g) in terms)
        )

    def distance(i: int) -> Row:
        """Of the moving pivot of the crank from the line of the other dyad, or of the fixed one."""
        o = 1 - i
        slider = kind[:, o] == PR
        normal = np.where(slider, z[:, o, 0], z[:, o, 1])
        gap = np.where(slider, z[:, i, 0] - z[:, o, 1], z[:, o, 0] - z[:, i, 1])
        value = (normal.conj() * gap).real
        by = np.zeros((n, COUNT))
        ends = (slider, (i, 0), (o, 1), (o, 0)), (~slider, (o, 0), (i, 1), (o, 1))
        for here, (a, b), (c, d), (e, f) in ends:
            for k, w, vector in ((4 * a + 2 * b, 1, normal), (4 * c + 2 * d, -1, normal), (4 * e + 2 * f, 1, gap)):
                by[:, k] += np.where(here, w * vector.real, 0)
                by[:, k + 1] += np.where(here, w * vector.imag, 0)
        return value, by

    a, c = chosen(first, links[0], links[1]), chosen(first, links[1], links[0])
    b, e = links[2], chosen(first, distance(0), distance(1))
    to_fixed = chosen(first, apart(z[:, 0, 0], 0, z[:, 1, 0], 2), apart(z[:, 1, 0], 2, z[:, 0, 0], 0))
    side = np.sign(ground[0] - a[0])
    four, slider, slide = (kind == RR).all(1), (kind == PR).any(1), (kind == RP).any(1)
    past = np.sign(to_fixed[0] - a[0])
    cases = [
        (four, plus((1, a), (1, ground), (-1, b), (-1, c))),
        (four, plus((1, b), (-1, c), (-side, ground), (side, a))),
        (four, plus((1, c), (-1, b), (-side, ground), (side, a))),
    ]
    for sign in (1, -1):
        cases.append((slider, plus((1, a), (sign, e), (-1, b))))
        cases.append((slide, plus((sign, e), (-past, to_fixed), (past, a))))
    for where, (value, slope) in cases:
        yield np.where(where, value / stroke, np.nan), slope / stroke
