"""Named guides: the historical and textbook linkages of ``data/named_guides.json``."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from ..curvature_theory.analysis import Curvature, curvature
from ..curvature_theory.leading_error import leading_error
from ..errors import InvalidDesign, InvalidLinkage
from ..folders import folder
from ..guidance.coupler_curve import CouplerCurve, coupler_curve
from ..guidance.placement import at_stroke
from ..guidance.trace import Traced
from ..kinematics.linkage import Linkage

Pivots = tuple[tuple[tuple[float, float, float], ...], ...]


@dataclass(frozen=True)
class NamedGuide:
    """A named guide of the literature in its usual position, in mid-stroke.

    Attributes
    ----------
    name : str
        Name, which ``catalogue show`` accepts.
    pivots : nested tuple, shape (2, 2, 3)
        Dyad, (fixed, moving), (x, y, w) [the unit of the proportions].
    guided, centre : tuple of float
        Guided point; centre of the circle, if the nominal is one.
    nominal : str
        ``line`` or ``circle``.
    stroke : float
        Usual stroke, half of it to either side of the position.
    inflections : int
        Number of inflections of the path over that stroke, merged ones with their multiplicity; 0
        if it is exact, or for a circle.
    proportions, source, place : str
        Proportions in words; who described it, when and where; its place in the theory.

    Raises
    ------
    InvalidDesign
        If something is missing, the linkage is invalid or of another family, or the stroke cannot
        be traced.
    """

    name: str
    title: str
    family: str
    pivots: Pivots
    guided: tuple[float, float]
    nominal: str
    stroke: float
    inflections: int
    proportions: str
    source: str
    place: str
    centre: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        for text in ("name", "title", "proportions", "source", "place"):
            if not getattr(self, text).strip():
                raise InvalidDesign(f"design {self.name!r}: {text} is blank")
        if self.nominal not in ("line", "circle") or (self.nominal == "circle") != (self.centre is not None):
            raise InvalidDesign(f"design {self.name}: the nominal is a line, or a circle with a centre")
        if self.inflections < 0:
            raise InvalidDesign(f"design {self.name}: a path has no {self.inflections} inflections")
        try:
            family = str(self.linkage.family[0])
        except InvalidLinkage as error:
            raise InvalidDesign(f"design {self.name}: {error}") from None
        if family != self.family:
            raise InvalidDesign(f"design {self.name}: the pivots are those of a {family}, not a {self.family}")
        if not np.isfinite(self.curvature.pole).all():
            raise InvalidDesign(f"design {self.name}: {self.curvature.reason[0]}")
        if not np.isfinite(self.traced.fit.deviation[0]):
            raise InvalidDesign(f"design {self.name}: the stroke {self.stroke:g} cannot be traced")

    @property
    def linkage(self) -> Linkage:
        """The linkage, in its usual position."""
        return Linkage(self.pivots)

    @cached_property
    def order(self) -> int:
        """Order of contact of the path with its nominal in the usual position; 99 if exact."""
        return int(leading_error(self.linkage, np.array([complex(*self.guided)]), circle=self.circle).order[0])

    @property
    def circle(self) -> bool:
        """Whether the nominal is a circle."""
        return self.nominal == "circle"

    @cached_property
    def curvature(self) -> Curvature:
        """The instant in the usual position."""
        return curvature(self.linkage)

    @cached_property
    def guide(self) -> CouplerCurve:
        """The guide, ready to be traced."""
        return coupler_curve(self.linkage, np.array([complex(*self.guided)]))

    @cached_property
    def traced(self) -> Traced:
        """Measurements over the usual stroke, with the guided point as published."""
        return at_stroke(self.guide, self.stroke, circle=self.circle)

    @property
    def deviation(self) -> float:
        """Half the width of the narrowest strip (annulus) of the path over the usual stroke."""
        return float(self.traced.fit.deviation[0])

    @property
    def share(self) -> float:
        """Usual stroke over the length of the path between its turning points."""
        return float(0.5 * self.stroke / self.guide.extent.min())

    def canonical(self) -> tuple[Linkage, complex, complex, float]:
        """Return linkage, guided point, centre and half the usual stroke in the canonical frame.

        Pole at the origin, inflection pole at (0, 1); parallel cranks: cranks along x, crank 1 at
        the height 1.
        """
        at = self.curvature
        origin, along = (complex(*v) for v in (at.pole[0], at.axes[0, 0]))
        scale = along.conjugate() / at.rho0[0]
        if not np.isfinite(at.rho0[0]):
            scale = along.conjugate()
            height = ((self.linkage.points[0, 0, 1] - origin) * scale).imag
            scale /= height  # a negative height turns the linkage by a half turn
        shift = -scale * origin
        centre = complex(*self.centre) if self.centre else complex(np.nan, np.nan)
        point, centre = (scale * z + shift for z in (complex(*self.guided), centre))
        return self.linkage.moved(scale, shift), point, centre, 0.5 * abs(scale) * self.stroke


def named_guides() -> dict[str, NamedGuide]:
    """Return all named guides by name.

    Raises
    ------
    InvalidDesign
        If a guide is inconsistent, or two have the same name.
    """
    return {name: _made(name) for name in _entries()}


def named_guide(name: str | None) -> NamedGuide | None:
    """Return a named guide, or None for an unknown name; no other guide is traced."""
    return None if name is None or name not in _entries() else _made(name)


def is_named(name: str) -> bool:
    """Tell whether a named guide has this name, without tracing any."""
    return name in _entries()


@cache
def _made(name: str) -> NamedGuide:
    entry = _entries()[name]
    pivots = tuple(tuple(tuple(pivot) for pivot in dyad) for dyad in entry["pivots"])
    points = {key: tuple(entry[key]) for key in ("guided", "centre") if key in entry}
    return NamedGuide(**entry | {"pivots": pivots} | points)


@cache
def _entries() -> dict[str, dict[str, Any]]:
    """Return the data of the named guides by name."""
    found: dict[str, dict[str, Any]] = {}
    for entry in json.loads((folder("data") / "named_guides.json").read_text("utf-8")):
        if entry["name"] in found:
            raise InvalidDesign(f"two designs have the name {entry['name']}")
        found[entry["name"]] = entry
    return found
