"""Guided elements of any linkage in its reference position, with their order of contact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..kinematics.types import Floats, Integers, Mask
from .analysis import DEAD_POINT
from .circling_points import circling_points
from .dead_points import dead_points
from .instant import Instant
from .leading_error import leading_error_of_pairs

if TYPE_CHECKING:
    import pandas as pd


class Coincidence(NamedTuple):
    """Distances up to which two guided elements coincide."""

    near: float = 1e-9  #: largest distance of their points [sizes of the linkage]
    #: Largest distance of coincident principal pairs, and largest coefficient that counts as zero
    #: for them: a double root has half of the digits.
    double: float = 1e-6


COINCIDENCE = Coincidence()


@dataclass(frozen=True)
class GuidedElements:
    """Guided elements of n linkages.

    Attributes
    ----------
    labels : list of str, length k
    pairs : ndarray, shape (n, k, 2, 3)
        Fixed and moving point, homogeneous.  A fixed point at infinity: a point on a straight line;
        a moving one: a straight slot over a fixed point.  NaN where a linkage has no such element.
    order : ndarray of int, shape (n, k)
        Order of contact on the finite motion; 99: exact; 0: no such element.
    """

    labels: list[str]
    pairs: Floats
    order: Integers

    def to_pandas(self) -> pd.DataFrame:
        """Return one row per element that exists: linkage, label, both points, order."""
        import pandas as pd

        which, label = np.nonzero(self.order > 0)
        frame = pd.DataFrame({"linkage": which, "label": [self.labels[k] for k in label]})
        for i, name in enumerate(("fixed", "moving")):
            for j, axis in enumerate("xyw"):
                frame[f"{name}_{axis}"] = self.pairs[which, label, i, j]
        frame["order"] = self.order[which, label]
        return frame


def guided_elements(instant: Instant, radius: float | None = None) -> GuidedElements:
    """Find undulation point, cuspidation slot, principal pairs and points on circles of a radius.

    Elements guided by the linkage's own dyads are left out; of two coincident principal pairs one
    is given.  At a dead point the elements of both branches of the motion are given, with labels of
    their own for the second, unless the instant states the branch.

    Parameters
    ----------
    instant : Instant of n
    radius : float, optional
        Radius of circles with four positions in common with a path [length].

    Raises
    ------
    InvalidRequest
        If the radius is not a finite number above zero.

    Source: Allievi 1895, secs. 6-8.
    """
    dead = instant.curvature.state == DEAD_POINT
    if instant.pole is not None or not dead.any():
        return _elements_of_branch(instant, radius)
    both = dead_points(instant.linkage).pole.reshape(-1, 2, 2)
    here = instant.curvature.pole
    poles = [np.where(dead[:, None], both[:, i], here) for i in (0, 1)]
    first, second = (_elements_of_branch(Instant(instant.linkage, p[:, 0] + 1j * p[:, 1]), radius) for p in poles)
    only = dead[:, None]  # at other positions the motion has one branch
    return GuidedElements(
        first.labels + [f"{label}, branch 2" for label in second.labels],
        np.concatenate([first.pairs, np.where(only[..., None, None], second.pairs, np.nan)], axis=1),
        np.concatenate([first.order, np.where(only, second.order, 0)], axis=1),
    )


def _elements_of_branch(instant: Instant, radius: float | None) -> GuidedElements:
    """Find the elements on one branch of each motion."""
    at = instant.curvature
    found = {
        "undulation": _is_straight(at.undulation, at.pole),
        "cuspidation": _is_straight(at.cuspidation, at.pole)[:, ::-1],
        "[3]": at.principal_pairs[:, 0],
        "[4]": at.principal_pairs[:, 1],
    }
    if radius is not None:
        circling = circling_points(at, radius)
        found |= {f"radius {radius:g}, {j + 1}": circling[:, j] for j in range(circling.shape[1])}
    pairs = np.stack(list(found.values()), axis=1)
    pole = instant.pole
    orders = [
        leading_error_of_pairs(instant.linkage, p, pole=pole, tolerance=COINCIDENCE.double).order
        for p in found.values()
    ]
    pivots, size = instant.linkage.pivots, instant.linkage.size[:, None]
    driving = [_is_equal(pairs, pivots[:, None, i], COINCIDENCE.near * size[..., None]) for i in (0, 1)]
    there = np.isfinite(pairs).all(axis=(2, 3)) & ~(driving[0] | driving[1])
    there[:, 3] &= ~_is_equal(pairs[:, 3], pairs[:, 2], COINCIDENCE.double * size)
    return GuidedElements(
        list(found), np.where(there[..., None, None], pairs, np.nan), np.where(there, np.stack(orders, 1), 0)
    )


def _is_straight(point: Floats, pole: Floats) -> Floats:
    """Pair a point with the normal of its straight path, shape (n, 2, 3)."""
    normal = point - pole
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        fixed = np.concatenate([normal / length, 0 * length], axis=-1)
    return np.stack([fixed, np.concatenate([point, np.ones_like(length)], axis=-1)], axis=1)


def _is_equal(one: Floats, two: Floats, near: Floats) -> Mask:
    """Tell where two pairs (..., 2, 3) coincide.

    Finite points coincide within `near` [length], points at infinity if their directions do.
    """
    z, w = ((p[..., 0] + 1j * p[..., 1]) for p in (one, two))
    infinite = [p[..., 2] == 0 for p in (one, two)]
    directions = infinite[0] & infinite[1] & (np.abs((z.conj() * w).imag) < COINCIDENCE.near)
    with np.errstate(invalid="ignore"):
        points = ~infinite[0] & ~infinite[1] & (np.abs(z - w) <= near)
    return np.asarray((directions | points).all(-1))
