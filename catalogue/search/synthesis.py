"""Starts made to measure: linkages whose guided point touches the path asked to second order, pivots where they may be.

In mid-stroke the guided point P is on the path, with the tangent along +x and curvature k.  Its pole Q lies on the
normal; with Q, both fixed pivots and the place of one moving pivot chosen at random, Euler and Savary give the rest: a
point at the signed distance a from Q along the unit ray e, whose path has its centre at a*, obeys

    1 / a - 1 / a* = 1 / (e . W),

W being the vector from Q to the inflection pole.  P and the first dyad are two linear equations for W, the second
dyad's moving pivot follows.  A fixed pivot at infinity (slider) is 1 / a* = 0 on a ray across its line.

Source: Euler-Savary as in Allievi 1895, sec. 3; the draw is ours.
"""

from __future__ import annotations

import numpy as np

from ..candidates.batch import CandidateBatch, Origin
from ..candidates.placement import measured
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array
from ..problem.constraints import Region
from ..problem.problem import Problem

#: Families that are made, with whether their dyads are cranks.
MADE = {"four-bar": (True, True), "slider-crank": (True, False)}
#: Where fixed pivots are drawn if nothing is said: log-normally about this distance from mid-stroke [strokes].
DISTANCE, SPREAD = 1.0, 0.6
#: Longest and shortest link or arm of a start, in strokes.
LONGEST, SHORTEST = 12.0, 0.06
#: Least angle of a parallelogram over the stroke [rad].
DEAD = 0.35


def families(problem: Problem) -> list[str]:
    """Return which families are made for a problem."""
    wanted = problem.constraints
    if wanted.series or wanted.configurations or wanted.order or wanted.slots or wanted.returns:
        return []
    allowed = [name for name in MADE if not wanted.families or name in wanted.families]
    return [name for name in allowed if name == "four-bar" or not wanted.pins_only]


def starts(problem: Problem, family: str, count: int, random: np.random.Generator) -> CandidateBatch | None:
    """Return starts of a family, measured; those that do not reach over the stroke have deviation NaN.

    Parameters
    ----------
    count : int
        How many are drawn; linkages that cannot be, or have links out of all proportion, are left out.
    """
    pivots = drawn(problem, family, count, random)
    linkage, _ = Linkage.valid(pivots)
    if not len(linkage):
        return None
    point = np.full(len(linkage), complex(0.5, summit(problem)))
    bend = np.full(len(linkage), _curvature(problem))
    pole = np.full(len(linkage), complex(np.nan, np.nan))
    return measured(problem, Origin.made(linkage, "general"), linkage, point, pole, bend)


def parallelograms(problem: Problem, count: int, random: np.random.Generator) -> CandidateBatch | None:
    """Return parallelograms whose cranks are as long as the radius given, measured; None if they would come too near
    to a dead point.  Every point of the coupler runs along such an arc exactly: trivial, but compact and sound."""
    radius = problem.path.radius
    assert radius is not None
    free = 0.5 * np.pi - np.arcsin(0.5 / radius) - DEAD
    if free <= 0 or radius > LONGEST:
        return None
    point = complex(0.5, summit(problem))
    tilt = random.uniform(-free, free, count) + np.where(random.random(count) < 0.5, 0.0, np.pi)
    first = _fixed(problem, point, count, random)
    fixed = np.stack([first, first + np.exp(random.normal(np.log(0.5), 0.5, count)) * np.exp(1j * tilt)], axis=1)
    ends = np.stack([fixed, fixed + 1j * radius], axis=-1)
    linkage = Linkage(np.stack([ends.real, ends.imag, np.ones(ends.shape)], axis=-1))
    bend, pole = np.full(count, _curvature(problem)), np.full(count, complex(np.nan, np.nan))
    return measured(problem, Origin.made(linkage, "parallel", 99), linkage, np.full(count, point), pole, bend)


def summit(problem: Problem) -> float:
    """Return how high the path runs above its chord in mid-stroke."""
    k = -_curvature(problem)
    return float(0.25 * k / (1 + np.sqrt(1 - 0.25 * k * k)))


def _curvature(problem: Problem) -> float:
    return -1.0 if problem.curvature is None else problem.curvature


def drawn(problem: Problem, family: str, count: int, random: np.random.Generator) -> Array:
    """Return the pivots of linkages with contact of second order, shape (n, 2, 2, 3)."""
    point = complex(0.5, summit(problem))
    second = MADE[family][1]
    fixed = np.stack([_fixed(problem, point, count, random) for _ in range(2)], axis=1)
    pole = point + 1j * random.standard_cauchy(count)
    away = fixed - pole[:, None]
    far = np.abs(away)
    ray = away / far
    if not second:
        ray[:, 1] = np.exp(1j * random.uniform(0, np.pi, count))
    reach = np.where(random.random(count) < 0.5, 1, -1) * np.exp(random.normal(np.log(DISTANCE), 1.0, count))
    with np.errstate(all="ignore"):
        p = (point - pole).imag  # along the normal, +y
        k = _curvature(problem)
        centre = 0.0 if k == 0 else 1 / (p + 1 / k)
        inflection_p = 1 / (1 / p - centre)
        inflection_1 = 1 / (1 / reach - 1 / far[:, 0])
        # W = (wx, wy): wy from the guided point, wx from the first dyad
        wy = inflection_p
        wx = (inflection_1 - ray[:, 0].imag * wy) / ray[:, 0].real
        along = ray[:, 1].real * wx + ray[:, 1].imag * wy
        inverse = 1 / along + (1 / far[:, 1] if second else 0.0)
        moving = np.stack([pole + reach * ray[:, 0], pole + ray[:, 1] / inverse], axis=1)
        pivots = np.ones((count, 2, 2, 3))
        ends = np.stack([fixed, moving], axis=-1)
        if not second:
            ends[:, 1, 0] = ray[:, 1]
            pivots[:, 1, 0, 2] = 0.0
        pivots[..., 0], pivots[..., 1] = ends.real, ends.imag
        links = [np.abs(ends[:, 0, 1] - ends[:, 0, 0]), np.abs(moving[:, 1] - moving[:, 0])]
        if second:
            links += [np.abs(ends[:, 1, 1] - ends[:, 1, 0]), np.abs(fixed[:, 1] - fixed[:, 0])]
        arms = [np.abs(moving[:, i] - point) for i in (0, 1)]
        every = np.stack([*links, *arms])
        good = (every > SHORTEST).all(0) & (every < LONGEST).all(0)
    return np.asarray(pivots[good & np.isfinite(pivots).all(axis=(1, 2, 3))])


def _fixed(problem: Problem, point: complex, count: int, random: np.random.Generator) -> Array:
    """Return places for a fixed pivot: in the region where it must stand, else about the path."""
    wanted = problem.constraints
    region: Region | None = next(
        (r for r in (wanted.fixed_pivots_in, wanted.pivots_in, wanted.swept_in) if r is not None), None
    )
    most = wanted.max_size or LONGEST
    away = np.minimum(np.exp(random.normal(np.log(DISTANCE), SPREAD, count)), 0.8 * most)
    about = point + away * np.exp(2j * np.pi * random.random(count))
    if region is None:
        return np.asarray(about)
    x0, y0, x1, y1 = np.clip(region.box, -LONGEST, LONGEST)
    return np.asarray(random.uniform(x0, x1, count) + 1j * random.uniform(y0, y1, count))
