"""Linkages of your own as guides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InvalidLinkage, InvalidRequest
from ..given import text
from ..kinematics.linkage import Linkage
from ..problem.request import point as two_numbers
from ..units import common, unit_or_none
from .placed import PlacedGuide


@dataclass(frozen=True)
class OwnGuide(PlacedGuide):
    """A linkage of your own with the point that is to be guided; made by `catalogue.guide`."""

    pivots: list[list[list[float]]]
    guided: list[float]
    pole: list[float] | None = None
    name: str = ""
    unit: str | None = None
    __hash__ = PlacedGuide.__hash__

    def to_dict(self) -> dict[str, Any]:
        """Return the linkage as plain Python numbers, lists and strings."""
        return {
            "family": str(self.linkage.family[0]),
            "name": self.name or None,
            "pivots": self.pivots,
            "guided": self.guided,
            "pole": self.pole,
            "lengths": dict(self.lengths),
            "unit": self.unit,
        }

    def __repr__(self) -> str:
        lengths = ", ".join(f"{name} {value:.6g}" for name, value in self.lengths.items())
        unit = f", lengths in {self.unit}" if self.unit else ""
        return f"<{self.name or 'OwnGuide'}: {self.linkage.family[0]}, {lengths}{unit}>"


def guide(linkage: Any, point: Any = None, *, name: str = "", unit: str | None = None) -> OwnGuide:
    """Return a linkage of your own as a guide that can be measured, moved and improved.

    Parameters
    ----------
    linkage : Linkage, array_like or mapping
        One linkage: its pivots, [[A1, A1*], [A2, A2*]], each (x, y) or (x, y, w); or its link lengths by name, see
        `catalogue.kinematics.from_lengths`, with the `angle` of the crank and the `branch`, or without if any position
        will do.
    point : (x, y)
        The coupler point, where it is in that position.  Of link lengths it may be given by `along` and `across`
        instead, from crank 1's moving pivot along and across the line to the other one; see
        `catalogue.kinematics.link_lengths`.
    unit : str, optional
        Of all lengths: mm, cm, m, in or ft.  Of link lengths it may stand among them, by ``unit``.

    Raises
    ------
    InvalidLinkage, InvalidRequest
        If they form no linkage, there is no point, or no such unit.
    """
    from ..kinematics.from_lengths import guide_from_lengths

    name = text("name", name)
    if isinstance(linkage, Mapping):
        linkage = dict(linkage)
        said = linkage.pop("unit", None)
        unit = common([one for one in (said, unit) if one is not None])
        one, at = guide_from_lengths(linkage)
    else:
        one = linkage if isinstance(linkage, Linkage) else Linkage(linkage)
        at = np.full(len(one), complex(np.nan, np.nan))
    if len(one) != 1:
        raise InvalidLinkage(f"one linkage is wanted, not {len(one)}: `catalogue.measure` takes many")
    if point is None and np.isnan(at[0]):
        raise InvalidRequest(
            "say which point is guided: point=(x, y) in that position, or `along` and `across` beside link lengths"
        )
    place = two_numbers("point", point) if point is not None else (float(at[0].real), float(at[0].imag))
    return OwnGuide(one.pivots[0].tolist(), [*place], None, name, unit_or_none(unit))
