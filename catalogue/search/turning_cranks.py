"""Starts for arcs near a half circle and beyond: coupler points at nearly constant distance.

While a crank turns, such a point keeps its distance from a fixed place. The point is near the
moving pivot of the crank: its place in the coupler and the centre of its arc are four coordinates.
They minimise the mean square, over the turn, of the distance from the centre less the radius.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..candidates.batch import CandidateBatch, Origin, measured
from ..guidance.best_circle import squared_centre
from ..kinematics.circuits import circuits
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Complexes, Floats
from ..problem.problem import Problem
from .draws import allowed, fixed_pivots

#: Families that are drawn, with whether all their joints are pins.
TURNING = {"four-bar": True, "slider-crank": False, "inverted-slider-crank": False}


class Draws(NamedTuple):
    """Options of random linkages, and of the fit of their points to an arc."""

    positions: int = 33  #: number of positions of a crank: over a full turn none of eight waves is missed
    #: Median length of a crank [radii]: in sound guides it is a little shorter than the radius.
    crank: float = 0.8
    crank_spread: float = 0.3  #: standard deviation of the logarithm of its length
    #: Median length of the coupler [radii]: a longer one turns less, and transmits better.
    coupler: float = 2.5
    coupler_spread: float = 0.5  #: standard deviation of the logarithm of its length
    #: Standard deviation of the coordinates of a start's point, relative to the moving pivot of the
    #: crank [radii]; half the starts begin at the pivot.
    away: float = 0.6
    steps: int = 10  #: number of Gauss-Newton steps, after which most starts have converged
    longest_step: float = 0.5  #: longest step of a coordinate [radii]
    damping: float = 1e-6  #: damping of the normal equations, over their trace
    each: int = 4  #: number of linkages drawn per measured start; those of least scatter are measured


DRAWS = Draws()


def starts(problem: Problem, family: str, count: int, random: np.random.Generator) -> CandidateBatch | None:
    """Return measured starts of a family; None if no point stays near the circle.

    Parameters
    ----------
    count : int
        Largest number of measured starts.
    """
    path = problem.path
    assert path.radius is not None
    assert path.angle is not None
    radius, half = path.radius, np.radians(0.5 * path.angle)
    centre = 0.5 * path.stroke - 1j * radius * np.cos(half)
    linkage, _ = Linkage.valid(_draw(problem, family, DRAWS.each * count, radius, centre, random))
    if not len(linkage):
        return None
    found = circuits(linkage)
    found = found[np.flatnonzero(np.isfinite(found.phase) & (found.lead == 0))]
    share = np.linspace(-1, 1, DRAWS.positions)[:, None]
    with np.errstate(all="ignore"):
        pose = found.pose(found.phase + half * share)
        pin = found.linkage.points[:, 0, 1]
        shift, turn = pose.point(pin), 1 + pose.x
        drawn = DRAWS.away * radius * (random.normal(size=len(pin)) + 1j * random.normal(size=len(pin)))
        first: Complexes = np.where(random.random(len(pin)) < 0.5, 0.0, drawn).astype(complex)
        scatter, arm, middle = fit_circles(shift, turn, radius, first)
        point = pin + arm
        top = point - middle
        scale = 1j * np.abs(top) / top
    best = np.flatnonzero(np.isfinite(scatter))
    best = best[np.argsort(scatter[best], kind="stable")][:count]
    if not len(best):
        return None
    scale, move = scale[best], centre - scale[best] * middle[best]
    nothing = np.full(len(best), complex(np.nan, np.nan))
    laid = found.linkage[best].moved(scale, move)
    return measured(problem, Origin.made(laid, "general"), laid, scale * point[best] + move, nothing)


def fit_circles(
    shift: Complexes, turn: Complexes, radius: float, arm: Complexes
) -> tuple[Floats, Complexes, Complexes]:
    """Fit circles to the paths z -> shift + turn z of points of n planes.

    Parameters
    ----------
    shift, turn : complex ndarray, shape (m, n)
    radius : float
        Radius of the circles.
    arm : complex ndarray, shape (n,)
        First guesses of the points.

    Returns
    -------
    scatter : ndarray, shape (n,)
        Root mean square distance from the circle.
    arm, centre : complex ndarray, shape (n,)
        The points and the centres of their circles.
    """
    centre = squared_centre(shift + turn * arm)
    for _ in range(DRAWS.steps):
        spoke = shift + turn * arm - centre
        far = np.abs(spoke)
        ray = spoke / far
        by = ray.conj() * turn
        slope = np.stack([by.real, -by.imag, -ray.real, -ray.imag], axis=-1)  # (m, n, 4)
        square = np.einsum("mni,mnj->nij", slope, slope)
        square += DRAWS.damping * np.trace(square, axis1=1, axis2=2)[:, None, None] * np.eye(4)
        right = np.einsum("mni,mn->ni", slope, radius - far)
        good = np.isfinite(square).all((1, 2)) & np.isfinite(right).all(1)
        step = np.full(right.shape, np.nan)
        step[good] = np.linalg.solve(square[good], right[good][..., None])[..., 0]
        step *= np.minimum(1.0, DRAWS.longest_step * radius / np.abs(step).max(1, keepdims=True))
        arm, centre = arm + step[:, 0] + 1j * step[:, 1], centre + step[:, 2] + 1j * step[:, 3]
    off = np.abs(shift + turn * arm - centre) - radius
    return np.sqrt((off * off).mean(0)), arm, centre


def _draw(
    problem: Problem, family: str, count: int, radius: float, centre: complex, random: np.random.Generator
) -> Array:
    """Draw linkages with the first crank about the centre of the arc, (count, 2, 2, 3)."""

    def length(median: float, spread: float) -> Floats:
        return radius * median * np.exp(random.normal(0.0, spread, count))

    def turned() -> Complexes:
        return np.asarray(np.exp(2j * np.pi * random.random(count)))

    crank = length(DRAWS.crank, DRAWS.crank_spread)
    first = centre + 0.5 * (radius - crank) * turned()
    pin = first + 1j * crank * np.exp(1j * random.normal(0.0, 0.3, count))
    second = fixed_pivots(problem, np.full(count, centre), random)
    other = pin + length(DRAWS.coupler, DRAWS.coupler_spread) * turned()
    pivots = np.ones((count, 2, 2, 3))
    ends = np.stack([first, pin, second, other], axis=1).reshape(-1, 2, 2)
    if family == "slider-crank":
        ends[:, 1, 0] = turned()
        pivots[:, 1, 0, 2] = 0.0
    elif family == "inverted-slider-crank":
        ends[:, 1, 1] = turned()
        pivots[:, 1, 1, 2] = 0.0
    pivots[..., 0], pivots[..., 1] = ends.real, ends.imag
    return pivots


def families(problem: Problem) -> list[str]:
    """Return the drawn families that suit a problem."""
    return allowed(problem, TURNING)
