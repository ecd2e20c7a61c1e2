"""A series: data and three formulas; the core samples, traces, stores, ranks and draws.

How to write a plugin that adds a series:

1. Write `pivots(p)`: from a mapping of parameter arrays (n,) to homogeneous pivots (n, 2, 2, 3) in
   the canonical frame (pole at the origin, inflection pole at (0, 1), so rho0 = 1; parallel
   cranks: see theory of series IV).
2. Write `classify(instant)`: residual (n,), zero exactly on the series, dimensionless, NaN for
   other families than those of the series; margin (n,), zero where it meets another series.
3. Write `guided(p)`: the guided elements in the same frame, with their order of contact.
4. Put them in a `Series` and return it from the hook ``catalogue_series``.  The inverse series is
   ``series.inversion(code, title)``: nothing else has to be written for it.
5. Run the contract tests: subclass `catalogue.testing.SeriesContract`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from ..curvature_theory.instant import Instant
from ..errors import PluginError, quoted
from ..foreign_code import checked_text, foreign
from ..kinematics.linkage import FAMILIES
from ..kinematics.types import Array, Floats, Integers, Mask, read_only
from .pairs import half_turn
from .posed import Posed, Solve, dual

Parameters = Mapping[str, Array]


def lent(parameters: Parameters) -> Parameters:
    """Return parameters as lent to a plugin: read-only copies."""
    return MappingProxyType({name: read_only(values) for name, values in parameters.items()})


@dataclass(frozen=True)
class Parameter:
    """A free parameter: its name, the intervals of its domain, and its meaning."""

    name: str
    domain: tuple[tuple[float, float], ...]
    meaning: str

    def __post_init__(self) -> None:
        ends = [end for interval in self.domain for end in interval]
        if not self.domain or not np.all(np.isfinite(ends)) or any(b <= a for a, b in pairwise(ends)):
            raise PluginError(
                f"parameter {self.name}: the domain must be increasing finite intervals, not {self.domain}"
            )

    def spread(self, share: Floats) -> Floats:
        """Map shares in [0, 1), any shape, uniformly to the union of the domain's intervals."""
        low = np.array([a for a, _ in self.domain])
        width = np.array([b - a for a, b in self.domain])
        start = np.concatenate([[0.0], np.cumsum(width)])
        at = np.asarray(share) * start[-1]
        k = np.clip(np.searchsorted(start, at, side="right") - 1, 0, len(low) - 1)
        return np.asarray(low[k] + (at - start[k]))

    def holds(self, values: Floats) -> Mask:
        """Tell where values lie in the domain."""
        return np.asarray(np.any([(values >= a) & (values <= b) for a, b in self.domain], axis=0))


def angles(*intervals: tuple[float, float]) -> tuple[tuple[float, float], ...]:
    """Return a domain in radians from intervals in degrees."""
    return tuple((float(np.radians(a)), float(np.radians(b))) for a, b in intervals)


