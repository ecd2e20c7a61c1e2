"""A surface or curve on a body, located in the design pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import InvalidLinkage
from ...kinematics.types import Array
from ..geometry.guides import Guides
from ..geometry.kinds import Kind
from ..geometry.rotation import matrix
from . import elements as e
from .hard_points import label, numbers

#: Largest distance of a point from its guide in the design pose [sizes of the mechanism].
MAX_GUIDE_DISTANCE = 1e-9


@dataclass(frozen=True)
class LocatedGuide:
    """A guide: shape in units, frame (3, 3), origin, and coordinates of its point in the design
    pose.
    """

    kind: Kind
    shape: Array
    frame: Array
    origin: Array
    start: tuple[float, ...]

    def shapes(self, n: int) -> Array:
        return np.repeat(self.shape[:, None], n, axis=1)


def located(x: e.OnGuide, centre: Array, unit: float) -> LocatedGuide:
    """Return a guide in units, about a centre (3,).

    Raises
    ------
    InvalidLinkage
        If its point is off it in the design pose, or it is one of a batch.
    """
    guides = Guides(x.guide, x.parameters, x.origin, x.quaternion)
    if len(guides) > 1 or len(numbers(x.at, label(x))) > 1:
        raise InvalidLinkage(f"{label(x)}: a guide and its point are the same for a whole batch: give one")
    kind, _, p = guides.each()[0]
    shape = kind.scaled(p, np.array([unit]))[:, 0] if len(p) else np.zeros(0)
    frame = matrix(guides.quaternion.T / np.abs(guides.quaternion).max())[:, :, 0]
    origin = (guides.origin[0] - centre) / unit
    local = frame.T @ ((numbers(x.at, label(x))[0] - centre) / unit - origin)
    value, slope = kind.gradients(local[:, None], shape[:, None])
    off = float(np.abs(value[:, 0] / np.sqrt((slope**2).sum(1))[:, 0]).max())
    if not off < MAX_GUIDE_DISTANCE * max(1.0, float(np.abs(local).max())):
        raise InvalidLinkage(f"{label(x)}: its point is {off * unit:.3g} off the {kind.name} in the design pose")
    u, w = (float(v[0]) for v in kind.locate(local[:, None], shape[:, None]))
    return LocatedGuide(kind, shape, frame, origin, (u,) if kind.conditions == 2 else (u, w))
