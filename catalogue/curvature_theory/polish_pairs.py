"""Principal pairs of linkages with a far pole, to full accuracy.

The formulas find a pair by its distance from the pole.  With the pole at 1/angle (in sizes of the
linkage) they lose log10(1/angle) digits of its place, and taking the rays for parallel costs an
error of the angle.  The pivots carry all digits, and one or two steps of Newton's method recover
them: the constraint of a dyad is bilinear in its homogeneous pivots,

    w w* |d|^2 + 2 Re(conj(w (1 + x) A* - w* A) d) - 2 Re(conj(A) A* x) = 0,

with z -> z + d + x (z - o) the motion; for a principal pair its coefficients of t, t^2, t^3 and t^4
vanish.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kinematics.linkage import Linkage
from ..kinematics.motion import Motion
from ..kinematics.power_series import taylor_product
from ..kinematics.types import Floats
from .finite_pole import POLE
from .taylor import charts, norm_squared, path_series


class Polish(NamedTuple):
    """Options of Newton's method for principal pairs."""

    #: Least conditioning of a chart: worse ones, near change points, have fewer digits than the
    #: pairs.
    conditioning: float = 0.05
    #: Condition number of the system above which two pairs nearly coincide.
    coincident: float = 1e8
    #: Longest step of the unit vectors: a longer one means that the start was no approximate pair.
    step: float = 1e-2
    steps: int = 2  #: largest number of steps


POLISH = Polish()


def polish_pairs(linkage: Linkage, pairs: Floats) -> Floats:
    """Improve approximate principal pairs (n, 2, 2, 3) by the motion.

    NaN pairs, and pairs that nearly coincide, are returned unchanged.
    """
    out = pairs.copy()
    start = np.where(linkage.finite[:, 0, 1], linkage.points[:, 0, 1], linkage.points[:, 0, 0])
    for where, moving in charts(linkage, start, None, np.longdouble):
        good = np.flatnonzero(moving.conditioning > POLISH.conditioning)
        if good.size:
            forms = _bilinear(moving[good])
            for k in (0, 1):
                out[where[good], k] = _newton(forms, moving[good], pairs[where[good], k])
    return out


def _bilinear(moving: Motion) -> Floats:
    """Compute the constraint's coefficients of t^1 ... t^4, bilinear in A and A*.

    They are computed in extended precision, where the platform has it, since they determine the
    accuracy. Lengths are in sizes of the linkage, from the origin of the chart; each matrix is
    scaled to about 1.

    Returns
    -------
    ndarray, shape (n, 4, 3, 3)
        Linkage, power of t, (x, y, w) of A, (x, y, w) of A*.
    """
    d, x = path_series(moving.point(moving.origin)) / moving.linkage.size, path_series(moving.turn())
    turned = d + taylor_product(x.conj(), d)
    rows = [
        [-2 * x.real, 2 * x.imag, -2 * d.real],
        [-2 * x.imag, -2 * x.real, -2 * d.imag],
        [2 * turned.real, 2 * turned.imag, norm_squared(d)],
    ]
    forms: Floats = np.moveaxis(np.stack([np.stack(row) for row in rows])[:, :, 1:5], (3, 2), (0, 1))
    return np.asarray(forms / np.abs(forms).max((2, 3), keepdims=True))


def _newton(forms: Floats, moving: Motion, pair: Floats) -> Floats:
    """Improve one pair of each linkage by Newton's method, shape (n, 2, 3)."""
    size, origin = moving.linkage.size[:, None], np.stack([moving.origin.real, moving.origin.imag], -1)[:, None]
    w = pair[..., 2:]
    now = _unit(np.concatenate([(pair[..., :2] - w * origin) / size[..., None], w], axis=-1))
    done = np.zeros(len(pair), dtype=bool)
    now = np.where(np.isfinite(now), now, 0.0)
    for _ in range(POLISH.steps):
        by_fixed, by_moving = (forms * now[:, None, None, 1]).sum(3), (forms * now[:, None, 0, :, None]).sum(2)
        gap = (by_fixed * now[:, None, 0]).sum(2)
        system, right = np.zeros((len(pair), 6, 6)), np.zeros((len(pair), 6, 1))
        system[:, :4, :3], system[:, :4, 3:], right[:, :4, 0] = by_fixed, by_moving, gap
        system[:, 4, :3], system[:, 5, 3:] = now[:, 0], now[:, 1]
        with np.errstate(all="ignore"):
            regular = np.linalg.cond(system) < POLISH.coincident
        step = np.linalg.solve(np.where(regular[:, None, None], system, np.eye(6)), right)[..., 0]
        taken = regular & (np.abs(step).max(1) < POLISH.step)
        now = np.where(taken[:, None, None], _unit(now - step.reshape(-1, 2, 3)), now)
        done |= taken
    xy, w = now[..., :2] * size[..., None], now[..., 2:]
    with np.errstate(all="ignore"):
        far = np.abs(w) <= POLE.infinite
        direction = xy / np.linalg.norm(xy, axis=-1, keepdims=True)
        place = np.where(far, direction, xy / w + origin)
        back = np.concatenate([place, np.where(far, 0.0, 1.0)], axis=-1)
    return np.where(done[:, None, None], back, pair)


def _unit(points: Floats) -> Floats:
    with np.errstate(invalid="ignore"):
        return np.asarray(points / np.linalg.norm(points, axis=-1, keepdims=True))
