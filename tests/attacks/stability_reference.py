"""What `stability.py` compares with: chains closed in 50 digits, and how an error is counted.

Chains are closed by circles and lines (`tests/naive.py`), derivatives are differences over 1e-15, narrowest strips come
from hulls: no formula is the catalogue's.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np

from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.types import Array, Mask
from tests.naive import Chain, circle_circle, circle_line, dot, narrowest_strip

DIGITS = 50
EPS = float(np.finfo(float).eps)
#: Other roundings of what is given, by a unit in the last place at most: what they change is inherent.
ROUNDINGS = 4
#: From this relative change on the numbers that are given do not determine the result.
UNDETERMINED = 1e-3


class NotClosed(ArithmeticError):
    """There is no such position."""


class Closed:
    """One linkage in many digits, closed at angles, from the given position on, of a crank (0, 1) or the coupler (2).

    Parameters
    ----------
    numbers : sequence of 8 or more numbers of mpmath
        x and y of A1, A1*, A2, A2*, then x and y of a coupler point.
    finite : (2, 2) bool
    """

    def __init__(self, numbers: Sequence[Any], finite: Mask, lead: int) -> None:
        places = [[mp.mpc(*numbers[4 * i + 2 * j : 4 * i + 2 * j + 2]) for j in (0, 1)] for i in (0, 1)]
        places = [
            [z if there else z / abs(z) for z, there in zip(pair, known, strict=True)]
            for pair, known in zip(places, finite, strict=True)
        ]
        flags = np.zeros((2, 2, 3))
        flags[..., 0], flags[..., 2] = 1, finite
        self.chain = Chain(flags, lead, exact=True)
        self.chain.fixed, self.chain.moving = ([places[i][j] for i in (0, 1)] for j in (0, 1))
        self.kinds, self.lead = self.chain.kinds, lead
        self.circle: Any = None  # a crank, the other dyad and its kind, where the coupler leads a crank
        self.point = mp.mpc(*numbers[8:10]) if len(numbers) >= 10 else mp.mpc(0)
        if lead == 2 and "RR" in self.kinds:
            first = self.kinds.index("RR")
            self.circle = (places[first], places[1 - first], self.kinds[1 - first])
        gaps = [abs(d) + abs(turn - 1) * abs(places[0][1]) for d, turn in (self._pose(mp.mpf(0), s) for s in (1, -1))]
        self.side = 1 if gaps[0] <= gaps[1] else -1

    def pose(self, angle: Any, side: int | None = None) -> tuple[Any, Any]:
        """Return d and turn of z -> d + turn z."""
        d, turn = self._pose(angle, self.side if side is None else side)
        if abs(abs(turn) - 1) > 1e-9:  # the root of a negative number
            raise NotClosed
        return d, turn

    def _pose(self, angle: Any, side: int) -> tuple[Any, Any]:
        if self.circle is None:
            found: tuple[Any, Any] = self.chain.pose(angle, side)
            return found
        ((a, a_star), (b, b_star), kind), turn = self.circle, mp.expj(angle)
        r, bar = abs(a_star - a), b_star - a_star
        if kind == "RR":
            at = circle_circle(a, r, b - turn * bar, abs(b_star - b), side, mp.sqrt)
        elif kind == "PR":
            at = circle_line(a, r, b, dot(b, b_star) - dot(b, turn * bar), side, mp.sqrt)
        else:
            normal = turn * b_star
            at = circle_line(a, r, normal, dot(normal, b) - dot(b_star, b - a_star), side, mp.sqrt)
        if abs(abs(at - a) - r) > 1e-9 * r:
            raise NotClosed
        return at - turn * a_star, turn

    def at(self, angle: Any) -> Any:
        """Return where the coupler point is."""
        d, turn = self.pose(angle)
        return d + turn * self.point

    def derivatives(self, order: int = 2, step: float = 1e-8) -> list[Any]:
        """Return derivatives of the point's place by the angle, in the given position, by differences."""
        with mp.workdps(2 * DIGITS + 20):
            h = mp.mpf(step) ** 2
            ahead, here, behind, far, back = (self.at(k * h) for k in (1, 0, -1, 2, -2))
            found = [(ahead - behind) / (2 * h), (ahead - 2 * here + behind) / h**2]
            if order > 2:
                found.append((far - 2 * ahead + 2 * behind - back) / (2 * h**3))
        return found


def width(places: Sequence[Any]) -> float:
    """Return half the width of the narrowest strip that holds places, at Chebyshev points of a parameter, of a path."""
    chord = places[-1] - places[0]
    if abs(chord) * 1e3 < max(abs(p - places[0]) for p in places):  # it runs out and back
        chord = max((p - places[0] for p in places), key=abs)
    w = [(p - places[0]) / chord for p in places]
    scale = max(abs(p.imag) for p in w)
    u, v = np.array([float(p.real) for p in w]), np.array([float(p.imag / scale) for p in w])
    n = len(places) - 1
    x, fine = -np.cos(np.pi * np.arange(n + 1) / n), -np.cos(np.pi * np.arange(4001) / 4000)
    u, v = (np.polynomial.Chebyshev.fit(x, f, n, domain=(-1, 1))(fine) for f in (u, v))
    return narrowest_strip(u, v, float(scale)) * float(abs(chord))


