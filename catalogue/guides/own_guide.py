"""Guides from linkages that a user brings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InvalidLinkage, InvalidRequest
from ..given import text
from ..kinematics.linkage import Linkage
from ..problem.path import point as two_numbers
from ..units import common, unit_or_none
from .placed import PlacedGuide


@dataclass(frozen=True)
class OwnGuide(PlacedGuide):
    """A linkage of your own with its guided point; made by `catalogue.guide`.

    Examples
    --------
    >>> from catalogue import guide
    >>> watt = guide([[[-50, 30], [0, 30]], [[50, -30], [0, -30]]], (0, 0), unit="mm")
    >>> [round(value, 4) for value in watt.in_unit("in").guided]
    [0.0, 0.0]
    """

    pivots: list[list[list[float]]]
    guided: list[float]
    pole: list[float] | None = None
    name: str = ""
    unit: str | None = None
    __hash__ = PlacedGuide.__hash__

    def to_dict(self) -> dict[str, Any]:
        """Convert the linkage to plain numbers, lists and strings."""
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
    """Make a guide of your own linkage, to measure, move, improve, draw and export.

    Parameters
    ----------
    linkage : Linkage, array_like or mapping
        One linkage: pivots [[A1, A1*], [A2, A2*]], each (x, y) or (x, y, w) with w = 0 at infinity;
        or link lengths by name, see `catalogue.kinematics.from_lengths`, with the `angle` of the
        crank [deg] and the `branch`, or without for any position [length].
    point : (x, y), optional
        Guided point in this position [length].  Link lengths may give it by `along` and `across`
        instead: from crank 1's moving pivot, along and across the line to the other moving pivot.
    name : str
        Name of the guide, for tables and drawings.
    unit : str, optional
        Unit of all lengths: mm, cm, m, in or ft; link lengths may give it as ``unit``.

    Returns
    -------
    OwnGuide

    Raises
    ------
    InvalidLinkage, InvalidRequest
        If the linkage, the point or the unit is invalid.

    Examples
    --------
    >>> from catalogue import guide
    >>> watt = guide([[[-50, 30], [0, 30]], [[50, -30], [0, -30]]], (0, 0), unit="mm")
    >>> watt.lengths["crank 1"], watt.circuits[0].motion
    (50.0, 'swings')
    """
    from ..kinematics.from_lengths import guide_from_lengths

    name = text("name", name)
    if isinstance(linkage, Mapping) and "bars" in linkage:
        raise InvalidRequest("a mechanism of many bars is made by catalogue.mechanism")
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
