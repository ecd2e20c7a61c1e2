"""Title, unit and meaning of each column of an answer, for tables, legends and help texts.

`CANDIDATE`, `STRETCH`, `CHAIN` and `DWELL` describe `Candidate`, `Stretch`, `ChainStretch` and
`DwellCandidate` by the names of their fields, which JSON and CSV share; `TABLE` describes columns
of tables only.  A title may be broken at a soft hyphen.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from ..quantities import QUANTITIES, RATIO, Measured
from ..units import LENGTH

__all__ = ["CANDIDATE", "CHAIN", "DWELL", "LENGTH", "STRETCH", "TABLE", "Column", "attributes"]


class Column(NamedTuple):
    """A column: title, unit (`LENGTH`, ``deg``, ``%`` or empty), meaning, and right alignment."""

    title: str
    unit: str
    meaning: str
    right: bool = True

    @property
    def plain(self) -> str:
        """The title without soft hyphens."""
        return self.title.replace("\u00ad", "")

    @property
    def told(self) -> str:
        """The meaning, with the unit."""
        return f"{self.meaning} [{self.unit}]" if self.unit else self.meaning


def _column(name: str, unit: str, meaning: str, title: str = "", *, right: bool = True) -> tuple[str, Column]:
    return name, Column(title or name.replace("_", " "), unit, meaning, right)


def _measured(*, in_all: bool) -> list[tuple[str, Column]]:
    """Make the columns of the quantities that all answers have, or of the others."""
    some = [row for row in QUANTITIES if (row.name in Measured.__annotations__) == in_all]
    rows = sorted(some, key=lambda row: row.legend)
    return [_column(row.name, "" if row.unit == RATIO else row.unit, row.meaning, row.title) for row in rows]


TABLE: Mapping[str, Column] = dict(
    [
        _column("code", "", "identifies this answer in show, measure, improve, trace and export", right=False),
        _column("links", LENGTH, "shortest and longest of cranks and coupler"),
        _column(
            "kept_share",
            "",
            "fraction of 1000 simulated machines, pivots scattered by the allowance, within the tolerance",
        ),
        _column("which", "", "the mechanism before, improved, or the best of the catalogue", right=False),
        _column(
            "transmission",
            "deg",
            "minimum transmission angle over the stroke; in brackets over the full turn",
            "trans\u00admission",
        ),
        _column(
            "crank", "deg", "number of the driving crank, its angle at the start and the end of the path", right=False
        ),
    ]
)

CANDIDATE: Mapping[str, Column] = dict(
    [
        _column("id", "", "number of the stored guide it was refined from, for `show`; none if synthesised"),
        _column("family", "", "types of the two dyads, such as four-bar", right=False),
        _column(
            "series",
            "",
            "series (Allievi) of the guide it was refined from; parallel, cardan: exact, synthesised",
            right=False,
        ),
        _column(
            "configuration", "", "where the pivots of that guide stand: letters of the dyads", "conf.", right=False
        ),
        _column("order", "", "order of contact of that guide with the path; exact: the whole path"),
        _column("stroke", LENGTH, "length of the path; chord of an arc"),
        _column(
            "deviation",
            LENGTH,
            "half the width of the narrowest strip (annulus) that contains the path; from the "
            "best-fitting arc where the radius is given, from the path itself where pivots are given",
            "devi\u00adation",
        ),
        _column("radius", LENGTH, "radius of the best-fitting arc, or as given"),
        _column("arc_angle", "deg", "central angle of an arc near a half circle, or beyond; none of others"),
        *_measured(in_all=True),
        _column("rotates", "", "cranks that turn fully", "turns", right=False),
        _column(
            "pivots",
            LENGTH,
            "[[A1, A1*], [A2, A2*]] at mid-stroke, fixed and moving, each x, y, w (0 at infinity); "
            "of a slot: of the inversion, in which its point moves",
        ),
        _column("guided", LENGTH, "position of the guided point at mid-stroke; of a point that returns: at rest"),
        _column("driver", "", "number of the driving crank"),
        *_measured(in_all=False),
        _column(
            "sensitivity_rms",
            "",
            "standard deviation of the path, across itself, per standard deviation of pivot position",
        ),
        _column("expected", LENGTH, "deviation that 95 % of machines keep with the given play"),
        _column("asked_deviation", LENGTH, "tolerance requested; allowance and expected deviation refer to it"),
        _column(
            "fitted", "", "number of fitted coordinates of the line or arc: 0 none, 2 its position, 3 the radius too"
        ),
        _column(
            "score",
            "",
            "joint desirability, 0 to 100, of size, transmission (over the full turn where a crank must "
            "turn fully), allowance, shortest link, ground and slider travel",
        ),
        _column("front", "", "number of its Pareto front; 1: no other answer is better by all criteria"),
        _column("nearest", "", "distance to the nearest other answer as a design, 0 to 1"),
        _column(
            "gap",
            "",
            "reduction of the ranked quantity still possible by pivot moves of a hundredth; 0: a local optimum",
        ),
        _column(
            "alternations", "", "number of alternating extrema at which the path reaches its deviation, ends included"
        ),
        _column("cognate", "", "1, 2: the cognate of the stored guide that shares this fixed pivot"),
        _column("pole", LENGTH, "at a change point: the pole of the branch on which it moves"),
        _column("start", LENGTH, "start of the path, x, y"),
        _column("along", "deg", "direction of the path at its start"),
        _column("unit", "", "unit of all lengths: mm, cm, m, in or ft; none: unknown", right=False),
        _column(
            "drift",
            "",
            "distance of a refined guide from the series of its ancestor; 0: a member; not stored with its code",
        ),
        _column("band", LENGTH, "width of the narrowest strip, twice the deviation"),
        _column("percent", "%", "width of the narrowest strip over the stroke"),
        _column(
            "lengths",
            LENGTH,
            "lengths of the links, and the guided point along and across the coupler, by name; of a "
            "slot: of the inversion",
        ),
    ]
)

STRETCH: Mapping[str, Column] = {
    **CANDIDATE,
    **dict(
        [
            _column("number", "", "number of the given linkage, from 1", "#"),
            _column(
                "circuit",
                "",
                "circuit (assembly mode) of the stretch; *: not that of the given position, \u2020: joined "
                "to it at a change point",
            ),
            _column("given", "", "whether the circuit is that of the given position"),
            _column("joined", "", "whether the two circuits cross at change points"),
            _column("drive_from", "deg", "angle of the driving crank at the start of the path"),
            _column(
                "drive_to",
                "deg",
                "angle of the driving crank at the end of the path, counted from the start: less if clockwise",
            ),
            _column(
                "nearest_series", "", "series nearest to the linkage on the stretch, and its residual", right=False
            ),
            _column("residual", "", "residual of the nearest series: 0 for a member"),
        ]
    ),
}

CHAIN: Mapping[str, Column] = {name: CANDIDATE[name] for name in ("stroke", "deviation", "radius")} | dict(
    [
        _column("number", "", "number of the given mechanism, from 1", "#"),
        _column("size", LENGTH, "diameter of all joints over the stroke, the path included"),
        _column(
            "min_transmission", "deg", "minimum transmission angle of any dyad over the stroke", "trans\u00admission"
        ),
        _column("drive_from", "", "drive at the start of the path, from its given pose: deg, of a slider length"),
        _column("drive_to", "", "drive at the end of the path, from its given pose: deg, of a slider length"),
        _column("joints", LENGTH, "positions of the joints in the given pose"),
        _column("bars", "", "joints on each bar"),
        _column("start", LENGTH, "start of the path"),
        _column("along", "deg", "direction of the path from the x axis"),
    ]
)

DWELL: Mapping[str, Column] = {name: CANDIDATE[name] for name in ("id", "family", "series", "configuration")} | dict(
    [
        _column("order", "", "order of contact of the stored arc"),
        _column("angle", "deg", "rotation of the crank during the dwell", "dwell"),
        _column("residual", "deg", "range of the rocker's angle during the dwell"),
        _column("swing", "deg", "swing of the rocker over a turn"),
        _column(
            "min_transmission",
            "deg",
            "minimum transmission angle over the full turn, of the linkage and of the rocker",
            "trans\u00admission",
        ),
        _column("size", LENGTH, "overall size: diameter of all pivots, rails, slots and the guided path over the turn"),
        _column("driver", "", "number of the driving crank"),
        _column(
            "pivots",
            LENGTH,
            "[[A1, A1*], [A2, A2*]] at a position within the dwell, not always its middle, fixed "
            "and moving, each x, y, w",
        ),
        _column("guided", LENGTH, "coupler point that drives the rod"),
        _column("joint", LENGTH, "joint of rod and rocker"),
        _column("pivot", LENGTH, "fixed pivot of the rocker"),
        _column(
            "drive_from",
            "deg",
            "angle of the driving crank at the start of the dwell, measured from the line of its "
            "fixed pivot and the rocker's",
        ),
        _column("drive_to", "deg", "angle of the driving crank at the end of the dwell, from that line"),
        _column(
            "allowance",
            LENGTH,
            "standard deviation of pivot position (each coordinate) at which 95 % of machines "
            "keep the requested residual over the requested dwell",
            "allow\u00adance",
        ),
        _column("asked_angle", "deg", "dwell requested; the allowance refers to it, in the middle of the dwell"),
        _column("asked_residual", "deg", "residual requested; the allowance refers to it"),
        _column("lengths", LENGTH, "lengths of all links, including rod and rocker, by name"),
    ]
)
DWELL = {**DWELL, "unit": CANDIDATE["unit"]}


def attributes(columns: Mapping[str, Column], names: Iterable[str]) -> str:
    """Return the Attributes section of a docstring for some columns."""
    lines = [f"    {name}\n        {columns[name].told}" for name in names]
    return "\n".join(["    Attributes", "    ----------", *lines, "    "])
