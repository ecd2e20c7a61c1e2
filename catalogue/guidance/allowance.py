"""The allowance: the scatter of the pivots at which 95 % of paths stay within tolerance.

Where the coordinates of the finite pivots and of the guided point are off by s c, c (10,)
independent standard normal numbers, the distance from the nominal at a station becomes e + s G c to
first order (`pose_jacobian`).  The nominal is placed anew, as for the deviation.  By de la
Vallee-Poussin the half width of the zone is then

    max over references of  |L . (e + s G c)|,   sum |L| = 1,

where a reference is as many stations as the nominal has coordinates, and one more, and its weights
L are orthogonal to what moves of the nominal do there.  So along a direction c = r u the path stays
within a tolerance A while

    s r <= R(u),   1 / R(u) = max over references and signs of  L . G u / (A - L . e).

With r chi distributed the allowance is the s at which the mean over directions u of P(r > R(u) / s)
is 5 per cent. Paths answer in two or three directions, nearly all in four: there r has four degrees
of freedom, P(r > y) = exp(-x) (1 + x), x = y^2 / 2, and the directions are the 120 vertices of the
600-cell, which integrate polynomials to degree 11.
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

#: Probability with which a path stays within its tolerance over the whole stroke, at pivots that
#: scatter by the allowance: two standard deviations of a normal number.
PROBABILITY = 0.95


class AllowanceOptions(NamedTuple):
    """Grids and limits of the allowance; `rough` ones are those of a search."""

    #: Intervals between the Chebyshev points of the stroke in a search: the probability is known
    #: to 3 %.
    rough_intervals: int = 8
    intervals: int = 20  #: The intervals for what is shown and bounded: it is known to 1 %.
    #: The intervals where the radius is sought too: references are four stations then, and many
    #: more; 1 % again.
    arc_intervals: int = 16
    #: Strictest references that a search looks at in all directions. An answer takes all: where
    #: the deviation nearly fills the tolerance hundreds are as strict, and 64 left 2.5 % open.
    rough_references: int = 24
    #: Simulated machines, to first order, along wide arcs in a search: the probability is known to
    #: 1 %.
    rough_draws: int = 500
    draws: int = 4000  #: Simulated machines for an answer: it is known to 0.3 %.
    rough_drawn: int = 64  #: references evaluated for these in a search
    #: References evaluated for an answer: more change the probability by less than 0.1 %.
    drawn: int = 512
    #: Least excess of the tolerance over the deviation [deviations]. Below it the allowance is
    #: proportional to the excess, and negative where there is none.
    least_left: float = 1e-3
    steps: int = 12  #: Newton steps to the standard deviation, which leave 1e-9 of it open.
    tolerance_steps: int = 8  #: fixed-point steps from the standard deviation to the tolerance
    #: Largest allowance [shortest links]: beyond it distances are not proportional to the scatter,
    #: and linkages that no longer close become frequent. There the path keeps its tolerance with a
    #: higher probability.
    largest: float = 0.01


ALLOWANCE = AllowanceOptions()

#: x at which exp(-x) (1 + x) is 5 per cent.
TAIL = 4.743864518
#: Dimensions of the directions.
DIMENSIONS = 4


@dataclass(frozen=True)
class _AtOnce:
    """Numbers of references that are handled at once; measured on arcs of any radius."""

    made: int = 16384  #: of all guides: their derivatives fill a core's cache
    #: Looked at in all directions: few enough for the cache, and for BLAS to take one thread, as
    #: several wait for one another where cores are busy.
    seen: int = 1024


AT_ONCE = _AtOnce()


class Zone(NamedTuple):
    """Type of the zone about a path: line or circle, and its fitted coordinates."""

    circle: bool
    free: int  #: coordinates of the nominal that are sought: 0 in a fixed place, 2 of a line or given radius, else 3

    def intervals(self, rough: bool) -> int:
        """Return the number of intervals between stations, for a search or an answer."""
        return (
            ALLOWANCE.rough_intervals if rough else ALLOWANCE.arc_intervals if self.free == 3 else ALLOWANCE.intervals
        )


@dataclass(frozen=True)
class Response(Rows):
    """Deviations of n guides at m stations, and their first derivatives by the pivots."""

    error: Floats  #: (n, m), distances from the nominal [length]
    place: Floats  #: (n, m), along the nominal, as a polynomial knows it
    weight: Floats  #: (n, m), by which polynomials are divided; see `catalogue.guidance.minimum_zone`
    across: Floats  #: (n, m, 10), derivatives of the distances by the coordinates of finite pivots
    carried: Floats  #: (n, m, nodes), from values at the nodes of the stroke to the stations
    moved: Floats  #: (n, nodes, 10), derivatives of the distances by all coordinates, at the nodes
    deviation: Floats  #: (n,), half widths of the zones, NaN where a point returns [length]
    turned: Floats | None = None  #: (n, m), angles about the centres of arcs near a half circle, or beyond [rad]


def response(guides: CouplerCurve | CircuitCurve, traced: Traced, zone: Zone, intervals: int) -> Response:
    """Compute the linear response of traced guides at ends and extreme deviations.

    An extreme is taken between each two Chebyshev points, read on twice as many, as it oscillates
    more.
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
    carried = _carrying(intervals)[stations]
    given = carried @ np.where(scattered(guides.linkage)[:, None], across, 0.0)
    if turned is not None:
        turned = (many.fine[stations] @ turned.T[..., None])[..., 0]
    deviation = np.where(guides.cusp, np.nan, fit.deviation.astype(float))
    return Response(error, place, weight, given, carried, across, deviation, turned)


