"""Boxes in which named hard points may move, and mechanisms with moved points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...errors import InvalidRequest, quoted
from ...given import Stated, array, choice, names
from ...kinematics.types import Array
from ..jointed.elements import Cylindrical, Element, Link, OnGuide, Revolute, Spherical, Universal
from ..jointed.hard_points import numbers
from ..jointed.mechanism import Mechanism
from ..jointed.system import System

#: Fields of elements that hold hard points.
POINT_FIELDS: dict[type, tuple[str, ...]] = {
    Link: ("from_", "to"),
    Spherical: ("at",),
    Revolute: ("at", "to"),
    Cylindrical: ("at", "to"),
    OnGuide: ("at",),
    Universal: ("at",),
}


@dataclass(frozen=True, eq=False)
class Box(Stated):
    """A box about one or more hard points that move by one displacement.

    Parameters
    ----------
    points : str or sequence of str
        Names such as ``"tie rod.to"``: an element and its field of the point.  Coincident points in
        the design pose are one hard point; one of their names suffices.
    half : float or sequence of 3 floats
        Largest displacement of each coordinate in both senses; 0 fixes it.
    mirror : {"", "x", "y", "z"}
        Component of the displacement that is reversed for all points after the first: they move as
        its mirror images.
    """

    points: str | Sequence[str]
    half: float | Sequence[float]
    mirror: str = ""


class Variables:
    """Variables of a fit, from -1 to 1: displacements of hard points within their boxes.

    Attributes
    ----------
    labels : tuple of str
        Names of hard points, such as ``"tie rod.to"``; `points` (h, 3) are their given positions.
    names : tuple of str
        Names of the variables, such as ``"tie rod.to z"``.
    half : ndarray, shape (k,)
        Displacement for a variable of 1.
    moves : ndarray, shape (k, h, 3)
        Displacement of every hard point by each variable.

    Raises
    ------
    InvalidRequest
        If a name is unknown, a size is invalid, or a point is in two boxes or on a guide.
    """

    def __init__(self, mechanism: Mechanism, boxes: Sequence[Box]) -> None:
        self.mechanism = mechanism
        titles = mechanism.system().labelled
        self.where = [
            (i, field)
            for i, x in enumerate(mechanism.elements)
            for field in POINT_FIELDS.get(type(x), ())
            if getattr(x, field) is not None
        ]
        self.labels = tuple(f"{titles[i]}.{field.rstrip('_')}" for i, field in self.where)
        given = [
            numbers(getattr(mechanism.elements[i], field), label)
            for (i, field), label in zip(self.where, self.labels, strict=True)
        ]
        if any(len(p) > 1 for p in given):
            raise InvalidRequest("hard points are fitted of one mechanism, not of a batch")
        self.points = np.concatenate([np.zeros((0, 3)), *given])
        self.at_home: set[int] = set()
        names, half, moves = [], [], []
        for box in boxes:
            size, signs = _check_box(box)
            displaced, title = self._displacement_factors(box, signs)
            for axis in np.flatnonzero(size):
                names.append(f"{title} {'xyz'[axis]}")
                half.append(size[axis])
                moves.append(displaced * np.eye(3)[axis] * size[axis])
        if not names:
            raise InvalidRequest("nothing may move: give a Box with a half size above 0")
        self.names, self.half, self.moves = tuple(names), np.array(half), np.array(moves)

    def _displacement_factors(self, box: Box, signs: Array) -> tuple[Array, str]:
        """Return factors (h, 3) of the displacement of a box by hard point, and its name."""
        wanted = names("Box.points", box.points)
        if not wanted:
            raise InvalidRequest(f"a Box is about hard points, by their names, not {quoted(box.points)}")
        displaced = np.zeros_like(self.points)
        for k, name in enumerate(wanted):
            found = [i for i, label in enumerate(self.labels) if label == name]
            if not found:
                raise InvalidRequest(f"there is no hard point {quoted(name)}, only {', '.join(self.labels)}")
            if len(found) > 1:
                raise InvalidRequest(f"{len(found)} hard points are called {quoted(name)}: give their elements names")
            same = np.flatnonzero((self.points == self.points[found[0]]).all(1))
            for i in same:
                if isinstance(self.mechanism.elements[self.where[i][0]], OnGuide):
                    raise InvalidRequest(f"{self.labels[i]} is on a guide, which stays where it is: it cannot move")
                if i in self.at_home:
                    raise InvalidRequest(f"{self.labels[i]} is in two boxes, by itself or with a point on it")
                self.at_home.add(int(i))
            displaced[same] = signs if k else 1.0
        return displaced, wanted[0]

    def displacement(self, u: Array) -> Array:
        """Return displacements (n, h, 3) of all hard points at variables (n, k)."""
        return np.asarray(np.tensordot(u, self.moves, 1))

    def elements(self, u: Array, repeat: int = 1) -> list[Element]:
        """Return the elements with hard points displaced by variables u (n, k).

        Each of the n mechanisms is repeated `repeat` times; several are one batch.
        """
        points, out = self.points + self.displacement(u), list(self.mechanism.elements)
        for h in sorted(self.at_home):
            i, field = self.where[h]
            moved: Any = np.repeat(points[:, h], repeat, axis=0)
            moved = moved if len(moved) > 1 else tuple(moved[0].tolist())
            out[i] = replace(out[i], **{field: moved})
        return out

    def moved(self, u: Array) -> Mechanism:
        """Return the mechanism with points displaced by variables u (n, k); a batch for n > 1."""
        return Mechanism(self.elements(u), self.mechanism.unit)

    def in_system(self, system: System, displacement: Array) -> Array:
        """Convert displacements (n, h, 3) to those of the points of a system, in its units."""
        out = np.zeros((len(displacement), system.points.shape[1], 3))
        for h in self.at_home:
            out[:, system.labels.index(self.labels[h])] = displacement[:, h] / system.unit
        return out


def _check_box(box: Box) -> tuple[Array, Array]:
    """Check a box; return half sizes (3,) and the mirror factors of all points after the first."""
    size = np.broadcast_to(array("Box.half", box.half, (), (3,)), (3,))
    if not (np.isfinite(size) & (size >= 0)).all():
        raise InvalidRequest(f"half sizes of a Box are one or three numbers, 0 or more, not {quoted(box.half)}")
    choice("Box.mirror", box.mirror, ("", "x", "y", "z"))
    return size, np.where([box.mirror == k for k in "xyz"], -1.0, 1.0)
