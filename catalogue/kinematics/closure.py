"""Closure of the second dyad, in the frame of the leading crank.

With phi the crank's angle from an axis of the fixed plane, the chain closes where

    (cos phi - p)(q - cos phi) >= 0.

The two signs of the root of this product are the two ways to close it.  r, f, l, c are the lengths
of crank, frame, coupler and second crank, e the distance of the slider's line from the crank's
pivot, h that of the coupler line from the crank pin:

==================  ===================================  ===================================
second dyad, axis   p                                    q
==================  ===================================  ===================================
crank, to its       (r^2 + f^2 - (l + c)^2)/(2 r f)      (r^2 + f^2 - (l - c)^2)/(2 r f)
pivot
slider, normal of   (e - l)/r                            (e + l)/r
its line
slide, to its       -infinity                            (r^2 + f^2 - h^2)/(2 r f)
pivot
==================  ===================================  ===================================

All roots are computed from products, which lose no digits near a dead point.

Source: the closures by two circles, or a circle and a line.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .batch import Columns
from .linkage import PR, RP, Linkage
from .motion import CHANGE
from .plane_vectors import cross, dot
from .types import Complexes, Floats, Indices, Integers, Mask


@dataclass(frozen=True)
class Closure(Columns):
    """Closure of the second dyads of n linkages in the frames of the leading cranks.

    Arrays of shape (n,), except `dead`, `change` and `at`, (2, n): by p and by q.
    """

    kind: Integers  # kind of the second dyad
    pivot: Complexes
    pin: Complexes
    arm: Complexes  # vector of the crank along the axis
    goal: Complexes  # pivot of the second dyad; for a slider the normal of its line
    way: Complexes  # vector of the coupler from pin to pin; for a slide the normal of its line
    r: Floats
    f: Floats
    square: Floats  # (l^2 - c^2)/2; for a slider e, for a slide h
    p_up: Floats  # 1 + p
    q_down: Floats  # 1 - q
    dead: Mask  # whether the crank reaches a dead point
    change: Mask  # whether the crank reaches a change point
    stuck: Mask  # whether the chain closes in one position of the crank only
    at: Floats  # angles of dead and change points from the axis [rad]
    side: Floats  # number with the sign of the root in the given position

    @classmethod
    def of(cls, linkage: Linkage, lead: Integers) -> Closure:
        row = np.arange(len(linkage))
        (pivot, pin), (goal, pin2) = (linkage.points[row, dyad].T for dyad in (lead, 1 - lead))
        kind = linkage.dyads[row, 1 - lead]
        slider, slide = kind == PR, kind == RP
        r, f = np.abs(pin - pivot), np.abs(goal - pivot)
        l, c = np.abs(pin2 - pin), np.abs(pin2 - goal)  # noqa: E741  # of the head of the module
        e, h = dot(goal, pin2 - pivot), dot(pin2, goal - pin)
        axis = np.where(slider, goal, (goal - pivot) / f)
        near, far, high = np.abs(r - f), r + f, np.abs(h)
        with np.errstate(all="ignore"):
            # 1 + p, 1 - p, 1 + q, 1 - q
            four_bar = [
                (far - l - c) * (far + l + c),
                (l + c - near) * (l + c + near),
                (far - np.abs(l - c)) * (far + np.abs(l - c)),
                (np.abs(l - c) - near) * (np.abs(l - c) + near),
            ]
            by_slider = [(r + e - l) / r, (r - e + l) / r, (r + e + l) / r, (r - e - l) / r]
            by_slide = [-np.ones_like(r), np.ones_like(r), (far - high) * (far + high), (high - near) * (high + near)]
            bounds = np.where(slider, by_slider, np.where(slide, by_slide, four_bar))
            bounds = bounds / np.where(slider, 1.0, 2 * r * f)
            bounds[:2, slide] = [[-1.0], [1.0]]
            # length missing for a full turn, with the crank pin at its farthest and at its nearest
            crank_excess = [far - l - c, np.abs(l - c) - near]
            excess = np.where(slider, [r + e - l, r - e - l], np.where(slide, [-far, high - near], crank_excess))
            nearly = CHANGE * np.maximum(
                np.maximum(r, l), np.where(slider, np.abs(e), np.maximum(f, np.where(slide, 0, c)))
            )
            # spare length to close anywhere, with the crank pin at its nearest and at its farthest
            crank_spare = [l + c - near, far - np.abs(l - c)]
            spare = np.where(slider, [r - e + l, r + e + l], np.where(slide, [far, far - high], crank_spare))
            change, dead = np.abs(excess) <= nearly, excess > nearly
            stuck = (dead & (spare <= nearly)).any(0)
            bounds[[0, 3]] = np.where(change, 0.0, bounds[[0, 3]])
            short = bounds[[0, 3]]
            at = 2 * np.arctan2(np.sqrt(np.maximum(bounds[[1, 3]], 0)), np.sqrt(np.maximum(bounds[[0, 2]], 0)))
        square = np.where(slider, e, np.where(slide, h, 0.5 * (l - c) * (l + c)))
        way = np.where(slide, pin2, pin2 - pin)
        side = cross(np.where(slider, goal, goal - pin), way)
        return cls(
            kind, pivot, pin, r * axis, goal, way, r, f, square, short[0], short[1], dead, change, stuck, at, side
        )

    @property
    def angle(self) -> Floats:
        """The crank's angle from the axis in the given position [rad]."""
        return np.angle((self.pin - self.pivot) / self.arm)

    def root(self, phi: Floats, cosine: Floats, sine: Floats, swing: Swing | None) -> Floats:
        """Compute the signed root that closes the linkage; see the head of the module.

        Parameters
        ----------
        phi, cosine, sine : ndarray, shape (m, n)
            Angles of the cranks [rad], cosine and sine of their halves.
        swing : Swing, optional
            The swinging cranks among them.

        Returns
        -------
        ndarray, shape (m, n)
            Roots, which change their signs at dead and change points.
        """
        p, q = 2 * cosine**2 - self.p_up, 2 * sine**2 - self.q_down
        with np.errstate(all="ignore"):
            if swing is not None:
                for factor, dead in zip((p, q), self.dead[:, swing.which], strict=True):
                    factor[:, swing.which] = np.where(dead, swing.ends, factor[:, swing.which])
            square = np.where(self.kind == RP, q, p * q)
            if (both := np.asarray(self.dead.all(0))).any():
                some = columns(both)
                away, (at_p, at_q) = np.abs(phi[:, some]), self.at[:, some]
                square[:, some] = p[:, some] * 2 * np.sin(0.5 * (at_p + away)) * np.sin(0.5 * (away + at_q))
            root = np.sqrt(square)
        for through, factor in zip(self.change, (cosine, sine), strict=True):
            if through.any():
                root = np.where(through & (factor < 0), -root, root)
        if swing is not None:
            root[:, swing.which] = np.where(swing.back, -root[:, swing.which], root[:, swing.which])
        return np.asarray(root)


