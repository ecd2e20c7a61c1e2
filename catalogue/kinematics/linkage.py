"""Linkages: two dyads and the coupler they guide, as batches of homogeneous pivots.

A pivot is (x, y, w).  w = 1: a point; w = 0: the point at infinity in direction (x, y).  A dyad is
a fixed and a moving pivot:

====  ========================  ================================================================
dyad  pivots                    constraint
====  ========================  ================================================================
RR    both finite               crank: the moving pivot keeps its distance from the fixed one
PR    fixed pivot at infinity   slider: the moving pivot stays on a fixed line, whose normal is
                                the direction of the fixed pivot
RP    moving pivot at infinity  slide: a line of the coupler, whose normal is the direction of
                                the moving pivot, always passes through the fixed pivot
====  ========================  ================================================================

Pivots are given in one *reference position*, in which fixed and moving plane share their
coordinates.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ..errors import InvalidLinkage
from ..given import doubles
from .types import Array, Complexes, Floats, Integers, Mask, Objects, Texts

RR = 0  #: crank
PR = 1  #: slider on a rail
RP = 2  #: slide with a slot
FAMILIES: dict[str, tuple[int, int]] = {
    "four-bar": (RR, RR),
    "slider-crank": (RR, PR),
    "inverted-slider-crank": (RR, RP),
    "swinging-block": (PR, RP),
    "elliptic-trammel": (PR, PR),
    "oldham": (RP, RP),
}
#: Families with a sliding joint.
SLIDING = tuple(name for name, dyads in FAMILIES.items() if dyads != (RR, RR))
_NAME = np.empty((3, 3), dtype=object)
for _name, (_i, _j) in FAMILIES.items():
    _NAME[_i, _j] = _NAME[_j, _i] = _name


class Extent(NamedTuple):
    """Limits of sizes in double precision."""

    coincident: float = 1e-12  #: distance up to which two pivots coincide [sizes of the linkage]
    #: Least unit of `coincident`, for linkages far from the origin [distance from the origin].
    rounding: float = 1e-3
    smallest: float = 1e-152  #: smallest size [length]: its square is still a normal double
    largest: float = 1e152  #: largest coordinate of a pivot [length]: its square is still a double


EXTENT = Extent()


class Linkage:
    """A batch of n linkages.

    Parameters
    ----------
    pivots : array_like, shape (2, 2, 3) or (n, 2, 2, 3)
        Dyad, (fixed, moving), (x, y, w), in any length unit; (x, y) is a finite pivot, w = 1.
        Scaled on entry so that w is 0 or 1 and the direction of a pivot at infinity is a unit
        vector.

    Raises
    ------
    InvalidLinkage
        NaN or infinite numbers, lengths beyond 1e-152 ... 1e152, a wrong shape, a dyad with both
        pivots at infinity, a link of length zero, coincident fixed or coincident moving pivots (at
        infinity: parallel directions).

    Examples
    --------
    >>> from catalogue import Linkage
    >>> slider_crank = Linkage([[[0, 0, 1], [1, 0, 1]], [[0, 1, 0], [3, 0, 1]]])
    >>> str(slider_crank.family[0]), len(slider_crank)
    ('slider-crank', 1)
    """

    def __init__(self, pivots: npt.ArrayLike) -> None:
        given = _read(pivots)
        refuse(faults(given))
        self.pivots = _normalised(given)
        self.pivots.setflags(write=False)

    @classmethod
    def of(cls, given: LinkageLike) -> Linkage:
        """Convert linkages, pivots or a mapping of link lengths to a `Linkage`.

        Parameters
        ----------
        given : Linkage, array_like or mapping
            See `catalogue.kinematics.from_lengths` for a mapping.
        """
        if isinstance(given, Linkage):
            return given
        if isinstance(given, Mapping):
            from .from_lengths import from_lengths  # imported late: it is built on this module

            return from_lengths(given)
        return cls(given)

    @classmethod
    def valid(cls, pivots: Floats) -> tuple[Linkage, Mask]:
        """Select the valid linkages from arrays of pivots.

        Parameters
        ----------
        pivots : ndarray, shape (n, 2, 2, 3)

        Returns
        -------
        Linkage, ndarray of bool, shape (n,)
            The valid linkages, and their mask.
        """
        mask = faults(pivots) == ""
        return cls.trusted(_normalised(pivots[mask])), mask

    @classmethod
    def trusted(cls, pivots: Floats) -> Linkage:
        """Make linkages of valid pivots without checks or copies; the array is frozen.

        Parameters
        ----------
        pivots : ndarray, shape (n, 2, 2, 3)
            w is 0 or 1, directions are unit vectors.
        """
        made = cls.__new__(cls)
        made.pivots = pivots
        made.pivots.setflags(write=False)
        return made

    def __len__(self) -> int:
        return len(self.pivots)

    def __getitem__(self, index: Any) -> Linkage:
        chosen = self.pivots[index]
        return self.trusted(chosen.reshape(-1, 2, 2, 3))

    def __iter__(self) -> Iterator[Linkage]:
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        names = ", ".join(f"{np.sum(self.family == name)} {name}" for name in np.unique(self.family))
        return f"<Linkage: {names or 'empty'}>"

    def _repr_html_(self) -> str:
        """Return the pivots as a table for a notebook."""
        from ..html_table import MOST, html_table

        def place(x: float, y: float, w: float) -> str:
            return f"({x:.6g}, {y:.6g})" if w else f"∞ along ({x:.6g}, {y:.6g})"

        rows = [[one.family[0], *(place(*pivot) for pivot in one.pivots.reshape(4, 3).tolist())] for one in self[:MOST]]
        return html_table(["family", "A₁", "A₁*", "A₂", "A₂*"], rows, len(self))

    @cached_property
    def dyads(self) -> Integers:
        """Kind of each dyad (`RR`, `PR`, `RP`), shape (n, 2), from the zeros of w."""
        finite = self.pivots[..., 2] != 0
        return np.where(finite.all(-1), RR, np.where(finite[..., 1], PR, RP))

    @cached_property
    def family(self) -> Texts:
        """Family name of each linkage, shape (n,)."""
        return np.asarray(_NAME[self.dyads[:, 0], self.dyads[:, 1]], dtype=str)

    @property
    def points(self) -> Complexes:
        """Pivots as complex numbers x + iy, shape (n, 2, 2).

        A pivot at infinity is given by its unit direction.
        """
        return self.pivots[..., 0] + 1j * self.pivots[..., 1]

    @property
    def finite(self) -> Mask:
        """True where a pivot is finite, shape (n, 2, 2)."""
        return np.asarray(self.pivots[..., 2] != 0)

    @cached_property
    def rays(self) -> Complexes:
        """Unit vector of each dyad's ray, complex, shape (n, 2): along the crank, else the normal.

        NaN where the pivots of a crank coincide by rounding.
        """
        z, kind = self.points, self.dyads
        crank = z[..., 1] - z[..., 0]
        ray = np.where(kind == RR, crank, np.where(kind == PR, z[..., 0], z[..., 1]))
        with np.errstate(invalid="ignore"):
            return np.asarray(ray / np.abs(ray))

    @cached_property
    def sine(self) -> Floats:
        """Sine of the angle from ray 1 to ray 2, shape (n,).

        It is 0 for parallel cranks and at dead points.
        """
        return np.asarray((self.rays[:, 0].conj() * self.rays[:, 1]).imag)

    @cached_property
    def size(self) -> Floats:
        """Diameter of the finite pivots, shape (n,) [length]."""
        z = np.where(self.finite, self.points, np.nan).reshape(-1, 4)
        return np.asarray(np.nanmax(np.abs(z[:, :, None] - z[:, None, :]), axis=(1, 2)))

    def inverted(self) -> Linkage:
        """Return the kinematic inversions: fixed and moving plane exchanged."""
        return self.trusted(np.ascontiguousarray(self.pivots[:, :, ::-1]))

    def moved(self, scale: npt.ArrayLike = 1.0, shift: npt.ArrayLike = 0.0, mirror: npt.ArrayLike = False) -> Linkage:
        """Transform the linkages by z -> scale z + shift; mirrored: z -> scale conj(z) + shift.

        Parameters
        ----------
        scale, shift : complex array_like, shape () or (n,)
            ``abs(scale)`` is the magnification, its angle the rotation; the shift is a length.
        mirror : bool array_like, shape () or (n,)

        Raises
        ------
        InvalidLinkage
            If a scale is zero or not finite, or a shift not finite.
        """
        try:
            given = np.asarray(scale, dtype=complex), np.asarray(shift, dtype=complex), np.asarray(mirror, dtype=bool)
            a, b, flip = (np.broadcast_to(v, len(self))[:, None, None] for v in given)
        except (TypeError, ValueError, OverflowError):
            raise InvalidLinkage("scale, shift and mirror must be one number each, or one for each linkage") from None
        if not (np.all(np.isfinite(a)) and np.all(np.isfinite(b)) and np.all(a != 0)):
            raise InvalidLinkage("a similarity needs a finite shift and a finite scale other than zero")
        z = np.where(flip, self.points.conj(), self.points)
        z = np.where(self.finite, a * z + b, a / np.abs(a) * z)
        return self.trusted(homogeneous(z, self.pivots[..., 2]))


#: Types that `Linkage.of` accepts: linkages, pivots, or link lengths as in `from_lengths`.
LinkageLike: TypeAlias = Linkage | npt.ArrayLike | Mapping[str, Any]


SHAPE = "a linkage is [[A1, A1*], [A2, A2*]], each pivot (x, y) or (x, y, w)"


def _read(pivots: npt.ArrayLike) -> Floats:
    """Parse pivots, shape (n, 2, 2, 3), with w = 1 where missing; refuse other shapes."""
    try:
        given = doubles(pivots)
    except ValueError:
        try:  # only pivots at infinity are given with w
            given = doubles(_complete(pivots))
        except ValueError:
            raise InvalidLinkage(f"pivots must be numbers in an array of shape (n, 2, 2, 3): {SHAPE}") from None
    if given.shape[-3:] == (2, 2, 2):
        given = np.insert(given, 2, 1.0, axis=-1)
    if given.shape[-3:] != (2, 2, 3) or given.ndim not in (3, 4):
        raise InvalidLinkage(f"pivots must have shape (2, 2, 3) or (n, 2, 2, 3), not {given.shape}: {SHAPE}")
    return given.reshape(-1, 2, 2, 3)


def _complete(given: object) -> Any:
    """Return nested sequences with w = 1 after each x, y."""
    if not isinstance(given, Sequence | np.ndarray) or isinstance(given, str | bytes):
        return given
    if isinstance(given, np.ndarray) and not given.ndim:
        return given.item()
    if len(given) == 2 and not any(isinstance(part, Sequence | np.ndarray) for part in given):
        return [*given, 1.0]
    return [_complete(part) for part in given]


def homogeneous(z: Complexes, w: npt.ArrayLike = 1.0) -> Floats:
    """Return (x, y, w) of complex numbers z, shape (..., 3); w is NaN where z is."""
    return np.stack([z.real, z.imag, np.where(np.isnan(z.real), np.nan, w)], axis=-1)


def refuse(wrong: Array) -> None:
    """Raise `InvalidLinkage` for the first fault in the messages of linkages (n,).

    An empty message means no fault.
    """
    bad = np.flatnonzero(wrong != "")
    if bad.size:
        more = f" (and {bad.size - 1} more)" if bad.size > 1 else ""
        raise InvalidLinkage(f"linkage {bad[0]}: {wrong[bad[0]]}{more}")


def faults(pivots: Floats) -> Objects:
    """Find the faults of pivots.

    Parameters
    ----------
    pivots : ndarray, shape (n, 2, 2, 3)

    Returns
    -------
    ndarray of str, shape (n,)
        A message for each linkage, empty if it is valid.
    """
    p = np.asarray(pivots, dtype=float)
    wrong = np.full(len(p), "", dtype=object)

    def mark(where: Mask, text: str) -> None:
        wrong[where & (wrong == "")] = text

    mark(~np.isfinite(p).all(axis=(1, 2, 3)), "a pivot has a NaN or infinite coordinate (at infinity means w = 0)")
    with np.errstate(all="ignore"):
        q = _normalised(p)
        z, finite = q[..., 0] + 1j * q[..., 1], q[..., 2] != 0
        mark((p == 0).all(-1).any(axis=(1, 2)), "a pivot is (0, 0, 0), which is no point")
        lost = ~np.isfinite(q).all(axis=-1) | ~finite & (z == 0)
        mark(lost.any(axis=(1, 2)), "a pivot is so far out that its coordinates overflow")
        mark((~finite).all(-1).any(-1), "a dyad has both pivots at infinity")
        spread = np.where(finite, np.abs(z - np.where(finite[:, :1, :1], z[:, :1, :1], 0)), 0)
        size, far = spread.max(axis=(1, 2)), np.abs(np.where(finite, z, 0)).max(axis=(1, 2))
        near = EXTENT.coincident * np.maximum(size, far * EXTENT.rounding)
        mark(far > EXTENT.largest, f"a pivot is farther out than {EXTENT.largest:.0e}: choose another unit of length")
        mark(
            (size < EXTENT.smallest) & (size > 0),
            f"it is smaller than {EXTENT.smallest:.0e}: choose another unit of length",
        )
        link = np.abs(z[..., 0] - z[..., 1])
        mark((finite.all(-1) & (link <= near[:, None])).any(-1), "the two pivots of a crank coincide")
        for k, name in enumerate(("fixed", "moving")):
            both, none = finite[:, :, k].all(-1), ~finite[:, :, k].any(-1)
            apart = np.abs(z[:, 0, k] - z[:, 1, k])
            cross = np.abs((z[:, 0, k].conj() * z[:, 1, k]).imag)
            mark(both & (apart <= near), f"the two {name} pivots coincide")
            mark(none & (cross <= EXTENT.coincident), f"the two {name} pivots at infinity coincide (parallel lines)")
    return wrong


def _normalised(pivots: Floats) -> Floats:
    x, y, w = np.moveaxis(np.asarray(pivots, dtype=float), -1, 0)
    by = np.where(w != 0, w, np.hypot(x, y))
    with np.errstate(all="ignore"):
        return np.stack([x / by, y / by, np.where(w != 0, 1.0, 0.0)], axis=-1)
