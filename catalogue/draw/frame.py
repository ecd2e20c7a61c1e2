"""Place an animated drawing on paper, with room for its symbols."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..kinematics.types import Complexes, Floats, Mask
from .drive_marks import MARK
from .machine import Bearing, Machine, Rail
from .symbols import BLOCK, SYMBOL


class FrameShape(NamedTuple):
    """Shape of a drawing."""

    flat: float = 0.3  #: smallest height over width
    tall: float = 1.0  #: largest height over width, if the height is not given


FRAME = FrameShape()


class BearingSymbol(NamedTuple):
    """Symbol of a fixed pivot [pt]."""

    height: float = 14.0  #: height
    foot: float = 13.0  #: half the width of its foot
    hatching: float = 5.0  #: distance of its hatching lines


BEARING_SYMBOL = BearingSymbol()


@dataclass(frozen=True)
class Frame:
    """The map from the plane to paper.

    Attributes
    ----------
    scale : float
        Units of paper per unit of length.
    corner : complex
        Position of the paper's upper left corner in the plane.
    point : float
        Size of a point of the symbols [units of paper].
    width, height : float
        Size of the paper.
    """

    scale: float
    corner: complex
    point: float
    width: float
    height: float

    def at(self, z: object) -> Any:
        """Map positions, one or an array, to paper."""
        return np.conj((np.asarray(z) - self.corner) * self.scale)

    def along(self, z: object) -> Any:
        """Map directions, or differences of positions, to paper."""
        return np.conj(np.asarray(z) * self.scale)

    def near(self, z: Complexes, times: float = 1.0) -> Mask:
        """Tell which positions are less than a number of paper widths away from the paper."""
        at = self.at(z)
        x, y = times * self.width, times * self.height
        with np.errstate(invalid="ignore"):
            return np.asarray(
                (at.real > -x) & (at.real < self.width + x) & (at.imag > -y) & (at.imag < self.height + y)
            )

    @classmethod
    def around(cls, shown: Machine, width: float, height: float | None, point: float) -> Frame:
        """Return the frame of the largest scale that fits a width, and a height if given."""
        scale = largest_scale(shown, width, FRAME.tall * width if height is None else height, point)
        if height is None:
            height = max(FRAME.flat * width, size_at(shown, scale, point).imag)
        return cls.centred(shown, scale, point, width, height, complex(0.5 * width, 0.5 * height))

    @classmethod
    def centred(cls, shown: Machine, scale: float, point: float, width: float, height: float, centre: complex) -> Frame:
        """Return the frame of a given scale, centred at a position of the paper."""
        (left, right), (below, above) = _extent(shown, scale, point)
        middle = complex(0.5 * (left + right), 0.5 * (below + above))
        return cls(scale, (middle - centre.conjugate()) / scale, point, width, height)


def largest_scale(shown: Machine, width: float, height: float, point: float) -> float:
    """Compute the largest scale that fits a width and a height."""
    places, border = room(shown, point)
    return min(
        _largest_scale_along(places.real, border[:, :2], width),
        _largest_scale_along(places.imag, border[:, 2:], height),
    )


def size_at(shown: Machine, scale: float, point: float) -> complex:
    """Compute width and height of the drawing at a scale."""
    (left, right), (below, above) = _extent(shown, scale, point)
    return complex(right - left, above - below)


def _extent(shown: Machine, scale: float, point: float) -> list[tuple[float, float]]:
    """Compute the horizontal and vertical range of the drawing [units of paper]."""
    places, border = room(shown, point)
    return [
        (float((scale * x - b[:, 0]).min()), float((scale * x + b[:, 1]).max()))
        for x, b in ((places.real, border[:, :2]), (places.imag, border[:, 2:]))
    ]


def room(shown: Machine, point: float) -> tuple[Complexes, Floats]:
    """Return positions (k,) and the margins of their symbols on four sides, (k, 4)."""
    link, block, foot = SYMBOL.link + 2, BLOCK[0] + 14, BEARING_SYMBOL.height + BEARING_SYMBOL.hatching
    parts: list[tuple[Complexes, tuple[float, ...]]] = [(shown.extent, (link,) * 4)]
    for one in shown.supports:
        if isinstance(one, Bearing):
            margin = (BEARING_SYMBOL.foot + 6, BEARING_SYMBOL.foot + 3, foot + 1, MARK.radius + 5)
            parts.append((np.array([one.at]), margin))
        elif isinstance(one, Rail):
            spare = BLOCK[0] + 9 + 1j * (BLOCK[1] + BEARING_SYMBOL.hatching + 1)
            across = abs(one.side.imag) * spare.real + abs(one.side.real) * spare.imag
            upwards = abs(one.side.real) * spare.real + abs(one.side.imag) * spare.imag
            parts.append((one.ends, (across, across, upwards, upwards)))
    parts += [(corners.ravel(), (block,) * 4) for plate, corners in shown.plates if plate.is_slim]
    places = np.concatenate([z for z, _ in parts])
    border = np.concatenate([np.tile(margin, (len(z), 1)) for z, margin in parts])
    return places, border * point


def _largest_scale_along(x: Floats, border: Floats, room: float) -> float:
    """Compute the largest scale that fits coordinates x (k,) with margins (k, 2)."""
    least = np.inf
    for low, high in ((low, high) for low in np.unique(border[:, 0]) for high in np.unique(border[:, 1])):
        across = float(x[border[:, 1] == high].max() - x[border[:, 0] == low].min())
        if across > 0:
            least = min(least, (room - low - high) / across)
    return least
