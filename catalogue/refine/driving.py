"""Bounds on the drive as smooth pieces, with derivatives by the pivots; loaded on use.

At a fixed place along the nominal the angle of the driving crank is differentiated by the pivots,
and so is the rotation of the crank per length of the path.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..guidance.drive import differentiation
from ..guidance.minimum_zone import times
from ..kinematics.types import Floats, Indices, Mask
from ..quantities import BOUNDS, DEGREES
from .quantities import Pieces, Quantities, Row, chosen, ratio


@dataclass(frozen=True)
class Driving:
    """Bounds on the drive of candidates, at the stations of their quantities."""

    of: Quantities

    def __call__(self, name: str) -> Pieces:
        """Return the violation of a bound on the drive, as pieces.

        Angles are in radians, other measures are divided by the bound.
        """
        row = BOUNDS[name]
        bound, sign = getattr(self.of.problem.constraints, name), 1.0 if row.is_upper else -1.0
        made: dict[str, Callable[[], Iterator[Row]]] = {
            "drive_angle": self._drive_angle,
            "rotation": self._rotation,
            "uniformity": self._uniformity,
            "advantage": self._advantage,
        }
        pieces = Pieces.of(made[row.measure](), sign)
        if row.unit == DEGREES:
            return pieces.less(sign * np.radians(bound))
        return Pieces(pieces.value / bound - sign, pieces.slope / bound)

    def uniformity(self) -> Pieces:
        """Return the negative uniformity as pieces; the largest one is the measure."""
        return Pieces.of(self._uniformity(), -1.0)

    def _drive_angle(self) -> Iterator[Row]:
        (angle, by), side = self._crank, self._sense
        yield side * (angle[-1] - angle[0]), side[:, None] * (by[-1] - by[0])

    def _rotation(self) -> Iterator[Row]:
        angle, by = np.unwrap(np.angle(1 + self.of.pose.x), axis=0), self.of.by.angle
        most, least = _extremes(angle)
        for one, other in _pairs(most, least, len(angle)):
            yield _at_station(angle, one) - _at_station(angle, other), _at_station(by, one) - _at_station(by, other)

    def _uniformity(self) -> Iterator[Row]:
        lever, by = self._rotation_per_length
        most, least = _extremes(lever)
        steady = _at_station(lever, least) > 0
        for one, other in _pairs(most, least, len(lever)):
            value, slope = ratio(
                (_at_station(lever, other), _at_station(by, other)), (_at_station(lever, one), _at_station(by, one))
            )
            # where the crank reverses only the pair with the fastest station counts
            yield np.where(steady | (one == most), value, np.nan), slope

    def _advantage(self) -> Iterator[Row]:
        radius, by_radius = chosen(self._first, *self.of.links()[:2])
        for lever, by in zip(*self._rotation_per_length, strict=True):
            yield radius * lever, radius[:, None] * by + lever[:, None] * by_radius

    @property
    def _first(self) -> Mask:
        """Whether the first crank drives, shape (n,)."""
        return np.asarray(self.of.driver != 2)

    @cached_property
    def _crank(self) -> Row:
        """Angles of the driving crank, in its linkage; NaN where none drives."""
        fixed, moving = self.of.ends
        dyads = [(self.of.at(i, moving), self.of.at(i, fixed)) for i in (0, 1)]
        spoke, by = chosen(self._first, *((pin[0] - ground[0], pin[1] - ground[1]) for pin, ground in dyads))
        spoke = np.where(self.of.driver > 0, spoke, np.nan)
        with np.errstate(all="ignore"):
            angle, slope = np.unwrap(np.angle(spoke), axis=0), (by / spoke[..., None]).imag
        if self.of.problem.constraints.slots:  # in the inversion of a guided slot the frame of the linkage moves
            angle = angle - np.unwrap(np.angle(1 + self.of.pose.x), axis=0)
            slope = slope - self.of.by.angle
        return angle, slope

    @cached_property
    def _turning(self) -> Row:
        """Rotation of the driving crank per length of the path."""
        along = differentiation(len(self.of.pose.d) - 1)
        (angle, by), (ahead, by_ahead) = ([times(along, x) for x in row] for row in (self._crank, self.of.at(2, 1)))
        speed = np.abs(ahead)
        with np.errstate(all="ignore"):
            rise = (ahead.conj()[..., None] * by_ahead).real / speed[..., None]
            return angle / speed, (by - (angle / speed)[..., None] * rise) / speed[..., None]

    @property
    def _sense(self) -> Floats:
        """Sense in which the crank turns over the whole stroke, 1 or -1."""
        return np.asarray(np.sign(self._turning[0].sum(0)))

    @property
    def _rotation_per_length(self) -> Row:
        """Rotation of the crank per length of path, positive in its overall sense."""
        turning, by = self._turning
        return self._sense * turning, self._sense[:, None] * by


def _extremes(values: Floats) -> tuple[Indices, Indices]:
    """Return the indices of the largest and least values (m, n), shape (n,) each."""
    good = np.isfinite(values)
    return (
        np.argmax(np.where(good, values, -np.inf), axis=0),
        np.argmin(np.where(good, values, np.inf), axis=0),
    )


def _pairs(most: Indices, least: Indices, count: int) -> Iterator[tuple[Indices, Indices]]:
    """Yield pairs of stations (n,): that of the largest or least value, with each other one."""
    for station in range(count):
        yield most, np.full_like(least, station)
        yield np.full_like(most, station), least


def _at_station(values: Floats, station: Indices) -> Floats:
    """Return values (m, n, ...) at one station per column, shape (n, ...)."""
    return np.asarray(values[station, np.arange(len(station))])
