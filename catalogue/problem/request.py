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

#: Largest chord over radius; a half circle has 2.
FULLEST = 1.98


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
        if self.deviation > 0.1 * self.stroke:
            like_a_radius = self.kind == "circle" and FULLEST * self.deviation >= self.stroke
            raise InvalidRequest(
                f"a deviation of {self.deviation:g} over a stroke of {self.stroke:g} is no guidance"
                + ": of an arc give stroke, deviation, radius in this order" * like_a_radius
            )

    @property
    def relative(self) -> float:
        """Deviation over stroke."""
        return self.deviation / self.stroke


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
    sweep: ClassVar[float | None] = None  #: a line has none

    @classmethod
    def between(
        cls, start: Sequence[float], end: Sequence[float], deviation: float, *, unit: str | None = None
    ) -> StraightLine:
        """Return the request for a path from one point (x, y) to another."""
        return cls(deviation=deviation, unit=unit, **ends(start, end))


@dataclass(frozen=True)
class CircularArc(_Placed):
    """A point is to run along a circular arc that bulges to the left of the way from its start to its end.

    Parameters
    ----------
    stroke : float
        Chord of the arc.
    deviation : float
        With a radius: the largest distance from the best-placed arc of exactly that radius.  Without: half the width of
        the narrowest annulus that holds the path.
    radius : float, optional
        Radius of the arc; if not given whatever fits best.
    start, along, unit
        As of a `StraightLine`; the direction is that of the chord.

    Raises
    ------
    InvalidRequest
        Unless all are finite and positive, the arc below a half circle, the deviation below a tenth of the stroke.
    """

    stroke: float
    deviation: float
    radius: float | None = None
    start: tuple[float, float] = (0.0, 0.0)
    along: float = 0.0
    unit: str | None = None

    kind = "circle"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.radius is not None:
            object.__setattr__(self, "radius", positive("radius", self.radius))
        if self.radius is not None and self.stroke > FULLEST * self.radius:
            raise InvalidRequest(
                f"an arc of chord {self.stroke:g} and radius {self.radius:g} is a half circle or impossible; "
                f"give a stroke below {FULLEST:g} radius"
            )

    @classmethod
    def between(
        cls, start: Sequence[float], end: Sequence[float], deviation: float, radius: float | None = None, *,
        unit: str | None = None,
    ) -> CircularArc:  # fmt: skip
        """Return the request for an arc from one point (x, y) to another."""
        return cls(deviation=deviation, radius=radius, unit=unit, **ends(start, end))

    @property
    def sweep(self) -> float | None:
        """Chord over radius, if that is given."""
        return self.stroke / self.radius if self.radius is not None else None


Request = StraightLine | CircularArc


def path_request(name: str, given: Any) -> Request:
    """Return what is a request; raise `InvalidRequest`, in the name of who was asked, for anything else."""
    if not isinstance(given, Request):
        raise InvalidRequest(f"{name} wants a StraightLine or CircularArc, not {quoted(given)}")
    return given
