"""What each column of an answer means: its title, unit and meaning, stated once, for tables, legends and help texts.

`CANDIDATE`, `STRETCH`, `DWELL` hold the columns of `Candidate`, `Stretch` and `DwellCandidate` by the names of their
fields, in JSON and CSV too; `TABLE` those that only tables have.  A soft hyphen says where a title may be broken.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from ..units import LENGTH

__all__ = ["CANDIDATE", "DWELL", "LENGTH", "STRETCH", "TABLE", "Column", "attributes"]


@dataclass(frozen=True)
class Column:
    """A column: its heading in a table, the unit of its values (`LENGTH`, ``deg``, ``%``; empty if they have none),
    what it means, and whether it is set to the right, as numbers are."""

    title: str
    unit: str
    meaning: str
    right: bool = True

    @property
    def plain(self) -> str:
        """The title in one piece."""
        return self.title.replace("\u00ad", "")

    @property
    def told(self) -> str:
        """The meaning, with the unit."""
        return f"{self.meaning} [{self.unit}]" if self.unit else self.meaning


def _column(name: str, unit: str, meaning: str, title: str = "", *, right: bool = True) -> tuple[str, Column]:
    return name, Column(title or name.replace("_", " "), unit, meaning, right)


TABLE: Mapping[str, Column] = dict([
    _column("code", "", "by it show, measure, improve, trace, export take up exactly this answer", right=False),
    _column("links", LENGTH, "shortest and longest of cranks and coupler"),
    _column("kept_share", "", "share of a thousand machines, drawn at the allowance, whose path keeps the deviation "
            "asked"),
    _column("which", "", "the linkage as it was given, improved, or the best of the catalogue", right=False),
    _column("transmission", "deg", "least transmission angle over the stroke; in brackets over the whole turn",
            "trans\u00admission"),
    _column("crank", "deg", "number of the crank that drives, its angle at the start and the end of the path",
            right=False),
])  # fmt: skip

CANDIDATE: Mapping[str, Column] = dict([
    _column("id", "", "number of the stored guide it comes from, which `show` takes; none if made to measure"),
    _column("family", "", "which dyads the linkage has, such as four-bar", right=False),
    _column("series", "", "code of the series (Allievi) of its ancestor; parallel, cardan: exact, made to measure",
            right=False),
    _column("configuration", "", "where the pivots of its ancestor stand: letters of its dyads", "conf.", right=False),
    _column("order", "", "order of contact of its ancestor with the path; exact: all of it"),
    _column("stroke", LENGTH, "length of the path, of an arc its chord"),
    _column("deviation", LENGTH, "half the width of the narrowest strip (annulus) that holds the path; from the "
            "best-placed arc where the radius is given, from the path itself where pivots are", "devi\u00adation"),
    _column("radius", LENGTH, "of the best arc, or as given"),
    _column("arc_angle", "deg", "of an arc near a half circle, or beyond, as seen from its centre; none of others"),
    _column("size", LENGTH, "diameter of pivots, rails, slots and path together"),
    _column("max_link", LENGTH, "longest crank or coupler"),
    _column("max_ground", LENGTH, "distance of the fixed pivots"),
    _column("max_arm", LENGTH, "distance of the guided point from the nearer moving pivot"),
    _column("min_transmission", "deg", "least transmission angle over the stroke, the better crank driving",
            "trans\u00admission"),
    _column("rotates", "", "which cranks turn fully", "turns", right=False),
    _column("pivots", LENGTH, "[[A1, A1*], [A2, A2*]] in mid-stroke, fixed and moving, each x, y, w, which is 0 at "
            "infinity; of a slot: of the inversion, in which its point moves"),
    _column("guided", LENGTH, "where the guided point is at the same moment; one that returns: at rest"),
    _column("driver", "", "number of the crank that drives"),
    _column("drive_angle", "deg", "by how much the driving crank turns over the stroke"),
    _column("time_ratio", "", "rest of the driver's turn to the part in which the stroke is done"),
    _column("uniformity", "", "least over largest speed along the path, the crank turning steadily"),
    _column("advantage", "", "least force along the path over force at the crank pin, without friction"),
    _column("rotation", "deg", "range of the coupler's angles over the stroke"),
    _column("min_link", LENGTH, "shortest crank or coupler"),
    _column("travel", LENGTH, "longest travel of a slide in its rail or slot over the stroke; none with pins only"),
    _column("min_transmission_turn", "deg", "least transmission angle over the whole turn of the driver"),
    _column("lift", LENGTH, "how far the point lifts off the line or circle on its way back, the driving crank turning "
            "on; none where it does not turn fully"),
    _column("allowance", LENGTH, "scatter of the pivots (standard deviation of each coordinate) at which the path "
            "stays within the deviation asked with 95 % probability; a hundredth of the shortest link at most",
            "allow\u00adance"),
    _column("sensitivity_rms", "", "standard deviation of the path across its way per scatter of the pivots"),
    _column("expected", LENGTH, "deviation that the path keeps with 95 % probability for the play asked"),
    _column("asked_deviation", LENGTH, "largest deviation asked; the allowance and what is expected are for it"),
    _column("fitted", "", "coordinates of the line or arc that are fitted to the path: 0 none, 2 its place, 3 the "
            "radius too"),
    _column("score", "", "joint desirability of size, transmission (over the whole turn where a crank is to turn "
            "fully), allowance, shortest link and ground, travel of slides, 0 to 100"),
    _column("front", "", "number of its Pareto front; 1: no other answer is better by all criteria"),
    _column("nearest", "", "how near the nearest other answer is as a design, 0 to 1"),
    _column("gap", "", "what moves of the pivots by a hundredth could still take away from what is ranked by; 0: none"),
    _column("alternations", "", "peaks of alternating sign at which the path reaches its deviation, ends included"),
    _column("cognate", "", "1, 2: a cognate of the stored guide, the one that shares this fixed pivot"),
    _column("pole", LENGTH, "at a change point: the pole of the branch on which it moves"),
    _column("start", LENGTH, "where the path starts, x, y"),
    _column("along", "deg", "direction of the path from there"),
    _column("unit", "", "of all lengths: mm, cm, m, in or ft; none: not known", right=False),
    _column("drift", "", "how far a refined guide has left the series of its ancestor; 0: none; not kept by its code"),
    _column("band", LENGTH, "width of the narrowest strip, twice the deviation"),
    _column("percent", "%", "the band in parts of the stroke"),
    _column("lengths", LENGTH, "lengths of the links, and the guided point along and across the coupler, by name; of a "
            "slot: of the inversion"),
])  # fmt: skip

STRETCH: Mapping[str, Column] = {**CANDIDATE, **dict([
    _column("number", "", "which of the linkages that were given, from 1", "#"),
    _column("circuit", "", "what it reaches without being taken apart; *: another one, \u2020: joined to that given "
            "at a change point"),
    _column("given", "", "whether the circuit is that of the position given"),
    _column("joined", "", "whether the two circuits cross at change points"),
    _column("drive_from", "deg", "angle of the driving crank at the start of the path"),
    _column("drive_to", "deg", "angle of the driving crank at its end, counted on from the start: less where it turns "
            "clockwise"),
    _column("nearest_series", "", "the series to which the linkage comes nearest on the stretch, and its residual",
            right=False),
    _column("residual", "", "how near that series is: 0 is a member"),
])}  # fmt: skip

DWELL: Mapping[str, Column] = {name: CANDIDATE[name] for name in ("id", "family", "series", "configuration")} | dict([
    _column("order", "", "order of contact of the stored arc"),
    _column("angle", "deg", "by how much the crank turns while the rocker stands still", "dwell"),
    _column("residual", "deg", "band of angles in which the rocker strays meanwhile"),
    _column("swing", "deg", "how far the rocker swings over a turn"),
    _column("min_transmission", "deg", "least transmission angle over the full turn, of the linkage and of the rocker",
            "trans\u00admission"),
    _column("size", LENGTH, "diameter of all pivots, rails and slots and of the guided path over the turn"),
    _column("driver", "", "number of the crank that turns"),
    _column("pivots", LENGTH, "[[A1, A1*], [A2, A2*]] at a place within the dwell, not always its middle, fixed and "
            "moving, each x, y, w"),
    _column("guided", LENGTH, "the coupler point that leads the rod"),
    _column("joint", LENGTH, "where rod and rocker meet"),
    _column("pivot", LENGTH, "fixed pivot of the rocker"),
    _column("drive_from", "deg", "angle of the driving crank at the beginning of the dwell, from the line between its "
            "fixed pivot and that of the rocker"),
    _column("drive_to", "deg", "the same at the end of the dwell"),
    _column("allowance", LENGTH, "scatter of all pivots (standard deviation of each coordinate) at which the rocker "
            "keeps the residual asked over the dwell asked with 95 % probability", "allow\u00adance"),
    _column("asked_angle", "deg", "dwell asked; the allowance is for it, in the middle of the dwell"),
    _column("asked_residual", "deg", "residual asked; the allowance is for it"),
    _column("lengths", LENGTH, "lengths of all links, rod and rocker too, by name"),
])  # fmt: skip
DWELL = {**DWELL, "unit": CANDIDATE["unit"]}


def attributes(columns: Mapping[str, Column], names: Iterable[str]) -> str:
    """Return the section of a docstring that says what the attributes of these names are."""
    lines = [f"    {name}\n        {columns[name].told}" for name in names]
    return "\n".join(["    Attributes", "    ----------", *lines, "    "])
