"""Requested paths: a line or an arc with stroke and tolerance."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from ..errors import InvalidRequest, quoted
from ..given import number, positive
from ..units import unit_or_none

#: Largest chord over radius of an arc measured along its chord: near a half circle the ends of the
#: arc run across the chord, and the angle is the better measure.
FULLEST = 1.98
#: Angle of an arc whose chord over radius is `FULLEST` [deg].
WIDE = math.degrees(2 * math.asin(0.5 * FULLEST)) * (1 + 1e-12)


class PathLimits(NamedTuple):
    """Limits of a requested arc."""

    max_angle: float = 350.0  #: largest angle [deg]: its chord is then a sixth of the radius
    #: Relative contradiction permitted between stroke, radius and angle: rounding by units and
    #: files.
    contradiction: float = 1e-6


PATH_LIMITS = PathLimits()


def digits(value: float) -> float:
    """Round a ratio to 12 digits: the last digits depend on the user's unit."""
    return float(f"{value:.12g}")


def places(name: str, given: object) -> dict[str, tuple[float, float]]:
    """Parse points (x, y) by name; None means none."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise InvalidRequest(f"{name} must be a mapping of names to points (x, y), not {quoted(given)}")
    return {str(one): point(f"{name} {one}", at) for one, at in given.items()}


class _Directed:
    """Start and direction of a path."""

    start: tuple[float, float]
    along: float

    @property
    def origin(self) -> complex:
        """Start of the path as a complex number."""
        return complex(*self.start)

    @property
    def direction(self) -> complex:
        """Unit vector from start to end, exact for right angles."""
        quarters, rest = divmod(self.along, 90.0)
        return cmath.exp(1j * math.radians(self.along)) if rest else (1 + 0j, 1j, -1 + 0j, -1j)[int(quarters) % 4]


@dataclass(frozen=True)
class PathFrame(_Directed):
    """The frame of a path: its start, and the direction to its end [deg]."""

    start: tuple[float, float]
    along: float


class _Placed(_Directed):
    """Size and position of a requested path."""

    kind: ClassVar[str]
    stroke: float
    deviation: float
    unit: str | None

    def __post_init__(self) -> None:
        unit_or_none(self.unit)
        read = {name: positive(name, getattr(self, name)) for name in ("stroke", "deviation")}
        along = number("along", self.along, "a number of degrees")
        for name, value in {**read, "start": point("start", self.start), "along": along}.items():
            object.__setattr__(self, name, value)
        if not math.isfinite(along):
            raise InvalidRequest(f"along must be a finite number of degrees, not {along:g}")
        if self.deviation > 0.1 * self.extent:
            like_a_radius = self.kind == "circle" and FULLEST * self.deviation >= self.stroke
            raise InvalidRequest(
                f"a deviation of {self.deviation:g} over a stroke of {self.stroke:g} is no guidance"
                + ": of an arc give stroke, deviation, radius in this order" * like_a_radius
            )

    @property
    def extent(self) -> float:
        """Largest distance between two points of the path."""
        return self.stroke

    @property
    def relative(self) -> float:
        """Deviation over extent."""
        return self.deviation / self.extent


def ends(start: object, end: object) -> dict[str, Any]:
    """Return stroke, start and direction of a path between two different points."""
    here, there = point("from", start), point("to", end)
    way = complex(*there) - complex(*here)
    if not way:
        raise InvalidRequest(f"the path starts and ends in ({here[0]:g}, {here[1]:g}): give two places")
    try:
        stroke = abs(way)
    except OverflowError:
        stroke = math.inf
    return {"stroke": stroke, "start": here, "along": math.degrees(math.atan2(way.imag, way.real))}


def point(name: str, value: Any) -> tuple[float, float]:
    """Parse two finite coordinates."""
    try:
        x, y = value
    except (TypeError, ValueError):
        raise InvalidRequest(f"{name} must be two numbers, x and y, not {quoted(value)}") from None
    x, y = (number(f"a coordinate of {name}", part) for part in (x, y))
    if not (math.isfinite(x) and math.isfinite(y)):
        raise InvalidRequest(f"{name} has a coordinate that is not finite")
    return x, y


@dataclass(frozen=True)
class StraightLine(_Placed):
    """Request to guide a point along a straight line.

    Parameters
    ----------
    stroke : float
        Length of the path [length].
    deviation : float
        Tolerance: largest deviation from the best-fitting line, half the width of the narrowest
        strip that contains the path [length].
    start : (x, y)
        Start of the path; regions, pivots and answers are in this frame [length].
    along : float
        Direction from start to end [deg].
    unit : str, optional
        Unit of all lengths of request, constraints and answers: mm, cm, m, in or ft.

    Raises
    ------
    InvalidRequest
        If a length is not finite and positive, the deviation is a tenth of the stroke or more, or
        the unit is unknown.

    Examples
    --------
    >>> from catalogue import StraightLine
    >>> line = StraightLine(stroke=150, deviation=0.05, unit="mm")
    >>> upward = StraightLine.between((20, 15), (20, 165), deviation=0.05)
    >>> upward.stroke, upward.along
    (150.0, 90.0)
    """

    stroke: float
    deviation: float
    start: tuple[float, float] = (0.0, 0.0)
    along: float = 0.0
    unit: str | None = None

    kind = "line"
    radius = math.inf
    angle = 0.0
    is_wide = False
    sweep: ClassVar[float | None] = None  #: chord over radius; None for a line

    @classmethod
    def between(
        cls, start: Sequence[float], end: Sequence[float], deviation: float, *, unit: str | None = None
    ) -> StraightLine:
        """Request a straight path from one point to another.

        Parameters
        ----------
        start, end : (x, y)
            Ends of the path [length].
        deviation : float
            Tolerance [length].
        unit : str, optional
            Unit of all lengths.
        """
        return cls(deviation=deviation, unit=unit, **ends(start, end))


def angle_over(stroke: float, radius: float) -> float:
    """Compute the angle of an arc from chord and radius, at most a half circle [deg]."""
    return math.degrees(2 * math.asin(min(0.5 * stroke / radius, 1.0)))


def is_wide(angle: float | None) -> bool:
    """Tell whether an arc of this angle is near a half circle or beyond [deg]."""
    return angle is not None and angle > WIDE


def chord_of(radius: float, angle: float) -> float:
    """Return the chord of an arc from radius and angle [deg]."""
    return 2 * radius * math.sin(math.radians(0.5 * angle))


@dataclass(frozen=True)
class CircularArc(_Placed):
    """Request to guide a point along a circular arc on the left of its chord.

    Give two of stroke, radius and angle, or three that agree.  An arc given by its stroke alone may
    have any radius, and is less than a half circle.

    Parameters
    ----------
    stroke : float, optional
        Chord of the arc [length].
    deviation : float
        Tolerance [length].  With a radius: largest distance from the best-fitting arc of this
        radius; without: half the width of the narrowest annulus that contains the path.
    radius : float, optional
        Radius of the arc; any if not given [length].
    start : (x, y)
        Start of the path; regions, pivots and answers are in this frame [length].
    along : float
        Direction of the chord from start to end [deg].
    unit : str, optional
        Unit of all lengths of request, constraints and answers: mm, cm, m, in or ft.
    angle : float, optional
        Angle of the arc, above 0 and up to 350 [deg]; without it the arc is at most a half circle.

    Raises
    ------
    InvalidRequest
        If a number is not finite and positive, they contradict one another, or the deviation is a
        tenth of the stroke or more.

    Examples
    --------
    >>> from catalogue import CircularArc
    >>> round(CircularArc(deviation=0.1, radius=50, angle=270).stroke, 3)
    70.711
    >>> round(CircularArc(stroke=50, deviation=0.1, radius=50).angle, 9)
    60.0
    """

    stroke: float = None  # type: ignore[assignment]  # computed from radius and angle
    deviation: float = None  # type: ignore[assignment]  # required: None is refused
    radius: float | None = None
    start: tuple[float, float] = (0.0, 0.0)
    along: float = 0.0
    unit: str | None = None
    angle: float | None = None

    kind = "circle"

    def __post_init__(self) -> None:
        if self.angle is None:
            super().__post_init__()
        stroke, radius, angle = consistent_arc(self.stroke, self.radius, self.angle)
        for name, value in (("stroke", stroke), ("radius", radius), ("angle", angle)):
            object.__setattr__(self, name, value)
        super().__post_init__()

    @classmethod
    def between(
        cls,
        start: Sequence[float],
        end: Sequence[float],
        deviation: float,
        radius: float | None = None,
        *,
        unit: str | None = None,
        angle: float | None = None,
    ) -> CircularArc:
        """Request an arc from one point to another.

        Parameters
        ----------
        start, end : (x, y)
            Ends of the arc [length].
        deviation : float
            Tolerance [length].
        radius : float, optional
            Radius; any if not given [length].
        unit : str, optional
            Unit of all lengths.
        angle : float, optional
            Angle of the arc [deg].
        """
        return cls(deviation=deviation, radius=radius, unit=unit, angle=angle, **ends(start, end))

    @property
    def extent(self) -> float:
        """Largest distance between two points: the chord; beyond a half circle the diameter."""
        return 2 * self.radius if self.radius is not None and (self.angle or 0.0) > 180 else self.stroke

    @property
    def is_wide(self) -> bool:
        """Whether the arc is near a half circle or beyond, and so measured by its angle."""
        return is_wide(self.angle)

    @property
    def sweep(self) -> float | None:
        """Chord over radius; None for any radius."""
        return self.stroke / self.radius if self.radius is not None else None


def consistent_arc(
    stroke: object, radius: object, angle: object, name: str = "stroke"
) -> tuple[float, float | None, float | None]:
    """Complete chord, radius and angle [deg] of an arc from two of them.

    For an arc of any radius the chord suffices.

    Raises
    ------
    InvalidRequest
        If too little is given, a value is impossible, or values contradict one another.
    """
    if angle is not None:
        angle = positive("angle", angle)
        if angle > PATH_LIMITS.max_angle:
            raise InvalidRequest(
                f"an arc of {angle:g}\u00b0 nearly closes: its angle must be {PATH_LIMITS.max_angle:g}\u00b0 or less"
            )
    if radius is not None:
        radius = positive("radius", radius)
    if stroke is None:
        if radius is None or angle is None:
            raise InvalidRequest(f"an arc needs its {name}, or radius and angle: give two of {name}, radius and angle")
        return chord_of(radius, angle), radius, angle
    stroke = positive(name, stroke)
    if radius is None:
        if angle is None:
            return stroke, None, None
        return stroke, 0.5 * stroke / math.sin(math.radians(0.5 * angle)), angle
    if angle is None:
        if stroke > 2 * radius * (1 + 1e-12):
            raise InvalidRequest(
                f"an arc of chord {stroke:g} and radius {radius:g} is impossible: the chord is at most {2 * radius:g}"
            )
        return stroke, radius, angle_over(stroke, radius)
    chord = chord_of(radius, angle)
    if abs(stroke - chord) > PATH_LIMITS.contradiction * max(stroke, chord):
        raise InvalidRequest(
            f"{name} {stroke:g}, radius {radius:g} and angle {angle:g}\u00b0 contradict one another: an arc of "
            f"{angle:g}\u00b0 and radius {radius:g} has a chord of {chord:.6g}; leave one of the three out"
        )
    return stroke, radius, angle


PathRequest = StraightLine | CircularArc


def path_request(name: str, given: object) -> PathRequest:
    """Return a request; refuse anything else, with the called function `name` in the message."""
    if not isinstance(given, PathRequest):
        raise InvalidRequest(f"{name} wants a StraightLine or CircularArc, not {quoted(given)}")
    return given