@lru_cache
def _carrying(intervals: int) -> Floats:
    """Return the interpolation matrix from nodes to the fine points of the next grid."""
    angle = np.pi * (1 - np.arange(8 * intervals + 1) / (8 * intervals))
    return np.asarray(np.cos(angle[:, None] * np.arange(intervals + 1)) @ grid(intervals).coefficients)


def scattered(linkage: Linkage) -> Mask:
    """Mark the coordinates that scatter, of finite pivots and guided points, (n, 10)."""
    finite = np.concatenate([linkage.finite.reshape(-1, 4), np.ones((len(linkage), 1), bool)], axis=1)
    return np.repeat(finite, 2, axis=1)


@dataclass(frozen=True)
class References(Rows):
    """Sets of stations whose weighted deviations bound the minimum zone, l for each guide."""

    stations: Indices  #: (n, l, k)
    weights: Floats  #: (n, l, k), of the distances, their absolute values add up to 1
    error: Floats  #: (n, l), weighted distances [length]
    across: Floats  #: (n, l, 10), their derivatives by the coordinates of finite pivots
    missed: Floats  #: (n,), how much more the deviation is than the largest of the distances [length]
    wide: Mask  #: (n,), whether they are of arcs near a half circle, or beyond

    @classmethod
    def of(cls, here: Response, free: int) -> References:
        """Return all references of responses."""
        m = here.error.shape[1]
        stations = _combinations(m, free + 1)
        if here.turned is not None and free == 2:  # beyond half a turn a tangent has poles
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
        """Select the strictest references of each guide, a given number."""
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
        """Return how much farther the distances may grow upward and downward, (n, l) each."""
        left = (asked - self.missed)[:, None]
        return left - self.error, left + self.error


