"""Exact guides of any proportions, as starts: parallelograms for arcs, Cardan's circles for lines.

They are trivial, but compact and sound, and have no deviation.
"""

from __future__ import annotations

import numpy as np

from ..candidates.batch import CandidateBatch, Origin, measured
from ..kinematics.linkage import Linkage
from ..problem.problem import Problem
from .draws import (
    MAX_LINK,
    MEDIAN_DISTANCE,
    MIN_LINK,
    RADIUS_SPREAD,
    allowed,
    curvatures,
    fixed_pivots,
    region_of,
    summit,
)

#: Least angle of a parallelogram from its dead points over the stroke [rad].
MIN_DEAD_POINT_ANGLE = 0.35
#: Largest stroke over the diameter of the rolling circle.
MAX_STROKE = 0.95


def starts(problem: Problem, count: int, random: np.random.Generator) -> CandidateBatch | None:
    """Draw `count` exact guides of the requested families, and measure them; None without any."""
    if problem.curvature == 0:
        kinds = allowed(problem, {"elliptic-trammel": False, "slider-crank": False})
        return cardan(problem, kinds, count, random) if kinds else None
    return parallelograms(problem, count, random) if allowed(problem, {"four-bar": True}) else None


def parallelograms(problem: Problem, count: int, random: np.random.Generator) -> CandidateBatch | None:
    """Draw parallelograms with cranks as long as the radius; None too near a dead point.

    All points of the coupler run along such an arc exactly.
    """
    bend = curvatures(problem, count, random)
    free = np.maximum(0.5 * np.pi - np.arcsin(-0.5 * bend) - MIN_DEAD_POINT_ANGLE, 0.0)
    tilt = random.uniform(-free, free) + np.where(random.random(count) < 0.5, 0.0, np.pi)
    first, second = (fixed_pivots(problem, summit(bend), random) for _ in range(2))
    if region_of(problem) is None:
        second = first + np.exp(random.normal(np.log(0.5), 0.5, count)) * np.exp(1j * tilt)
    ground = second - first
    inclination = np.arctan2(np.abs(ground.imag), np.abs(ground.real))
    good = (ground != 0) & (inclination < free) & (-bend * MAX_LINK >= 1)
    bend, fixed = bend[good], np.stack([first[good], second[good]], axis=1)
    if not len(bend):
        return None
    ends = np.stack([fixed, fixed - 1j / bend[:, None]], axis=-1)
    linkage = Linkage(np.stack([ends.real, ends.imag, np.ones(ends.shape)], axis=-1))
    pole = np.full(len(bend), complex(np.nan, np.nan))
    return measured(problem, Origin.made(linkage, "parallel", 99), linkage, summit(bend), pole)


def cardan(problem: Problem, kinds: list[str], count: int, random: np.random.Generator) -> CandidateBatch | None:
    """Draw linkages in Cardan motion, and measure them; None if none reaches over the stroke.

    A circle rolls inside another of twice its radius, whose centre lies on the path.  Each point of
    the rolling circle runs along a line through that centre.  Sliders guide two such points, or a
    slider guides one and a crank the centre of the rolling circle.

    Parameters
    ----------
    problem : Problem
        Problem of a straight line.
    kinds : list of str
        Families to make: ``elliptic-trammel``, ``slider-crank``, or both.
    count : int
        Number of draws; linkages out of proportion, or whose path is too short, are left out.

    Source: Allievi 1895, series II.ooo and II.xoy; the draws are ours.
    """
    point = np.full(count, 0.5 + 0j)
    pin = fixed_pivots(problem, point, random)
    fixed_centre = 0.5 + np.where(random.random(count) < 0.5, 1, -1) * np.exp(
        random.normal(np.log(MEDIAN_DISTANCE), RADIUS_SPREAD, count)
    )
    half = 0.5 * (fixed_centre + 0.5)  # the rolling circle passes through this point, the guided point and the pin
    with np.errstate(all="ignore"):
        centre = half + 0.5j * (np.abs(half - pin) ** 2 - (half - fixed_centre) ** 2) / pin.imag
    radius = np.abs(centre - fixed_centre)
    other = centre + (pin - centre) * np.exp(1j * random.normal(0.0, 1.0, count))
    crank = np.array([name == "slider-crank" for name in kinds])[random.integers(len(kinds), size=count)]
    second = np.where(crank, centre, other)
    fixed = [1j * (pin - fixed_centre), np.where(crank, fixed_centre, 1j * (second - fixed_centre))]
    pairs = ((pin, second), (pin, fixed_centre), (second, fixed_centre), (pin, point), (second, point))
    long = np.stack([np.abs(a - b) for a, b in pairs])
    good = (np.abs(fixed_centre - 0.5) + 0.5 < MAX_STROKE * 2 * radius) & (radius < MAX_LINK) & (long > MIN_LINK).all(0)
    with np.errstate(all="ignore"):
        turn = np.sign(centre.imag) * np.arccos((np.array([[0.0], [1.0]]) - fixed_centre) / (2 * radius))
    way = np.cos(turn - np.angle(pin - fixed_centre))
    good &= ~crank | (way[0] * way[1] > 0)  # otherwise the slider passes the crank's pivot: a change point
    if not good.any():
        return None
    pivots = np.ones((count, 2, 2, 3))
    for i, (away, near) in enumerate(zip(fixed, (pin, second), strict=True)):
        ends = np.stack([away, near], axis=1)
        pivots[:, i, :, 0], pivots[:, i, :, 1] = ends.real, ends.imag
    pivots[:, 0, 0, 2], pivots[:, 1, 0, 2] = 0.0, crank
    linkage = Linkage(pivots[good])
    pole = np.full(len(linkage), complex(np.nan, np.nan))
    return measured(problem, Origin.made(linkage, "cardan", 99), linkage, point[good], pole)
