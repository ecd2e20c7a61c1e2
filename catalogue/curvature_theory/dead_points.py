"""Dead points: both rays on one line d, where two smooth branches of the motion cross.

Along d each dyad has a polynomial, crank (z - a)(z - a*)/(a - a*), slider -(z - a*), slide z - a;
the poles of the branches are the roots of their difference, and the value there is rho0 with its
sign along d.  The line is the pole normal of both branches, and each branch is symmetric about it
(s = 0).

Source: Allievi 1895, sec. 4 and eqs. (18), (19), (32).  His statement that the poles are always
real is wrong: a chain stretched to its full length (one link equal to the sum of the other three)
is immobile; NaN is returned for it.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from ..kinematics.linkage import PR, RP, Linkage, homogeneous
from ..kinematics.types import Complexes, Floats, Indices, Integers
from .analysis import DEAD_POINT, REGULAR, Curvature, blank, curvature
from .finite_pole import POLE


def both_branches(found: Curvature, linkage: Linkage, branch: int | Complexes) -> Curvature:
    """Replace the instants of linkages at dead points by those of one branch.

    The branch is 0 or 1, or is selected by poles, complex (n,): the nearest one counts.
    """
    dead = np.flatnonzero(found.state == DEAD_POINT)
    if dead.size:
        both = dead_points(linkage[dead])
        chosen: int | Indices
        if isinstance(branch, int):
            chosen = branch
        else:
            off = np.abs(both.pole[:, 0] + 1j * both.pole[:, 1] - np.repeat(branch[dead], 2)).reshape(-1, 2)
            chosen = np.argmin(np.where(np.isnan(off), np.inf, off), axis=1)
        for f in fields(Curvature):
            getattr(found, f.name)[dead] = getattr(both, f.name)[2 * np.arange(dead.size) + chosen]
    return found


def dead_points(linkage: Linkage, *, beside: bool = False) -> Curvature:
    """Compute the instants of both branches of linkages at a dead point.

    Parameters
    ----------
    linkage : Linkage of n
        Linkages with all pivots on one line and the rays along it.
    beside : bool
        Whether linkages near a dead point are moved to it first, by projecting their pivots on a
        common line.

    Returns
    -------
    Curvature of 2 n
        Branches 0 and 1 of linkage i at 2 i and 2 i + 1; NaN where a linkage is not at a dead
        point, is immobile, or has that pole at infinity (cranks of equal signed length).
    """
    there = curvature(linkage).state == DEAD_POINT
    if beside and not there.all():
        moved = np.where(there[:, None, None, None], linkage.pivots, _on_line(linkage))
        linkage = Linkage.trusted(moved)
        with np.errstate(all="ignore"):  # pivots may meet on the line
            there = curvature(linkage).state == DEAD_POINT
            line = linkage.rays[:, 0]
    else:
        line = linkage.rays[:, 0]
    z = linkage.points[:, 0, 1]
    z = np.where(linkage.finite[:, 0, 1], z, linkage.points[:, 0, 0])
    at = ((linkage.points - z[:, None, None]) * line[:, None, None].conj()).real
    g = [_polynomial(at[:, i, 0], at[:, i, 1], linkage.dyads[:, i]) for i in (0, 1)]
    a, b, c = g[0] - g[1]
    with np.errstate(all="ignore"):
        root = np.sqrt(b * b - 4 * a * c)
        q = -0.5 * (b + np.copysign(root, b))
        poles = np.stack([q / a, c / q], axis=-1)
        poles = np.where(np.isfinite(poles), poles, np.nan)
        signed = (g[0][0, :, None] * poles + g[0][1, :, None]) * poles + g[0][2, :, None]
        rho0 = np.abs(signed)
        up = np.sign(signed)
        finite = linkage.finite
        distance = at[..., None] - poles[:, None, None]
        inverse = np.where(finite[..., None], (rho0 * up)[:, None, None] / distance, 0.0)
        fixed, moving = inverse[:, 0, 0] + inverse[:, 1, 0], inverse[:, 0, 1] + inverse[:, 1, 1]
        kappa, star = 0.375 * fixed - 0.125 * moving, 0.375 * moving - 0.125 * fixed
        pairs = _pairs(kappa, star, inverse[:, 0, 0] - kappa, inverse[:, 1, 0] - kappa)
    alive = there[:, None] & np.isfinite(rho0) & (rho0 > 0)
    unit = np.where(alive, rho0, np.nan)
    y = line[:, None] * up
    x = -1j * y
    pole = z[:, None] + line[:, None] * poles
    point = pairs[..., 0] + 1j * pairs[..., 1]
    world = pole[..., None, None] + (rho0 * x)[..., None, None] * point.real + (rho0 * y)[..., None, None] * point.imag
    axes = np.stack([np.stack([x.real, x.imag], -1), np.stack([y.real, y.imag], -1)], axis=-2)
    centre = np.stack([pole.real, pole.imag], -1)
    normal = rho0[..., None] * axes[..., 1, :]
    out = blank(*alive.shape) | {
        "pole": centre,
        "axes": axes,
        "rho0": rho0,
        "kappa": kappa / unit,
        "kappa_star": star / unit,
        "s": np.zeros_like(rho0),
        "undulation": np.where(np.abs(kappa) < POLE.vanishing, np.nan, 1.0)[..., None] * normal + centre,
        "cuspidation": np.where(np.abs(star) < POLE.vanishing, np.nan, -1.0)[..., None] * normal + centre,
        "principal_pairs": homogeneous(world),
    }
    for value in out.values():
        value[~alive] = np.nan
    out["state"] = np.where(alive, REGULAR, DEAD_POINT)
    return Curvature(**{name: value.reshape(-1, *value.shape[2:]) for name, value in out.items()})


def _polynomial(fixed: Floats, moving: Floats, kind: Integers) -> Floats:
    """Compute the coefficients of z^2, z, 1 of dyads' polynomials along the line, (3, n)."""
    with np.errstate(all="ignore"):
        crank = np.stack([np.ones_like(fixed), -(fixed + moving), fixed * moving]) / (fixed - moving)
    zero, one = np.zeros_like(fixed), np.ones_like(fixed)
    return np.where(kind == PR, [zero, -one, moving], np.where(kind == RP, [zero, one, -fixed], crank))


