"""The design problem in the frame of the path, normalised to the stroke."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from .constraints import Constraints
from .criteria import ANSWERS
from .path import CircularArc, PathRequest, StraightLine, digits
from .ranking import Ranking

#: Asymmetry of regions below which they count as symmetric [strokes]: above rounding to 12
#: decimals.
EVEN = 1e-9
#: Tolerance of the search over the requested one: its grid of stations underestimates a deviation
#: by less than this margin.
SEARCH_TOLERANCE = 1 - 2e-4


@dataclass(frozen=True)
class Problem:
    """A design problem: the path runs from 0 to 1, lengths are in strokes.

    Beyond a half circle, where the chord becomes short again, lengths are in diameters, and the
    path ends at `path.stroke`.  The user's unit, position and direction enter once, in `of`.
    Search, refinement and selection do not depend on them, so a scaled or moved request has the
    same answers.
    """

    path: PathRequest  # of stroke 1
    constraints: Constraints
    ranking: Ranking
    limit: int  # maximum number of answers
    effort: int  # multiple of the usual search time
    scale: complex  # z -> scale z + shift maps the path to the user's frame
    shift: complex
    #: Objective in place of the ranking: minimise the violation of this constraint, or of
    #: ``deviation``, subject to the others; ``ranking``: only satisfy all constraints.
    relaxed: str = ""
    #: Whether the requested path itself is the nominal, instead of the best-fitting one: with
    #: prescribed pivots.
    in_place: bool = False

    @classmethod
    def of(
        cls, request: PathRequest, constraints: Constraints, ranking: Ranking, limit: int = ANSWERS, effort: int = 1
    ) -> Problem:
        """Normalise a request in the user's unit."""
        scale, shift = request.extent * request.direction, request.origin
        path: PathRequest = StraightLine(1.0, digits(request.relative))
        if isinstance(request, CircularArc):
            radius = None if request.radius is None else digits(request.radius / request.stroke)
            path = CircularArc(1.0, digits(request.relative), radius)
            if request.is_wide and request.angle and request.radius:  # the chord, which its angle tells better, follows
                radius, angle = digits(request.radius / request.extent), digits(request.angle)
                path = CircularArc(deviation=digits(request.relative), radius=radius, angle=angle)
        if constraints.returns:
            ranking = ranking.without("allowance")
        carried, fixed = constraints.carried(1 / scale, -shift / scale), constraints.given is not None
        return cls(path, carried, ranking, limit, effort, scale, shift, in_place=fixed)

    @property
    def mirrors(self) -> tuple[bool, bool]:
        """Mirrors of the problem to search: at mid-path and, for a line, in the line.

        They bring the regions to the left and below, so mirror images of a problem have the same
        answers.
        """
        middle = (0.5 * self.path.stroke, 0.0)
        corners = np.array([region.corners.mean(0) - middle for region in self.constraints.regions]).reshape(-1, 2)
        right, above = corners.sum(0) > EVEN
        return bool(right), bool(above and not self.curved)

    def mirrored(self, reverse: bool, over: bool) -> Problem:
        """Mirror the regions of the problem at mid-path and in the line of the path."""
        return replace(self, constraints=self.constraints.mirrored(reverse, over, self.path.stroke))

    def with_constraints(self, **changes: Any) -> Problem:
        """Replace some constraints [strokes]."""
        return replace(self, constraints=replace(self.constraints, **changes))

    def tightened(self) -> Problem:
        """Return the problem with the tolerance of the search, slightly below the requested one."""
        return replace(self, path=replace(self.path, deviation=self.deviation * SEARCH_TOLERANCE))

    @property
    def deviation(self) -> float:
        """Largest permitted deviation [strokes]."""
        return self.path.deviation

    @property
    def curved(self) -> bool:
        """Whether the nominal is an arc."""
        return self.path.kind == "circle"

    @cached_property
    def curvature(self) -> float | None:
        """Curvature of the nominal, negative for a centre below it.

        0 of a line, None of any radius.
        """
        radius = self.path.radius
        return None if radius is None else -1 / radius + 0.0

    @property
    def is_wide(self) -> bool:
        """Whether the nominal is an arc measured by its angle."""
        return self.path.is_wide

    @property
    def fixed_curvature(self) -> float | None:
        """Curvature of an arc of given radius; None for a line and for an arc of any radius."""
        return self.curvature if self.curved else None

    @property
    def needs_allowance(self) -> bool:
        """Whether a constraint or the ranking involves the allowance."""
        return bool(self.constraints.min_allowance) or "allowance" in self.ranking.quantities

    @property
    def zone(self) -> tuple[bool, int]:
        """Type of the zone: whether it is circular, and the number of its fitted coordinates.

        None for a prescribed nominal, two for a line or an arc of given radius, else three.
        """
        return self.curved, 0 if self.in_place else 3 if self.curvature is None else 2

    @property
    def stroke(self) -> float:
        """Unit of the problem in the user's unit: the stroke, beyond a half circle the diameter."""
        return abs(self.scale)
