"""What a user asks for: a nominal with stroke and tolerance, constraints, an order of preference."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from operator import index
from typing import Any

import numpy as np

from ..errors import InvalidRequest
from .region import Region, zones

#: What candidates can be ranked by; each is made a number of order 1 of which less is better.  The balance is the size
#: over the stroke less the transmission angle over 90 degrees, the score that of `catalogue.query.ranking.score`.
CRITERIA = ("balance", "size", "deviation", "transmission", "max_link", "max_ground", "max_arm", "score")


#: How far from each other answers are as designs unless asked otherwise: refinement leads neighbours to one.
DISTINCT = 0.02
#: Bounds on lengths, and on what `catalogue.guide.practice` knows.
LENGTHS = ("max_size", "max_link", "min_link", "max_ground", "max_arm")
PRACTICE = ("min_drive_angle", "max_drive_angle", "max_rotation", "min_uniformity", "min_advantage")
#: Constraints that say where pivots stand, and what that gives.
GIVEN = {"fixed_pivots": "fixed", "moving_pivots": "moving", "crank": "crank"}
#: Largest chord over radius; a half circle has 2.
FULLEST = 1.98


def positive(name: str, value: Any) -> float:
    """Return `value` as a float.

    Raises
    ------
    InvalidRequest
        Unless it is a finite number above zero.
    """
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InvalidRequest(f"{name} must be a number, not {value!r}") from None
    if not math.isfinite(number) or number <= 0:
        raise InvalidRequest(f"{name} must be a finite number above zero, not {number:g}")
    return number


def whole(name: str, value: Any, least: int) -> int:
    """Return `value` as an int.

    Raises
    ------
    InvalidRequest
        Unless it is a whole number of at least `least`.
    """
    try:
        number = index(value)
    except TypeError:
        raise InvalidRequest(f"{name} must be a whole number, not {value!r}") from None
    if number < least:
        raise InvalidRequest(f"{name} must be at least {least}, not {number}")
    return number


@dataclass(frozen=True)
class StraightLine:
    """A point is to run along a straight line.

    Parameters
    ----------
    stroke : float
        Length of the path [any unit; every length of the answer is in the same].
    deviation : float
        Largest distance from the best line: half the width of the narrowest strip that holds the path.

    Raises
    ------
    InvalidRequest
        Unless both are finite and positive and the deviation is below a tenth of the stroke.
    """

    stroke: float
    deviation: float

    kind = "line"
    radius = math.inf

    def __post_init__(self) -> None:
        _check(self)

    @property
    def relative(self) -> float:
        """Deviation over stroke."""
        return self.deviation / self.stroke


@dataclass(frozen=True)
class CircularArc:
    """A point is to run along a circular arc that bulges to +y.

    Parameters
    ----------
    stroke : float
        Chord of the arc [any unit].
    radius : float or None
        Radius of the arc; None: whatever fits best.
    deviation : float
        Half the width of the narrowest annulus that holds the path.

    Raises
    ------
    InvalidRequest
        Unless all are finite and positive, the arc below a half circle, the deviation below a tenth of the stroke.
    """

    stroke: float
    radius: float | None
    deviation: float

    kind = "circle"

    def __post_init__(self) -> None:
        _check(self)
        if self.radius is not None and self.stroke > FULLEST * positive("radius", self.radius):
            raise InvalidRequest(
                f"an arc of chord {self.stroke:g} and radius {self.radius:g} is a half circle or impossible; "
                f"give a stroke below {FULLEST:g} radius"
            )

    @property
    def relative(self) -> float:
        """Deviation over stroke."""
        return self.deviation / self.stroke

    @property
    def sweep(self) -> float | None:
        """Chord over radius, if that is given."""
        return self.stroke / self.radius if self.radius is not None else None


Request = StraightLine | CircularArc


def _check(request: Request) -> None:
    positive("stroke", request.stroke)
    if positive("deviation", request.deviation) > 0.1 * request.stroke:
        raise InvalidRequest(f"a deviation of {request.deviation:g} over a stroke of {request.stroke:g} is no guidance")


@dataclass(frozen=True)
class Constraints:
    """What an answer must satisfy; lengths in the unit of the request.

    Attributes
    ----------
    families, series, configurations : sequence of str
        Allowed ones; all if empty.
    pins_only : bool
        No sliding joint.
    order : int
        Least order of contact at the design position of the ancestor.
    slots : bool
        Instead of points that the coupler carries along a path: straight or circular slots that it carries over a fixed
        point.  An answer shows the inverse motion, in which that point runs along the slot: its fixed pivots are the
        pivots of the coupler.
    returns : bool
        Instead: points that run along the path to one of its ends, where they rest, and back along it.
    fixed_pivots_in, pivots_in : (x0, y0, x1, y1) or sequence of points, optional
        Where the fixed pivots (all pivots, in mid-stroke, of returning points at rest) must stand, in the frame in
        which the path runs from (0, 0) to (stroke, 0).  A pivot at infinity stands nowhere.
    fixed_pivots, moving_pivots : two points (x, y), optional
        Exactly where both fixed pivots stand, or both moving ones in mid-stroke.
    crank : two points (x, y), optional
        Where the fixed and, in mid-stroke, the moving pivot of one crank stand.
    within : float
        How far off given pivots may stand.
    swept_in : region as above, optional
        Within which the whole linkage stays over the stroke; see `catalogue.guide.room`.
    keep_out : sequence of regions
        Into which no part of it may come over the stroke.
    max_size, max_link, min_link, max_ground, max_arm : float, optional
        See `catalogue.guide.measures.Measures`.
    min_transmission : float
        Least transmission angle over the stroke, the better crank driving [deg].
    full_rotation : bool
        A crank must be able to turn fully.
    min_drive_angle, max_drive_angle, max_rotation, min_uniformity, min_advantage : float, optional
        See `catalogue.guide.practice.Practice` [deg, deg, deg, 1, 1].
    play : float
        Standard deviation of every coordinate of every pivot, from play and manufacture [length].  It strays the path:
        what a deviation is ranked by is then `Candidate.expected`.
    """

    families: Sequence[str] = ()
    series: Sequence[str] = ()
    configurations: Sequence[str] = ()
    pins_only: bool = False
    order: int = 0
    slots: bool = False
    returns: bool = False
    fixed_pivots_in: Any = None
    pivots_in: Any = None
    fixed_pivots: Any = None
    moving_pivots: Any = None
    crank: Any = None
    within: float = 0.0
    swept_in: Any = None
    keep_out: Any = ()
    max_size: float | None = None
    max_link: float | None = None
    min_link: float | None = None
    max_ground: float | None = None
    max_arm: float | None = None
    min_transmission: float = 0.0
    full_rotation: bool = False
    min_drive_angle: float | None = None
    max_drive_angle: float | None = None
    max_rotation: float | None = None
    min_uniformity: float | None = None
    min_advantage: float | None = None
    play: float = 0.0

    def __post_init__(self) -> None:
        for name in ("families", "series", "configurations"):
            value = getattr(self, name)
            object.__setattr__(self, name, (value,) if isinstance(value, str) else tuple(value))
        for name in (*LENGTHS, *PRACTICE):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, positive(name, getattr(self, name)))
        object.__setattr__(self, "keep_out", zones("keep_out", self.keep_out))
        for name in ("fixed_pivots_in", "pivots_in", "swept_in"):
            value = getattr(self, name)
            if value is not None and not isinstance(value, Region):
                object.__setattr__(self, name, Region.of(name, value))
        object.__setattr__(self, "order", whole("order", self.order, 0))
        try:
            angle = float(self.min_transmission)
        except (TypeError, ValueError):
            angle = math.nan
        if not 0 <= angle < 90:
            raise InvalidRequest(f"min_transmission must be between 0 and 90 degrees, not {self.min_transmission}")
        object.__setattr__(self, "min_transmission", angle)
        given = [name for name in GIVEN if getattr(self, name) is not None]
        for name in given:
            object.__setattr__(self, name, _two_points(name, getattr(self, name)))
        if len(given) > 1:
            raise InvalidRequest(f"{given[0]} and {given[1]} exclude one another: give one of them")
        if self.play != 0:
            object.__setattr__(self, "play", positive("play", self.play))
        if self.within != 0:
            object.__setattr__(self, "within", positive("within", self.within))
            if not given:
                raise InvalidRequest(f"within says how far off given pivots may stand: give {', '.join(GIVEN)}")
        if given and (self.slots or self.returns):
            raise InvalidRequest(f"slots and returns cannot be asked for with {given[0]}")
        if self.slots and self.returns:
            raise InvalidRequest("slots and returns exclude one another: ask for one of them")
        if self.min_link is not None and self.max_link is not None and self.min_link > self.max_link:
            raise InvalidRequest(
                f"min_link {self.min_link:g} is above max_link {self.max_link:g}: nothing can be between"
            )

    @property
    def given(self) -> str | None:
        """Which pivots are given, as `catalogue.posed.Posed` has it."""
        return next((kind for name, kind in GIVEN.items() if getattr(self, name) is not None), None)

    @property
    def places(self) -> tuple[tuple[float, float], ...]:
        """Where the given pivots stand."""
        places: tuple[tuple[float, float], ...] = next(v for v in (getattr(self, n) for n in GIVEN) if v is not None)
        return places

    def active(self) -> list[str]:
        """Return the names of the constraints that are set."""
        return [f.name for f in fields(self) if getattr(self, f.name) not in ((), None, 0, 0.0, False)]


def _two_points(name: str, given: Any) -> tuple[tuple[float, float], ...]:
    """Return two points given as ((x, y), (x, y)) or (x, y, x, y)."""
    try:
        values = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise InvalidRequest(f"{name} must be two points, x and y of each") from None
    if values.shape not in ((2, 2), (4,)):
        raise InvalidRequest(f"{name} must be two points, x and y of each")
    if not np.isfinite(values).all():
        raise InvalidRequest(f"{name} has a coordinate that is not finite")
    (a, b), (c, d) = values.reshape(2, 2).tolist()
    if (a, b) == (c, d):
        raise InvalidRequest(f"{name} coincide at ({a:g}, {b:g}): give two places")
    return (a, b), (c, d)


def weights(rank_by: str | Mapping[str, float]) -> dict[str, float]:
    """Return criteria with weights from ``"size"``, ``"size=1,transmission=0.5"`` or a mapping.

    Raises
    ------
    InvalidRequest
        If a criterion is unknown or a weight is not positive.
    """
    if isinstance(rank_by, str):
        parts = [part.partition("=") for part in rank_by.split(",")]
        rank_by = {name.strip(): value if equal else 1.0 for name, equal, value in parts}  # type: ignore[misc]
    if not isinstance(rank_by, Mapping):
        raise InvalidRequest(f"cannot rank by {rank_by!r}; choose from {', '.join(CRITERIA)}")
    unknown = [name for name in rank_by if name not in CRITERIA]
    if unknown or not rank_by:
        raise InvalidRequest(
            f"cannot rank by {unknown[0] if unknown else 'nothing'}; choose from {', '.join(CRITERIA)}"
        )
    return {name: positive(f"the weight of {name}", weight) for name, weight in rank_by.items()}
