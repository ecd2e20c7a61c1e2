"""Rails and slots: the segments that sliders cover during a stroke.

A slider (PR) runs along a line of the frame: its *rail* is the segment of this line between the
extreme places of the moving pivot.  A slide (RP) is a line of the coupler that passes through a
fixed pivot: its *slot* is the segment of this line between the extreme places of the fixed pivot,
as the coupler sees it, and moves with the coupler.  The length of either is its *travel*.  An
inversion turns rails into slots of the same travel.
"""

from __future__ import annotations

import numpy as np

from ..kinematics.linkage import PR, RP, RR, Linkage
from ..kinematics.motion import Pose
from ..kinematics.types import Complexes, Floats
from .minimum_zone import grid, largest, times

#: End of a rail or slot that does not exist.
NOWHERE = complex(np.nan, np.nan)

#: Distance from an end of its rail, over the travel, within which the end of a slide's stroke
#: counts as a possible extreme beside the actual one. A step of the refinement may exchange the
#: two, as in symmetric guides, whose slides end where they began.
EXTREME_MARGIN = 0.1


def slide_runs(linkage: Linkage, pose: Pose) -> Floats:
    """Compute the displacements of n linkages' slides along their lines in m poses.

    Returns
    -------
    ndarray, shape (m, n, 2)
        Displacement of each dyad's slide from the reference position [length]; NaN for a crank.
    """
    run = np.full((*pose.d.shape, 2), np.nan)
    for i in (0, 1):
        some = np.flatnonzero(linkage.dyads[:, i] != RR)
        if not len(some):
            continue
        home, along = _slot_line(linkage[some], i)
        part = Pose(pose.d[:, some], pose.x[:, some], pose.origin[some])
        with np.errstate(all="ignore"):
            gone = part.point(home) - home
            slider = (along.conj() * gone).real
            # displacement of the fixed pivot relative to the coupler
            slide = -(part.direction(along).conj() * gone).real
        run[:, some, i] = np.where(linkage.dyads[some, i] == PR, slider, slide)
    return run


def slide_ends(linkage: Linkage, run: Floats) -> Complexes:
    """Return the ends of rails and slots in the reference position.

    Parameters
    ----------
    linkage : Linkage of n
    run : ndarray, shape (m, n, 2)
        Displacements by `slide_runs` at Chebyshev points of the stroke [length].

    Returns
    -------
    ndarray, complex, shape (n, 2, 2)
        Both ends for each dyad [length]; `NOWHERE` for a crank.
    """
    ends = np.full((len(linkage), 2, 2), NOWHERE)
    fine = grid(len(run) - 1).fine
    for i in (0, 1):
        some = np.flatnonzero(linkage.dyads[:, i] != RR)
        if len(some):
            home, along = _slot_line(linkage[some], i)
            way = times(fine, run[:, some, i])
            ends[some, i] = home[:, None] + along[:, None] * np.stack([-largest(-way), largest(way)], axis=-1)
    return ends


def extremes(run: Floats) -> Floats:
    """Compute the weights of values at Chebyshev points (m, n) in their possible extremes.

    Returns
    -------
    ndarray, shape (4, n, m)
        Weights of the first and the last value, and of the highest and the lowest between them; NaN
        for a value that is not nearly an extreme.
    """
    at_ends = run[[0, -1]]
    # excess of inner values over those at the ends
    low, high = (run - at_ends.min(0)).min(0), (run - at_ends.max(0)).max(0)
    span = at_ends.max(0) - at_ends.min(0) + high - low
    extreme = (at_ends - at_ends.min(0) - low <= EXTREME_MARGIN * span) | (
        at_ends.max(0) + high - at_ends <= EXTREME_MARGIN * span
    )
    ends = np.where(extreme[..., None], np.eye(len(run))[[0, -1], None], np.nan)
    return np.concatenate([ends, [_peak_weights(run), _peak_weights(-run)]])


def _peak_weights(values: Floats) -> Floats:
    """Compute the weights (n, m) of the inner maximum of values (m, n), by a parabola.

    The parabola is that of `largest`; NaN where the first or last value is the maximum.
    """
    fine = grid(len(values) - 1).fine
    every = times(fine, values)
    peak = np.argmax(np.where(np.isnan(every), -np.inf, every), axis=0)
    inner = np.clip(peak, 1, len(fine) - 2)
    low, at, high = (every[inner + k, np.arange(len(peak))] for k in (-1, 0, 1))
    with np.errstate(all="ignore"):
        step = (low - high) / (2 * (low - 2 * at + high))  # distance to the vertex, in steps
    step = np.where((peak == inner) & np.isfinite(step), step, np.nan)[:, None]
    shares = (0.5 * step * (step - 1), 1 - step * step, 0.5 * step * (step + 1))
    before, here, after = (share * fine[inner + k] for share, k in zip(shares, (-1, 0, 1), strict=True))
    return np.asarray(before + here + after)


def _slot_line(linkage: Linkage, i: int) -> tuple[Complexes, Complexes]:
    """Return a point and the unit vector of the slot of dyad i, (n,) each."""
    fixed, moving = linkage.points[:, i].T
    slider = linkage.dyads[:, i] == PR
    return np.where(slider, moving, fixed), 1j * np.where(slider, fixed, moving)


def travels(ends: Complexes) -> Floats:
    """Return the longest travel of the slides with ends (n, 2, 2), shape (n,) [length].

    NaN for linkages with cranks only.
    """
    return np.asarray(np.fmax.reduce(np.abs(ends[..., 1] - ends[..., 0]), axis=1))


def rails(linkage: Linkage, ends: Complexes) -> Complexes:
    """Return the ends (n, 2, 2) of rails of the frame; `NOWHERE` for slots."""
    return np.where((linkage.dyads == PR)[..., None], ends, NOWHERE)


def slots(linkage: Linkage, ends: Complexes) -> Complexes:
    """Return the ends (n, 2, 2) of slots of the coupler; `NOWHERE` for rails."""
    return np.where((linkage.dyads == RP)[..., None], ends, NOWHERE)
