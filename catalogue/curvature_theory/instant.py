"""A batch of linkages with their instants, computed on first use."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..kinematics.batch import mapped
from ..kinematics.linkage import Linkage
from ..kinematics.types import Complexes, Floats, Texts, read_only
from .analysis import Curvature, curvature
from .configuration import configuration
from .dead_points import both_branches


@dataclass(frozen=True, eq=False)
class Instant:
    """Linkages in their reference position, as a series classifies them; read-only.

    Attributes
    ----------
    linkage : Linkage of n
    pole : complex ndarray, shape (n,), optional
        Selects the branch of linkages at a dead point; without it their curvature is NaN.
    """

    linkage: Linkage
    pole: Complexes | None = None

    def __post_init__(self) -> None:
        if self.pole is not None:
            object.__setattr__(self, "pole", read_only(self.pole))

    def __len__(self) -> int:
        return len(self.linkage)

    @cached_property
    def curvature(self) -> Curvature:
        """Pole, axes, cubics of stationary curvature, principal pairs."""
        found = curvature(self.linkage)
        found = found if self.pole is None else both_branches(found, self.linkage, self.pole)
        frozen: Curvature = mapped(read_only, found)
        return frozen

    @cached_property
    def configuration(self) -> Texts:
        """Configuration of each linkage, shape (n,)."""
        return read_only(configuration(self.linkage, self.curvature))

    @cached_property
    def along_axes(self) -> tuple[Floats, Floats]:
        """Absolute cosines of the rays with the pole tangent and the pole normal, (n, 2) each."""
        axes = self.curvature.axes[..., 0] + 1j * self.curvature.axes[..., 1]
        x, y = (read_only(np.abs((self.linkage.rays * axes[:, i, None].conj()).real)) for i in (0, 1))
        return x, y

    @cached_property
    def inverted(self) -> Instant:
        """The instant of the inverse motion: fixed and moving plane exchanged."""
        return Instant(self.linkage.inverted(), self.pole)
