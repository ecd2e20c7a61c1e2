"""Place the texts of a picture where they cover as little as possible."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...kinematics.types import Array
from ...paper import PAPER

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Font size [points].
FONT_SIZE = 8.5
#: Mean width of a letter [font sizes].
LETTER_WIDTH = 0.56
#: Positions along a line at which a text is tried [lengths of the line].
POSITIONS_ALONG = (0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8)
#: Distances from a line at which a text is tried [points].
DISTANCES = (10.0, 15.0, 22.0, 30.0)


class Letters:
    """Texts on a figure and the places they occupy; all lengths are in pixels."""

    def __init__(self, figure: Figure) -> None:
        self.figure, self.scale = figure, figure.dpi / 72
        self.taken: list[Array] = []  #: centres and half sizes of texts, (4,)
        self.points = np.zeros((0, 2))

    def keep_off(self, x: Array, half: float = 1.0) -> None:
        """Keep points (n, 2) free of texts."""
        for d in ((0, 0),) if half <= 1 else ((0, 0), (half, 0), (-half, 0), (0, half), (0, -half)):
            self.points = np.concatenate([self.points, x + np.array(d) * self.scale])

    def write(self, text: str, x: Array, colour: str, bold: bool = False, at_ends: bool = False) -> None:
        """Write a text beside the line through points (n, 2), or beside its ends."""
        from matplotlib.patheffects import withStroke

        if not text:
            return
        half = (
            np.array([len(text) * LETTER_WIDTH * FONT_SIZE * (1.08 if bold else 1.0), 1.25 * FONT_SIZE])
            / 2
            * self.scale
        )
        place = min(self._places(x, half, at_ends), key=lambda p: self._cost(p[0], half) + p[1])[0]
        self.taken.append(np.concatenate([place, half]))
        style: dict[str, Any] = {"fontsize": FONT_SIZE, "color": colour, "fontweight": "bold" if bold else "normal"}
        at = self.figure.transFigure.inverted().transform(place)
        self.figure.text(
            at[0],
            at[1],
            text,
            ha="center",
            va="center",
            path_effects=[withStroke(linewidth=2.2, foreground=PAPER)],
            **style,
        )

    def _places(self, x: Array, half: Array, at_ends: bool) -> list[tuple[Array, float]]:
        """Return possible centres of a text, with the cost of each."""
        out = []
        if at_ends or len(x) != 2:
            anchors = [(p, 0.0) for p in x]
        else:
            anchors = [(x[0] + t * (x[1] - x[0]), 2 * abs(t - 0.5)) for t in POSITIONS_ALONG]
        for p, less in anchors:
            for k in range(12):
                direction = np.array([np.cos(k * np.pi / 6), np.sin(k * np.pi / 6)])
                for away in DISTANCES:
                    reach = away * self.scale + min(half[0] * abs(direction[0]) + half[1] * abs(direction[1]), half[0])
                    out.append((p + reach * direction, less + 0.08 * away))
        return out

    def _cost(self, place: Array, half: Array) -> float:
        """Return the cost of a text at a place: the amount that it covers."""
        off = np.abs(self.points - place) - half - 2.0 * self.scale
        cost = 3.0 * float((off < 0).all(1).sum())
        for other in self.taken:
            gap = np.abs(other[:2] - place) - other[2:] - half - 1.0
            cost += 60.0 * float((gap < 0).all())
        box = self.figure.bbox
        inside = (
            (place - half > 4).all() and place[0] + half[0] < box.width - 4 and place[1] + half[1] < 0.9 * box.height
        )
        return cost + (0.0 if inside else 100.0)
