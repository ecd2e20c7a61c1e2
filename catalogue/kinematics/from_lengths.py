"""Linkages from link lengths and the angle of the first crank, as textbooks give them.

Crank 1 turns about the origin; the second dyad stands to the right of it:

====================  ==========================================================================
links                 linkage
====================  ==========================================================================
ground crank coupler  four-bar; the second crank turns about (ground, 0)
rocker
crank coupler offset  slider-crank; the slider runs on the line y = offset
ground crank offset   inverted slider-crank; a line of the coupler runs through (ground, 0), at
                      the distance `offset` from the moving pivot of crank 1, to its left
height offset         swinging-block slider; the slider runs on the line y = height; a line of
                      the coupler runs through (0, 0), at `offset` from the slider's pivot
coupler between       elliptic trammel; one slider runs on the x axis, the other on a line
                      through (0, 0) at the angle `between` [deg] from it
ground between        Oldham linkage; two lines of the coupler, at the angle `between` [deg],
                      run through (0, 0) and (ground, 0)
====================  ==========================================================================

The angle is that of crank 1 from the x axis.  Without a crank it is that of the coupler: of the
line from slider to slider, or of the line of the (first) slide.

Source: the usual closures by two circles, or a circle and a line.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..errors import InvalidLinkage, quoted
from ..given import doubles
from .link_lengths import in_coupler
from .linkage import Linkage, homogeneous, refuse
from .types import Array, Complexes, Floats

FOUR_BAR = ("ground", "crank", "coupler", "rocker")
SLIDER_CRANK = ("crank", "coupler", "offset")
INVERTED = ("ground", "crank", "offset")
SWINGING_BLOCK = ("height", "offset")
TRAMMEL = ("coupler", "between")
OLDHAM = ("ground", "between")
#: Further names permitted with lengths.
POSITION = ("angle", "branch")
#: Names of the guided point's coordinates: in the given position, or along and across the coupler;
#: see `link_lengths`.
POINT = ("x", "y", "along", "across")


def from_lengths(links: Mapping[str, object]) -> Linkage:
    """Return linkages from the lengths of their links.

    Parameters
    ----------
    links : mapping of str to array_like, shape () or (n,)
        One row of the table above [length, deg].  ``offset`` may be negative; its default is 0.
        ``angle``: that of the first crank from the x axis; without a crank that of the coupler
        [deg]. ``branch``: 1 (the default) or -1, the two ways to close the chain.  With 1 the end
        of the rocker is to the left of the line from crank pivot to rocker pivot, the slider is to
        the right, and the line of the coupler runs towards the slide.

    Raises
    ------
    InvalidLinkage
        If the names match no row, a length is not above zero, or a chain cannot be closed at its
        angle.
    """
    if "angle" not in links:
        raise InvalidLinkage(
            "link lengths need the `angle` of the first crank, in degrees: a series is of one position"
        )
    return _close(_numbers(links))


def guide_from_lengths(links: Mapping[str, object]) -> tuple[Linkage, Complexes]:
    """Build linkages from link lengths, with guided points (n,), NaN if not given.

    The points are given by ``x`` and ``y``, or by ``along`` and ``across``.  Without ``angle`` the
    position is in the middle of the range of the first crank.

    Raises
    ------
    InvalidLinkage
        See `from_lengths`; also if a chain cannot be closed at any angle.
    """
    values = _numbers(links)
    given = {name: value for name, value in values.items() if name not in POINT}
    if "angle" not in given:
        given["angle"] = _closable(given)
    linkage = _close(given)
    pairs = [[values[name] for name in pair if name in values] for pair in (POINT[:2], POINT[2:])]
    if any(len(pair) == 1 for pair in pairs) or all(pairs):
        raise InvalidLinkage("a guided point is given by `x` and `y`, or by `along` and `across`")
    for name in POINT:
        if name in values:
            refuse(np.where(np.isfinite(values[name]), "", f"its `{name}` is NaN or infinite"))
    if pairs[1]:
        return linkage, in_coupler(linkage, pairs[1][0] + 1j * pairs[1][1])
    place = pairs[0][0] + 1j * pairs[0][1] if pairs[0] else complex(np.nan, np.nan)
    return linkage, np.broadcast_to(place, len(linkage)).astype(complex)


def _numbers(links: Mapping[str, object]) -> dict[str, Floats]:
    """Convert the value of each name to numbers, shape (n,) each."""
    given = {}
    for name, value in links.items():
        try:
            given[name] = np.atleast_1d(doubles(value))
        except ValueError:
            given[name] = np.empty((0, 0))
        if given[name].ndim > 1:
            raise InvalidLinkage(f"the link length `{name}` must be a number or a list of numbers, not {quoted(value)}")
    try:
        return dict(zip(given, np.broadcast_arrays(*given.values()), strict=True))
    except ValueError:
        raise InvalidLinkage("link lengths must be numbers, or lists of one length") from None


def _closable(of: Mapping[str, Floats]) -> Floats:
    """Choose an angle of the first crank for each chain [deg], far from dead points."""
    names = _matching_row({*of})
    if names not in (FOUR_BAR, SLIDER_CRANK, INVERTED):
        return np.full(1, 30.0)
    _check_above_zero(of)
    r = of["crank"]
    offset = of.get("offset", np.zeros_like(r))
    with np.errstate(all="ignore"):
        if names == SLIDER_CRANK:
            low, high = (offset - of["coupler"]) / r, (offset + of["coupler"]) / r
        else:
            f, inner, outer = of["ground"], np.abs(offset), np.full_like(r, np.inf)
            if names == FOUR_BAR:
                inner, outer = np.abs(of["coupler"] - of["rocker"]), of["coupler"] + of["rocker"]
            low, high = ((r**2 + f**2 - far**2) / (2 * r * f) for far in (outer, inner))
    middle = 0.5 * (np.maximum(low, -1) + np.minimum(high, 1))
    refuse(np.where((low <= 1) & (high >= -1) & (low <= high), "", "its chain cannot be closed in any position"))
    return np.asarray(np.degrees(np.arcsin(middle) if names == SLIDER_CRANK else np.arccos(middle)))


def _matching_row(names: set[str]) -> tuple[str, ...]:
    """Return the row of the table to which the given names belong."""
    lengths = names - {*POSITION}
    fits = [row for row in CLOSURES if lengths in ({*row}, {*row} - {"offset"})]
    if not fits:
        raise InvalidLinkage(
            f"link lengths {', '.join(sorted(map(str, lengths))) or 'that are not there'} make no linkage: give "
            + ", or ".join(" ".join(row) for row in CLOSURES)
        )
    return fits[0]


def _check_above_zero(of: Mapping[str, Floats]) -> None:
    """Refuse lengths that are not positive, except signed ones."""
    for name in {*of} - {*POSITION, "offset", "between", "height"}:
        refuse(np.where(of[name] > 0, "", f"its {name} must be above zero"))


def _close(given: Mapping[str, Floats]) -> Linkage:
    names = _matching_row({*given})
    values = {"offset": np.zeros(1), "branch": np.ones(1), **given}
    values = dict(zip(values, np.broadcast_arrays(*values.values()), strict=True))
    _check_above_zero(values)
    refuse(np.where(np.abs(values["branch"]) == 1, "", "its branch must be 1 or -1"))
    refuse(np.where(np.isfinite(np.stack(list(values.values()))).all(0), "", "a number is NaN or infinite"))
    turn = np.exp(1j * np.radians(values["angle"]))
    with np.errstate(invalid="ignore"):
        pivots = CLOSURES[names](turn, values)
    refuse(np.where(np.isnan(pivots).any(axis=(1, 2, 3)), "its chain cannot be closed at this angle", ""))
    return Linkage(pivots)


def _dyads(*places: tuple[Array, float]) -> Floats:
    """Return pivots (n, 2, 2, 3) from A1, A1*, A2, A2*, each with its w."""
    return np.stack([homogeneous(z, w) for z, w in places], axis=1).reshape(-1, 2, 2, 3)


def _four_bar(turn: Complexes, of: Mapping[str, Floats]) -> Floats:
    crank = of["crank"] * turn
    base = of["ground"] - crank
    along = (np.abs(base) ** 2 + of["coupler"] ** 2 - of["rocker"] ** 2) / (2 * np.abs(base))
    across = np.sqrt(of["coupler"] ** 2 - along**2)
    moving = crank + (along + 1j * of["branch"] * across) * base / np.abs(base)
    return _dyads((0 * turn, 1.0), (crank, 1.0), (of["ground"] + 0j, 1.0), (moving, 1.0))


def _slider_crank(turn: Complexes, of: Mapping[str, Floats]) -> Floats:
    crank = of["crank"] * turn
    run = np.sqrt(of["coupler"] ** 2 - (of["offset"] - crank.imag) ** 2)
    slider = crank.real + of["branch"] * run + 1j * of["offset"]
    return _dyads((0 * turn, 1.0), (crank, 1.0), (1j + 0 * turn, 0.0), (slider, 1.0))


def _inverted(turn: Complexes, of: Mapping[str, Floats]) -> Floats:
    crank = of["crank"] * turn
    base = of["ground"] - crank
    sine = of["offset"] / np.abs(base)
    run = of["branch"] * np.sqrt(1 - sine**2)
    normal = 1j * base / np.abs(base) * (run + 1j * sine)  # normal of the line, to the left of its direction
    return _dyads((0 * turn, 1.0), (crank, 1.0), (of["ground"] + 0j, 1.0), (normal, 0.0))


def _swinging_block(turn: Complexes, of: Mapping[str, Floats]) -> Floats:
    normal = 1j * turn
    # the slider's pivot x + i height is at `offset` from the line through (0, 0) in the direction
    # of `turn`
    with np.errstate(all="ignore"):
        x = np.where(turn.imag != 0, (of["height"] * turn.real + of["offset"]) / turn.imag, np.nan)
    return _dyads((1j + 0 * turn, 0.0), (x + 1j * of["height"], 1.0), (0 * turn, 1.0), (normal, 0.0))


def _trammel(turn: Complexes, of: Mapping[str, Floats]) -> Floats:
    line = np.exp(1j * np.radians(of["between"]))
    with np.errstate(all="ignore"):
        reach = np.where(np.abs(line.imag) > 1e-12, of["coupler"] * turn.imag / line.imag, np.nan)
    second = reach * line
    first = (second - of["coupler"] * turn).real + 0j
    return _dyads((1j + 0 * turn, 0.0), (first, 1.0), (1j * line, 0.0), (second, 1.0))


def _oldham(turn: Complexes, of: Mapping[str, Floats]) -> Floats:
    other = turn * np.exp(1j * np.radians(of["between"]))
    return _dyads((0 * turn, 1.0), (1j * turn, 0.0), (of["ground"] + 0j, 1.0), (1j * other, 0.0))


CLOSURES = {
    FOUR_BAR: _four_bar,
    SLIDER_CRANK: _slider_crank,
    INVERTED: _inverted,
    SWINGING_BLOCK: _swinging_block,
    TRAMMEL: _trammel,
    OLDHAM: _oldham,
}
