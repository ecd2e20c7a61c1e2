"""Linkages from the lengths of their links and the angle of the first crank, as textbooks give them.

Crank 1 turns about the origin; the second dyad stands to the right of it:

====================  ==========================================================================================
links                 linkage
====================  ==========================================================================================
ground crank coupler  four-bar; the second crank turns about (ground, 0)
rocker
crank coupler offset  slider-crank; the slider runs on the line y = offset
ground crank offset   inverted slider-crank; a line of the coupler, at the distance `offset` from crank 1's moving
                      pivot, to its left seen from there, runs through (ground, 0)
====================  ==========================================================================================

Source: the usual closures by two circles, or a circle and a line.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from ..errors import InvalidLinkage
from .linkage import Linkage, homogeneous, refuse
from .types import Complexes, Floats

FOUR_BAR = ("ground", "crank", "coupler", "rocker")
SLIDER_CRANK = ("crank", "coupler", "offset")
INVERTED = ("ground", "crank", "offset")
#: What may stand beside the lengths.
POSITION = ("angle", "branch")


def from_lengths(links: Mapping[str, npt.ArrayLike]) -> Linkage:
    """Return linkages from the lengths of their links, arrays of shape () or (n,): one row of the table above.

    ``offset`` may be left out (0) or negative.  ``angle``: of the first crank from the x axis [deg].  ``branch``: 1 (if
    left out) or -1, the two ways to close the chain: the rocker's end to the left or right of the line from crank to
    rocker pivot, the slider to the right or left, the coupler's line running to the slide or away from it.

    Raises
    ------
    InvalidLinkage
        If the names are none of the rows, a length is not above zero, or a chain cannot be closed at its angle.
    """
    given = {name: np.asarray(value, dtype=float) for name, value in links.items()}
    lengths = {*given} - {*POSITION}
    if "angle" not in given:
        raise InvalidLinkage(
            "link lengths need the `angle` of the first crank, in degrees: a series is of one position"
        )
    fits = [names for names in CLOSURES if lengths in ({*names}, {*names} - {"offset"})]
    if not fits:
        raise InvalidLinkage(
            f"link lengths {', '.join(sorted(lengths))} make no linkage: give "
            + ", or ".join(" ".join(names) for names in CLOSURES)
        )
    values = {"offset": np.zeros(()), "branch": np.ones(()), **given}
    wide = np.broadcast_arrays(*(np.atleast_1d(v) for v in values.values()))
    values = dict(zip(values, wide, strict=True))
    for name in lengths - {"offset"}:
        refuse(np.where(values[name] > 0, "", f"its {name} must be above zero"))
    refuse(np.where(np.abs(values["branch"]) == 1, "", "its branch must be 1 or -1"))
    refuse(np.where(np.isfinite(np.stack(list(values.values()))).all(0), "", "a number is NaN or infinite"))
    crank = values["crank"] * np.exp(1j * np.radians(values["angle"]))
    with np.errstate(invalid="ignore"):
        second = CLOSURES[fits[0]](crank, values)
    refuse(np.where(np.isnan(second).any(axis=(1, 2)), "its chain cannot be closed at this angle", ""))
    first = np.stack([homogeneous(0 * crank), homogeneous(crank)], axis=1)
    return Linkage(np.stack([first, second], axis=1))


def _four_bar(crank: Complexes, of: Mapping[str, Floats]) -> Floats:
    base = of["ground"] - crank
    along = (np.abs(base) ** 2 + of["coupler"] ** 2 - of["rocker"] ** 2) / (2 * np.abs(base))
    across = np.sqrt(of["coupler"] ** 2 - along**2)
    moving = crank + (along + 1j * of["branch"] * across) * base / np.abs(base)
    return np.stack([homogeneous(of["ground"] + 0j), homogeneous(moving)], axis=1)


def _slider_crank(crank: Complexes, of: Mapping[str, Floats]) -> Floats:
    run = np.sqrt(of["coupler"] ** 2 - (of["offset"] - crank.imag) ** 2)
    slider = crank.real + of["branch"] * run + 1j * of["offset"]
    return np.stack([homogeneous(1j + 0 * crank, 0.0), homogeneous(slider)], axis=1)


def _inverted(crank: Complexes, of: Mapping[str, Floats]) -> Floats:
    base = of["ground"] - crank
    sine = of["offset"] / np.abs(base)
    run = of["branch"] * np.sqrt(1 - sine**2)
    normal = 1j * base / np.abs(base) * (run + 1j * sine)  # of the line, to the left of its run
    return np.stack([homogeneous(of["ground"] + 0j), homogeneous(normal, 0.0)], axis=1)


CLOSURES = {FOUR_BAR: _four_bar, SLIDER_CRANK: _slider_crank, INVERTED: _inverted}
