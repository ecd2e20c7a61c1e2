"""Lay the parts to cut of a guide out beside it, with names, levels and notes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .levels import Levels
from .links import GUIDED, Links
from .outlines import Part


class PartLayout(NamedTuple):
    """Layout of parts [sizes of the linkage]."""

    letter: float = 0.018  #: height of letters
    space: float = 0.06  #: free space around parts


PART_LAYOUT = PartLayout()


@dataclass(frozen=True)
class Layout:
    """Parts beside a guide.

    Attributes
    ----------
    letter : float
        Height of letters [length].
    parts : list of (Part, complex)
        Each part with the place of its link's origin.
    texts : list of (str, complex)
        Names of pivots, and lines under the parts, each with the place where it begins.
    """

    letter: float
    parts: list[tuple[Part, complex]]
    texts: list[tuple[str, complex]]


def laid_out(cut: list[Part], levels: Levels, links: Links) -> Layout:
    """Place the parts in a column right of the linkage."""
    letter, gap = PART_LAYOUT.letter * links.size, PART_LAYOUT.space * links.size
    pivots = {name: part.link.placed(z) for part in cut for name, z in part.holes.items()}
    beside = (0.5 * cut[0].bore + 0.4 * letter) * (1 + 1j)
    texts = [("P" if name == GUIDED else name, z + beside) for name, z in pivots.items()]
    placed = [z for part in cut for z in part.edge.placed(part.link.origin, part.link.turn).points()]
    rims = [centre + radius * way for _, centre, radius in links.wheels for way in (1, 1j)]
    every = np.array([*placed, *links.path, *rims])
    left, top = float(every.real.max()) + 2 * gap, float(every.imag.max())
    parts = []
    for part in cut:
        x0, _, _, y1 = part.edge.box
        shift = complex(left - x0, top - y1)
        parts.append((part, shift))
        line = part.edge.box[1] + shift.imag - 1.6 * letter
        texts.append((f"{part.link.name}, level {levels.of[part.link.name]}", complex(left, line)))
        top = line - gap
    crossed = [f"pin {pin} meets {link} between its levels" for pin, link in levels.crossed]
    for note in [*crossed, *links.notes]:
        top -= 1.6 * letter
        texts.append((note, complex(left, top)))
    return Layout(letter, parts, texts)
