"""Fit mechanisms of many bars into regions, as given or in a mirror.

Bars are segments between their joints; wheels stand for their joints.  A mirror at mid-path leaves
the guided path unchanged, as does a mirror in a straight path: a line permits four images, an arc
two.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..candidates.feasibility import WEIGHTS
from ..collections.spec import Places
from ..guidance.swept_area import intrusion, protrusion
from ..kinematics.types import Floats
from ..problem.constraints import REGIONS, Constraints
from ..problem.path import PathRequest


class Image(NamedTuple):
    """A mirror image of a mechanism: flips, and excess by region [length]."""

    reverse: bool
    over: bool
    excess: dict[str, float]


@dataclass(frozen=True)
class Regions:
    """Regions of a request in the frame of its path, in strokes, by mirror image."""

    stroke: float
    images: Mapping[tuple[bool, bool], Constraints]

    @classmethod
    def of(cls, request: PathRequest, given: Mapping[str, Any]) -> Regions | None:
        """Convert the regions of a request; None without any.

        Parameters
        ----------
        request : PathRequest
        given : mapping
            ``fixed_pivots_in``, ``pivots_in``, ``swept_in``, ``keep_out`` in the frame of the user.
        """
        wanted = Constraints.of({name: given[name] for name in (*REGIONS, "keep_out") if name in given})
        if not wanted.regions:
            return None
        scale = np.exp(-1j * np.radians(request.along)) / request.stroke
        here = wanted.carried(complex(scale), complex(-scale * complex(*request.start)))
        flips = [(False, False), (True, False), (False, True), (True, True)][: 2 if request.kind == "circle" else 4]
        return cls(request.stroke, {(reverse, over): here.mirrored(reverse, over) for reverse, over in flips})

    def outside(self, places: Places) -> Floats:
        """Return the violations of regions by n mechanisms, each in its best mirror image, (n,).

        It is negative inside. `places` are in strokes.
        """
        return np.asarray(np.min([outside(places, wanted) for wanted in self.images.values()], axis=0))

    def best_image(self, places: Places) -> Image:
        """Select the mirror image of least excess; ties go to the given one."""
        unit = Places(*(z[None] / self.stroke for z in (places.fixed, places.joints, places.bars)))
        best: Image | None = None
        for (reverse, over), wanted in self.images.items():
            found = {name: float(out[0]) for name, out in _excess(unit, wanted).items()}
            excess = {name: self.stroke * out if out > WEIGHTS.rounding else 0.0 for name, out in found.items()}
            image = Image(reverse, over, excess)
            if best is None or sum(image.excess.values()) < sum(best.excess.values()) - WEIGHTS.tie * self.stroke:
                best = image
        assert best is not None  # the given image is one of them
        return best


def outside(places: Places, wanted: Constraints) -> Floats:
    """Return the violations of regions by places of n mechanisms, (n,); negative inside."""
    return np.asarray(np.max([*_excess(places, wanted).values()], axis=0))


def _excess(places: Places, wanted: Constraints) -> dict[str, Floats]:
    """Compute the violations of regions by places, (n,) [strokes], negative inside permitted ones.

    It is negative where they do not.
    """
    middle = places.joints[:, places.joints.shape[1] // 2]
    pivots = np.concatenate([places.fixed, middle], axis=1)
    found = {
        name: region.outside(z).max(1)
        for name, z in (("fixed_pivots_in", places.fixed), ("pivots_in", pivots))
        if (region := getattr(wanted, name)) is not None
    }
    bars = np.moveaxis(places.bars, 0, 1)
    if wanted.swept_in is not None:
        found["swept_in"] = protrusion(wanted.swept_in, bars)
    if wanted.keep_out:
        found["keep_out"] = np.max([intrusion(zone, bars) for zone in wanted.keep_out], axis=0)
    return found
