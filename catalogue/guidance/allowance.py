"""The allowance: the scatter of the pivots at which 95 % of paths stay within tolerance.

Let the errors of the coordinates of the finite pivots and of the guided point be s c, with c (10,)
independent standard normal numbers. The distance from the nominal at a station is then e + s G c to
first order (`pose_jacobian`). The nominal is fitted again, as for the deviation.  By de la
Vallee-Poussin the half width of the zone is then

    max over references of  |L . (e + s G c)|,   sum |L| = 1,

where a reference is a set of stations, one more than the nominal has coordinates. Its weights L are
orthogonal to the displacements there by moves of the nominal. So along a direction c = r u the path
stays within a tolerance A while

    s r <= R(u),   1 / R(u) = max over references and signs of  L . G u / (A - L . e).

With r chi distributed the allowance is the s at which the mean over directions u of P(r > R(u) / s)
is 5 per cent. Paths respond to two or three directions of the scatter, nearly all to at most four.
In these r has four degrees of freedom, P(r > y) = exp(-x) (1 + x), x = y^2 / 2, and the directions
are the 120 vertices of the 600-cell, which integrate polynomials to degree 11.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations, permutations, product
from typing import NamedTuple

import numpy as np

from ..kinematics.batch import Rows, join
from ..kinematics.linkage import Linkage
from ..kinematics.types import Floats, Indices, Mask
from .circuit_curve import CircuitCurve
from .coupler_curve import CouplerCurve
from .minimum_zone import concentric, grid, polar, seen
from .sensitivity import COUNT, pose_jacobian, ways
from .trace import Traced

#: Probability with which a path stays within its tolerance over the whole stroke, when the pivots
#: scatter by the allowance: that of two standard deviations of a normal variable.
PROBABILITY = 0.95


class AllowanceOptions(NamedTuple):
    """Grids and limits of the allowance; fields named `rough` apply in a search."""

    #: Number of intervals between the Chebyshev points of the stroke in a search: the error of the
    #: probability is 3 %.
    rough_intervals: int = 8
    intervals: int = 20  #: number of intervals for display and constraints: the error is 1 %
    #: Number of intervals where the radius is fitted too. References then have four stations and
    #: are many more; the error is again 1 %.
    arc_intervals: int = 16
    #: Number of strictest references that a search evaluates in all directions. An answer evaluates
    #: all: where the deviation nearly fills the tolerance hundreds are equally strict, and 64 gave
    #: an error of 2.5 %.
    rough_references: int = 24
    #: Number of simulated machines, to first order, along wide arcs in a search: the error of the
    #: probability is 1 %.
    rough_draws: int = 500
    draws: int = 4000  #: number of simulated machines for an answer: the error is 0.3 %
    rough_drawn: int = 64  #: number of references evaluated on simulated machines in a search
    #: Number of references evaluated on simulated machines for an answer: more change the
    #: probability by less than 0.1 %.
    drawn: int = 512
    #: Least excess of the tolerance over the deviation [deviations]. Below it the allowance is
    #: proportional to the excess, and negative where there is none.
    least_left: float = 1e-3
    steps: int = 12  #: number of Newton steps for the standard deviation: their error is 1e-9
    tolerance_steps: int = 8  #: number of fixed-point steps from the standard deviation to the tolerance
    #: Largest allowance [shortest links]: beyond it distances are not proportional to the scatter,
    #: and linkages that no longer close become frequent. There the path keeps its tolerance with a
    #: higher probability.
    largest: float = 0.01


ALLOWANCE = AllowanceOptions()

#: Solution x of exp(-x) (1 + x) = 5 per cent.
TAIL = 4.743864518
#: Number of principal directions of the scatter that are evaluated: nearly all paths respond to at
#: most four.
DIMENSIONS = 4


@dataclass(frozen=True)
class _AtOnce:
    """Batch sizes of references, chosen by run times on arcs of any radius."""

    made: int = 16384  #: references whose derivatives are computed at once: they fill a core's cache
    #: References evaluated at once in all directions: few enough for the cache, and for BLAS to
    #: stay with one thread, as several threads wait for one another on busy cores.
    seen: int = 1024


AT_ONCE = _AtOnce()


class Zone(NamedTuple):
    """Type of the zone about a path: line or circle, and its fitted coordinates."""

    circle: bool
    #: number of fitted coordinates of the nominal: 0 in a fixed place, 2 for a line or a given
    #: radius, else 3
    free: int

    def intervals(self, rough: bool) -> int:
        """Return the number of intervals between stations, for a search or an answer."""
        return (
            ALLOWANCE.rough_intervals if rough else ALLOWANCE.arc_intervals if self.free == 3 else ALLOWANCE.intervals
        )


@dataclass(frozen=True)
class Response(Rows):
    """Deviations of n guides at m stations, and their first derivatives by the pivots."""

    error: Floats  #: distances from the nominal, (n, m) [length]
    place: Floats  #: positions along the nominal, the variable of the fitted polynomials, (n, m)
    weight: Floats  #: divisors of these polynomials, (n, m); see `catalogue.guidance.minimum_zone`
    across: Floats  #: derivatives of the distances by the coordinates of finite pivots, (n, m, 10)
    carried: Floats  #: interpolation from values at the nodes of the stroke to the stations, (n, m, nodes)
    moved: Floats  #: derivatives of the distances at the nodes by all coordinates, (n, nodes, 10)
    deviation: Floats  #: half widths of the zones, (n,); NaN where a point returns [length]
    turned: Floats | None = None  #: angles about the centres of arcs near a half circle or beyond, (n, m) [rad]


def response(guides: CouplerCurve | CircuitCurve, traced: Traced, zone: Zone, intervals: int) -> Response:
    """Compute the linear response of traced guides at ends and extreme deviations.

    The stations between the ends are the extremes between Chebyshev points. They are sampled on
    twice as many points, as the response oscillates more than the path.
    """
    few, many, fit = grid(intervals), grid(2 * intervals), traced.fit
    by = pose_jacobian(guides.motion, guides.point, traced.parameters(few.nodes), ways(guides, traced, few.nodes))
    across = np.moveaxis(by.across, 0, 1)
    z = guides.motion.pose(traced.parameters(many.nodes)).point(guides.point)
    start, along, curvature = fit.start.astype(complex), fit.along.astype(complex), fit.curvature.astype(float)
    half = 0.5 * fit.stroke.astype(float)
    x, y = seen(z.real, z.imag, start + half * along, along)
    turned = None
    if zone.circle:
        y = y - fit.rise.astype(float)
        error, place, weight = (polar if zone.free == 3 else concentric)(x, y, curvature)
        if fit.is_wide.any() and zone.free == 2:
            turned = np.unwrap(np.arctan2(curvature * x, 1 - curvature * y), axis=0)
    else:
        error, place, weight = y, x, np.ones_like(x)
    fine = (many.fine @ error).T
    size = (fine.shape[1] - 1) // intervals
    bins = np.abs(fine[:, 1:]).reshape(len(fine), intervals, size)[..., :-1]  # a reversed path has the same bins
    worst = np.argmax(np.where(np.isnan(bins), -1.0, bins), axis=2) + 1 + np.arange(0, fine.shape[1] - 1, size)
    stations = np.pad(worst, ((0, 0), (1, 1)), constant_values=((0, 0), (0, fine.shape[1] - 1)))
    error, place, weight = ((many.fine[stations] @ part.T[..., None])[..., 0] for part in (error, place, weight))
    carried = _interpolation_matrix(intervals)[stations]
    given = carried @ np.where(scattered(guides.linkage)[:, None], across, 0.0)
    if turned is not None:
        turned = (many.fine[stations] @ turned.T[..., None])[..., 0]
    deviation = np.where(guides.cusp, np.nan, fit.deviation.astype(float))
    return Response(error, place, weight, given, carried, across, deviation, turned)


@lru_cache
def _interpolation_matrix(intervals: int) -> Floats:
    """Return the interpolation matrix from nodes to the fine points of the next grid."""
    angle = np.pi * (1 - np.arange(8 * intervals + 1) / (8 * intervals))
    return np.asarray(np.cos(angle[:, None] * np.arange(intervals + 1)) @ grid(intervals).coefficients)


def scattered(linkage: Linkage) -> Mask:
    """Tell which coordinates of finite pivots and guided points scatter, (n, 10)."""
    finite = np.concatenate([linkage.finite.reshape(-1, 4), np.ones((len(linkage), 1), bool)], axis=1)
    return np.repeat(finite, 2, axis=1)


@dataclass(frozen=True)
class References(Rows):
    """Sets of stations whose weighted deviations bound the minimum zone; l sets for each guide."""

    stations: Indices  #: stations of each reference, (n, l, k)
    weights: Floats  #: weights of the distances, (n, l, k); their absolute values add up to 1
    error: Floats  #: weighted distances, (n, l) [length]
    across: Floats  #: derivatives of the weighted distances by the coordinates of finite pivots, (n, l, 10)
    missed: Floats  #: excess of the deviation over the largest weighted distance, (n,) [length]
    wide: Mask  #: whether the references are of arcs near a half circle or beyond, (n,)

    @classmethod
    def of(cls, here: Response, free: int) -> References:
        """Return all references of responses."""
        m = here.error.shape[1]
        stations = _combinations(m, free + 1)
        if here.turned is not None and free == 2:  # beyond a half circle the tangent in the formula below has poles
            one, two, three = (here.turned[:, at] for at in stations.T)
            weights = [np.sin(two - three), np.sin(three - one), np.sin(one - two)]
        else:
            place, weights = ([part[:, at] for at in stations.T] for part in (here.place, here.weight))
            for i, j in combinations(range(free + 1), 2):
                apart = place[i] - place[j]
                weights[i] /= apart
                weights[j] /= -apart
        scale = 1 / np.abs(weights).sum(0)
        error, across = np.zeros(scale.shape), np.zeros((*scale.shape, here.across.shape[-1]))
        for weight, at in zip(weights, stations.T, strict=True):
            weight *= scale
            error += weight * here.error[:, at]
            across += weight[..., None] * here.across[:, at]
        missed = here.deviation - np.abs(error).max(1)
        wide = np.full(len(missed), here.turned is not None)
        together = np.stack(weights, axis=-1)
        return cls(np.broadcast_to(stations, together.shape), together, error, across, missed, wide)

    def strongest(self, asked: Floats, count: int) -> References:
        """Select the strictest references of each guide, `count` of them."""
        if self.error.shape[1] <= count:
            return self
        least = np.minimum(*self.margins(asked))
        strength = (self.across**2).sum(-1) / least**2
        which = np.argpartition(-np.nan_to_num(strength, nan=-1.0), count, axis=1)[:, :count]
        row = np.arange(len(which))[:, None]
        return References(
            self.stations[row, which],
            self.weights[row, which],
            self.error[row, which],
            self.across[row, which],
            self.missed,
            self.wide,
        )

    def margins(self, asked: Floats) -> tuple[Floats, Floats]:
        """Return the permitted growth of weighted distances, upward and downward, (n, l) each."""
        left = (asked - self.missed)[:, None]
        return left - self.error, left + self.error


@dataclass(frozen=True)
class Reach(Rows):
    """Distances of n guides from their tolerances along directions of the scatter."""

    nearness: Floats  #: reciprocal distances from the tolerance, (n, 120) [1/length]
    reference: Indices  #: index of the reference that reaches the tolerance first, (n, 120)
    direction: Floats  #: directions as unit vectors, (n, 120, 10)
    margin: Floats  #: permitted growth of the weighted distance of that reference, (n, 120) [length]

    @classmethod
    def of(cls, found: References, asked: Floats) -> Reach:
        """Return the reach of paths within tolerances (n,) [length]."""
        up, down = found.margins(asked)
        count = up.shape[1]
        scaled = known(found.across / np.minimum(up, down)[..., None])
        # principal axes of the responses, (n, 10, 4)
        axes = np.linalg.eigh(np.swapaxes(scaled, 1, 2) @ scaled)[1][..., -DIMENSIONS:]
        seen_ = found.across @ axes
        length, whole = np.linalg.norm(seen_, axis=-1), np.linalg.norm(found.across, axis=-1)
        # scale a reference that responds beyond these axes too to its full response
        with np.errstate(all="ignore"):
            seen_ *= np.where(length > 0.3 * whole, whole / length, 1.0)[..., None]
        half = _directions()
        ends = np.concatenate([seen_ / up[..., None], -seen_ / down[..., None]], axis=1)
        nearness, first_out = _support(known(ends), half)
        both = np.concatenate([half, -half]) @ np.swapaxes(axes, 1, 2)
        margin = np.take_along_axis(np.concatenate([up, down], axis=1), first_out, 1)
        return cls(nearness, first_out % count, both, margin)

    def scatter(self) -> Floats:
        """Compute the scatter at which paths stay within tolerance with `PROBABILITY`, (n,)."""
        with np.errstate(all="ignore"):
            square = 0.5 / self.nearness**2
            rate = TAIL / square.min(1)  # 1 / variance, by Newton steps on the logarithms, from above
            for _ in range(ALLOWANCE.steps):
                x = rate[:, None] * square
                tail = np.exp(-x)
                missing = (tail * (1 + x)).mean(1)
                slope = (tail * x * x).mean(1) / missing
                rate = rate * np.exp(np.log(missing / (1 - PROBABILITY)) / slope)
            return np.asarray(1 / np.sqrt(rate))

    def shares(self, scatter: Floats) -> Floats:
        """Compute the share of each direction in the log scatter, (n, 120), sum 1."""
        with np.errstate(all="ignore"):
            x = 0.5 / (self.nearness * scatter[:, None]) ** 2
            part = np.nan_to_num(np.exp(-x) * x * x)
            return np.asarray(part / part.sum(1, keepdims=True))


def _support(points: Floats, half: Floats) -> tuple[Floats, Indices]:
    """Return how far points (n, l, 4) extend along directions (60, 4) and their opposites.

    Returns
    -------
    ndarray, shape (n, 120)
        Largest scalar products.
    ndarray of int, shape (n, 120)
        Indices of the points with these products.
    """
    n, count = len(points), len(half)
    farthest, which = np.full((n, 2 * count), -np.inf), np.zeros((n, 2 * count), int)
    sides = slice(0, count), slice(count, None)  # points on either side, for opposite directions
    columns = np.ascontiguousarray(np.swapaxes(points, 1, 2))
    row = np.arange(count)
    for i, first in product(range(n), range(0, points.shape[1], AT_ONCE.seen)):
        along = half @ columns[i, :, first : first + AT_ONCE.seen]
        for side, sign, at in zip(sides, (1.0, -1.0), (along.argmax(1), along.argmin(1)), strict=True):
            reached = sign * along[row, at]
            farther = reached > farthest[i, side]
            farthest[i, side][farther] = reached[farther]
            which[i, side][farther] = first + at[farther]
    return farthest, which


def drawn_scatter(found: References, asked: Floats, *, rough: bool) -> Floats:
    """Compute by simulation the scatter at which paths keep tolerances (n,) with `PROBABILITY`.

    The scatter is simulated in all ten coordinates: along an arc near a full circle paths respond
    in more than four directions.
    """
    found, moves = _simulated_sample(found, asked, rough=rough)
    up, down = found.margins(asked)
    scatter = np.empty(len(asked))
    for i in range(len(asked)):  # one guide at a time: its array is as large as the cache of a core
        moved = known(found.across[i]) @ moves
        scatter[i] = 1 / _kept(np.maximum(moved / up[i, :, None], -moved / down[i, :, None]).max(0))
    return scatter


def drawn_deviation(found: References, asked: Floats, scatter: float, *, rough: bool) -> Floats:
    """Compute by simulation the deviations that paths keep with `PROBABILITY` at a scatter, (n,).

    It is the inverse of `drawn_scatter`. `asked`, tolerances (n,) near the result, select the
    references to evaluate.
    """
    found, moves = _simulated_sample(found, asked, rough=rough)
    deviation = np.empty(len(asked))
    for i in range(len(asked)):
        error = found.error[i, :, None] + scatter * (known(found.across[i]) @ moves)
        deviation[i] = found.missed[i] + _kept(np.abs(error).max(0))
    return deviation


def _simulated_sample(found: References, asked: Floats, *, rough: bool) -> tuple[References, Floats]:
    """Return the references to evaluate, and a sample (10, draws) of normal numbers."""
    draws, count = (ALLOWANCE.rough_draws, ALLOWANCE.rough_drawn) if rough else (ALLOWANCE.draws, ALLOWANCE.drawn)
    return found.strongest(asked, count), np.random.default_rng(0).normal(size=(COUNT, draws))


def _kept(values: Floats) -> float:
    """Return the quantile of `PROBABILITY`, interpolated as `numpy.quantile` does."""
    place = PROBABILITY * (len(values) - 1)
    first = int(place)
    low, high = np.partition(values, (first, first + 1))[first : first + 2]
    return float(low + (place - first) * (high - low))


def allowances(
    asked: float | Floats,
    guides: CouplerCurve | CircuitCurve,
    traced: Traced,
    zone: Zone,
    *,
    rough: bool = False,
) -> Floats:
    """Return the allowances of traced guides for a tolerance, to first order, shape (n,) [length].

    Negative where the deviation is larger than the tolerance, NaN where the point returns or
    nothing was traced.

    Parameters
    ----------
    asked : float or ndarray, shape (n,)
        Largest deviations that are allowed [length].
    rough : bool
        Use fewer stations, as in a search.
    """
    here = responses(guides, traced, zone, rough=rough)
    asked = np.broadcast_to(asked, here.deviation.shape)
    every = [allowed(found, here.deviation[i], asked[i], rough=rough) for i, found in in_parts(here, zone.free)]
    least = np.concatenate(every)
    return np.minimum(least, ALLOWANCE.largest * shortest(guides.linkage))


def shortest(linkage: Linkage) -> Floats:
    """Return the shortest of cranks and couplers, shape (n,); infinite for linkages without one."""
    z = np.where(linkage.finite, linkage.points, np.nan)
    lengths = np.abs([z[:, 0, 0] - z[:, 0, 1], z[:, 1, 0] - z[:, 1, 1], z[:, 0, 1] - z[:, 1, 1]])
    return np.asarray(np.fmin.reduce(lengths, axis=0, initial=np.inf))


def expected_deviation(
    scatter: float, guides: CouplerCurve | CircuitCurve, traced: Traced, zone: Zone, *, rough: bool = False
) -> Floats:
    """Compute the tolerances that guides keep with `PROBABILITY` at a scatter, shape (n,) [length].

    It is the inverse of `allowances`: the scatter is the allowance of these tolerances.
    """
    here = responses(guides, traced, zone, rough=rough)
    if not scatter:
        return here.deviation
    asked = np.where(here.deviation > 0, 2 * here.deviation, scatter)
    with np.errstate(all="ignore"):
        for i, found in in_parts(here, zone.free):
            deviation = here.deviation[i]
            if found.wide.any():
                for _ in range(2):  # the second pass selects references by the result of the first
                    asked[i] = drawn_deviation(found, asked[i], scatter, rough=rough)
                continue
            for _ in range(ALLOWANCE.tolerance_steps):
                spared = allowed(found, deviation, asked[i], rough=rough)
                asked[i] = deviation + scatter * (asked[i] - deviation) / spared
    return np.asarray(asked)


def intervals_of(traced: Traced, zone: Zone, rough: bool) -> int:
    """Return the number of intervals between stations.

    It is doubled along wide arcs of given radius.
    """
    return zone.intervals(rough) * (2 if zone.free == 2 and traced.fit.is_wide.any() else 1)


def responses(guides: CouplerCurve | CircuitCurve, traced: Traced, zone: Zone, *, rough: bool) -> Response:
    """Compute the linear response of traced guides, at the stations of a search or an answer."""
    with np.errstate(all="ignore"):
        return response(guides, traced, zone, intervals_of(traced, zone, rough))


def in_parts(here: Response, free: int) -> Iterator[tuple[slice, References]]:
    """Yield the references of a few guides at a time, to stay in a core's cache."""
    n, m = here.error.shape
    few = max(1, AT_ONCE.made // math.comb(m, free + 1))
    for first in range(0, max(n, 1), few):
        some = slice(first, first + few)
        with np.errstate(all="ignore"):
            found = References.of(here[some], free)
        yield some, found


def reaches(here: Response, free: int, asked: Floats) -> Reach:
    """Return the reach of paths within tolerances (n,) [length], over all references."""
    return join(*(Reach.of(found, asked[some]) for some, found in in_parts(here, free)))


def allowed(found: References, deviation: Floats, asked: Floats, *, rough: bool = False) -> Floats:
    """Compute the allowances of guides for tolerances (n,) from their references."""
    scatter, good = np.full(len(deviation), np.nan), np.flatnonzero(np.isfinite(deviation))
    if len(good):
        some, deviation, asked = found[good], deviation[good], asked[good]
        with np.errstate(all="ignore"):
            at = np.maximum(asked, deviation * (1 + ALLOWANCE.least_left))
            if some.wide.any():
                reached = drawn_scatter(some, at, rough=rough)
            else:
                some = some.strongest(at, ALLOWANCE.rough_references) if rough else some
                reached = Reach.of(some, at).scatter()
            scatter[good] = reached * (asked - deviation) / (at - deviation)
    return scatter


def known(values: Floats) -> Floats:
    """Replace NaN and infinite values by 0."""
    return np.where(np.isfinite(values), values, 0.0)


@lru_cache
def _combinations(count: int, size: int) -> Indices:
    return np.array(list(combinations(range(count), size)))


@lru_cache
def _directions() -> Floats:
    """Return unit vectors (60, 4): one of each opposite pair of vertices of the 600-cell."""
    golden = (1 + math.sqrt(5)) / 2
    even = [p for p in permutations(range(4)) if sum(a > b for a, b in combinations(p, 2)) % 2 == 0]
    vertices: set[tuple[float, ...]] = {
        (1.0, 0.0, 0.0, 0.0),
        (0.0, 1.0, 0.0, 0.0),
        (0.0, 0.0, 1.0, 0.0),
        (0.0, 0.0, 0.0, 1.0),
    }
    vertices |= {(0.5, *rest) for rest in product((0.5, -0.5), repeat=3)}
    for p in even:
        for signs in product((1, -1), repeat=3):
            corner = [0.5 * s * v for s, v in zip((*signs, 1), (golden, 1.0, 1 / golden, 0.0), strict=True)]
            placed = tuple(corner[k] for k in p)
            if next(v for v in placed if v) > 0:
                vertices.add(placed)
    return np.array(sorted(vertices))
