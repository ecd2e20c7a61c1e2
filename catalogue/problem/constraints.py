"""Constraints on answers, besides the tolerance of the path."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any, TypeAlias, TypedDict

import numpy as np

from ..errors import InvalidRequest
from ..given import doubles, names, number, positive, switch, whole
from ..kinematics.types import Floats
from ..quantities import BOUNDS, DRIVE, LENGTHS, SIZES, TRANSMISSIONS, BoundArguments, Bounded
from .path import digits
from .region import Region, RegionLike, zones

#: Two points, ((x, y), (x, y)) or (x, y, x, y).
TwoPoints: TypeAlias = Floats | Sequence[float | Sequence[float]]


class DwellArguments(TypedDict, total=False):
    """Constraints of a dwell as keywords; see `Constraints`."""

    families: Sequence[str]
    series: Sequence[str]
    configurations: Sequence[str]
    order: int
    pins_only: bool
    min_transmission: float
    max_size: float | None


class ConstraintArguments(BoundArguments, DwellArguments, total=False):
    """All constraints as keywords, for type checkers: the fields of `Constraints`."""

    slots: bool
    returns: bool
    fixed_pivots_in: RegionLike | None
    pivots_in: RegionLike | None
    fixed_pivots: TwoPoints | None
    moving_pivots: TwoPoints | None
    crank: TwoPoints | None
    within: float
    swept_in: RegionLike | None
    keep_out: Region | Floats | Sequence[float | RegionLike]
    play: float


REGIONS = ("fixed_pivots_in", "pivots_in", "swept_in")
#: Constraints that prescribe pivots, with the name of the prescribed pair.
PRESCRIBED = {"fixed_pivots": "fixed", "moving_pivots": "moving", "crank": "crank"}


@dataclass(frozen=True, init=False, repr=False, eq=False)
class _KindAndPlace:
    """Fields of `Constraints` before the bounds."""

    families: Sequence[str] = ()
    series: Sequence[str] = ()
    configurations: Sequence[str] = ()
    pins_only: bool = False
    order: int = 0
    slots: bool = False
    returns: bool = False
    fixed_pivots_in: Any = None
    pivots_in: Any = None
    fixed_pivots: Any = None
    moving_pivots: Any = None
    crank: Any = None
    within: float = 0.0
    swept_in: Any = None
    keep_out: Any = ()


dataclass(frozen=True, init=False, repr=False, eq=False)(Bounded)


@dataclass(frozen=True)
class Constraints(Bounded, _KindAndPlace):
    """Constraints on an answer; lengths in the unit of the request.

    Positions are in the frame in which the path runs from (0, 0) to (stroke, 0).  Without
    `max_size` answers have at most 100 strokes, or ten times the extent of regions, prescribed
    pivots, least lengths and radius, but never more than 1,000 strokes.  Bounds over the turn of
    the driving crank imply `full_rotation`.

    Attributes
    ----------
    families, series, configurations : sequence of str
        Permitted ones; all if empty.
    pins_only : bool
        Revolute joints only, no sliders.
    order : int
        Minimum order of contact of the stored guide at its design position.
    slots : bool
        Guide a straight or circular slot in the coupler over a fixed point, instead of a coupler
        point along a path.  An answer shows the inverse motion, in which the point runs along the
        slot: its fixed pivots are the pivots of the coupler.
    returns : bool
        Guide a coupler point that travels the path to one end, rests there and travels back.  Such
        an answer has no allowance; its score consists of the other desirabilities.
    fixed_pivots_in, pivots_in : (x0, y0, x1, y1) or sequence of points (x, y), optional
        Region of the fixed pivots and rails; of all pivots, rails and slots at mid-stroke (for a
        returning point: at rest) [length].  A pivot at infinity is exempt; a rail or slot is as
        long as its travel over the stroke.
    fixed_pivots, moving_pivots : two points (x, y), optional
        Prescribed positions of the fixed pivots; of the moving ones at mid-stroke [length].  At
        most 10,000 strokes from the path.  The deviation is then measured from the prescribed line
        or arc itself, not from the best-fitting one.
    crank : two points (x, y), optional
        Prescribed fixed pivot and, at mid-stroke, moving pivot of one crank [length].
    within : float
        Tolerance of prescribed positions [length].
    swept_in : region as above, optional
        Region of the whole linkage over the stroke; see `catalogue.guidance.swept_area`.
    keep_out : sequence of regions
        Regions that no link may enter over the stroke.
    full_rotation : bool
        The driving crank must turn fully.
    BOUNDS
    play : float
        Standard deviation of every pivot coordinate, from play and manufacture [length].  With
        play, a ranking by deviation uses `Candidate.expected`.

    Examples
    --------
    >>> from catalogue import Constraints
    >>> Constraints(families=["four-bar"], min_transmission=40, max_size=300).active()
    ['families', 'max_size', 'min_transmission']
    """

    play: float = 0.0

    def __post_init__(self) -> None:
        def convert(names: Iterable[str], to: Callable[[str, Any], Any]) -> None:
            for name in names:
                value = getattr(self, name)
                if value is not getattr(Constraints, name):  # a value other than the default
                    object.__setattr__(self, name, to(name, value))

        convert(("families", "series", "configurations"), names)
        convert(("pins_only", "slots", "returns", "full_rotation"), switch)
        convert((*LENGTHS, *DRIVE), positive)
        convert(["keep_out"], zones)
        convert(REGIONS, Region.of)
        convert(["order"], partial(whole, least=0))
        convert([row.name for row in TRANSMISSIONS], _acute)
        convert(["play", "within"], lambda name, v: number(name, v) and positive(name, v))
        convert(PRESCRIBED, _two_points)
        if self.needs_turn:
            object.__setattr__(self, "full_rotation", True)
        if self.min_lift and (self.slots or self.returns):
            raise InvalidRequest("min_lift is of points that run along the path: it does not go with slots or returns")
        given = [name for name in PRESCRIBED if getattr(self, name) is not None]
        if len(given) > 1:
            raise InvalidRequest(f"{given[0]} and {given[1]} exclude one another: give one of them")
        if self.within and not given:
            raise InvalidRequest(f"within says how far off given pivots may stand: give {', '.join(PRESCRIBED)}")
        if given and (self.slots or self.returns):
            raise InvalidRequest(f"slots and returns cannot be asked for with {given[0]}")
        if self.slots and self.returns:
            raise InvalidRequest("slots and returns exclude one another: ask for one of them")
        if self.returns and (self.min_allowance or self.play):
            name = "min_allowance" if self.min_allowance else "play"
            raise InvalidRequest(f"{name} does not go with returns: what play does to a point at rest is not known")
        for what in ("link", "ground"):
            least, largest = (getattr(self, f"{side}_{what}") for side in ("min", "max"))
            if least is not None and largest is not None and least > largest:
                raise InvalidRequest(f"min_{what} {least:g} is above max_{what} {largest:g}: nothing can be between")

    @classmethod
    def of(cls, given: Mapping[str, Any], options: Iterable[str] = ()) -> Constraints:
        """Build constraints from keywords; suggest the closest name for an unknown one.

        Parameters
        ----------
        given : mapping of str to object
            Values of fields by name.
        options : iterable of str
            Further names to suggest.
        """
        known = [field.name for field in fields(cls)]
        if wrong := [name for name in given if name not in known]:
            from difflib import get_close_matches

            near = get_close_matches(wrong[0], [*known, *options], n=1)
            raise InvalidRequest(
                f"unknown constraint: {wrong[0]!r}; "
                + (f"did you mean {near[0]}?" if near else "`help(catalogue.Constraints)` lists what there is")
            )
        return cls(**given)

    @property
    def longest(self) -> float | None:
        """Upper bound on every crank, the coupler and the ground [length]; None without any."""
        bounds = (getattr(self, row.name) for row in SIZES if row.is_of_links)
        return min((bound for bound in bounds if bound is not None), default=None)

    @property
    def shortest(self) -> float:
        """Largest lower bound on a length of the linkage [length]; 0 without any."""
        return max(getattr(self, row.name) or 0.0 for row in SIZES if not row.is_upper)

    @property
    def needs_turn(self) -> bool:
        """Whether a bound can be met only by a guide whose driving crank turns fully."""
        return any(row.needs_turn and getattr(self, row.name) for row in BOUNDS.values())

    @property
    def given(self) -> str | None:
        """Name of the prescribed pair of pivots, as in `catalogue.series.posed.Posed`."""
        return next((kind for name, kind in PRESCRIBED.items() if getattr(self, name) is not None), None)

    @property
    def places(self) -> tuple[tuple[float, float], ...]:
        """Positions of the prescribed pivots."""
        places: tuple[tuple[float, float], ...] = self.fixed_pivots or self.moving_pivots or self.crank
        return places

    def carried(self, scale: complex, shift: complex) -> Constraints:
        """Transform the constraints by z -> scale z + shift, into strokes.

        Bounds are rounded to 12 digits and regions to 12 decimals, so that results do not depend on
        the unit.

        Parameters
        ----------
        scale : complex
            Its magnitude is 1 over the stroke [1/length].
        shift : complex
            Displacement [strokes].
        """
        lengths = {name: getattr(self, name) for name in (*LENGTHS, "within", "play")}
        to: dict[str, Any] = {name: digits(value * abs(scale)) for name, value in lengths.items() if value}
        to |= {n: region.carried(scale, shift).rounded() for n in REGIONS if (region := getattr(self, n)) is not None}
        to["keep_out"] = tuple(zone.carried(scale, shift).rounded() for zone in self.keep_out)
        for name in PRESCRIBED:
            if (pair := getattr(self, name)) is not None:
                carried = [scale * complex(*place) + shift for place in pair]
                to[name] = tuple((z.real, z.imag) for z in carried)
        return replace(self, **to)

    @property
    def regions(self) -> list[Region]:
        """All regions and keep-out zones."""
        return [*(region for name in REGIONS if (region := getattr(self, name)) is not None), *self.keep_out]

    def mirrored(self, reverse: bool, over: bool, stroke: float = 1.0) -> Constraints:
        """Mirror regions and zones for a path that starts at the origin.

        Parameters
        ----------
        reverse, over : bool
            Whether to mirror at mid-path, and in the line of the path.
        stroke : float
            Length of the path.
        """
        image = reverse, over, stroke
        to: dict[str, Any] = {
            name: region.mirrored(*image) for name in REGIONS if (region := getattr(self, name)) is not None
        }
        return replace(self, **to, keep_out=tuple(zone.mirrored(*image) for zone in self.keep_out))

    def active(self) -> list[str]:
        """List the names of the constraints in force."""
        return [f.name for f in fields(self) if getattr(self, f.name) != f.default]


Constraints.__doc__ = str(Constraints.__doc__).replace(
    "    BOUNDS",
    "\n".join(f"    {row.name} : float, optional\n        {row.text} [{row.unit}]" for row in BOUNDS.values()),
)


def _acute(name: str, given: object) -> float:
    angle = number(name, given, "between 0 and 90 degrees")
    if not 0 <= angle < 90:
        raise InvalidRequest(f"{name} must be between 0 and 90 degrees, not {angle:g}")
    return angle


def _two_points(name: str, given: object) -> tuple[tuple[float, float], ...]:
    """Parse two points: ((x, y), (x, y)) or (x, y, x, y)."""
    try:
        values = doubles(given)
    except ValueError:
        values = np.empty(0)
    if values.shape not in ((2, 2), (4,)):
        raise InvalidRequest(f"{name} must be two points, x and y of each")
    if not np.isfinite(values).all():
        raise InvalidRequest(f"{name} has a coordinate that is not finite")
    (a, b), (c, d) = values.reshape(2, 2).tolist()
    if (a, b) == (c, d):
        raise InvalidRequest(f"{name} coincide at ({a:g}, {b:g}): give two places")
    return (a, b), (c, d)
