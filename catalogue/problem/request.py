"""The path that a user asks for: a nominal with stroke and tolerance."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from ..errors import InvalidRequest, quoted
from ..given import number, positive
from ..units import unit_or_none

#: Largest chord over radius of an arc that is measured over its chord: there its ends still run along that.
FULLEST = 1.98
#: Its angle [deg].
WIDE = math.degrees(2 * math.asin(0.5 * FULLEST)) * (1 + 1e-12)
#: Largest angle of an arc [deg]: its chord, to which lengths are related, is then a sixth of the radius.
MAX_ANGLE = 350.0
#: Part by which stroke, radius and angle may contradict one another: what units and files leave in the last digits.
CONTRADICTION = 1e-6


def digits(value: float) -> float:
    """Return a ratio to 12 digits: what the user's unit leaves in the last ones is no part of what is asked."""
    return float(f"{value:.12g}")


def places(name: str, given: Any) -> dict[str, tuple[float, float]]:
    """Return points (x, y) by name; `InvalidRequest` for anything else, None is none."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise InvalidRequest(f"{name} must be a mapping of names to points (x, y), not {quoted(given)}")
    return {str(one): point(f"{name} {one}", at) for one, at in given.items()}


class _Directed:
    """Where a path starts, and which way it runs."""

    start: tuple[float, float]
    along: float

    @property
    def origin(self) -> complex:
        """Where the path starts."""
        return complex(*self.start)

    @property
    def direction(self) -> complex:
        """Unit vector from the start to the end; exact for right angles."""
        quarters, rest = divmod(self.along, 90.0)
        return cmath.exp(1j * math.radians(self.along)) if rest else (1 + 0j, 1j, -1 + 0j, -1j)[int(quarters) % 4]


@dataclass(frozen=True)
class PathFrame(_Directed):
    """The frame of a path, whatever its deviation: its start, and the direction to its end [deg]."""

    start: tuple[float, float]
    along: float


class _Placed(_Directed):
    """What the requests share: the size of a path and where it lies."""

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
        """Largest distance of two places on the path."""
        return self.stroke

    @property
    def relative(self) -> float:
        """Deviation over extent."""
        return self.deviation / self.extent


def ends(start: Any, end: Any) -> dict[str, Any]:
    """Return stroke, start and direction of a path between two points, as the requests take them; `InvalidRequest`
    unless both are two finite numbers, and apart."""
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
    """Return two finite coordinates; `InvalidRequest` for anything else."""
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
    """A point is to run along a straight line.

    Parameters
    ----------
    stroke : float
        Length of the path; every length of the constraints and of the answers is in its unit.
    deviation : float
        Largest distance from the best line: half the width of the narrowest strip that holds the path.
    start : (x, y)
        Where the path starts; regions, pivots and answers are in the same frame.
    along : float
        Direction from the start to the end [deg].
    unit : str, optional
        Of all lengths: mm, cm, m, in or ft.  Answers have it, and so has what is drawn and exported of them.

    Raises
    ------
    InvalidRequest
        Unless both are finite and positive and the deviation is below a tenth of the stroke; or if there is no such
        unit.
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
    sweep: ClassVar[float | None] = None  #: a line has none

    @classmethod
    def between(
        cls, start: Sequence[float], end: Sequence[float], deviation: float, *, unit: str | None = None
    ) -> StraightLine:
        """Return the request for a path from one point (x, y) to another."""
        return cls(deviation=deviation, unit=unit, **ends(start, end))


def angle_over(stroke: float, radius: float) -> float:
    """Return the angle of the arc up to a half circle over a chord [deg]."""
    return math.degrees(2 * math.asin(min(0.5 * stroke / radius, 1.0)))


def is_wide(angle: float | None) -> bool:
    """Return whether an arc is near a half circle, or beyond; its angle in degrees."""
    return angle is not None and angle > WIDE


def chord_of(radius: float, angle: float) -> float:
    """Return the chord of an arc, its angle in degrees."""
    return 2 * radius * math.sin(math.radians(0.5 * angle))


@dataclass(frozen=True)
class CircularArc(_Placed):
    """A point is to run along a circular arc that bulges to the left of the way from its start to its end.

    Stroke, radius and angle are three names of two numbers: give two of them, or three that agree.  An arc of any
    radius, given by its stroke alone, stays below a half circle.

    Parameters
    ----------
    stroke : float, optional
        Chord of the arc.
    deviation : float
        With a radius: the largest distance from the best-placed arc of exactly that radius.  Without: half the width of
        the narrowest annulus that holds the path.
    radius : float, optional
        Radius of the arc; if not given whatever fits best.
    start, along, unit
        As of a `StraightLine`; the direction is that of the chord.
    angle : float, optional
        Of the arc, above 0 and up to 350 [deg].  Without it the arc over a chord is at most a half circle.

    Raises
    ------
    InvalidRequest
        Unless all are finite and positive, agree with one another, and the deviation is below a tenth of the stroke.

    Examples
    --------
    >>> round(CircularArc(deviation=0.1, radius=50, angle=270).stroke, 3)
    70.711
    >>> CircularArc(50, 0.1, 50).angle
    60.0
    """

    stroke: float = None  # type: ignore[assignment]  # it follows where radius and angle are given
    deviation: float = None  # type: ignore[assignment]  # refused
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
        cls, start: Sequence[float], end: Sequence[float], deviation: float, radius: float | None = None, *,
        unit: str | None = None, angle: float | None = None,
    ) -> CircularArc:  # fmt: skip
        """Return the request for an arc from one point (x, y) to another."""
        return cls(deviation=deviation, radius=radius, unit=unit, angle=angle, **ends(start, end))

    @property
    def extent(self) -> float:
        """Largest distance of two places on the arc: its chord, beyond a half circle the diameter."""
        return 2 * self.radius if self.radius is not None and (self.angle or 0.0) > 180 else self.stroke

    @property
    def is_wide(self) -> bool:
        """Whether the arc is near a half circle, or beyond: its windows are told by its angle."""
        return is_wide(self.angle)

    @property
    def sweep(self) -> float | None:
        """Chord over radius, if that is given."""
        return self.stroke / self.radius if self.radius is not None else None


def consistent_arc(
    stroke: Any, radius: Any, angle: Any, name: str = "stroke"
) -> tuple[float, float | None, float | None]:
    """Return chord, radius and angle [deg] of an arc of which two are given; of any radius the chord alone.

    Raises
    ------
    InvalidRequest
        If too little is given, a value is impossible, or they contradict one another.
    """
    if angle is not None:
        angle = positive("angle", angle)
        if angle > MAX_ANGLE:
            raise InvalidRequest(
                f"an arc of {angle:g}\u00b0 nearly closes: its angle must be {MAX_ANGLE:g}\u00b0 or less"
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
    if abs(stroke - chord) > CONTRADICTION * max(stroke, chord):
        raise InvalidRequest(
            f"{name} {stroke:g}, radius {radius:g} and angle {angle:g}\u00b0 contradict one another: an arc of "
            f"{angle:g}\u00b0 and radius {radius:g} has a chord of {chord:.6g}; leave one of the three out"
        )
    return stroke, radius, angle


Request = StraightLine | CircularArc


def path_request(name: str, given: Any) -> Request:
    """Return what is a request; raise `InvalidRequest`, in the name of who was asked, for anything else."""
    if not isinstance(given, Request):
        raise InvalidRequest(f"{name} wants a StraightLine or CircularArc, not {quoted(given)}")
    return given
