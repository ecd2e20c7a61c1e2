"""Measures of mechanisms of many bars over their stretches, and the places of joints and bars.

A link is the distance of two pins of a moving bar, an arm that of the guided joint from the nearest
pin of a bar that carries it.  The drive is measured as that of a linkage of two dyads, with the
driving bar as crank; see `catalogue.guidance.drive.DriveMetrics`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, combinations

import numpy as np

from ..chains.poses import Poses
from ..chains.rates import rates
from ..collections.spec import LENGTH, Metric, Places
from ..kinematics.types import Complexes, Floats, Mask
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
#: Measure that is small where further bars move idly.
ARM = "max_arm"


def chain_measures(
    family: ChainFamily, at: Poses, scale: Floats, names: Iterable[str] = tuple(MEASURES)
) -> dict[str, Floats]:
    """Measure mechanisms at positions of their stretches.

    Parameters
    ----------
    family : ChainFamily
    at : Poses
        n mechanisms at m positions from one end of their paths to the other.
    scale : ndarray, shape (n,)
        Length of a unit of the chains.
    names : iterable of str
        Which of `MEASURES`; ``turns`` is left out.

    Returns
    -------
    dict of str to ndarray, shape (n,)
        The measures; lengths are in units of `scale`.
    """
    read = _Reading(family, at)
    found = {name: np.asarray(getattr(read, name)) for name in names if name != "turns"}
    return {name: scale * value if MEASURES[name].unit == LENGTH else value for name, value in found.items()}


@dataclass(frozen=True)
class _Reading:
    """The measures of n mechanisms by name, in the unit of the chains."""

    family: ChainFamily
    at: Poses

    @property
    def size(self) -> Floats:
        return self.at.extent

    @property
    def min_transmission(self) -> Floats:
        return np.asarray(self.at.transmission.min(0))

    @property
    def rotation(self) -> Floats:
        turned = np.unwrap(np.angle(self.at.turn[self.family.bar]), axis=0)
        return np.asarray(np.degrees(np.ptp(turned, axis=0)))

    @property
    def bars(self) -> Floats:
        return np.full(len(self.at.chain), float(len(self.family.structure.bars)))

    @property
    def max_link(self) -> Floats:
        return self._largest(self._between_pins(bar) for bar in self._moving)

    @property
    def min_link(self) -> Floats:
        links = [apart for bar in self._moving for apart in self._between_pins(bar)]
        return np.asarray(np.min(links, axis=0)) if links else self.at.extent

    @property
    def max_ground(self) -> Floats:
        return self._largest([self._between_pins(self.family.structure.frame)])

    @property
    def max_arm(self) -> Floats:
        on, z, guided = self.family.structure.on, self.at.chain.z, self.family.guided
        arms = [np.abs(z[j] - z[guided]) for j in self._pins if j != guided and {*on[j]} & {*on[guided]}]
        return np.asarray(np.min(arms, axis=0)) if arms else np.zeros(len(self.at.chain))

    @property
    def travel(self) -> Floats:
        slides = range(len(self.family.structure.slides))
        return self._largest([[np.ptp(self.at.way(slide), axis=0) for slide in slides]])

    @property
    def drive_angle(self) -> Floats:
        if self.family.structure.is_pushed:
            return np.zeros(len(self.at.chain))
        return np.asarray(np.degrees(np.ptp(self.at.drive, axis=0)))

    @property
    def uniformity(self) -> Floats:
        """Least over largest speed; 0 where the drive passes a dead point."""
        least, most, steady = self._speed_range
        return np.where(steady, least / most, 0.0)

    @property
    def advantage(self) -> Floats:
        """Length of the crank over the largest speed; 0 where the drive passes a dead point."""
        bar, link = self.family.structure.driver
        z, on = self.at.chain.z, self.family.structure.on
        _, most, steady = self._speed_range
        crank = np.ones(len(self.at.chain))
        if not link.is_slide:
            pins = [j for j in self._pins if bar in on[j] and j != link.joint]
            crank = self._largest([[np.abs(z[j] - z[link.joint]) for j in pins]])
        return np.where(steady, crank / most, 0.0)

    @cached_property
    def _speed_range(self) -> tuple[Floats, Floats, Mask]:
        """Least and largest speed of the point, and whether it is steady; 1 where not."""
        drive = self.at.drive
        with np.errstate(all="ignore"):
            speed = np.abs(rates(self.at).velocity_of(self.family.bar, self.at.chain.z[self.family.guided]))
        back = (np.diff(drive, axis=0) > 0).any(0) & (np.diff(drive, axis=0) < 0).any(0)
        steady = np.isfinite(speed).all(0) & (speed > 0).all(0) & ~back
        least, most = (np.where(steady, end, 1.0) for end in (speed.min(0), speed.max(0)))
        return least, most, np.asarray(steady)

    @property
    def _moving(self) -> list[int]:
        """Numbers of the moving bars."""
        structure = self.family.structure
        return [bar for bar in range(len(structure.bars)) if bar != structure.frame]

    @property
    def _pins(self) -> list[int]:
        """Numbers of the joints of two bars or more."""
        return [j for j, bars in enumerate(self.family.structure.on) if len(bars) > 1]

    def _between_pins(self, bar: int) -> list[Floats]:
        """Return the distances of the pins of a bar."""
        z, on = self.at.chain.z, self.family.structure.on
        here = [j for j in self._pins if bar in on[j]]
        return [np.abs(z[one] - z[other]) for one, other in combinations(here, 2)]

    def _largest(self, lengths: Iterable[Iterable[Floats]]) -> Floats:
        """Return the largest of some lengths; 0 without any."""
        return np.asarray(np.max([np.zeros(len(self.at.chain)), *chain.from_iterable(lengths)], axis=0))


def places_of(at: Poses, laid: Callable[[Complexes], Complexes]) -> Places:
    """Return the places of the joints and bars of mechanisms.

    Parameters
    ----------
    at : Poses
        n mechanisms at m positions.
    laid : callable
        Maps places (..., n) to those along the path [length].

    Returns
    -------
    Places
        Of n mechanisms.
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
    axes = np.concatenate(ends).T, np.moveaxis(joints, 2, 0).swapaxes(1, 2), np.moveaxis(np.array(bars), 2, 0)
    return Places(axes[0], axes[1], axes[2].swapaxes(1, 2))
