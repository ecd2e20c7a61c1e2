"""Determine the handedness of circuits and the direction in which their curves are followed.

A search along a coupler curve depends on its start and its direction. If left-handed circuits are
followed like their mirror images, the search gives the same result for a linkage and for its mirror
image.
"""

from __future__ import annotations

import numpy as np

from .circuits import COUPLER, SWING, TURN, Carriers, Circuits
from .plane_vectors import cross, dot
from .types import Complexes, Floats, Mask


def left_handed(circuits: Circuits, point: Complexes) -> Mask:
    """Tell which circuits (k,) with coupler points (k,) are left-handed.

    Their mirror images are right-handed. Of the two circuits of a crank that turns fully one is
    left-handed, whatever the point. Otherwise the position of the point in the coupler decides: the
    side of the line through the moving pivots, or the quadrant about the slot. A shape that is its
    own mirror image is right-handed.

    Examples
    --------
    >>> import numpy as np
    >>> from catalogue.kinematics.circuits import circuits
    >>> from catalogue.kinematics.linkage import Linkage
    >>> pivots = np.array([[[0.0, 0], [0, 1]], [[3, 0], [3.5, 2]]])
    >>> found = circuits(Linkage([pivots, pivots * [1, -1]]))
    >>> left_handed(found, np.array([1 + 2j, 1 - 2j])[found.of]).tolist()
    [False, True, True, False]
    """
    crank, swing = circuits.lead != COUPLER, circuits.kind == SWING
    two = crank & (circuits.kind == TURN) & (circuits.period < 3 * np.pi)
    side = np.where(two, circuits.sign, np.where(swing & ~_is_about_axis(circuits), circuits.centre, 0.0))
    return np.where(side != 0, side < 0, _coupler_handedness(circuits, point) < 0)


def followed(circuits: Carriers, point: Complexes) -> tuple[Floats, Floats]:
    """Choose start and direction along coupler curves (k,), alike for mirror images.

    The parameter s of a curve is the phase offset + sense * s of its circuit. Right-handed curves
    run forward from phase 0, left-handed ones backward from the period. The left-handed curve of a
    crank that swings to either side of its axis runs forward from its other dead point, at pi.

    Returns
    -------
    offset, sense : ndarray, shape (k,)
        Phases [rad], and 1 or -1.
    """
    if not isinstance(circuits, Circuits):  # handedness is not defined for chains of many bars
        return np.zeros(len(point)), np.ones(len(point))
    left, same = left_handed(circuits, point), _is_about_axis(circuits)
    return np.where(left, np.where(same, np.pi, circuits.period), 0.0), np.where(left & ~same, -1.0, 1.0)


def _is_about_axis(circuits: Circuits) -> Mask:
    """Tell which cranks swing about their axis, with both sides on one circuit."""
    return np.asarray((circuits.kind == SWING) & ((circuits.centre == 0) | (circuits.centre == np.pi)))


def _coupler_handedness(circuits: Circuits, point: Complexes) -> Floats:
    """Compute the signed handedness of couplers with their points, (k,); 0 if symmetric."""
    linkage = circuits.linkage
    z, finite = linkage.points, linkage.finite[..., 1]
    both, none = finite.all(1), ~finite.any(1)
    i = np.argmax(finite, axis=1)  # a finite moving pivot, or the first of two slots
    rows = np.arange(len(i))
    here: Complexes = np.where(none, z[:, 0, 0], z[rows, i, 1])
    ray: Complexes = np.where(both, z[:, 1, 1] - here, np.where(none, z[:, 1, 0] - here, z[rows, 1 - i, 1]))
    away, unit = point - here, ray / np.maximum(np.abs(ray), np.finfo(float).tiny)
    along, across = dot(unit, away), cross(unit, away)
    off = cross(unit, z[rows, 1 - i, 0] - here)  # distance of the slot from the moving pivot
    small = 1e-12 * linkage.size  # four digits above rounding
    side = np.where(both | none, across, along * np.where(np.abs(across) > small, across, off))
    return np.asarray(np.where(np.abs(side) > small * np.where(both | none, 1.0, linkage.size), side, 0.0))
