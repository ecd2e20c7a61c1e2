"""Elements of SVG, in its coordinates: y downwards, angles clockwise in degrees."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..kinematics.types import Complexes, Floats
from ..markup import NOTHING, Markup, element

#: Difference below which steps of time are equal.
EQUAL_TIMES = 1e-9


def group(kind: str, *content: str, **attributes: object) -> Markup:
    """Return a group of a class."""
    return element("g", *content, class_=kind, **attributes)


def text(words: str, at: complex, kind: str, **attributes: object) -> Markup:
    """Return a line of text that begins at a place, or ends there by its anchor."""
    return element("text", words, class_=kind, x=number(at.real), y=number(at.imag), **attributes)


def number(value: float, digits: int = 2) -> str:
    """Format a number without trailing zeros."""
    told = f"{value:.{digits}f}".rstrip("0").rstrip(".") if digits else f"{value:.0f}"
    return "0" if told in ("-0", "") else told


def pair(z: complex, digits: int = 2) -> str:
    """Format a place as two numbers."""
    return f"{number(z.real, digits)} {number(z.imag, digits)}"


def ticks(low: float, high: float, most: int) -> list[float]:
    """Return round values from low to high with at most `most` intervals."""
    if not high > low:
        return [low]
    rough = (high - low) / most
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * part for part in (1, 2, 2.5, 5, 10) if power * part >= rough * (1 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [step * k for k in range(first, last + 1)]


def segments(ends: Complexes, digits: int = 2) -> str:
    """Return the data of a path of single lines, by their ends (n, 2)."""
    places = np.round(np.asarray(ends), digits).view(float) + 0.0  # no -0
    return "".join([f"M{a:.9g} {b:.9g}L{c:.9g} {d:.9g}" for a, b, c, d in places.tolist()])


def polyline(z: Complexes, digits: int = 2) -> str:
    """Return the data of a path through points; it is interrupted where they are NaN."""
    parts, pen = [], "M"
    for point in np.asarray(z).tolist():
        if point != point:  # NaN
            pen = "M"
            continue
        parts.append(pen + pair(point, digits))
        pen = "L" if pen == "M" else ""
    return " ".join(parts).replace(" L", "L").replace(" M", "M")


def plate(z: Complexes, radius: float) -> str:
    """Return the outline at a distance `radius` about the convex hull of z."""
    corner = _hull(np.asarray(z), 1e-6 * radius)
    r = number(radius)
    if len(corner) == 1:
        left, right = pair(corner[0] - radius), pair(corner[0] + radius)
        return f"M{left}A{r} {r} 0 0 1 {right}A{r} {r} 0 0 1 {left}Z"
    away = np.roll(corner, -1) - corner
    normal = -1j * away / np.abs(away) * radius  # outwards, for corners in clockwise order on the screen
    begin, end = corner + normal, np.roll(corner, -1) + normal
    parts = [f"M{pair(begin[0])}"]
    for k in range(len(corner)):
        parts.append(f"L{pair(end[k])}A{r} {r} 0 0 1 {pair(begin[(k + 1) % len(corner)])}")
    return "".join(parts) + "Z"


def _hull(z: Complexes, near: float) -> Complexes:
    """Compute the convex hull by ascending angle (A. M. Andrew 1979).

    Close points coincide.
    """
    points = sorted(np.asarray(z).tolist(), key=lambda p: (p.real, p.imag))
    corner = points[:1]
    for point in points[1:]:
        if min(abs(point - other) for other in corner) > near:
            corner.append(point)
    if len(corner) < 3:
        return np.array(corner)
    ends: list[complex] = []
    for way in (corner, corner[::-1]):
        chain: list[complex] = []
        for point in way:
            while len(chain) > 1 and _signed_area(chain[-2], chain[-1], point) <= near * abs(point - chain[-2]):
                chain.pop()
            chain.append(point)
        ends += chain[:-1]
    return np.array(ends)


def _signed_area(a: complex, b: complex, c: complex) -> float:
    """Return twice the area of a triangle, positive for corners in order of ascending angle."""
    return ((b - a).conjugate() * (c - a)).imag


@dataclass(frozen=True)
class Clock:
    """Animates parts of a drawing through poses in a common period, endlessly.

    Attributes
    ----------
    seconds : float
        Duration of a period [s].
    closed : bool
        Whether the motion is a cycle, whose last pose equals the first; else it runs to and fro.
    middle : int
        Index of the pose to draw where animation is not supported.
    still : bool
        Whether the drawing shows this pose alone.
    time : ndarray, shape (m,), optional
        Times of the poses, from 0 to 1: over a period, or over the first half of a motion to and
        fro; evenly spaced by default.
    """

    seconds: float
    closed: bool
    middle: int
    still: bool = False
    time: Floats | None = None

    def order(self, values: list[str]) -> str:
        """Arrange the values of all poses in the order of a period."""
        return ";".join(values if self.closed else values + values[-2::-1])

    def animate(self, attribute: str, values: list[str], **attributes: object) -> Markup:
        """Return the animation of an attribute; empty if nothing changes."""
        if self.still or len(set(values)) == 1:
            return NOTHING
        return element(
            "animate",
            attributeName=attribute,
            values=self.order(values),
            dur=f"{number(self.seconds)}s",
            repeatCount="indefinite",
            keyTimes=self._key_times,
            **attributes,
        )

    @cached_property
    def _key_times(self) -> str | None:
        """Return the times of the values of a period; None for equal times."""
        if self.time is None or np.ptp(np.diff(self.time)) < EQUAL_TIMES:
            return None
        time = self.time if self.closed else 0.5 * np.append(self.time, 2 - self.time[-2::-1])
        return ";".join(number(t, 5) for t in time.tolist())

    def _transform(self, kind: str, values: list[str]) -> Markup:
        if self.still or len(set(values)) == 1:
            return NOTHING
        return element(
            "animateTransform",
            attributeName="transform",
            type=kind,
            values=self.order(values),
            dur=f"{number(self.seconds)}s",
            repeatCount="indefinite",
            keyTimes=self._key_times,
        )

    def moved(self, at: Complexes, kind: str, *content: str) -> Markup:
        """Return a group translated to positions, shape (m,)."""
        values = [pair(z) for z in at.tolist()]
        start = f"translate({values[self.middle]})"
        return group(kind, self._transform("translate", values), *content, transform=start)

    def turned(self, angle: Floats, kind: str | None, *content: str) -> Markup:
        """Return a group rotated about its origin by angles, shape (m,) [rad, counterclockwise]."""
        values = [number(-a, 3) for a in np.degrees(angle).tolist()]
        inner = (self._transform("rotate", values), *content)
        return element("g", *inner, class_=kind, transform=f"rotate({values[self.middle]})")
