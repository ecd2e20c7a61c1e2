"""A batch of linkages together with what is known of their instant, computed when first asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ..linkage import Array, Linkage
from .analysis import Curvature, curvature
from .regions import configuration


@dataclass(frozen=True, eq=False)
class Instant:
    """Linkages in their reference position: what a series is given to classify."""

    linkage: Linkage

    def __len__(self) -> int:
        return len(self.linkage)

    @cached_property
    def curvature(self) -> Curvature:
        """Pole, axes, cubics of stationary curvature, principal pairs."""
        return curvature(self.linkage)

    @cached_property
    def configuration(self) -> Array:
        """Configuration of each linkage, shape (n,)."""
        return configuration(self.linkage, self.curvature)

    @cached_property
    def inverted(self) -> Instant:
        """The instant of the inverse motion: fixed and moving plane exchanged."""
        return Instant(self.linkage.inverted())
