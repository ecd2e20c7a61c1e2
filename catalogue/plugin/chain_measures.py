"""Measures of mechanisms of many bars over their stretches, and the places of joints and bars.

A link is the distance of two pins of a moving bar, an arm that of the guided joint from the nearest
pin of a bar that carries it.  The drive is measured as that of a linkage of two dyads, with the
driving bar as crank; see `catalogue.guidance.drive.DriveMetrics`.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np

from ..chains.poses import Poses
from ..chains.rates import rates
from ..collections.spec import LENGTH, Metric, Places
from ..kinematics.types import Complexes, Floats
from ..series.chain_family import ChainFamily

#: Measures by name; the names are those of bounds.
MEASURES = {
    "size": Metric("diameter of all joints over the stroke, the path included", LENGTH),
    "min_transmission": Metric("least transmission angle of any dyad over the stroke", "deg", more=True),
    "rotation": Metric("range of the angle of the guided bar over the stroke", "deg"),
    "bars": Metric("number of bars, the frame included", "1"),
    "max_link": Metric("largest distance of two pins of a moving bar", LENGTH, minor=True),
    "min_link": Metric("least distance of two pins of a moving bar", LENGTH, more=True, minor=True),
    "max_ground": Metric("largest distance of two pins of the frame", LENGTH, minor=True),
    "max_arm": Metric("distance of the guided joint from the nearest pin of its bars", LENGTH, minor=True),
    "travel": Metric("largest way of a slider over the stroke; 0 without any", LENGTH, minor=True),
    "drive_angle": Metric("rotation of the drive over the stroke; 0 of one that slides", "deg", minor=True),
    "uniformity": Metric("least over largest speed of the point at a steady drive", "1", more=True, minor=True),
    "advantage": Metric("least force along the path over force at the crank pin", "1", more=True, minor=True),
    "turns": Metric("1 if the drive turns fully, else 0", "1", more=True, minor=True),
}


def chain_measures(family: ChainFamily, at: Poses, scale: Floats) -> dict[str, Floats]:
    """Measure mechanisms at positions of their stretches.

    Parameters
    ----------
    family : ChainFamily
    at : Poses
        n mechanisms at m positions from one end of their paths to the other.
    scale : ndarray, shape (n,)
        Length of a unit of the chains.

    Returns
    -------
    dict of str to ndarray, shape (n,)
        `MEASURES` except ``turns``; lengths are in units of `scale`.
    """
    structure, z, n = family.structure, at.chain.z, len(scale)
    turned = np.unwrap(np.angle(at.turn[family.bar]), axis=0)
    pins = [j for j, bars in enumerate(structure.on) if len(bars) > 1]
    links, ground, arms = (list[Floats]() for _ in range(3))
    for bar in range(len(structure.bars)):
        here = [j for j in pins if bar in structure.on[j]]
        apart = [np.abs(z[one] - z[other]) for one, other in combinations(here, 2)]
        (ground if bar == structure.frame else links).extend(apart)
        if bar in structure.on[family.guided]:
            arms += [np.abs(z[j] - z[family.guided]) for j in here if j != family.guided]
    ways = [np.ptp(at.way(k), axis=0) for k in range(len(structure.slides))]
    nothing = np.zeros(n)
    lengths = {
        "size": at.extent,
        "max_link": np.max([nothing, *links], axis=0),
        "min_link": np.min(links, axis=0) if links else at.extent,
        "max_ground": np.max([nothing, *ground], axis=0),
        "max_arm": np.min(arms, axis=0) if arms else nothing,
        "travel": np.max([nothing, *ways], axis=0),
    }
    drive = nothing if structure.is_pushed else np.degrees(np.ptp(at.drive, axis=0))
    return {
        **{name: scale * length for name, length in lengths.items()},
        "min_transmission": at.transmission.min(0),
        "rotation": np.degrees(np.ptp(turned, axis=0)),
        "bars": np.full(n, float(len(structure.bars))),
        "drive_angle": drive,
        **_of_the_drive(family, at),
    }


def _of_the_drive(family: ChainFamily, at: Poses) -> dict[str, Floats]:
    """Measure uniformity and mechanical advantage; 0 where the drive passes a dead point."""
    structure, z = family.structure, at.chain.z
    with np.errstate(all="ignore"):
        speed = np.abs(rates(at).velocity_of(family.bar, z[family.guided]))
    bar, link = structure.driver
    crank = np.ones(len(at.chain))
    if not link.is_slide:
        pins = [j for j, bars in enumerate(structure.on) if bar in bars and len(bars) > 1 and j != link.joint]
        crank = np.max([0 * crank, *(np.abs(z[j] - z[link.joint]) for j in pins)], axis=0)
    back = (np.diff(at.drive, axis=0) > 0).any(0) & (np.diff(at.drive, axis=0) < 0).any(0)
    steady = np.isfinite(speed).all(0) & (speed > 0).all(0) & ~back
    least, most = (np.where(steady, end, 1.0) for end in (speed.min(0), speed.max(0)))
    return {
        "uniformity": np.where(steady, least / most, 0.0),
        "advantage": np.where(steady, crank / most, 0.0),
    }


def places_of(at: Poses, laid: Callable[[Complexes], Complexes]) -> list[Places]:
    """Return the places of the joints and bars of mechanisms.

    Parameters
    ----------
    at : Poses
        n mechanisms at m positions.
    laid : callable
        Maps places (..., n) to those along the path [length].

    Returns
    -------
    list of Places
        Places of each mechanism.
    """
    structure = at.chain.structure
    with np.errstate(all="ignore"):
        joints = laid(np.array([at.joint(j) for j in range(len(structure.joints))]))
    fixed = [j for j, bars in enumerate(structure.on) if structure.frame in bars]
    ends = [joints[fixed, 0]]
    moving = {bar: joints[[j for j, on in enumerate(structure.on) if bar in on]] for bar in range(len(structure.bars))}
    for number, slide in enumerate(structure.slides):
        rail, slider = (structure.number(name) for name in slide.ends)
        way, along = at.way(number), at.turn[rail] * at.chain.u[number]
        slot = laid(at.at[slider] + np.array([end - way for end in (way.min(0), way.max(0))]) * along)
        if rail == structure.frame:
            ends.append(slot[:, 0])
        else:
            moving[rail] = np.concatenate([moving[rail], slot])
        if not len(moving[slider]):
            moving[slider] = laid(at.at[slider])[None]
    bars = [
        np.stack([places[one], places[other]], -1)
        for bar, places in moving.items()
        if bar != structure.frame
        for one, other in (combinations(range(len(places)), 2) if len(places) > 1 else [(0, 0)] * len(places))
    ]
    stood = np.concatenate(ends)
    return [
        Places(stood[:, i], joints[:, :, i].T, np.array(bars)[:, :, i].transpose(1, 0, 2)) for i in range(len(at.chain))
    ]