def turn_between(goal: Complexes, way: Complexes, side: Complexes) -> Complexes:
    """Compute unit vectors that turn `way` into the direction of `side` as seen from `goal`.

    They close every dyad with a pin at one end: `goal` is the vector to its other pin, or the
    normal of its line.
    """
    turned = goal * way.conj() * side
    return np.asarray(turned / np.abs(turned))


class Swing(NamedTuple):
    """Columns of swinging cranks, and their angles `phi` by phases (m, k).

    `ends` is twice the product of the sines of half the angles to both dead points, `back` tells
    whether the swing runs back.
    """

    which: Indices | slice
    phi: Floats
    ends: Floats
    back: Mask

    @classmethod
    def of(cls, swings: Mask, centre: Floats, half: Floats, s: Floats) -> Swing | None:
        """Return the columns that swing about `centre` by `half`; None if none does."""
        if not swings.any():
            return None
        which = columns(swings)
        centre, half, part = centre[which], half[which], 0.5 * s[:, which]
        sine, cosine = np.sin(part), np.cos(part)
        low, high = np.abs(half) * sine**2, np.abs(half) * cosine**2
        phi = centre - half * (cosine - sine) * (cosine + sine)
        return cls(which, phi, 2 * np.sin(low) * np.sin(high), sine * cosine < 0)


def columns(some: Mask) -> Indices | slice:
    """Return the indices of the True entries of a mask; a slice if all are True."""
    return slice(None) if some.all() else np.flatnonzero(some)
