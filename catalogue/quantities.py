"""Measured quantities and the bounds on them, a row each; importable without NumPy.

Constraints, ranking, violations, rows of refinement, options, stored columns, answers, tables, data
sheets and pages are made from `QUANTITIES`.  A new measure of guides takes three steps:

1. Here, a row, and fields in `Bounded`, `BoundArguments` and `Further` for type checkers.
2. Its value, in `guidance.metrics.Measures` or `guidance.drive.DriveMetrics`.
3. Its pieces with derivatives, in `refine.quantities` or `refine.driving`.
"""

from __future__ import annotations

from math import inf
from typing import Any, NamedTuple, TypedDict, TypeVar, dataclass_transform

from .units import LENGTH

T = TypeVar("T")
#: Units beside `LENGTH`.
DEGREES = "deg"
RATIO = "1"
#: Sources of quantities: `Measures`, `DriveMetrics`, or a function.
MEASURES = "measures"
DRIVE_METRICS = "drive"
FUNCTION = "function"


class Bound(NamedTuple):
    """A bound on one side of a quantity, and the ranking criterion that favours this side."""

    name: str  #: keyword of `Constraints`; with hyphens the option
    is_upper: bool  #: whether it is the largest value allowed, else the least
    text: str  #: help of the option
    option: str = ""  #: further spellings of the option
    default: float | None = None  #: value without the option
    criterion: str = ""  #: name in the ranking; empty: it is not ranked
    is_main: bool = False  #: whether lists of criteria begin with it
    scores_only: bool = False  #: whether it is ranked within the score only
    desire: tuple[float, float] | None = None  #: desirabilities of 1 and of 0 [strokes, right angles, tolerances]
    absent: float | None = None  #: value in costs of a guide that has none, such as one without sliders
    limit: float | None = None  #: value that no guide improves on [strokes, right angles]
    typical: float | None = None  #: value taken of stored guides, where it is not stored
    is_of_links: bool = False  #: whether it bounds every crank, the coupler and the ground
    needs_crank: bool = False  #: whether only a guide with a crank can meet it
    needs_turn: bool = False  #: whether only a guide whose driving crank turns fully can meet it
    piece: str = ""  #: name in the refinement: the criterion, else the quantity
    measure: str = ""  #: name of the quantity
    unit: str = ""  #: that of the quantity
    source: str = ""  #: where the quantity is measured


class Range(NamedTuple):
    """Values that a stored column may hold."""

    least: float
    most: float
    check: str = ""  #: as a condition of the table; empty: none


POSITIVE = Range(5e-324, 1e300, "> 0")
NOT_NEGATIVE = Range(0, 1e300, ">= 0")
ACUTE = Range(0, 90, "BETWEEN 0 AND 90")
TURN = Range(0, 1e6)


class Stored(NamedTuple):
    """A column of stored reaches."""

    range: Range
    comment: str
    is_nullable: bool = True


class Quantity(NamedTuple):
    """A measured number of a guide."""

    name: str  #: column of answers, and attribute of the class that measures it
    unit: str  #: `LENGTH`, `DEGREES` or `RATIO`
    source: str  #: `MEASURES`, `DRIVE_METRICS` or `FUNCTION`
    meaning: str
    bounds: tuple[Bound, ...] = ()
    stored: Stored | None = None
    title: str = ""  #: of its column, with soft hyphens; default: its name
    format: str = ""  #: of numbers in the command's tables
    legend: int = 0  #: place among the columns, those of `Measured` or those after them
    sheet: tuple[int, str] = (0, "")  #: place, and words in the limits of a data sheet; 0: none
    page: int = 0  #: place among the numbers of a page; 0: none
    in_study: bool = False  #: whether the table of a study shows it

    def at_most(self, name: str, text: str = "", **more: Any) -> Quantity:
        """Add an upper bound; its help is by default that of the meaning."""
        return self._bounded(Bound(name, True, text or f"Maximum {self.meaning}.", **more))

    def at_least(self, name: str, text: str = "", **more: Any) -> Quantity:
        """Add a lower bound; its help is by default that of the meaning."""
        return self._bounded(Bound(name, False, text or f"Minimum {self.meaning}.", **more))

    def _bounded(self, bound: Bound) -> Quantity:
        bound = bound._replace(measure=self.name, unit=self.unit, source=self.source, piece=self.name)
        return self._replace(bounds=(*self.bounds, bound))

    def ranked(self, criterion: str, **more: Any) -> Quantity:
        """Make the last bound a criterion of the ranking."""
        *others, last = self.bounds
        return self._replace(bounds=(*others, last._replace(criterion=criterion, piece=criterion, **more)))

    def stored_as(self, range: Range, comment: str, *, is_nullable: bool = True) -> Quantity:
        """Add the column of stored reaches."""
        return self._replace(stored=Stored(range, comment, is_nullable))

    def shown(self, legend: int, **more: Any) -> Quantity:
        """Say where it is shown."""
        return self._replace(legend=legend, **more)


