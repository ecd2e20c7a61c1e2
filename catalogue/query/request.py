"""The path that a user asks for: a nominal with stroke and tolerance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from operator import index
from typing import Any, ClassVar

from ..errors import InvalidRequest

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
    sweep: ClassVar[float | None] = None  #: a line has none

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


def path_request(name: str, given: Any) -> Request:
    """Return what is a request; raise `InvalidRequest`, in the name of who was asked, for anything else."""
    if not isinstance(given, Request):
        raise InvalidRequest(f"{name} wants a StraightLine or CircularArc, not {given!r}")
    return given
