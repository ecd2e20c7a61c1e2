"""Where a moving drawing stands on paper, and how much room its symbols take."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..kinematics.linkage import PR, RP
from ..kinematics.types import Array, Complexes, Floats
from .drive_marks import RADIUS
from .poses import Poses
from .symbols import BLOCK, LINK

#: Least and greatest height over width of a drawing whose height is not given.
FLAT, TALL = 0.3, 1.0
#: Height of a bearing, half its foot and the distance of its hatching [points].
BEARING, FOOT, HATCHING = 14.0, 13.0, 5.0


@dataclass(frozen=True)
class Frame:
    """Where things of the plane stand on paper.

    Attributes
    ----------
    scale : float
        Units of paper per unit of length.
    corner : complex
        Place in the plane of the paper's upper left corner.
    point : float
        Size of a point of the symbols [units of paper].
    width, height : float
        Of the paper.
    """

    scale: float
    corner: complex
    point: float
    width: float
    height: float

    def at(self, z: Any) -> Any:
        """Return where a place in the plane, or an array of such, is on paper."""
        return np.conj((np.asarray(z) - self.corner) * self.scale)

    def along(self, z: Any) -> Any:
        """Return what a direction or a difference of places is on paper."""
        return np.conj(np.asarray(z) * self.scale)

    def near(self, z: Array, times: float = 1.0) -> Array:
        """Return which places are on paper, or within so many widths of it."""
        at = self.at(z)
        x, y = times * self.width, times * self.height
        with np.errstate(invalid="ignore"):
            return np.asarray(
                (at.real > -x) & (at.real < self.width + x) & (at.imag > -y) & (at.imag < self.height + y)
            )

    @classmethod
    def around(cls, shown: Poses, width: float, height: float | None, point: float) -> Frame:
        """Return the frame in which everything is as large as a width, and a height if it is given, allow."""
        scale = largest_scale(shown, width, TALL * width if height is None else height, point)
        if height is None:
            height = max(FLAT * width, size_at(shown, scale, point).imag)
        return cls.centred(shown, scale, point, width, height, complex(0.5 * width, 0.5 * height))

    @classmethod
    def centred(cls, shown: Poses, scale: float, point: float, width: float, height: float, centre: complex) -> Frame:
        """Return the frame in which everything, drawn to a scale, stands about a place of the paper."""
        (left, right), (below, above) = _ends(shown, scale, point)
        middle = complex(0.5 * (left + right), 0.5 * (below + above))
        return cls(scale, (middle - centre.conjugate()) / scale, point, width, height)


def largest_scale(shown: Poses, width: float, height: float, point: float) -> float:
    """Return the largest scale at which everything has room in a width and a height."""
    places, border = room(shown, point)
    return min(_largest(places.real, border[:, :2], width), _largest(places.imag, border[:, 2:], height))


def size_at(shown: Poses, scale: float, point: float) -> complex:
    """Return width and height of everything at a scale."""
    (left, right), (below, above) = _ends(shown, scale, point)
    return complex(right - left, above - below)


def _ends(shown: Poses, scale: float, point: float) -> list[tuple[float, float]]:
    """Return from where to where everything reaches, to the right and upwards [units of paper]."""
    places, border = room(shown, point)
    return [
        (float((scale * x - b[:, 0]).min()), float((scale * x + b[:, 1]).max()))
        for x, b in ((places.real, border[:, :2]), (places.imag, border[:, 2:]))
    ]


def room(shown: Poses, point: float) -> tuple[Complexes, Floats]:
    """Return places (k,) and how much room about each the symbols take to the left, right, below and above, (k, 4)
    [units of paper]."""
    link, block, foot = LINK + 2, BLOCK[0] + 14, BEARING + HATCHING
    parts: list[tuple[Array, tuple[float, ...]]] = [(shown.extent, (link,) * 4)]
    for i in (0, 1):
        if shown.kinds[i] == PR:
            spare = BLOCK[0] + 9 + 1j * (BLOCK[1] + HATCHING + 1)
            normal = shown.fixed[i]
            across = abs(normal.imag) * spare.real + abs(normal.real) * spare.imag
            upwards = abs(normal.real) * spare.real + abs(normal.imag) * spare.imag
            parts.append((shown.moving[:, i], (across, across, upwards, upwards)))
        else:
            parts.append((shown.fixed[i : i + 1], (FOOT + 6, FOOT + 3, foot + 1, RADIUS + 5)))
        if shown.kinds[i] == RP:
            parts.append((shown.carried(shown.rods[i]).ravel(), (block, block, block, block)))
    if shown.joint is not None:
        parts.append((np.array([shown.pivot]), (FOOT + 6, FOOT + 3, foot + 1, link)))
    places = np.concatenate([z for z, _ in parts])
    border = np.concatenate([np.tile(b, (len(z), 1)) for z, b in parts])
    return places, border * point


def _largest(x: Floats, border: Floats, room: float) -> float:
    """Return the largest scale at which places x (k,), with borders below and above (k, 2), have room."""
    least = np.inf
    for low, high in ((low, high) for low in np.unique(border[:, 0]) for high in np.unique(border[:, 1])):
        across = float(x[border[:, 1] == high].max() - x[border[:, 0] == low].min())
        if across > 0:
            least = min(least, (room - low - high) / across)
    return least
