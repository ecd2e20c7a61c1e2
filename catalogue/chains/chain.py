"""A batch of chains of one structure: the positions of their joints in a reference pose."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import InvalidLinkage, quoted
from ..kinematics.linkage import EXTENT, PR, RP, RR, Linkage
from ..kinematics.plane_vectors import cross
from ..kinematics.types import Complexes, Floats, Mask
from .structure import PRP, RPP, RPR, RRP, RRR, Dyad, Structure


@dataclass(frozen=True)
class PoseLimits:
    """Limits of a reference pose.

    Attributes
    ----------
    sine : float
        Least sine of the angle at which a dyad closes.  Below it, near a dead or change point,
        rounding (the square root of 1e-16) would determine the branch.
    smallest, largest : float
        Range of sizes [length]: fourth powers of lengths down to 1e-12 sizes neither over- nor
        underflow.
    """

    sine: float = 1e-7
    smallest: float = 1e-60
    largest: float = 1e60


LIMITS = PoseLimits()


@dataclass(frozen=True)
class Chain:
    """n chains of one structure, each in a reference pose.

    Parameters
    ----------
    structure : Structure
    z : complex ndarray, shape (j, n)
        Positions of the joints, in the order of `structure.joints` [length].
    u : complex ndarray, shape (s, n)
        Directions of the slides, as unit vectors.

    Raises
    ------
    InvalidLinkage
        If a position is not finite, the size is beyond 1e-60 ... 1e60, two joints of the crank or
        of a bar that closes a dyad coincide, or the chain is given at a dead or change point.

    Examples
    --------
    >>> from catalogue.chains.structure import Structure
    >>> bars = {"frame": "AD", "crank": "AB", "coupler": "BCP", "rocker": "CD"}
    >>> structure = Structure.of(bars, drive="crank")
    >>> chain = Chain.of(structure, {"A": 0, "D": 4, "B": 1j, "C": 3 + 2j, "P": 2 + 3j})
    >>> len(chain), round(float(chain.size[0]), 3)
    (1, 4.123)
    """

    structure: Structure
    z: Complexes
    u: Complexes

    @classmethod
    def of(cls, structure: Structure, joints: Mapping[str, Any], directions: Sequence[Any] = ()) -> Chain:
        """Make chains of plain data.

        Parameters
        ----------
        structure : Structure
        joints : mapping of str to complex, shape () or (n,)
            Position of each joint [length].
        directions : sequence of complex, shape () or (n,)
            Direction of each slide.
        """
        if missing := [name for name in structure.joints if name not in joints]:
            raise InvalidLinkage(f"joint {quoted(missing[0])} has no position")
        if unknown := [name for name in joints if name not in structure.joints]:
            raise InvalidLinkage(f"joint {quoted(unknown[0])} is on no bar")
        if len(directions) != len(structure.slides):
            raise InvalidLinkage(f"{len(structure.slides)} slides need as many directions, not {len(directions)}")
        z = np.array(np.broadcast_arrays(*(np.atleast_1d(joints[name]) for name in structure.joints)), complex)
        u = np.empty((len(directions), z.shape[1]), complex)
        for k, direction in enumerate(directions):
            u[k] = direction
        with np.errstate(all="ignore"):
            return cls(structure, z, np.asarray(u / np.abs(u)))

    def __post_init__(self) -> None:
        for faulty, text in self.faults():
            if faulty.any():
                raise InvalidLinkage(text)

    def faults(self) -> Iterator[tuple[Mask, str]]:
        """Yield masks (n,) of the invalid chains, each with the reason."""
        with np.errstate(all="ignore"):
            finite = np.isfinite(self.z).all(0) & np.isfinite(self.u).all(0)
            yield np.asarray(~finite), "a joint or a slide has a coordinate that is not finite, or no direction"
            fits = (self.size >= LIMITS.smallest) & (np.abs(self.z).max(0) <= LIMITS.largest)
            yield (
                np.asarray(~fits),
                f"its size must be between {LIMITS.smallest:.0e} and {LIMITS.largest:.0e}: choose another unit",
            )
            if len(arm := self.structure.arm):
                shortest = np.abs(self.z[arm] - self.z[self.structure.driver[1].joint]).max(0)
                name = quoted(self.structure.drive)
                yield (
                    ~(shortest > EXTENT.coincident * self.size),
                    f"joints of {name} coincide: it drives nothing, give it a length",
                )
            for group in self.structure.dyads:
                first, second = (self.structure.names[i] for i in (group.first, group.second))
                shortest, sine = self.lengths(group), np.abs(self.sine(group))
                yield (
                    ~(shortest > EXTENT.coincident * self.size),
                    f"joints of {quoted(first)} or {quoted(second)} coincide",
                )
                yield (
                    ~(sine >= LIMITS.sine),
                    f"it is given at a dead or change point of {quoted(first)} and {quoted(second)}, where its branch "
                    "is open: give another position",
                )

    @classmethod
    def valid(cls, structure: Structure, z: Complexes, u: Complexes) -> tuple[Chain, Mask]:
        """Select the valid chains, and return their mask, shape (n,)."""
        every = object.__new__(cls)
        for name, value in (("structure", structure), ("z", z), ("u", u)):
            object.__setattr__(every, name, value)
        mask = ~np.any([faulty for faulty, _ in every.faults()], axis=0)
        return every[mask], mask

    def __len__(self) -> int:
        return int(self.z.shape[1])

    def __getitem__(self, index: Any) -> Chain:
        made = object.__new__(type(self))
        for name, value in (("structure", self.structure), ("z", self.z[:, index]), ("u", self.u[:, index])):
            object.__setattr__(made, name, value)
        return made

    @cached_property
    def size(self) -> Floats:
        """Diameter of the joints, shape (n,) [length]."""
        return np.asarray(np.abs(self.z[:, None] - self.z).max((0, 1)))

    def rods(self, group: Dyad) -> tuple[Complexes, Complexes]:
        """Return the vectors between which a dyad closes, in the reference pose, shape (n,) each.

        RRR: both rods, in the order of its pins; RRP and RPR: a rod and the normal of the slide;
        PRP and RPP: the directions of both slides.
        """
        z, (a, b) = self.z, group.outer
        if group.kind == RRR:
            return z[group.inner] - z[a.joint], z[b.joint] - z[group.inner]
        if group.kind == RRP:
            return z[group.inner] - z[a.joint], 1j * self.u[b.joint]
        if group.kind == RPR:
            return 1j * self.u[group.inner], z[b.joint] - z[a.joint]
        if group.kind == PRP:
            return self.u[a.joint], self.u[b.joint]
        return self.u[group.inner], self.u[b.joint]

    def lengths(self, group: Dyad) -> Floats:
        """Return the shortest rod of a dyad, else the size of the chain, (n,) [length]."""
        rods = self.rods(group)
        if group.kind in (PRP, RPP):
            return self.size
        return np.asarray(np.abs({RRR: rods, RRP: rods[:1]}.get(group.kind, rods[1:])).min(0))

    def sine(self, group: Dyad) -> Floats:
        """Return the sine, with its sign, of the angle at which a dyad closes, (n,).

        It is the angle between the rods, or between rod and normal of a slide, or between two
        slides.
        """
        p, q = (rod / np.abs(rod) for rod in self.rods(group))
        return cross(q, p)

    @cached_property
    def branch(self) -> Floats:
        """Signs of the sines of the dyads, shape (d, n)."""
        dyads = self.structure.dyads
        signs = [np.where(self.sine(group) < 0, -1.0, 1.0) for group in dyads]
        return np.array(signs).reshape(len(dyads), len(self))


#: Structure of each family of two dyads driven by its first crank: bars, slides, closing joints.
_BARS = {
    RR: ({"frame": "AD", "crank": "AB", "coupler": "BCP", "second": "CD"}, ()),
    PR: ({"frame": "A", "crank": "AB", "coupler": "BCP", "second": "C"}, (("frame", "second"),)),
    RP: ({"frame": "AD", "crank": "AB", "coupler": "BP", "second": "D"}, (("coupler", "second"),)),
}


def chain_of(linkage: Linkage, point: Complexes) -> Chain:
    """Return linkages of one family as chains driven by their first dyad, a crank.

    Parameters
    ----------
    linkage : Linkage
        n linkages of one family; the first dyad is a crank.
    point : complex ndarray, shape (n,)
        Coupler points; joint `P`, on the bar `coupler`.

    Raises
    ------
    InvalidLinkage
        If the families differ, or the first dyad is no crank.
    """
    kinds = linkage.dyads
    if (kinds != kinds[0]).any() or kinds[0, 0] != RR:
        raise InvalidLinkage("linkages of one family whose first dyad is a crank make a batch of chains")
    bars, slides = _BARS[int(kinds[0, 1])]
    z = linkage.points
    places = {"A": z[:, 0, 0], "B": z[:, 0, 1], "P": point}
    places |= {"D": z[:, 1, 0]} if linkage.finite[0, 1, 0] else {}
    places |= {"C": z[:, 1, 1]} if linkage.finite[0, 1, 1] else {}
    directions = [1j * z[:, 1, 0 if kinds[0, 1] == PR else 1]] if slides else []
    return Chain.of(Structure.of(bars, drive="crank", slides=slides), places, directions)
