"""The guided elements of sampled linkages that are worth tracing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..curvature_theory.analysis import DEGENERATE
from ..guidance.kinds import POINTS, RETURNS, SLOTS, STRAIGHT
from ..kinematics.batch import join
from ..kinematics.linkage import Linkage
from ..kinematics.types import Complexes, Floats, Mask
from ..series.sampling import Drawn
from ..series.series import Series
from .rows import Columns


class ElementLimits(NamedTuple):
    """Limits of the places of guided points."""

    nearest: float = 0.15  #: smallest distance from the pole [rho0]: nearer ones have short strokes
    #: largest distance from the pole [rho0]: farther ones need a bulky coupler
    farthest: float = 6.0
    #: largest distance from the pole of a point at the pole, whose path returns [rho0]
    at_pole: float = 1e-9
    #: Distance from a moving pivot up to which a guided point is that pivot, which needs no guide.
    nearest_pivot: float = 0.03


ELEMENT = ElementLimits()

RADII = (0.1, 50.0)


def elements_worth_tracing(series: Series, drawn: Drawn) -> Columns:
    """Return the guided elements of all kinds; see `points`."""
    kinds = [kind for guided in (POINTS, SLOTS, RETURNS) for kind in guided.values()]
    return join(*(points(series, drawn, kind) for kind in kinds))


def points(series: Series, drawn: Drawn, kind: str) -> Columns:
    """Return the guided elements of a kind, of all usable linkages.

    See `Guide` for the frame. The moving point is guided where possible. Where it is at infinity or
    at the pole, the coupler instead carries a slot over the fixed point, which is a guided point of
    the inverse motion. Points at the pole travel to and fro.
    """
    circle, slots, returns = kind not in STRAIGHT, kind in SLOTS.values(), kind in RETURNS.values()
    found = []
    n = len(drawn.linkage)
    inverse = drawn.linkage.inverted()
    for guided in series.guided(drawn.complete):
        pairs = np.broadcast_to(guided.pairs, (n, 2, 3))
        good = _worth_guiding(drawn.linkage, pairs, circle, returns)
        if slots:
            taken = good | _worth_guiding(drawn.linkage, pairs, not circle)
            pairs = pairs[:, ::-1]
            good = _worth_guiding(inverse, pairs, circle) & ~taken
        k = np.flatnonzero(good)
        centre, z = _complex(pairs[k])
        found.append(
            {
                "mechanism": k,
                "kind": np.full(len(k), kind, dtype=object),
                "label": np.full(len(k), guided.label, dtype=object),
                "x": z.real,
                "y": z.imag,
                "contact_order": np.broadcast_to(guided.order, n)[k],
                "centre": centre,
            }
        )
    return join(*found)


def _worth_guiding(linkage: Linkage, pairs: Floats, circle: bool, returns: bool = False) -> Mask:
    """Tell which moving points are suitable guided points, with a suitable nominal, shape (n,).

    Suitable points are no pivots, are at a moderate distance from the pole (with `returns`, at it),
    and move on a line or a circle of moderate size.
    """
    w, w_star = pairs[:, 0, 2], pairs[:, 1, 2]
    parallel = np.abs(linkage.sine) < DEGENERATE.parallel_sine
    with np.errstate(all="ignore"):
        centre, z = _complex(pairs)
        radius, away = np.abs(z - centre), np.abs(z)
        pivot = np.where(linkage.finite[:, :, 1], linkage.points[:, :, 1], np.inf)
        apart = np.abs(pivot - z[:, None]).min(1)
        good = np.isfinite(pairs).all(axis=(1, 2)) & (w_star != 0) & (apart >= ELEMENT.nearest_pivot)
        if returns:
            good &= (away <= ELEMENT.at_pole) & ~parallel
        else:
            good &= ((away >= ELEMENT.nearest) | parallel) & (away <= ELEMENT.farthest)
        if circle:
            far = np.abs(w) * RADII[1] < np.hypot(pairs[:, 0, 0], pairs[:, 0, 1])
            good &= ~far & (radius >= RADII[0]) & (radius <= RADII[1])
        else:
            good &= w == 0
    return np.asarray(good)


def _complex(pairs: Floats) -> Complexes:
    """Return the fixed and the moving points of pairs as complex numbers, shape (2, n)."""
    with np.errstate(all="ignore"):
        z = (pairs[..., 0] + 1j * pairs[..., 1]) / pairs[..., 2]
    return np.asarray(z, complex).T
