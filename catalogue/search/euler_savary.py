"""Synthesised starts with second-order contact with the path, pivots in their regions.

In mid-stroke the guided point P is on the path, with the tangent along +x and curvature k.  Its
pole Q lies on the normal; with Q, both fixed pivots and the place of one moving pivot chosen at
random, Euler and Savary give the rest: a point at the signed distance a from Q along the unit ray
e, whose path has its centre at a*, obeys

    1 / a - 1 / a* = 1 / (e . W),

W being the vector from Q to the inflection pole.  P and the first dyad are two linear equations for
W, the second dyad's moving pivot follows.  A fixed pivot at infinity (slider) is 1 / a* = 0 on a
ray across its line.

Source: Euler-Savary as in Allievi 1895, sec. 3; the draws are ours.
"""

from __future__ import annotations

import numpy as np

from ..candidates.batch import CandidateBatch, Origin, measured
from ..kinematics.linkage import Linkage
from ..kinematics.types import Floats
from ..problem.problem import Problem
from .draws import MAX_LINK, MEDIAN_DISTANCE, MIN_LINK, curvatures, fixed_pivots, likeliest, summit

#: Part of the linkages drawn that is measured: those nearest to the path.
MEASURED_SHARE = 0.2
#: Synthesised families, with whether their second dyad is a crank too.
PINNED = {"four-bar": True, "slider-crank": False}


def starts(problem: Problem, family: str, count: int, random: np.random.Generator) -> CandidateBatch | None:
    """Synthesise and measure starts of a family; paths shorter than the stroke have deviation NaN.

    Parameters
    ----------
    count : int
        Number of linkages drawn; those that cannot close, or are out of proportion, are left out.
    """
    bend = curvatures(problem, count, random)
    linkage, good = Linkage.valid(drawn(problem, family, bend, random))
    bend = bend[good]
    some = likeliest(linkage, summit(bend), bend, int(MEASURED_SHARE * count))
    if not len(some):
        return None
    linkage, pole = linkage[some], np.full(len(some), complex(np.nan, np.nan))
    return measured(problem, Origin.made(linkage, "general"), linkage, summit(bend[some]), pole)


def drawn(problem: Problem, family: str, curvature: Floats, random: np.random.Generator) -> Floats:
    """Draw pivots (n, 2, 2, 3) in second-order contact with paths of curvatures (n,).

    NaN where no such pivots exist, or where links are out of proportion.
    """
    count = len(curvature)
    point = summit(curvature)
    second = PINNED[family]
    fixed = np.stack([fixed_pivots(problem, point, random) for _ in range(2)], axis=1)
    pole = point + 1j * random.standard_cauchy(count)
    away = fixed - pole[:, None]
    far = np.abs(away)
    ray = away / far
    if not second:
        ray[:, 1] = np.exp(1j * random.uniform(0, np.pi, count))
    reach = np.where(random.random(count) < 0.5, 1, -1) * np.exp(random.normal(np.log(MEDIAN_DISTANCE), 1.0, count))
    with np.errstate(all="ignore"):
        p = (point - pole).imag  # coordinate along the normal, +y
        centre = curvature / (1 + p * curvature)
        inflection_p = 1 / (1 / p - centre)
        inflection_1 = 1 / (1 / reach - 1 / far[:, 0])
        # W = (wx, wy): wy follows from the guided point, wx from the first dyad
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
        good = np.asarray((every > MIN_LINK).all(0) & (every < MAX_LINK).all(0))
    return np.where(good[:, None, None, None], pivots, np.nan)