QUANTITIES = (
    Quantity("size", LENGTH, MEASURES, "overall size: diameter of pivots, rails, slots and path")
    .at_most(
        "max_size",
        "Maximum overall size: diameter of pivots, rails, slots and path (100 strokes if not given).",
        is_of_links=True,
    )
    .ranked("size", is_main=True, desire=(1.0, 6.0), limit=1.0)  # a guide is at least as large as its stroke
    .stored_as(POSITIVE, "largest diameter of pivots, rails, slots and path [stroke]", is_nullable=False)
    .shown(1, format="{:.4g}", sheet=(1, "size, path included")),
    Quantity("max_link", LENGTH, MEASURES, "longest crank or coupler")
    .at_most("max_link", "Maximum length of crank or coupler.", is_of_links=True)
    .ranked("max_link")
    .stored_as(POSITIVE, "longest crank or coupler; NULL: no link joins pivots at finite distance [stroke]")
    .shown(2, sheet=(3, "longest link"), in_study=True),
    Quantity("min_link", LENGTH, MEASURES, "shortest crank or coupler")
    .at_least("min_link", "Minimum length of crank or coupler.")
    .ranked("min_link", desire=(0.25, 0.05), absent=inf)
    .stored_as(POSITIVE, "shortest crank or coupler [stroke]")
    .shown(15, sheet=(2, "shortest link"), in_study=True),
    Quantity("max_ground", LENGTH, MEASURES, "distance between the fixed pivots")
    .at_most("max_ground", is_of_links=True)
    .ranked("max_ground")
    .at_least("min_ground")
    .ranked("min_ground", scores_only=True, desire=(0.25, 0.05), absent=inf)
    .stored_as(NOT_NEGATIVE, "distance of the fixed pivots [stroke]")
    .shown(3, page=1, in_study=True),
    Quantity("max_arm", LENGTH, MEASURES, "distance from the guided point to the nearer moving pivot")
    .at_most("max_arm")
    .ranked("max_arm")
    .stored_as(NOT_NEGATIVE, "distance of the guided point from the nearer moving pivot [stroke]", is_nullable=False)
    .shown(4, sheet=(4, "arm of the guided point"), page=2, in_study=True),
    # A rail as long as the stroke could guide the point alone, so such a linkage gains nothing.
    # Scott Russell's linkage, whose crank turns by 2 a about mid-stroke, has a travel of
    # tan(a/2)/2 strokes, at most half a stroke.
    Quantity(
        "travel",
        LENGTH,
        MEASURES,
        "longest travel of a slider along its rail or slot over the stroke; none with pins only",
    )
    .at_most("max_travel", "Maximum travel of a slider along its rail or slot over the stroke.")
    .ranked("travel", scores_only=True, desire=(0.5, 1.0), absent=0.0, typical=0.0)
    .shown(16, format="{:.3g}", sheet=(5, "slider travel"), page=3, in_study=True),
    # Textbooks ask for 40 to 50 degrees and accept 30.
    Quantity(
        "min_transmission", DEGREES, MEASURES, "minimum transmission angle over the stroke; the better crank drives"
    )
    .at_least("min_transmission", "Minimum transmission angle over the stroke; the better crank drives.", default=0.0)
    .ranked("transmission", is_main=True, desire=(60 / 90, 15 / 90), limit=1.0)
    .stored_as(ACUTE, "least transmission angle over the stroke, the better crank driving [deg]", is_nullable=False)
    .shown(5, title="trans\u00admission", format="{:.0f}\u00b0", sheet=(7, "min. transmission angle")),
    Quantity(
        "min_transmission_turn",
        DEGREES,
        FUNCTION,
        "minimum transmission angle over the full turn of the driving crank",
    )
    .at_least(
        "min_transmission_turn",
        "Minimum transmission angle over a full turn of the driving crank.",
        default=0.0,
        needs_turn=True,
    )
    .shown(17, sheet=(8, "over a full turn"), page=6),
    # Sound guides at half of their tolerance permit two to four times as much scatter.
    Quantity(
        "allowance",
        LENGTH,
        FUNCTION,
        "standard deviation of pivot position (each coordinate) at which 95 % of machines "
        "stay within the tolerance; at most a hundredth of the shortest link",
    )
    .at_least(
        "min_allowance",
        "Minimum allowance: standard deviation of pivot position at which 95 % of machines keep the tolerance.",
    )
    .ranked("allowance", is_main=True, desire=(2.0, 0.0))
    .shown(19, title="allow\u00adance", format="{:.3g}"),
    Quantity(
        "lift",
        LENGTH,
        FUNCTION,
        "distance of the point from the line or circle on its return, the driving crank turning "
        "on; none where it does not turn fully",
    )
    .at_least("min_lift", "Minimum lift of the point off its path on the return, as of a walking leg.", needs_turn=True)
    .shown(18, sheet=(6, "lift on the return")),
    Quantity("drive_angle", DEGREES, DRIVE_METRICS, "rotation of the driving crank over the stroke")
    .at_least("min_drive_angle", needs_crank=True)
    .at_most("max_drive_angle", needs_crank=True)
    .stored_as(TURN, "angle of the better driving crank over the stroke; NULL: no crank, or not measured [deg]")
    .shown(10, sheet=(9, "rotation of the drive"), page=4),
    Quantity(
        "time_ratio", RATIO, DRIVE_METRICS, "time of the return over time of the stroke at constant crank speed"
    ).shown(11, page=9),
    Quantity("rotation", DEGREES, DRIVE_METRICS, "range of the coupler's angle over the stroke")
    .at_most(
        "max_rotation",
        "Maximum rotation of the guided body over the stroke: small where it is to stay level.",
        option="--level",
    )
    .stored_as(TURN, "turn of the coupler over the stroke; NULL: not measured [deg]")
    .shown(14, sheet=(10, "rotation of the coupler"), page=5),
    Quantity("uniformity", RATIO, DRIVE_METRICS, "lowest over highest speed along the path at constant crank speed")
    .at_least(
        "min_uniformity",
        "Minimum ratio of lowest to highest speed along the path at constant crank speed.",
        needs_crank=True,
    )
    .ranked("uniformity", limit=1.0, typical=0.6)  # starts are told apart by what they break
    .shown(12, sheet=(12, "min. over max. speed"), page=7),
    Quantity(
        "advantage",
        RATIO,
        DRIVE_METRICS,
        "minimum force along the path over force at the crank pin, without friction",
    )
    .at_least(
        "min_advantage",
        "Minimum mechanical advantage: force along the path over force at the crank pin.",
        needs_crank=True,
    )
    .shown(13, sheet=(11, "min. mechanical advantage"), page=8),
)

