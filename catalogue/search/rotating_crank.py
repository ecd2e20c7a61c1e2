"""Synthesised starts with a crank that turns fully and their straightest coupler points.

Four-bars are drawn at random whose crank turns fully; over the stroke it turns as far as requested.
In a pose a coupler point z is at F + E z. With the unit vector u across the path the distance from
a line, Re(conj(u) (F + E z)) up to a constant, is linear in the four numbers conj(u) and conj(u) z,
and so is the position along the line. The ratio of scatter across to scatter along the line is
therefore a quotient of two quadratic forms, and the straightest point its least eigenvector.

Source: the draws and the quotient are ours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..candidates.batch import CandidateBatch, Origin, measured
from ..guidance.metrics import rotation_margin
from ..kinematics.linkage import Linkage
from ..kinematics.motion import CRANK_1, motion
from ..kinematics.types import Complexes, Floats
from ..problem.problem import Problem
from .draws import MAX_LINK, MIN_LINK


@dataclass(frozen=True)
class Draws:
    """Options of random four-bars whose crank turns fully."""

    longest: float = 16.0  #: largest length of a link [shortest links]
    each: int = 25  #: number of linkages drawn per linkage kept
    drag_links: float = 0.3  #: share of drag links, whose frame is the shortest link, so that both cranks turn
    positions: int = 17  #: number of positions of a crank at which a path is sampled
    #: range of the angle of a crank over the stroke, if none is requested [rad]
    turned: tuple[float, float] = (0.7, 2.8)
    dragged: tuple[float, float] = (0.2, 1.6)  #: the range for a drag link, whose cranks are longer [rad]


DRAWS = Draws()


def starts(problem: Problem, count: int, random: np.random.Generator) -> CandidateBatch | None:
    """Return measured four-bars whose crank turns fully, each with its straightest point.

    None unless the path is a straight line.  Slider-cranks are left out: their straightest point is
    the slider.

    Parameters
    ----------
    count : int
        Largest number of measured linkages: those within the permitted length of links come first,
        then those whose path scatters least.
    """
    if problem.curvature != 0:
        return None
    linkage = _rotating(DRAWS.each * count, random)
    wanted, n = problem.constraints, len(linkage)
    # length 1 up to rounding, unless the linkage is a drag link
    drags = np.abs(linkage.points[:, 0, 1] - linkage.points[:, 0, 0]) > 1 + 1e-9
    turned = np.where(drags, random.uniform(*DRAWS.dragged, n), random.uniform(*DRAWS.turned, n))
    if wanted.min_drive_angle is not None:
        turned = np.full(n, np.radians(wanted.min_drive_angle))
    share = np.cos(
        np.pi * np.arange(DRAWS.positions) / (DRAWS.positions - 1)
    )  # denser towards both ends, where paths curve away
    with np.errstate(all="ignore"):
        moving = motion(linkage, CRANK_1)
        d, x, _ = moving.pose(np.tan(0.25 * share[:, None] * turned))
        shift, turn = d - x * moving.origin, 1 + x  # z moves to shift + turn z
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
    most = min(wanted.longest or MAX_LINK, MAX_LINK)
    good = np.flatnonzero(
        (longest < MAX_LINK) & (arms.min(1) > MIN_LINK) & (np.abs(z[:, 0, 1] - z[:, 0, 0]) > MIN_LINK)
    )
    best = good[np.lexsort((scatter[good], longest[good] > most))][:count]
    if not len(best):
        return None
    linkage, nothing = linkage[best], np.full(len(best), complex(np.nan, np.nan))
    return measured(problem, Origin.made(linkage, "general"), linkage, point[best], nothing)


def straightest(shift: Complexes, turn: Complexes) -> tuple[Floats, Complexes]:
    """Return the points z of n planes with straightest paths shift + turn z.

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
    """Draw `count` four-bars, and return those whose crank 1 turns fully.

    Each is in a random position. The crank has length 1; in a drag link the frame has.
    """
    ground, coupler, other = np.exp(random.uniform(0, np.log(DRAWS.longest), (3, count)))
    length = np.ones(count)
    drags = random.random(count) < DRAWS.drag_links
    length[drags], ground[drags] = ground[drags], 1.0
    crank = length * np.exp(2j * np.pi * random.random(count))
    side = np.where(random.random(count) < 0.5, 1.0, -1.0)
    ray = ground - crank
    with np.errstate(all="ignore"):
        cosine = (coupler**2 + np.abs(ray) ** 2 - other**2) / (2 * coupler * np.abs(ray))
        moving = crank + coupler * ray / np.abs(ray) * np.exp(1j * side * np.arccos(cosine))
    z = np.stack([0 * crank, crank, ground, moving], axis=1)[np.isfinite(moving)].reshape(-1, 2, 2)
    linkage, _ = Linkage.valid(np.stack([z.real, z.imag, np.ones(z.shape)], axis=-1))
    return linkage[rotation_margin(linkage)[:, 0] > 0]
