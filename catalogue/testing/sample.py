"""Members of a series at even, extreme and chosen parameters, for the contract tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from ..curvature_theory.instant import Instant
from ..kinematics.linkage import Linkage, faults
from ..kinematics.types import Array, Floats, Indices
from ..series.series import Guided, Member, Series

SIZE = 64
#: Number of points sampled to find the configurations that an even sample lacks.
RARE_SAMPLES = 4096


@dataclass(frozen=True)
class Sample:
    """A member of a series at n parameter points."""

    series: Series
    member: Member
    free: Mapping[str, Array]

    @cached_property
    def pivots(self) -> Floats:
        """Pivots returned by the series, shape (n, 2, 2, 3)."""
        return self.member.synthesise(self.free)

    @cached_property
    def faults(self) -> Array:
        """Fault of each linkage as a message, shape (n,); empty if it is valid."""
        return faults(self.pivots)

    @cached_property
    def guided(self) -> list[Guided]:
        """Guided elements of the n linkages, with orders broadcast to shape (n,)."""
        n = len(self.pivots)
        found = self.series.guided(self.member.complete(self.free))
        return [Guided(g.label, np.asarray(g.pairs), np.broadcast_to(g.order, n)) for g in found]

    @cached_property
    def valid(self) -> Sample:
        """The points that form linkages."""
        return self.part(np.flatnonzero(self.faults == ""))

    @cached_property
    def linkage(self) -> Linkage:
        """The linkages; all must be valid."""
        return Linkage(self.pivots)

    @cached_property
    def configuration(self) -> Array:
        """Configuration of each linkage, shape (n,).

        At a dead point it is that of the branch that turns about the origin.
        """
        return Instant(self.linkage, np.zeros(len(self.linkage), complex)).configuration

    def part(self, index: Indices) -> Sample:
        """Return the points with the given numbers."""
        return Sample(self.series, self.member, {name: values[index] for name, values in self.free.items()})

    def name(self, i: int) -> str:
        """Name a linkage in a message."""
        at = ", ".join(f"{name} = {float(values[i])!r}" for name, values in self.free.items())
        return f"{self.series.code}, {self.member.key}" + f" at {at}" * bool(at)


def even(series: Series, member: Member, size: int = SIZE) -> Sample:
    """Return a Latin hypercube over the domain of a member, always of the same points."""
    draw = np.random.default_rng(1895)
    share = {p.name: (draw.permutation(size) + draw.random(size)) / size for p in member.parameters}
    return Sample(series, member, {p.name: p.spread(share[p.name]) for p in member.parameters})


def rare(sample: Sample) -> Sample | None:
    """Draw a linkage of each configuration that the sample lacks; None if there is none."""
    many = even(sample.series, sample.member, RARE_SAMPLES).valid
    names, which = np.unique(many.configuration, return_index=True)
    lacking = which[~np.isin(names, sample.configuration)]
    return many.part(lacking) if lacking.size else None


def corners(series: Series, member: Member) -> Sample:
    """Return a member at every combination of the ends of its parameters' intervals."""
    ends = [[end for interval in p.domain for end in interval] for p in member.parameters]
    table = np.array(list(product(*ends)), dtype=float)
    return Sample(series, member, {p.name: table[:, j] for j, p in enumerate(member.parameters)})


def chosen(series: Series, member: Member, points: Sequence[Mapping[str, float]]) -> Sample:
    """Return a member at the given points."""
    return Sample(series, member, {p.name: np.array([point[p.name] for point in points]) for p in member.parameters})