BOUNDS = {bound.name: bound for row in QUANTITIES for bound in row.bounds}
STORED = {row.name: row.stored for row in QUANTITIES if row.stored is not None}
#: Bounds on sizes and lengths of links, on transmission angles, and on the drive.
SIZES = tuple(row for row in BOUNDS.values() if row.source == MEASURES and row.unit == LENGTH)
TRANSMISSIONS = tuple(row for row in BOUNDS.values() if row.source != DRIVE_METRICS and row.unit == DEGREES)
DRIVES = tuple(row for row in BOUNDS.values() if row.source == DRIVE_METRICS)
#: Quantities of the column of links: the shortest and the longest.
LINKS = ("min_link", "max_link")
#: Names of bounds on lengths, and on the drive.
LENGTHS = tuple(row.name for row in BOUNDS.values() if row.unit == LENGTH)
DRIVE = tuple(row.name for row in DRIVES)
#: Bounds whose side is ranked, the main ones first; the desirabilities among them.
RANKED = tuple(sorted((row for row in BOUNDS.values() if row.criterion), key=lambda row: not row.is_main))
DESIRED = tuple(row for row in RANKED if row.desire is not None)


@dataclass_transform(frozen_default=True)
def typed_fields(kind: type[T]) -> type[T]:
    """Mark a class whose fields a type checker takes for those of a dataclass.

    `dataclass` makes them so where they are used: it takes longer than all else of this module.
    """
    return kind


@typed_fields
class Bounded:
    """Fields of `Constraints` that bound quantities; None and 0 bound nothing."""

    max_size: float | None = None
    max_link: float | None = None
    min_link: float | None = None
    max_ground: float | None = None
    min_ground: float | None = None
    max_arm: float | None = None
    max_travel: float | None = None
    min_allowance: float | None = None
    min_transmission: float = 0.0
    min_transmission_turn: float = 0.0
    full_rotation: bool = False
    min_lift: float | None = None
    min_drive_angle: float | None = None
    max_drive_angle: float | None = None
    max_rotation: float | None = None
    min_uniformity: float | None = None
    min_advantage: float | None = None


class BoundArguments(TypedDict, total=False):
    """Fields of `Bounded` as keywords, besides the transmission angle over the stroke."""

    max_size: float | None
    max_link: float | None
    min_link: float | None
    max_ground: float | None
    min_ground: float | None
    max_arm: float | None
    max_travel: float | None
    min_allowance: float | None
    min_transmission_turn: float
    full_rotation: bool
    min_lift: float | None
    min_drive_angle: float | None
    max_drive_angle: float | None
    max_rotation: float | None
    min_uniformity: float | None
    min_advantage: float | None


@typed_fields
class Measured:
    """Fields of every answer with a path: its size."""

    size: float
    max_link: float | None
    max_ground: float | None
    max_arm: float | None
    min_transmission: float


@typed_fields
class Further(Measured):
    """Fields that an answer may lack."""

    drive_angle: float | None = None
    time_ratio: float | None = None
    uniformity: float | None = None
    advantage: float | None = None
    rotation: float | None = None
    min_link: float | None = None
    min_transmission_turn: float | None = None
    allowance: float | None = None
    sensitivity_rms: float | None = None
    travel: float | None = None
    expected: float | None = None