@dataclass(frozen=True)
class Member:
    """A sub-family of a series with a parametrisation of its own, within one linkage family.

    Parameters
    ----------
    name : str
        ``general``, or the special condition (``symmetric``, ``pseudo-undulation`` ...).
    parameters : sequence of Parameter
        The free parameters, which are sampled and stored.
    pivots : callable
        Maps all parameters, free and derived, arrays of shape (n,), to pivots of shape (n, 2, 2,
        3).
    derive : callable, optional
        Maps the free parameters to those determined by the condition of the sub-family; `pivots`
        and the series' `guided` receive both.
    weight : float
        Share of this member in a sample of the series.
    """

    name: str
    family: str
    parameters: Sequence[Parameter]
    pivots: Callable[[Parameters], Array]
    derive: Callable[[Parameters], Parameters] | None = None
    weight: float = 1.0

    @property
    def key(self) -> str:
        """Name that is unique within the series."""
        return f"{self.family} {self.name}"

    def complete(self, free: Parameters) -> Parameters:
        """Return the free parameters, in order, with the derived ones added.

        Raise `PluginError` if one is missing.
        """
        missing = [p.name for p in self.parameters if p.name not in free]
        if missing:
            raise PluginError(f"{self.key}: parameter {', '.join(missing)} is missing")
        arrays = lent({p.name: np.atleast_1d(np.asarray(free[p.name], dtype=float)) for p in self.parameters})
        complete = {**arrays, **self.derive(arrays)} if self.derive else arrays
        if len({np.shape(values) for values in complete.values()}) > 1:
            shapes = ", ".join(f"{name} {np.shape(values)}" for name, values in complete.items())
            raise PluginError(f"{self.key}: the shapes of its parameters differ: {shapes}")
        return lent(complete)

    def synthesise(self, free: Parameters) -> Floats:
        """Return pivots (n, 2, 2, 3) in the canonical frame."""
        complete = self.complete(free)
        pivots = np.asarray(self.pivots(complete))
        wanted = (*np.shape(next(iter(complete.values()), [0])), 2, 2, 3)
        if pivots.shape != wanted or pivots.dtype.kind not in "fiu":
            odd = f"shape {pivots.shape} and type {pivots.dtype}"
            raise PluginError(f"{self.key}: pivots have {odd}, not (n, 2, 2, 3) numbers, n = {wanted[0]}")
        return pivots.astype(float)


@dataclass(frozen=True)
class Guided:
    """A guided element of each of n linkages.

    Attributes
    ----------
    label : str
        Label, such as ``[3]`` for a principal pair, or ``undulation``.
    pairs : ndarray, shape (n, 2, 3)
        Fixed and moving point, homogeneous: a fixed point at infinity means a straight path, a
        moving point at infinity a straight slot. NaN where the element is imaginary, or no guide.
    order : int or ndarray of int, shape (n,)
        Order of contact; `EXACT` if the point stays on its nominal over the finite motion.
    """

    label: str
    pairs: Floats
    order: int | Integers

    def __post_init__(self) -> None:
        checked_text("label of a guided element", self.label, 60)

    def inverted(self) -> Guided:
        """Transform the element to the inverse motion, in its canonical frame."""
        return replace(self, label=inverse_words(self.label), pairs=half_turn(self.pairs[:, ::-1]))


