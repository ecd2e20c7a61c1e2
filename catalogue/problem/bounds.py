"""Bounds on measures, a row each; importable without NumPy.

Constraints, their violations, rows of refinement, options, fields of the page and the order of a
study are made from these rows.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..units import LENGTH

#: Units beside `LENGTH`.
DEGREES = "deg"
RATIO = "1"


@dataclass(frozen=True)
class Bound:
    """A bound that a request may set on a measure.

    Attributes
    ----------
    name : str
        Keyword of `Constraints`; with hyphens the option.
    measure : str
        Attribute of `guidance.metrics.Measures`, or of `guidance.drive.DriveMetrics` if it is of
        the drive; other measures have functions of their own.
    upper : bool
        Whether it is the largest value allowed, else the least.
    unit : str
        `LENGTH`, `DEGREES` or `RATIO`.
    text : str
        What it bounds, for the help.
    option : str
        Further spellings of the option.
    default : float or None
        Without it.
    """

    name: str
    measure: str
    upper: bool
    unit: str
    text: str
    option: str = ""
    default: float | None = None


#: Of sizes and lengths of links.
SIZES = (
    Bound(
        "max_size",
        "size",
        True,
        LENGTH,
        "Maximum overall size: diameter of pivots, rails, slots and path (100 strokes if not given).",
    ),
    Bound("max_link", "max_link", True, LENGTH, "Maximum length of crank or coupler."),
    Bound("min_link", "min_link", False, LENGTH, "Minimum length of crank or coupler."),
    Bound("max_ground", "max_ground", True, LENGTH, "Maximum distance between the fixed pivots."),
    Bound("min_ground", "max_ground", False, LENGTH, "Minimum distance between the fixed pivots."),
    Bound("max_arm", "max_arm", True, LENGTH, "Maximum distance from the guided point to the nearer moving pivot."),
    Bound("max_travel", "travel", True, LENGTH, "Maximum travel of a slider along its rail or slot over the stroke."),
)
TRANSMISSIONS = (
    Bound(
        "min_transmission",
        "min_transmission",
        False,
        DEGREES,
        "Minimum transmission angle over the stroke; the better crank drives.",
        default=0.0,
    ),
    Bound(
        "min_transmission_turn",
        "min_transmission_turn",
        False,
        DEGREES,
        "Minimum transmission angle over a full turn of the driving crank.",
        default=0.0,
    ),
)
ALLOWANCE = Bound(
    "min_allowance",
    "allowance",
    False,
    LENGTH,
    "Minimum allowance: standard deviation of pivot position at which 95 % of machines keep the tolerance.",
)
LIFT = Bound(
    "min_lift", "lift", False, LENGTH, "Minimum lift of the point off its path on the return, as of a walking leg."
)
#: Of the drive; see `guidance.drive.DriveMetrics`.
DRIVES = (
    Bound("min_drive_angle", "drive_angle", False, DEGREES, "Minimum rotation of the driving crank over the stroke."),
    Bound("max_drive_angle", "drive_angle", True, DEGREES, "Maximum rotation of the driving crank over the stroke."),
    Bound(
        "max_rotation",
        "rotation",
        True,
        DEGREES,
        "Maximum rotation of the guided body over the stroke: small where it is to stay level.",
        option="--level",
    ),
    Bound(
        "min_uniformity",
        "uniformity",
        False,
        RATIO,
        "Minimum ratio of lowest to highest speed along the path at constant crank speed.",
    ),
    Bound(
        "min_advantage",
        "advantage",
        False,
        RATIO,
        "Minimum mechanical advantage: force along the path over force at the crank pin.",
    ),
)
BOUNDS = {row.name: row for row in (*SIZES, *TRANSMISSIONS, ALLOWANCE, LIFT, *DRIVES)}
#: Names of bounds on lengths, and on the drive.
LENGTHS = tuple(name for name, row in BOUNDS.items() if row.unit == LENGTH)
DRIVE = tuple(row.name for row in DRIVES)