@dataclass(frozen=True)
class Reach(Rows):
    """Distance of n guides from their tolerance along each direction of the scatter."""

    nearness: Floats  #: (n, 120), one over how far [1/length]
    reference: Indices  #: (n, 120), number of the reference that ends it
    direction: Floats  #: (n, 120, 10), unit vectors
    margin: Floats  #: (n, 120), how much farther the distance of that reference may grow [length]

    @classmethod
    def of(cls, found: References, asked: Floats) -> Reach:
        """Return the reach of paths within tolerances (n,) [length]."""
        up, down = found.margins(asked)
        count = up.shape[1]
        scaled = known(found.across / np.minimum(up, down)[..., None])
        axes = np.linalg.eigh(np.swapaxes(scaled, 1, 2) @ scaled)[1][..., -DIMENSIONS:]  # (n, 10, 4)
        seen_ = found.across @ axes
        length, whole = np.linalg.norm(seen_, axis=-1), np.linalg.norm(found.across, axis=-1)
        with np.errstate(all="ignore"):  # of a reference that answers in other directions too all scatter counts
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
            rate = TAIL / square.min(1)  # 1 / variance; Newton on the logarithms, from above
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
    """Return how far points (n, l, 4) reach along directions (60, 4) and their opposites.

    Returns
    -------
    ndarray, shape (n, 120)
        Largest scalar products.
    ndarray of int, shape (n, 120)
        Numbers of the points that have them.
    """
    n, count = len(points), len(half)
    farthest, which = np.full((n, 2 * count), -np.inf), np.zeros((n, 2 * count), int)
    sides = slice(0, count), slice(count, None)  # opposite directions
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
    """Compute the scatter at which paths keep tolerances (n,) with `PROBABILITY`, by simulation.

    The scatter is drawn, in all ten coordinates: over an arc near a full circle paths answer in
    more than four directions.
    """
    found, moves = _drawn(found, asked, rough=rough)
    up, down = found.margins(asked)
    scatter = np.empty(len(asked))
    for i in range(len(asked)):  # one at a time: a row of all is as large as a core's memory
        moved = known(found.across[i]) @ moves
        scatter[i] = 1 / _kept(np.maximum(moved / up[i, :, None], -moved / down[i, :, None]).max(0))
    return scatter


def drawn_deviation(found: References, asked: Floats, scatter: float, *, rough: bool) -> Floats:
    """Compute the deviations that paths keep with `PROBABILITY` at a scatter, by simulation, (n,).

    It is the inverse of `drawn_scatter`; tolerances (n,) near them tell which references count.
    """
    found, moves = _drawn(found, asked, rough=rough)
    deviation = np.empty(len(asked))
    for i in range(len(asked)):
        error = found.error[i, :, None] + scatter * (known(found.across[i]) @ moves)
        deviation[i] = found.missed[i] + _kept(np.abs(error).max(0))
    return deviation


def _drawn(found: References, asked: Floats, *, rough: bool) -> tuple[References, Floats]:
    """Return the references to evaluate, and normal numbers (10, draws)."""
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
        At fewer stations, as a search does.
    """
    here = responses(guides, traced, zone, rough=rough)
    asked = np.broadcast_to(asked, here.deviation.shape)
    every = [allowed(found, here.deviation[i], asked[i], rough=rough) for i, found in in_parts(here, zone.free)]
    least = np.concatenate(every)
    return np.minimum(least, ALLOWANCE.largest * shortest(guides.linkage))


def shortest(linkage: Linkage) -> Floats:
    """Return the shortest lengths of cranks and couplers, infinite without one, shape (n,)."""
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
                for _ in range(2):  # the second time with the references that count there
                    asked[i] = drawn_deviation(found, asked[i], scatter, rough=rough)
                continue
            for _ in range(ALLOWANCE.tolerance_steps):
                spared = allowed(found, deviation, asked[i], rough=rough)
                asked[i] = deviation + scatter * (asked[i] - deviation) / spared
    return np.asarray(asked)


def intervals_of(traced: Traced, zone: Zone, rough: bool) -> int:
    """Return the intervals between stations, twice as many along wide arcs of a given radius."""
    return zone.intervals(rough) * (2 if zone.free == 2 and traced.fit.is_wide.any() else 1)


def responses(guides: CouplerCurve | CircuitCurve, traced: Traced, zone: Zone, *, rough: bool) -> Response:
    """Compute the linear response of traced guides, at the stations of a search or an answer."""
    with np.errstate(all="ignore"):
        return response(guides, traced, zone, intervals_of(traced, zone, rough))


def in_parts(here: Response, free: int) -> Iterator[tuple[slice, References]]:
    """Yield the references of a few guides at a time, which stay in a core's cache."""
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
    """Replace unknown values by 0."""
    return np.where(np.isfinite(values), values, 0.0)


@lru_cache
def _combinations(count: int, size: int) -> Indices:
    return np.array(list(combinations(range(count), size)))


@lru_cache
def _directions() -> Floats:
    """Return one of each two opposite vertices of the 600-cell, unit vectors (60, 4)."""
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