# -- rows -------------------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Row:
    """Some cases of one kernel under one stress.

    Attributes
    ----------
    inputs : ndarray, shape (n, k)
        The numbers that are given.
    ours : function
        Of inputs (n, k), returns (n, m); NaN where the catalogue says that it does not know.
    exact : function
        Of the case's number and its k numbers of mpmath, returns m numbers of mpmath.  What is compared is a vector:
        errors are divided by its largest component, or by `unit`.
    bound : float
        How many times the inherent error the error may be.
    seen : function, optional
        What is compared instead of `ours`: of the case's number and m doubles, returns numbers of mpmath.
    method : float or ndarray, shape (n,)
        Relative error that the method leaves by its own documents, where that is more than rounding.
    unit, condition : ndarray, shape (n,), optional
        By what the error is divided, and by what the error over the bound is divided besides: a condition that the
        catalogue itself reports.
    """

    kernel: str
    stress: str
    inputs: Array
    ours: Callable[[Array], Array]
    exact: Callable[[int, list[Any]], list[Any]]
    bound: float = 100.0
    seen: Callable[[int, Array], list[Any]] | None = None
    method: Array | float = 0.0
    unit: Array | None = None
    condition: Array | None = None
    timed: bool = True
    roundings: int = ROUNDINGS


@dataclass(frozen=True)
class Outcome:
    """Of a row: relative errors and inherent ones of the cases that have an answer, (n,), NaN where there is none;
    errors over bound; how many were not answered although determined, and because the numbers do not determine them;
    microseconds per case."""

    row: Row
    error: Array
    inherent: Array
    factor: Array
    refused: int
    unknown: int
    time: float

    @property
    def good(self) -> bool:
        """Whether nothing is worse than its bound."""
        return bool(np.nanmax(self.factor, initial=0) <= self.row.bound)


def tried(row: Row, *, timed: bool = False, seed: int = 1) -> Outcome:
    """Return what comes of a row."""
    draw = np.random.default_rng(seed)
    with np.errstate(all="ignore"):
        ours = np.asarray(row.ours(row.inputs))
    n = len(row.inputs)
    error, inherent = np.full(n, np.nan), np.full(n, np.nan)
    refused = unknown = 0
    for i in range(n):
        with mp.workdps(DIGITS):
            numbers = [mp.mpf(float(v)) for v in row.inputs[i]]
            try:
                exact = row.exact(i, numbers)
            except (NotClosed, ZeroDivisionError):
                unknown += 1
                if np.isfinite(ours[i]).all():
                    error[i], inherent[i] = np.inf, 0.0  # an answer where there is none
                continue
            unit = mp.mpf(float(row.unit[i])) if row.unit is not None else max(abs(v) for v in exact)
            moved = mp.mpf(0)
            for _ in range(row.roundings):
                other = [v * (1 + EPS * mp.mpf(draw.uniform(-1, 1))) for v in numbers]
                try:
                    moved = max(moved, *(abs(a - b) for a, b in zip(row.exact(i, other), exact, strict=True)))
                except (NotClosed, ZeroDivisionError):
                    moved = mp.mpf("inf")
            inherent[i] = float(moved / unit)
            if not np.isfinite(ours[i]).all():
                refused += inherent[i] < UNDETERMINED
                unknown += not inherent[i] < UNDETERMINED
                inherent[i] = np.nan
                continue
            mine = row.seen(i, ours[i]) if row.seen else [number(v) for v in ours[i]]
            error[i] = float(max(abs(a - b) for a, b in zip(mine, exact, strict=True)) / unit)
    with np.errstate(all="ignore"):
        left = np.where(inherent < UNDETERMINED, inherent, np.nan)  # beyond, any answer is as good as another
        factor = np.where(error == np.inf, np.inf, np.maximum(error - row.method, 0) / (left + EPS))
        factor = factor / (1 if row.condition is None else row.condition)
    return Outcome(row, error, inherent, factor, refused, unknown, _microseconds(row) if timed else np.nan)


def number(value: Any) -> Any:
    """Return a double, or a complex one, in many digits."""
    return mp.mpc(complex(value)) if isinstance(value, complex | np.complexfloating) else mp.mpf(float(value))


def _microseconds(row: Row, batch: int = 256) -> float:
    if not row.timed:
        batch = 1
    many = np.tile(row.inputs, (-(-batch // len(row.inputs)), 1)) if row.timed else row.inputs
    taken = []
    with np.errstate(all="ignore"):
        for _ in range(3):
            start = time.perf_counter()
            row.ours(many)
            taken.append(time.perf_counter() - start)
    return 1e6 * min(taken) / len(many)


def linkages(inputs: Array, finite: Mask) -> tuple[Linkage, Array]:
    """Return linkages and coupler points of rows of numbers; `finite` (n, 2, 2), repeated as often as needed."""
    n = len(inputs)
    finite = np.tile(finite, (-(-n // len(finite)), 1, 1))[:n]
    pivots = np.concatenate([inputs[:, :8].reshape(n, 2, 2, 2), finite[..., None]], axis=-1)
    return Linkage.trusted(Linkage(pivots).pivots.copy()), inputs[:, 8] + 1j * inputs[:, 9]


def numbers_of(linkage: Linkage, point: Array) -> Array:
    """Return rows of numbers of linkages and coupler points, shape (n, 10)."""
    return np.concatenate(
        [linkage.pivots[..., :2].reshape(len(linkage), 8), np.stack([point.real, point.imag], 1)], axis=1
    )
