"""Pole, pole axes, inflection circle, cubics of stationary curvature and principal pairs.

They are computed from the rays of the pivots and from ratios of lengths along a ray, never from an
angle, a tangent or the radius of a circle, which may be infinite.  `finite_pole` has the formulas
and the digits they keep.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from ..errors import InvalidRequest, quoted
from ..kinematics.batch import mapped
from ..kinematics.linkage import Linkage, LinkageLike
from ..kinematics.types import Array, Floats, Integers, Mask, Objects
from .finite_pole import POLE, finite_pole, noise
from .parallel_cranks import parallel_cranks
from .polish_pairs import polish_pairs

REGULAR = 0  #: the pole is finite
PARALLEL = 1  #: the rays are parallel, the pole is at infinity
DEAD_POINT = 2  #: both rays coincide, two branches meet


class Degeneration(NamedTuple):
    """Limits of parallel rays and of dead points."""

    #: Sine of the angle between the rays below which they count as parallel: neglecting that angle
    #: costs as many digits as a pole 1e8 times as far away as the pivots.
    parallel_sine: float = 1e-8
    #: Sine up to which the principal pairs are exact; from there to `near_sine` they are improved
    #: on the motion itself.
    exact_sine: float = 1e-15
    #: Sine and distance from a common line below which a linkage is at a dead point.
    dead_sine: float = 1e-7
    #: Sine and distance from a common line below which a linkage is at a dead point if rounding
    #: leaves too few digits of kappa.
    near_sine: float = 1e-2
    #: Relative error of kappa above which rounding leaves too few of its digits: three.
    noise: float = 1e-3
    #: Least size by which the distance from the line is divided [distance from the origin]: below
    #: it that distance is rounding.
    rounding: float = 1e-9


DEGENERATE = Degeneration()


@dataclass(frozen=True)
class Curvature:
    """Pole, inflection circle and cubics of n linkages, in the frame and unit of their pivots.

    Undefined numbers are NaN; `reason` explains them.

    Attributes
    ----------
    state : ndarray of int, shape (n,)
        `REGULAR`: finite pole.  `PARALLEL`: parallel rays, pole at infinity; `pole` is then the
        origin of the frame of the parallel transformation.  `DEAD_POINT`: both rays coincide;
        `dead_points`, or `curvature(linkage, branch)`, gives the two branches.
    pole : ndarray, shape (n, 2)
    axes : ndarray, shape (n, 2, 2)
        Unit vectors of the pole tangent x and the pole normal y; y points into the inflection
        circle. Parallel: x along the cranks.
    rho0 : ndarray, shape (n,)
        Diameter of the inflection circle [length]; infinite if parallel.
    kappa, kappa_star, s : ndarray, shape (n,)
        1/R, 1/R*, 1/S of the cubics [1/length]; kappa_star - kappa = 1/rho0.
    k, k_star : ndarray, shape (n,)
        Parallel transformation: the limits of S^3/R and S^3/R* [length^2]; NaN if the pole is
        finite.
    undulation, cuspidation : ndarray, shape (n, 2)
        Ball's point and its dual; NaN where the whole inflection (return) circle or no point
        qualifies.
    principal_pairs : ndarray, shape (n, 2, 2, 3)
        The two pairs besides the driving dyads: (fixed, moving), (x, y, w); NaN where they are
        imaginary.

    Source: Allievi 1895, secs. 1-7, 16-18, eqs. (3), (12), (15), (16), (20)-(22), (52)-(60).

    Examples
    --------
    >>> import catalogue
    >>> at = catalogue.curvature({"ground": 4, "crank": 2, "coupler": 3, "rocker": 3, "angle": 60})
    >>> at.pole.shape, at.principal_pairs.shape
    ((1, 2), (1, 2, 2, 3))
    """

    state: Integers
    pole: Floats
    axes: Floats
    rho0: Floats
    kappa: Floats
    kappa_star: Floats
    s: Floats
    k: Floats
    k_star: Floats
    undulation: Floats
    cuspidation: Floats
    principal_pairs: Floats

    def __len__(self) -> int:
        return len(self.state)

    def __getitem__(self, index: object) -> Curvature:
        chosen: Curvature = mapped(lambda values: values[index].reshape(-1, *values.shape[1:]), self)
        return chosen

    @property
    def reason(self) -> Objects:
        """Reason for missing numbers, shape (n,); empty where none is missing."""
        why = np.full(len(self), "", dtype=object)

        def add(where: Mask, text: str) -> None:
            why[where] += np.where(why[where] == "", "", "; ") + text

        regular, parallel, dead = (self.state == k for k in (REGULAR, PARALLEL, DEAD_POINT))
        add(parallel, "the rays are parallel: the pole is at infinity")
        add(parallel & np.isnan(self.k), "the coupler translates: no stationary curvature")
        add(
            dead,
            "dead point: the rays coincide, two branches meet (curvature takes branch 0 or 1) or the chain is immobile",
        )
        unit = np.where(regular, self.rho0, np.nan)
        straight = np.abs(self.s) * unit < POLE.vanishing
        mode_2 = np.zeros(len(self), dtype=bool)
        circles = (
            (self.undulation, self.kappa, "inflection", "undulation"),
            (self.cuspidation, self.kappa_star, "return", "cuspidation"),
        )
        for point, curved, circle, name in circles:
            none = regular & np.isnan(point).any(-1)
            whole = straight & (np.abs(curved) * unit < POLE.vanishing)
            add(none & whole, f"{name} all over the {circle} circle")
            add(none & ~whole, f"no {name}: it falls into the pole")
            mode_2 |= whole
        first, second = (np.isnan(self.principal_pairs[:, i]).any(axis=(1, 2)) for i in (0, 1))
        no_pairs = ~dead & first & second & ~(parallel & np.isnan(self.k))
        add(first != second, "the principal pairs coincide")
        add(no_pairs & ~mode_2, "the principal pairs are imaginary")
        add(no_pairs & mode_2, "the principal pairs are imaginary, or undetermined (cyclic motion, dead point)")
        return why


def curvature(linkage: LinkageLike, branch: int | None = None) -> Curvature:
    """Compute pole, inflection circle and cubics of stationary curvature of linkages.

    Parameters
    ----------
    linkage : Linkage of n, its pivots, or a mapping of link lengths
        See `Linkage` and `catalogue.kinematics.from_lengths`.
    branch : 0 or 1, optional
        Branch of the motion at a dead point, where two meet; without it the curvature there is
        NaN.  Both at once: `dead_points`.

    Returns
    -------
    Curvature
        Accuracy: see `finite_pole`.  Near a dead point, kappa loses three decimal digits per decade
        of the angle between the rays, because the pivots do not determine them; with none left it
        is NaN.

    Raises
    ------
    InvalidLinkage
        If the linkage is invalid.
    InvalidRequest
        If the branch is neither 0 nor 1.

    Examples
    --------
    >>> import catalogue
    >>> watt = [[[-1, 0.6], [0, 0.6]], [[1, -0.6], [0, -0.6]]]
    >>> catalogue.curvature(watt).pole.shape
    (1, 2)
    """
    linkage = Linkage.of(linkage)
    if branch is not None and (
        type(branch) is bool or not isinstance(branch, int | np.integer) or not 0 <= branch <= 1
    ):
        raise InvalidRequest(f"the branch at a dead point is 0 or 1, not {quoted(branch)}")
    sine = linkage.sine
    state = np.where(np.abs(sine) < DEGENERATE.parallel_sine, PARALLEL, REGULAR)
    state[_collinear(linkage, sine)] = DEAD_POINT
    out = blank(len(linkage)) | {"state": state}
    for which, solve in ((REGULAR, finite_pole), (PARALLEL, parallel_cranks)):
        chosen = state == which
        if chosen.any():
            for name, value in solve(linkage[chosen]).items():
                out[name][chosen] = value
    far = (state != DEAD_POINT) & (np.abs(sine) < DEGENERATE.near_sine) & (np.abs(sine) > DEGENERATE.exact_sine)
    if far.any():
        out["principal_pairs"][far] = polish_pairs(linkage[far], out["principal_pairs"][far])
    found = Curvature(**out)
    if branch is not None:
        from .dead_points import both_branches  # imported late: it is built on this module

        return both_branches(found, linkage, int(branch))
    return found


def blank(*shape: int) -> dict[str, Array]:
    """Return the fields of `Curvature`, filled with NaN, for an array of linkages of a shape."""
    of_one = {"pole": (2,), "axes": (2, 2), "undulation": (2,), "cuspidation": (2,), "principal_pairs": (2, 2, 3)}
    return {f.name: np.full((*shape, *of_one.get(f.name, ())), np.nan) for f in fields(Curvature)}


def _collinear(linkage: Linkage, sine: Floats) -> Mask:
    """Tell where all pivots and rays are on one line within rounding, shape (n,)."""
    near = np.flatnonzero(np.abs(sine) < DEGENERATE.near_sine)
    dead = np.zeros(len(linkage), dtype=bool)
    if near.size:
        some = linkage[near]
        z = np.where(some.finite, some.points, np.nan).reshape(-1, 4)
        first = np.where(some.finite[:, 0, 0], z[:, 0], z[:, 1])
        off = np.nanmax(np.abs(((z - first[:, None]) * some.rays[:, :1].conj()).imag), axis=1)
        off /= np.maximum(some.size, np.nanmax(np.abs(z), axis=1) * DEGENERATE.rounding)
        exact = (np.abs(sine[near]) < DEGENERATE.dead_sine) & (off < DEGENERATE.dead_sine)
        dead[near] = exact | (off < DEGENERATE.near_sine) & (noise(some) > DEGENERATE.noise)
    return dead
