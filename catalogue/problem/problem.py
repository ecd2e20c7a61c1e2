"""A problem: all that is asked, in strokes and in the frame of the path."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from .constraints import Constraints
from .criteria import ANSWERS
from .ranking import Ranking
from .request import CircularArc, Request, StraightLine, digits

#: Distance of regions from a mirror up to which they lie evenly about it [strokes].
EVEN = 1e-9
#: The tolerance inside which a search stays, of the one asked: what its grid leaves open.
SEARCH_TOLERANCE = 1 - 2e-4


@dataclass(frozen=True)
class Problem:
    """What is searched: the path runs from 0 to 1, every length is a multiple of the stroke.  Beyond a half circle,
    where the chord becomes short again, lengths are multiples of the diameter, and the path ends at `path.stroke`.

    The user's unit, place and direction enter here once, by `of`.  Search, refinement and selection know nothing of
    them, so that a problem that is scaled or moved has the same answers; what `catalogue.find` tells, answers, advice
    and errors, is in them again.
    """

    path: Request  # of stroke 1
    constraints: Constraints
    ranking: Ranking
    limit: int  # how many answers at most
    effort: int  # how hard they are searched for
    scale: complex  # z -> scale z + shift carries the path to where the user has it
    shift: complex
    #: Instead of the ranking: break this constraint, or ``deviation``, as little as the others allow; ``ranking``: none
    #: of them, whatever it costs.
    relaxed: str = ""
    #: Whether the path itself is the nominal, so that nothing is placed anew; so it is where pivots are given.
    in_place: bool = False

    @classmethod
    def of(
        cls, request: Request, constraints: Constraints, ranking: Ranking, limit: int = ANSWERS, effort: int = 1
    ) -> Problem:
        """Return the problem of a request in the user's unit."""
        scale, shift = request.extent * request.direction, request.origin
        path: Request = StraightLine(1.0, digits(request.relative))
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
        """In which mirrors the problem is searched, of the middle of the path and, of a line, of the line itself: those
        that bring its regions to the left and below, so that a problem and its mirror images have the same answers."""
        middle = (0.5 * self.path.stroke, 0.0)
        corners = np.array([region.corners.mean(0) - middle for region in self.constraints.regions]).reshape(-1, 2)
        right, above = corners.sum(0) > EVEN
        return bool(right), bool(above and not self.curved)

    def mirrored(self, reverse: bool, over: bool) -> Problem:
        """Return the problem with its regions mirrored in the middle of the path and in its line."""
        return replace(self, constraints=self.constraints.mirrored(reverse, over, self.path.stroke))

    def with_constraints(self, **changes: Any) -> Problem:
        """Return the problem with some constraints changed [strokes]."""
        return replace(self, constraints=replace(self.constraints, **changes))

    def tightened(self) -> Problem:
        """Return the problem as it is searched, inside the tolerance that is asked for."""
        return replace(self, path=replace(self.path, deviation=self.deviation * SEARCH_TOLERANCE))

    @property
    def deviation(self) -> float:
        """Largest deviation allowed."""
        return self.path.deviation

    @property
    def curved(self) -> bool:
        """Whether the nominal is an arc."""
        return self.path.kind == "circle"

    @cached_property
    def curvature(self) -> float | None:
        """Of the nominal, negative for a centre below the path; 0: a straight line, None: whatever fits best."""
        radius = self.path.radius
        return None if radius is None else -1 / radius + 0.0

    @property
    def is_wide(self) -> bool:
        """Whether the nominal is an arc that is measured by its angle."""
        return self.path.is_wide

    @property
    def fixed_curvature(self) -> float | None:
        """Curvature of an arc whose radius is given; None for a straight line and for an arc of any radius."""
        return self.curvature if self.curved else None

    @property
    def needs_allowance(self) -> bool:
        """Whether answers are bounded or ranked by the allowance."""
        return bool(self.constraints.min_allowance) or "allowance" in self.ranking.quantities

    @property
    def zone(self) -> tuple[bool, int]:
        """Whether it is a circle that holds the path, and how many coordinates of the nominal are sought: none in its
        place, two of a line or an arc of given radius, else three."""
        return self.curved, 0 if self.in_place else 3 if self.curvature is None else 2

    @property
    def stroke(self) -> float:
        """What 1 is in the user's unit: the stroke, beyond a half circle the diameter."""
        return abs(self.scale)
