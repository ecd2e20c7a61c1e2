"""The leading error of a guided point: how its path leaves the tangent or the osculating circle.

In axes at the point, u along the path and v along its normal, the path leaves its nominal as
v = c_m u^m + ..., and m - 1 is the order of contact.  c_m is the first coefficient of the Taylor
series of the finite motion that does not vanish.

Closed formulas exist for it (`tests/curvature_theory/test_leading_error.py` has them, row by row),
products of differences of tangents of the rays.  They agree, but each holds in one mode and on the
circling-point curve only, and they lose the digits of 1/S and of the angle of nearly parallel
cranks.  The series of the motion has neither modes nor poles and serves every coupler point.

A point at the pole has a cusped path, along which it returns.  With u the distance from the cusp,
v = +-c u^(N/2) on the two branches: N = 4 for points of a simple cusp on its circle, 5 and 6 for
return guides.

Source: theory of the leading coefficients c3 ... c6 and of the deviation by Chebyshev polynomials:
Allievi 1895, secs. 27-31, and the laws E = |c_m| L^m/2^(2m-1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kinematics.batch import Rows
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Complexes, Floats, Integers, Mask
from .exact_guides import FINITE, UNDECIDED, first_term, stays
from .taylor import TERMS, Jet, jet, norm_squared

#: Order of contact of a guide that is exact on the finite motion.
EXACT = 99
#: Coefficient over the largest term of the path below which it counts as zero: guided points have
#: 16 digits, only 8 where two principal pairs coincide.
TOLERANCE = 1e-8
#: Largest number of positions that a point has in common with its nominal unless it is exact.
MOST = 6
#: Minimax error of u^m over [-1, 1] when approximated by 1, u; by 1, u, u^2; by all lower powers.
LINE = {3: 1 / 4, 4: 1 / 2, 5: 0.3264468005, 6: 1 / 2}
CIRCLE = {3: 1 / 4, 4: 1 / 8, 5: 0.3264468005, 6: 0.1924500897}
CHEBYSHEV = {3: 1 / 4, 4: 1 / 8, 5: 1 / 16, 6: 1 / 32}
#: Minimax error of a return guide over [0, 1] from line and circle: v = +-c u^(N/2) for odd N, a
#: single curve for even N.
RETURN_LINE = {3: 1.0, 4: 1 / 8, 5: 1.0, 6: 0.1924500897}
RETURN_CIRCLE = {5: 1.0, 6: 1 / 32}


@dataclass(frozen=True)
class LeadingError(Rows):
    """Leading errors of n guided points.

    Attributes
    ----------
    positions : ndarray of int, shape (n,)
        N, the power of the motion's parameter with which the point leaves its nominal; `EXACT` + 1
        if it does not, on the finite motion; 0 where the motion has no series.
    coefficient : ndarray, shape (n,)
        c in v = c u^power [length^(1 - power)]; 0 if the point stays on its nominal, NaN where the
        motion has no series (a change point whose branch is not given).
    normal : complex ndarray, shape (n,)
        Direction of v; u runs along i normal, which is how the point moves when the coupler turns
        counter-clockwise: away from the pole, along the ray.  Where the coupler does not turn: the
        ray of dyad 1.  At a cusp u runs out of it, and c is the sign of v on the branch with
        counter-clockwise turn.
    curvature : ndarray, shape (n,)
        Curvature of the nominal, towards +v [1/length]; 0 for a line.
    circle, cusp : ndarray of bool, shape (n,)
        The nominal; whether the point stands at the pole.
    """

    positions: Integers
    coefficient: Floats
    normal: Complexes
    curvature: Floats
    circle: Mask
    cusp: Mask

    @property
    def order(self) -> Integers:
        """Order of contact, shape (n,): `EXACT` if the point stays on its nominal.

        It is 0 where the motion has no series.
        """
        return np.asarray(np.maximum(self.positions - 1, 0))

    @property
    def power(self) -> Floats:
        """m in v = c u^m, shape (n,): half of `positions` at a cusp."""
        return np.asarray(np.where(self.cusp, 0.5, 1.0) * self.positions)

    def law(self, stroke: Floats | float) -> Floats:
        """Deviation after optimal splitting of the inflections, |c| L^m/2^(2m-1), shape (n,).

        For straight guides with m = 6 this takes a change of one length of the linkage; a shift of
        the guided point alone (`guidance.trace`) reaches 6.2 times this.
        """
        return self._scaled(stroke, CHEBYSHEV, CHEBYSHEV)

    def held(self, stroke: Floats | float) -> Floats:
        """Deviation from the best line or circle without splitting, shape (n,)."""
        return self._scaled(stroke, LINE, CIRCLE)

    def _scaled(self, stroke: Floats | float, line: dict[int, float], circle: dict[int, float]) -> Floats:
        """Compute the deviation over a stroke from tables of the minimax errors of u^m.

        It is |c| (L/2)^m times that error; for cusped paths |c| L^(N/2) times it.
        """
        by = np.select(
            [self.cusp & self.circle, self.cusp, self.circle],
            [_level(self.positions, table) for table in (RETURN_CIRCLE, RETURN_LINE, circle)],
            _level(self.positions, line),
        )
        length = np.asarray(stroke) * np.where(self.cusp, 1.0, 0.5)
        bounded = np.where(self.coefficient == 0, 1.0, self.power)
        return np.where(self.coefficient == 0, 0.0, np.abs(self.coefficient) * by * length**bounded)


def _level(positions: Integers, table: dict[int, float]) -> Floats:
    out = np.full(positions.shape, np.nan)
    for power, value in table.items():
        out[positions == power] = value
    return out


def leading_error(
    linkage: Linkage,
    point: Complexes,
    *,
    circle: Mask | bool = False,
    order: Integers | int | None = None,
    pole: Complexes | None = None,
    tolerance: float = TOLERANCE,
) -> LeadingError:
    """Compute the leading error of coupler points (n,) from their tangent or osculating circle.

    For slots give `linkage.inverted()` and the fixed points.

    Parameters
    ----------
    linkage : Linkage of n
    point : complex ndarray, shape (n,)
    circle : bool or ndarray of bool, shape (n,)
        Whether the nominal is the osculating circle; else the tangent.
    order : int or ndarray of int, shape (n,), optional
        Known order of contact: its coefficient is returned, lower ones count as rounding. `EXACT`
        is returned as such.
    pole : complex ndarray, shape (n,), optional
        Chooses the branch of linkages at a change point.
    tolerance : float
        Part of the path's own terms below which a coefficient counts as zero, when `order` is not
        given.
    """
    point = np.broadcast_to(np.asarray(point, dtype=complex), len(linkage))
    path = jet(linkage, point, pole)
    with np.errstate(all="ignore"):
        cusp, z, unit, reach = _axes(linkage, path)
        u, v = z.real, z.imag
        bent = np.where(cusp, v[4], v[2]) / np.where(cusp, u[2], u[1]) ** 2
        wanted = np.broadcast_to(circle, len(linkage))
        # at a simple cusp v begins with t^3: the path has no osculating circle
        wanted_curvature = np.where(wanted, 2 * bent, 0.0)
        gap = v - 0.5 * wanted_curvature * norm_squared(z)
        gap[0] = gap[1] = 0.0
        gap[2] = np.where(cusp | wanted, 0.0, gap[2])
        gap[4] = np.where(cusp & wanted, 0.0, gap[4])
        base = np.where(cusp, np.abs(u[2]) * reach**2, np.abs(u[1]) * reach)
        sizes = np.abs(gap) * reach ** np.arange(TERMS)[:, None]
        there = sizes > tolerance * base
        positions = np.where(there.any(0), there.argmax(0), EXACT + 1)
        if order is not None:
            positions = np.broadcast_to(np.asarray(order) + 1, positions.shape)
        else:  # a contact higher than any approximate point has: the finite motion decides
            many = np.flatnonzero((positions > MOST) & np.isfinite(gap).all(0) & np.isfinite(unit + wanted_curvature))
            at = None if pole is None else np.asarray(pole)[many]
            which = linkage[many], point[many], unit[many], wanted_curvature[many], at
            first = first_term(gap[:, many], z[:, many], MOST, tolerance)
            exact = stays(*which) | (first == 0) & stays(*which, FINITE.nearer)
            positions[many] = np.where(exact, EXACT + 1, np.where(first == 0, UNDECIDED, first))
        exact = positions > EXACT
        row = np.clip(np.where(exact, 0, positions), 0, TERMS - 1)
        speed = np.where(cusp, np.sqrt(u[2]) * np.where(path.turn < 0, -1, 1), u[1])
        left = np.take_along_axis(gap, row[None], 0)[0] / speed
        coefficient = left / speed ** (row - 1.0)
        # the coefficient over- or underflows at lengths far from 1: it is unknown then
        lost = np.isinf(coefficient) | (coefficient == 0) & (left != 0)
    undefined = ~np.isfinite(base) | ~exact & lost
    coefficient = np.where(undefined, np.nan, np.where(exact, 0.0, coefficient))
    return LeadingError(np.where(undefined, 0, positions), coefficient, -1j * unit, wanted_curvature, wanted, cusp)


def leading_error_of_pairs(
    linkage: Linkage,
    pairs: Floats,
    *,
    order: Array | int | None = None,
    pole: Complexes | None = None,
    tolerance: float = TOLERANCE,
) -> LeadingError:
    """Compute the leading errors of guided pairs (n, 2, 3), as in `catalogue.series.series.Guided`.

    A point on a line or circle, or, with the moving point at infinity, a straight slot; see
    `leading_error`.  NaN gives NaN.
    """
    w = pairs[..., 2]
    with np.errstate(invalid="ignore"):
        z = (pairs[..., 0] + 1j * pairs[..., 1]) / np.where(w != 0, w, 1)
    slot = w[:, 1] == 0
    pivots = np.where(slot[:, None, None, None], linkage.pivots[:, :, ::-1], linkage.pivots)
    return leading_error(
        Linkage(pivots),
        np.where(slot, z[:, 0], z[:, 1]),
        circle=~slot & (w[:, 0] != 0),
        order=order,
        pole=pole,
        tolerance=tolerance,
    )


def path_singularity(linkage: Linkage, point: Complexes, *, pole: Complexes | None = None) -> tuple[Integers, Integers]:
    """Compute the singularities of coupler paths: p coincident cusps and q coincident inflections.

    A coefficient of the path counts as zero when it adds less than `TOLERANCE` to the path at the
    parameter at which its largest term equals the first; likewise the velocity beside the
    acceleration. Up to p + q = 3 a point rounded to double precision is decided surely.

    Parameters
    ----------
    linkage : Linkage of n
    point : complex ndarray, shape (n,)
    pole : complex ndarray, shape (n,), optional
        Chooses the branch of linkages at a change point.

    Returns
    -------
    p, q : ndarray of int, shape (n,)
        (0, 0) an ordinary point, (0, 1) an inflection, (0, 2), (0, 3), (0, 4) undulation, pseudo-
        and double undulation, (1, 0) a cusp, (1, 1) a rhamphoid cusp, (1, 2) a hypercusp; q =
        `EXACT` on a straight line; -1 where the motion has no series.

    Source: Allievi 1895, Introduction: p derivatives of the arc and q of the tangent's angle
    vanish; the point has N = p + q + 2 positions in common with its tangent.
    """
    found = leading_error(linkage, point, pole=pole)
    p = np.where(found.cusp, 1, 0)
    q = np.where(found.positions > EXACT, EXACT, found.positions - p - 2)
    return np.where(found.positions > 0, p, -1), np.where(found.positions > 0, q, -1)


def _axes(linkage: Linkage, path: Jet) -> tuple[Mask, Complexes, Complexes, Floats]:
    """Compute cusps, the path u + iv, the direction of u, and a scale.

    u + iv is the path in the axes at the point. The scale is the largest parameter at which no term
    exceeds the first.
    """
    z = path.z
    k = np.arange(TERMS)[:, None]
    reach = [np.min((np.abs(z[i]) / np.abs(z[i + 1 :])) ** (1.0 / (k[i + 1 :] - i)), axis=0) for i in (1, 2)]
    reach = [np.where(np.isinf(r), 1.0, r) for r in reach]
    cusp = np.abs(z[1]) <= TOLERANCE * np.abs(z[2]) * reach[1]
    first = np.where(cusp, z[2], z[1])
    unit = first / np.abs(first)
    still = np.abs(path.turn) * linkage.size <= TOLERANCE * np.abs(z[1])
    side = np.where(still, (linkage.rays[:, 0].conj() * -1j * unit).real, path.turn)
    unit = np.where(cusp, unit, unit * np.where(side < 0, -1, 1))
    z = z * unit.conj()  # u along the unit vector, v along -i times it
    z = z.conj()
    z[1] = np.where(cusp, 0.0, z[1].real)
    return cusp, z, unit, np.where(cusp, reach[1], reach[0])