def _pairs(kappa: Floats, star: Floats, v3: Floats, v4: Floats) -> Floats:
    """Compute the principal pairs (32), symmetric about y, for rho0 = 1.

    Returns
    -------
    ndarray, shape (n, 2, 2, 2, 2)
        Linkage, branch, pair, (fixed, moving), (x, y).  NaN where they are imaginary, and for kappa
        or kappa* = 0, where both coincide with the pole.
    """
    ratio = np.where(np.minimum(np.abs(kappa), np.abs(star)) < POLE.vanishing, np.nan, -v3 * v4 * kappa * star)
    x, y = np.sqrt(np.abs(v3 * v4)), np.sqrt(np.abs(kappa * star))
    norm = np.where(ratio > 0, np.hypot(x, y), np.nan)
    x, y = x / norm, y / norm
    both = [[np.stack([side * x * y / c, y * y / c], -1) for c in (kappa, star)] for side in (1, -1)]
    return np.stack([np.stack(one, axis=-2) for one in both], axis=-3)


def _on_line(linkage: Linkage) -> Floats:
    """Project the pivots on their common line by least squares, shape (n, 2, 2, 3)."""
    finite = linkage.finite.reshape(-1, 4)
    z, w = linkage.points.reshape(-1, 4), finite.astype(float)
    with np.errstate(all="ignore"):
        centre = ((w * np.where(finite, z, 0)).sum(1) / w.sum(1))[:, None]
        along = np.sqrt((w * np.where(finite, z - centre, 0) ** 2).sum(1))[:, None]
        along = along / np.abs(along)
        side = np.sign((z * along.conj()).real)
        moved = np.where(finite, centre + ((z - centre) * along.conj()).real * along, side * along)
    return homogeneous(moved, w).reshape(-1, 2, 2, 3)


def off_line(linkage: Linkage) -> Floats:
    """Measure the distance of linkages from a dead point, shape (n,).

    The measure is the larger of the sine of the angle between the rays and the largest distance of
    a pivot from the ray of dyad 1 [sizes of the linkage].
    """
    z = np.where(linkage.finite, linkage.points, np.nan).reshape(-1, 4)
    first = np.where(linkage.finite[:, 0, 0], z[:, 0], z[:, 1])
    with np.errstate(all="ignore"):
        off = np.abs(((z - first[:, None]) * linkage.rays[:, :1].conj()).imag)
        return np.asarray(np.maximum(np.fmax.reduce(off, axis=1) / linkage.size, np.abs(linkage.sine)))
