"""Which cranks turn fully, by how much, and how well they drive over the whole turn; in closed form, from the lengths.

With a the crank, g the frame, b the coupler, c the other crank, e the distance of the crank's fixed pivot from the line
of the slider's pivot, and h the distance of the crank's moving pivot from the coupler line of a slide:

====================  ====================================  ============================================
linkage               margin                                cosine of the extreme transmission angles
====================  ====================================  ============================================
four-bar              min(b + c - g - a, |g - a| - |b - c|)  (b^2 + c^2 - (g -+ a)^2) / (2 b c)
slider-crank          b - a - |e|                           (a + |e|) / b
inverted              |g - a| - h                           h / |g - a|
====================  ====================================  ============================================

A crank turns fully exactly if its margin is not negative.  At a margin of 0 the linkage has a *change point*: on its
turn the crank comes to where all pivots lie on one line.  It passes there, into either of two motions, so it is said to
turn fully (Grashof's condition with its equality, as textbooks count such linkages), and the least transmission angle
over the turn is 0, which says that something must lead it across.  What is 0 is decided by `CHANGE_POINT`, above the
rounding of the pivots and far below what can be made.

The extremes of the transmission angle lie where crank and frame are in line, with a slider where the crank is normal to
its line.

Source: Grashof, Theoretische Maschinenlehre 2, 1883, for the four-bar; Alt, Der Uebertragungswinkel, 1932.
"""

from __future__ import annotations

import numpy as np

from ..kinematics.linkage import PR, RR, Linkage
from ..kinematics.types import Array

#: Margins up to this part of the longest of the lengths that they are made of count as 0: the residual up to which a
#: linkage belongs to a series.  Stored members of the series with change points stay below 4e-16.
CHANGE_POINT = 1e-9


def rotation_margin(linkage: Linkage) -> Array:
    """Return by how much each crank turns fully, or fails to, shape (n, 2) [length].

    The least length by which the links that must reach a position of the turn are longer than needed: positive if the
    crank turns fully, 0 at a change point (to the rounding of the pivots, cut off at `CHANGE_POINT`), negative if it
    swings; NaN for a dyad that is no crank.

    Parameters
    ----------
    linkage : Linkage of n
    """
    return np.stack([_margin(linkage, k) for k in (0, 1)], axis=-1)


def rotates(linkage: Linkage) -> Array:
    """Return which cranks turn fully, shape (n,): bit i for dyad i; at a change point they do."""
    full = rotation_margin(linkage) >= 0
    return np.asarray(1 * full[:, 0] + 2 * full[:, 1])


def transmission_turn(linkage: Linkage) -> Array:
    """Return the least transmission angle over the whole turn of either crank, this crank driving, shape (n, 2) [deg].

    The angle is that of `catalogue.guide.metrics.transmissions`, 0 ... 90; 0 at a change point, NaN where the crank
    does not turn fully.

    Parameters
    ----------
    linkage : Linkage of n
    """
    return np.stack([_least(linkage, k) for k in (0, 1)], axis=-1)


def min_transmission_turn(linkage: Linkage, driver: Array | None = None) -> Array:
    """Return the least transmission angle over the whole turn of the driving crank, shape (n,) [deg].

    Parameters
    ----------
    linkage : Linkage of n
    driver : ndarray of int, shape (n,), optional
        Number of the crank that drives, 1 or 2, or 0 for none, as in `Measures.driver`; if not given, of those that
        turn fully the one that drives better.

    Returns
    -------
    ndarray, shape (n,)
        NaN where no crank turns fully, or not the one that is given.
    """
    each = transmission_turn(linkage)
    if driver is None:
        return np.asarray(np.fmax(each[:, 0], each[:, 1]))
    index = np.maximum(np.asarray(driver) - 1, 0)
    return np.where(np.asarray(driver) > 0, each[np.arange(len(each)), index], np.nan)


def _lengths(linkage: Linkage, crank: int) -> tuple[Array, ...]:
    """Return a, g, b, c, e and h of one crank, shape (n,) each; those that do not belong to the family mean nothing."""
    z, other = linkage.points, 1 - crank
    pivot, pin, far_pivot, far_pin = z[:, crank, 0], z[:, crank, 1], z[:, other, 0], z[:, other, 1]
    return (
        np.abs(pin - pivot),
        np.abs(far_pivot - pivot),
        np.abs(far_pin - pin),
        np.abs(far_pin - far_pivot),
        np.abs(((far_pin - pivot) * far_pivot.conj()).real),
        np.abs(((far_pivot - pin) * far_pin.conj()).real),
    )


def _margin(linkage: Linkage, crank: int) -> Array:
    a, g, b, c, e, h = _lengths(linkage, crank)
    kind = linkage.dyads[:, 1 - crank]
    four_bar = np.minimum(b + c - g - a, np.abs(g - a) - np.abs(b - c))
    margin = _of_kind(kind, four_bar, b - a - e, np.abs(g - a) - h)
    longest = np.maximum(a, _of_kind(kind, np.maximum(np.maximum(g, b), c), np.maximum(b, e), g))
    # coordinates are rounded where they stand, which may be far out
    z = np.where(linkage.finite, np.abs(linkage.points), 0).max((1, 2))
    nothing = CHANGE_POINT * longest + 8 * np.finfo(float).eps * z
    margin = np.where(np.abs(margin) <= nothing, 0.0, margin)
    return np.where(linkage.dyads[:, crank] == RR, margin, np.nan)


def _least(linkage: Linkage, crank: int) -> Array:
    a, g, b, c, e, h = _lengths(linkage, crank)
    kind, margin = linkage.dyads[:, 1 - crank], _margin(linkage, crank)
    near, far = np.abs(g - a), g + a
    with np.errstate(all="ignore"):
        # tangents of half an angle and of an angle, from factors each of which is a difference of lengths: no digits
        # are lost where the angle is small
        inner = 2 * np.arctan2(np.sqrt((near - (b - c)) * (near + (b - c))), np.sqrt((b + c - near) * (b + c + near)))
        outer = 2 * np.arctan2(np.sqrt((b + c - far) * (b + c + far)), np.sqrt((far - (b - c)) * (far + (b - c))))
        four_bar = np.fmin(inner, np.pi - inner)
        four_bar = np.minimum(four_bar, np.fmin(outer, np.pi - outer))
        reach = a + e
        slider = np.arctan2(np.sqrt((b - reach) * (b + reach)), reach)
        slide = np.arctan2(np.sqrt((near - h) * (near + h)), h)
        angle = np.degrees(_of_kind(kind, four_bar, slider, slide))
        return np.where(margin > 0, angle, np.where(margin == 0, 0.0, np.nan))


def _of_kind(kind: Array, four_bar: Array, slider: Array, slide: Array) -> Array:
    """Return what belongs to the kind of the driven dyad."""
    return np.where(kind == RR, four_bar, np.where(kind == PR, slider, slide))
