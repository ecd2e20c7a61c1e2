"""The guided elements of drawn linkages that are worth guiding, before anything is traced."""

from __future__ import annotations

import numpy as np

from ..candidates.batch import join
from ..curvature_theory.analysis import PARALLEL_SINE
from ..guide.kinds import POINTS, RETURNS, SLOTS, STRAIGHT
from ..kinematics.linkage import Linkage
from ..kinematics.types import Complexes, Floats, Mask
from ..series.sampling import Drawn
from ..series.series import Series
from .rows import Columns

#: Guided points nearer to the pole than this guide badly; farther ones need an unwieldy coupler (units of rho0).
NEAREST_POINT, FARTHEST_POINT = 0.15, 6.0
RADII = (0.1, 50.0)
#: Points nearer to the pole than this rest there: their paths return.
AT_POLE = 1e-9
#: A guided point nearer than this to a moving pivot is that pivot, which needs no guide.
NEAREST_PIVOT = 0.03


def elements_worth_tracing(series: Series, drawn: Drawn) -> Columns:
    """Return the guided elements of all kinds; see `points`."""
    kinds = [kind for guided in (POINTS, SLOTS, RETURNS) for kind in guided.values()]
    return join(*(points(series, drawn, kind) for kind in kinds))


def points(series: Series, drawn: Drawn, kind: str) -> Columns:
    """Return the guided elements of all linkages that can be used: points, or fixed points of slots.

    A moving point is guided if it can be; else, as where it is at infinity or at the pole, the coupler carries a slot
    over the fixed one, which is a guided point of the inverse motion.  Points at the pole are guided to and fro.

    Parameters
    ----------
    series : Series
    drawn : Drawn
    kind : str
        Which of `catalogue.guide.kinds`; see `Guide` for the frame.
    """
    circle, slots = kind not in STRAIGHT, kind in SLOTS.values()
    usable = _returning if kind in RETURNS.values() else _usable
    found = []
    n = len(drawn.linkage)
    inverse = drawn.linkage.inverted()
    for guided in series.guided(drawn.complete):
        pairs = np.broadcast_to(guided.pairs, (n, 2, 3))
        good = usable(drawn.linkage, pairs, circle)
        if slots:
            taken = good | _usable(drawn.linkage, pairs, not circle)
            pairs = pairs[:, ::-1]
            good = _usable(inverse, pairs, circle) & ~taken
        k = np.flatnonzero(good)
        with np.errstate(all="ignore"):
            centre, z = ((pairs[k, i, 0] + 1j * pairs[k, i, 1]) / pairs[k, i, 2] for i in (0, 1))
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


def _usable(linkage: Linkage, pairs: Floats, circle: bool) -> Mask:
    """Return where a moving point is worth guiding along a line or circle, shape (n,)."""
    away = np.abs(_moving(pairs))
    near = (away >= NEAREST_POINT) | _without_pole(linkage)
    return _worth(linkage, pairs, circle) & near & (away <= FARTHEST_POINT)


def _returning(linkage: Linkage, pairs: Floats, circle: bool) -> Mask:
    """Return where a moving point at the pole is worth guiding to and fro along a line or circle, shape (n,)."""
    return _worth(linkage, pairs, circle) & (np.abs(_moving(pairs)) <= AT_POLE) & ~_without_pole(linkage)


def _worth(linkage: Linkage, pairs: Floats, circle: bool) -> Mask:
    """Return where a moving point is no pivot and its line is one, its circle neither tiny nor nearly a line."""
    fixed, moving = pairs[:, 0], pairs[:, 1]
    with np.errstate(all="ignore"):
        z, centre = _moving(pairs), (fixed[:, 0] + 1j * fixed[:, 1]) / fixed[:, 2]
        far = np.abs(fixed[:, 2]) * RADII[1] < np.hypot(fixed[:, 0], fixed[:, 1])
        radius = np.abs(z - centre)
        pivot = np.where(linkage.finite[:, :, 1], linkage.points[:, :, 1], np.inf)
        apart = np.abs(pivot - z[:, None]).min(1)
        good = np.isfinite(pairs).all(axis=(1, 2)) & (moving[:, 2] != 0) & (apart >= NEAREST_PIVOT)
        good &= ~far & (radius >= RADII[0]) & (radius <= RADII[1]) if circle else fixed[:, 2] == 0
    return np.asarray(good)


def _moving(pairs: Floats) -> Complexes:
    with np.errstate(all="ignore"):
        return np.asarray((pairs[:, 1, 0] + 1j * pairs[:, 1, 1]) / pairs[:, 1, 2])


def _without_pole(linkage: Linkage) -> Mask:
    return np.asarray(np.abs(linkage.sine) < PARALLEL_SINE)