@dataclass(frozen=True, repr=False)
class Series:
    """A class of linkages whose cubics of stationary curvature degenerate in one way.

    Parameters
    ----------
    code : str
        Code, such as ``II*.xy``.
    title : str
        Title in one line.
    inverse : str
        Code of the inverse series; its own if it is self-inverse.
    source : str
        Source of the theory.
    members : sequence of Member
    classify : callable
        Maps an `Instant` of n linkages to residual (n,) and margin (n,).
    guided : callable
        Maps the complete parameters of a member to its `Guided` elements, one of each label, NaN
        where there is none.
    solve : callable, optional
        Closed-form solution of posed problems: maps a `Posed` of n problems to pivots (n, k, 2, 2,
        3) in its frame, NaN where there are fewer than k, or to None if it cannot use the given
        pivots. Each solution guides the point to order 3 at least.
    degenerate : bool
        False for a general class, such as all linkages with a finite pole, of which degenerate
        series are limits: it is nearest to a linkage only where no degenerate series is known.
    origin : str
        File or package it comes from, as the registry notes it.

    Raises
    ------
    PluginError
        If the data contradict one another.
    """

    code: str
    title: str
    inverse: str
    source: str
    members: Sequence[Member]
    classify: Callable[[Instant], tuple[Floats, Floats]]
    guided: Callable[[Parameters], Iterable[Guided]]
    solve: Solve | None = None
    degenerate: bool = True
    origin: str = ""

    def __post_init__(self) -> None:
        if not self.code or not self.title or not self.source:
            raise PluginError(f"series {quoted(self.code)}: code, title and source must not be empty")
        if not self.members:
            raise PluginError(f"series {self.code}: it has no member")
        keys = [m.key for m in self.members]
        if len(set(keys)) != len(keys):
            raise PluginError(f"series {self.code}: two members have the name {max(keys, key=keys.count)!r}")

    def __repr__(self) -> str:
        return f"<Series {self.code}: {self.title}>"

    def left_out(self, error: PluginError) -> str:
        """Return the reason for rejecting the series, and its origin, in one line."""
        return f"series {self.code} is left out: {error}" + f" ({self.origin})" * bool(self.origin)

    @property
    def families(self) -> list[str]:
        """Linkage families in which the series exists, in order of first mention."""
        return list(dict.fromkeys(m.family for m in self.members))

    def dimension(self, family: str) -> int:
        """Return the number of free parameters of the largest member of a family, 0 without any."""
        return max((len(m.parameters) for m in self.members if m.family == family), default=0)

    def member(self, key: str) -> Member:
        """Return the member with the given key."""
        named = {m.key: m for m in self.members}
        if key not in named:
            raise PluginError(f"series {self.code} has no member {key!r}; it has {', '.join(named)}")
        return named[key]

    def answers(self, posed: Posed) -> Floats:
        """Return the linkages (n, k, 2, 2, 3) that solve posed problems; NaN for fewer than k.

        Raises
        ------
        PluginError
            If `solve` raises, or returns something else.
        """
        found, n = None, len(posed.axis)
        if self.solve:
            with foreign(f"series {self.code}"), np.errstate(all="ignore"):
                found = self.solve(posed)
                if found is None and self.inverse == self.code:
                    found = dual(self.solve)(posed)
                if found is not None and (found.ndim, found.shape[0], *found.shape[2:]) != (5, n, 2, 2, 3):
                    raise ValueError(f"solve gives shape {found.shape}, not ({n}, k, 2, 2, 3)")
        return np.zeros((n, 0, 2, 2, 3)) if found is None else found

    def residuals(self, instant: Instant) -> tuple[Floats, Floats]:
        """Return residual and margin of n linkages by `classify`, shape (n,).

        Raises
        ------
        PluginError
            If `classify` raises, or returns something else.
        """
        n = len(instant.linkage)
        with foreign(f"series {self.code}"):
            residual, margin = (np.asarray(values, dtype=float) for values in self.classify(instant))
            if residual.shape != (n,) or margin.shape != (n,):
                raise ValueError(f"classify gives shapes {residual.shape} and {margin.shape}, not ({n},)")
            return residual, margin

    def inversion(self, code: str, title: str) -> Series:
        """Return the inverse series: fixed and moving plane exchanged in everything."""
        members = [
            replace(m, name=inverse_words(m.name), family=inverse_family(m.family), pivots=_invert(m.pivots))
            for m in self.members
        ]
        return Series(
            code,
            title,
            self.code,
            f"inversion of {self.code}",
            members,
            classify=lambda instant: self.classify(instant.inverted),
            guided=lambda p: [g.inverted() for g in self.guided(p)],
            solve=dual(self.solve) if self.solve else None,
        )


def _invert(pivots: Callable[[Parameters], Array]) -> Callable[[Parameters], Array]:
    return lambda p: half_turn(np.asarray(pivots(p))[:, :, ::-1])


def inverse_family(name: str) -> str:
    """Return the family of the inversions of a family."""
    swap = {0: 0, 1: 2, 2: 1}
    kinds = sorted(swap[k] for k in FAMILIES[name])
    return next(other for other, pair in FAMILIES.items() if sorted(pair) == kinds)


def inverse_words(text: str) -> str:
    """Exchange undulation and cuspidation in a name, as inversion does."""
    swap = {"undulation": "cuspidation", "cuspidation": "undulation"}
    return re.sub("undulation|cuspidation", lambda found: swap[found[0]], text)
