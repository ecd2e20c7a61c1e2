"""Starts made to measure: linkages whose guided point touches the path asked to second order, pivots where they may be.

In mid-stroke the guided point P is on the path, with the tangent along +x and curvature k.  Its pole Q lies on the
normal; with Q, both fixed pivots and the place of one moving pivot chosen at random, Euler and Savary give the rest: a
point at the signed distance a from Q along the unit ray e, whose path has its centre at a*, obeys

    1 / a - 1 / a* = 1 / (e . W),

W being the vector from Q to the inflection pole.  P and the first dyad are two linear equations for W, the second
dyad's moving pivot follows.  A fixed pivot at infinity (slider) is 1 / a* = 0 on a ray across its line.

Where a crank is to turn fully, linkages are drawn whose crank does, each with the point of its coupler that runs
straightest while the crank turns as far as is asked.  In the pose a coupler point z is at F + E z; with the unit vector
u across the path the distance from a line, Re(conj(u) (F + E z)) up to a constant, is linear in the four numbers
conj(u) and conj(u) z, and so is the way along it: the scatter across over that along is a quotient of two quadratic
forms, the point its least eigenvector.

Source: Euler-Savary as in Allievi 1895, sec. 3; the draws and the quotient are ours.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..candidates.batch import CandidateBatch, Origin, measured
from ..guidance.metrics import rotation_margin
from ..kinematics.linkage import Linkage
from ..kinematics.motion import CRANK_1, motion
from ..kinematics.types import Complexes, Floats
from ..problem.problem import Problem
from ..problem.region import Region

#: Families that are made, with whether their second dyad is a crank, too.
PINNED = {"four-bar": True, "slider-crank": False}
#: Where fixed pivots are drawn if nothing is said: log-normally about this distance from mid-stroke [strokes].
DISTANCE, SPREAD = 1.0, 0.6
#: Longest and shortest link or arm of a start, in strokes.
LONGEST, SHORTEST = 12.0, 0.06
#: About which radius arcs of any radius are drawn, log-normally, and the least [strokes].
RADIUS, BENT, SHARPEST = 1.0, 0.7, 0.55
#: Longest link in cranks where a crank turns fully, how many are drawn for one that is kept, positions of it that
#: are looked at, and through which angle it turns if nothing is said [rad].
CRANKS, EACH, POSITIONS, TURNED = 16.0, 25, 17, (0.7, 2.8)


def allowed(problem: Problem, made: Mapping[str, bool] = PINNED) -> list[str]:
    """Return which of the families that can be made, with whether they have pins only, suit a problem."""
    wanted = problem.constraints
    if wanted.series or wanted.configurations or wanted.order or wanted.slots or wanted.returns:
        return []
    here = [name for name in made if not wanted.families or name in wanted.families]
    return [name for name in here if made[name] or not wanted.pins_only]


def starts(problem: Problem, family: str, count: int, random: np.random.Generator) -> CandidateBatch | None:
    """Return starts of a family, measured; those that do not reach over the stroke have deviation NaN.

    Parameters
    ----------
    count : int
        How many are drawn; linkages that cannot be, or have links out of all proportion, are left out.
    """
    bend = curvatures(problem, count, random)
    linkage, good = Linkage.valid(drawn(problem, family, bend, random))
    if not len(linkage):
        return None
    bend = bend[good]
    point = summit(bend)
    pole = np.full(len(linkage), complex(np.nan, np.nan))
    return measured(problem, Origin.made(linkage, "general"), linkage, point, pole, bend)


def driven(problem: Problem, count: int, random: np.random.Generator) -> CandidateBatch | None:
    """Return four-bars whose crank turns fully, with the point that runs straightest meanwhile, measured; None unless
    the path is a straight line.

    Slider-cranks are none of them: their straightest point is the slider.

    Parameters
    ----------
    count : int
        How many are measured at most: those whose links are as long as may be, or shorter, come first, then those
        whose path scatters least.
    """
    if problem.curvature != 0:
        return None
    linkage = _rotating(EACH * count, random)
    wanted, n = problem.constraints, len(linkage)
    turned = random.uniform(*TURNED, n) if wanted.min_drive_angle is None else np.radians(wanted.min_drive_angle)
    share = np.cos(np.pi * np.arange(POSITIONS) / (POSITIONS - 1))  # denser towards both ends, where paths bend away
    with np.errstate(all="ignore"):
        moving = motion(linkage, CRANK_1)
        d, x, _ = moving.pose(np.tan(0.25 * share[:, None] * turned))
        shift, turn = d - x * moving.origin, 1 + x  # z goes to shift + turn z
    closes = np.flatnonzero(np.isfinite(shift).all(0))
    linkage, shift, turn = linkage[closes], shift[:, closes], turn[:, closes]
    scatter, point = straightest(shift, turn)
    low, high = (shift[i] + turn[i] * point for i in (-1, 0))
    with np.errstate(all="ignore"):
        scale = 1 / (high - low)
    linkage, point = linkage.moved(scale, -scale * low), scale * (point - low)
    z = linkage.points
    links = [np.abs(z[:, 1, j] - z[:, 0, j]) for j in (0, 1)]
    arms = np.abs(z[:, :, 1] - point[:, None])
    longest = np.maximum(np.max(links, axis=0), arms.min(1))
    most = min(b for b in (wanted.max_size, wanted.max_link, wanted.max_ground, LONGEST) if b is not None)
    good = np.flatnonzero((longest < LONGEST) & (arms.min(1) > SHORTEST) & (np.abs(z[:, 0, 1] - z[:, 0, 0]) > SHORTEST))
    best = good[np.lexsort((scatter[good], longest[good] > most))][:count]
    if not len(best):
        return None
    linkage, nothing = linkage[best], np.full(len(best), complex(np.nan, np.nan))
    return measured(problem, Origin.made(linkage, "general"), linkage, point[best], nothing, np.zeros(len(best)))


def straightest(shift: Complexes, turn: Complexes) -> tuple[Floats, Complexes]:
    """Return the points z of n moving planes that run straightest through m poses z -> shift + turn z.

    Parameters
    ----------
    shift, turn : complex ndarray, shape (m, n)

    Returns
    -------
    scatter : ndarray, shape (n,)
        Root mean square distance across the best line over that along it.
    z : complex ndarray, shape (n,)
    """
    parts = [a - a.mean(0) for a in (shift, 1j * shift, turn, 1j * turn)]
    across, along = (np.stack([take(a) for a in parts], axis=-1) for take in (np.real, np.imag))
    numerator, denominator = (np.einsum("mni,mnj->nij", a, a) for a in (across, along))
    small = 1e-9 * np.trace(denominator, axis1=1, axis2=2)[:, None, None] * np.eye(4)
    half = np.linalg.inv(np.linalg.cholesky(denominator + small))
    value, vectors = np.linalg.eigh(half @ numerator @ half.swapaxes(1, 2))
    w = (half.swapaxes(1, 2) @ vectors[..., :1])[..., 0]
    return np.sqrt(np.maximum(value[:, 0], 0.0)), (w[:, 2] + 1j * w[:, 3]) / (w[:, 0] + 1j * w[:, 1])


def _rotating(count: int, random: np.random.Generator) -> Linkage:
    """Return those of `count` random four-bars whose crank 1, of length 1, turns fully, in a position on its turn."""
    ground, coupler, other = np.exp(random.uniform(0, np.log(CRANKS), (3, count)))
    crank = np.exp(2j * np.pi * random.random(count))
    side = np.where(random.random(count) < 0.5, 1.0, -1.0)
    ray = ground - crank
    with np.errstate(all="ignore"):
        cosine = (coupler**2 + np.abs(ray) ** 2 - other**2) / (2 * coupler * np.abs(ray))
        moving = crank + coupler * ray / np.abs(ray) * np.exp(1j * side * np.arccos(cosine))
    z = np.stack([0 * crank, crank, ground, moving], axis=1)[np.isfinite(moving)].reshape(-1, 2, 2)
    linkage, _ = Linkage.valid(np.stack([z.real, z.imag, np.ones(z.shape)], axis=-1))
    return linkage[rotation_margin(linkage)[:, 0] > 0]


def summit(curvature: Floats) -> Complexes:
    """Return where paths of curvatures (n,) [1/stroke] are in mid-stroke."""
    return np.asarray(0.5 - 0.25j * curvature / (1 + np.sqrt(1 - 0.25 * curvature**2)), complex)


def curvatures(problem: Problem, count: int, random: np.random.Generator) -> Floats:
    """Return the curvatures of the paths that starts are made for [1/stroke]: of an arc of any radius they differ."""
    if problem.curvature is not None:
        return np.full(count, float(problem.curvature))
    return np.asarray(-1 / np.clip(np.exp(random.normal(np.log(RADIUS), BENT, count)), SHARPEST, LONGEST))


def drawn(problem: Problem, family: str, curvature: Floats, random: np.random.Generator) -> Floats:
    """Return the pivots (n, 2, 2, 3) of linkages with contact of second order with paths of curvatures (n,); NaN where
    they cannot be, or have links out of all proportion."""
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
    reach = np.where(random.random(count) < 0.5, 1, -1) * np.exp(random.normal(np.log(DISTANCE), 1.0, count))
    with np.errstate(all="ignore"):
        p = (point - pole).imag  # along the normal, +y
        centre = curvature / (1 + p * curvature)
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
        good = np.asarray((every > SHORTEST).all(0) & (every < LONGEST).all(0))
    return np.where(good[:, None, None, None], pivots, np.nan)


def fixed_pivots(problem: Problem, point: Complexes, random: np.random.Generator) -> Complexes:
    """Return places for a fixed pivot of each: in the region where it must stand, else about the path, (n,)."""
    wanted, count = problem.constraints, len(point)
    region = region_of(problem)
    most = wanted.max_size or LONGEST
    away = np.minimum(np.exp(random.normal(np.log(DISTANCE), SPREAD, count)), 0.8 * most)
    about = point + away * np.exp(2j * np.pi * random.random(count))
    if region is None:
        return np.asarray(about)
    x0, y0, x1, y1 = np.clip(region.box, -LONGEST, LONGEST)
    return np.asarray(random.uniform(x0, x1, count) + 1j * random.uniform(y0, y1, count))


def region_of(problem: Problem) -> Region | None:
    """Return the region in which fixed pivots must stand, None if they may stand anywhere."""
    wanted = problem.constraints
    return next((r for r in (wanted.fixed_pivots_in, wanted.pivots_in, wanted.swept_in) if r is not None), None)
