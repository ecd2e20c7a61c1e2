"""Contents of a data sheet: lengths with tolerances, pivots, limits, theory, provenance."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import __version__
from ..curvature_theory.analysis import REGULAR, curvature
from ..errors import InvalidRequest, quoted
from ..guidance.allowance import PROBABILITY
from ..guides.kinds import has_bars, has_stroke
from ..kinematics.linkage import PR
from ..quantities import DEGREES, QUANTITIES, RATIO
from ..units import ASSUMED, ASSUMPTION, LENGTH
from .units import decimals, fixed, length
from .words import describe_path, facts, family

if TYPE_CHECKING:
    from ..guides.kinds import Guide
    from ..guides.own_chain import OwnChain
    from ..guides.placed import PlacedGuide

#: Width and height of papers [mm].
PAPERS = {"a4": (210.0, 297.0), "letter": (215.9, 279.4)}
#: Half-width of a tolerance [standard deviations]: 95 % of normal errors are within.
SIDES = 2
#: Share of machines within tolerance at the allowance [%].
PERCENT = round(100 * PROBABILITY)
#: Order of contact of an exact guide.
EXACT_ORDER = 99


@dataclass(frozen=True)
class Room:
    """Space for tables on a data sheet.

    Attributes
    ----------
    letters : int
        Largest number of letters of a name.
    lines : int
        Number of lines of a table up to which the drawing keeps its height.
    drawing : float
        Least height of the drawing above longer tables [mm].
    """

    letters: int = 28
    lines: int = 10
    drawing: float = 60.0


ROOM = Room()


@dataclass(frozen=True)
class Table:
    """Rows under a heading; cells after the first are right-aligned."""

    heading: str
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]
    note: str = ""


@dataclass(frozen=True)
class Content:
    """All texts and numbers of a data sheet."""

    series: str
    kind: str
    code: str
    facts: list[str]
    lengths: Table
    pivots: Table
    limits: Table
    theory: list[str]
    provenance: str

    @property
    def lines(self) -> int:
        """Number of lines of the longest table, including its heading."""
        return max(len(table.rows) + any(table.columns) for table in (self.lengths, self.pivots, self.limits))


def content(guide: Guide, code: str) -> Content:
    """Collect the contents of a sheet, in the unit of the guide or in `ASSUMED`."""
    unit = guide.unit or ASSUMED
    if has_bars(guide):
        return _chain_content(guide, code, unit)
    configuration = getattr(guide, "configuration", "")
    return Content(
        series=getattr(guide, "series", "") or getattr(guide, "name", ""),
        kind=family(guide) + (f", configuration {configuration}" if configuration else ""),
        code=code,
        facts=facts(guide, unit),
        lengths=_lengths(guide, unit),
        pivots=_pivots(guide, unit),
        limits=Table("Limits", ("", ""), _limits(guide, unit), _dead_points(guide)),
        theory=_theory(guide, unit),
        provenance=_provenance(guide, code),
    )


def _chain_content(one: OwnChain, code: str, unit: str) -> Content:
    """Collect the contents of the sheet of an `OwnChain`: no theory, no tolerances."""
    structure, digits = one.chain.structure, _length_decimals(one, unit)
    lengths: list[tuple[str, ...]] = [(_shorten(name), fixed(value, digits)) for name, value in one.lengths.items()]
    joints: list[tuple[str, ...]] = [
        (_shorten(name), *(fixed(value, digits) for value in place)) for name, place in one.joints.items()
    ]
    for slide, along in zip(structure.slides, one.chain.u[:, 0].tolist(), strict=True):
        angle = math.degrees(math.atan2(along.imag, along.real)) % 180
        joints.append((_shorten(f"{slide.second} on {slide.first}"), f"{angle:.4f}°", ""))
    notes = [
        f"{gear.second} is kept parallel to {gear.first}"
        if gear.ratio == 1
        else f"{gear.second} turns {gear.ratio:.6g} times as {gear.first}, seen from {gear.carrier}"
        for gear in structure.gears
    ]
    return Content(
        series=_shorten(one.name) or "Mechanism",
        kind=family(one),
        code=code,
        facts=facts(one, unit),
        lengths=Table("Lengths", ("", unit), lengths, "lengths between joints of a bar"),
        pivots=Table("Joints in the given pose", ("", f"x [{unit}]", f"y [{unit}]"), joints),
        limits=Table("Limits", ("", ""), _chain_limits(one, unit), "drive and places from the given pose"),
        theory=notes,
        provenance=_provenance(one, code),
    )


def _shorten(name: str) -> str:
    """Shorten a name that is longer than a cell, by omitting its middle."""
    half = ROOM.letters // 2
    return name if len(name) <= ROOM.letters else f"{name[: half - 1]}…{name[-half:]}"


def _chain_limits(one: OwnChain, unit: str) -> list[tuple[str, ...]]:
    """List the drive and, for a stretch, its measures."""
    structure = one.chain.structure

    def driven(value: float) -> str:
        return length(value, unit) if structure.is_pushed else f"{value:.2f}°".replace("-", "−")

    rows: list[tuple[str, ...]] = []
    if one.drive_range is None:
        rows.append((f"{one.drive} turns", "fully"))
    else:
        rows += [(f"{one.drive} {way}", driven(end)) for way, end in zip(("from", "to"), one.drive_range, strict=True)]
    if has_stroke(one):
        rows += [("stroke from", driven(one.drive_from)), ("stroke to", driven(one.drive_to))]
        x, y = one.start
        rows += [("starts at x", length(x, unit)), ("starts at y", length(y, unit))]
        rows.append(("runs along", f"{one.along:.2f}°".replace("-", "−")))
    return rows + _limits(one, unit)


def paper_of(name: str) -> tuple[float, float]:
    """Return width and height of a paper [mm]; refuse unknown papers."""
    if not isinstance(name, str) or name.lower() not in PAPERS:
        raise InvalidRequest(f"unknown paper {quoted(name)}; choose from {', '.join(PAPERS)}")
    return PAPERS[name.lower()]


def _tolerance(guide: Guide, share: float) -> str:
    """Format the tolerance of a length that scatters `share` times as much as a coordinate."""
    allowance = getattr(guide, "allowance", None)
    return "–" if allowance is None or allowance <= 0 else f"±{_two_digits(SIDES * share * allowance)}"


def _two_digits(value: float) -> str:
    """Format a number with two digits, rounded down: a tolerance must not exceed the allowance."""
    power = math.floor(math.log10(value)) - 1
    told = math.floor(value / 10.0**power * (1 + 1e-12)) * 10.0**power
    return f"{told:.{max(0, -power)}f}"


def _lengths(guide: PlacedGuide, unit: str) -> Table:
    apart = math.sqrt(2)  # standard deviation of the distance of two pivots over that of a coordinate
    digits, tolerance = _length_decimals(guide, unit), _tolerance(guide, apart)
    rows: list[tuple[str, ...]] = [(name, fixed(value, digits), tolerance) for name, value in guide.lengths.items()]
    return Table("Lengths", ("", unit, "tolerance"), rows, _note(guide, unit))


def _length_decimals(guide: Guide, unit: str) -> int:
    """Return the decimals of lengths: a thousandth of a millimetre, finer for small guides."""
    size = max(abs(value) for value in guide.lengths.values())
    return max(decimals(unit), 4 - math.floor(math.log10(size)) - 1)


def _note(guide: Guide, unit: str) -> str:
    allowance = getattr(guide, "allowance", None)
    if allowance is None:
        return "tolerances: unknown, as no deviation was requested"
    if allowance <= 0:
        return "tolerances: none left, the guide uses up the requested deviation"
    told = f"standard deviation of pivot position {_two_digits(allowance)} {unit} in x and y"
    keep = f"the allowance: {PERCENT} % of machines within the deviation"
    if (share := getattr(guide, "kept_share", None)) is not None:
        keep += f"; {100 * share:.1f} % of 1000 simulated"
    return f"tolerances: ±{SIDES} standard deviations; {told} ({keep})"


def _pivots(guide: PlacedGuide, unit: str) -> Table:
    kinds, digits, each = guide.linkage.dyads[0], _length_decimals(guide, unit), _tolerance(guide, 1.0)
    rows: list[tuple[str, ...]] = []

    def place(name: str, at: Sequence[float], tolerance: str = "") -> tuple[str, ...]:
        return (name, *(fixed(value, digits) for value in at), tolerance)

    for i, dyad in enumerate(guide.pivots):
        for (x, y, w), star in zip(dyad, ("", "*"), strict=True):
            if w:
                rows.append(place(f"A{'₁₂'[i]}{star}", (x, y), each))
            else:
                what = "rail of slider" if kinds[i] == PR else "slot of slide"
                rows.append((f"{what} {i + 1}", f"{math.degrees(math.atan2(x, -y)) % 180:.4f}°", "", ""))
    rows.append(place("guided point", guide.guided))
    if hasattr(guide, "joint"):
        rows.append(place("joint of the rod", guide.joint))
        rows.append(place("pivot of the rocker", getattr(guide, "pivot", ())))
    where = "at mid-stroke" if hasattr(guide, "stroke") else "in the given position"
    return Table(f"Pivots {where}", ("", f"x [{unit}]", f"y [{unit}]", "tolerance"), rows)


#: Formats of the limits by the units of their rows.
_FORMATS: Mapping[str, Callable[[float, str], str]] = {
    LENGTH: length,
    DEGREES: lambda value, _: f"{value:.1f}°",
    RATIO: lambda value, _: f"{value:.3g}",
}


def _limits(guide: Guide, unit: str) -> list[tuple[str, ...]]:
    """List the measured limits of the guide."""

    def known(name: str) -> Any:
        return getattr(guide, name, None)

    rows: list[tuple[str, ...]] = [
        (row.sheet[1], _FORMATS[row.unit](value, unit))
        for row in sorted(QUANTITIES, key=lambda row: row.sheet)
        if row.sheet[0] and (value := known(row.name)) is not None
    ]
    turning = known("rotates")
    if turning is not None:
        rows.append(("turns fully", " and ".join(f"crank {k}" for k in turning) or "no crank"))
    return rows


def _dead_points(guide: PlacedGuide) -> str:
    """List the dead points of the cranks in one line."""
    told = [
        f"{crank} at {', '.join(f'{angle:.1f}' for angle in angles)}°"
        for crank, angles in guide.dead_points.items()
        if angles
    ]
    return f"dead points: {'; '.join(told)} from the x axis" if told else "no crank has a dead point"


def _theory(guide: PlacedGuide, unit: str) -> list[str]:
    """Describe the curvature in the given position in three lines."""
    found = curvature(guide.linkage)
    if found.state[0] != REGULAR or not np.isfinite(found.rho0[0]):
        lines = ["The pole of that position is at infinity: the coupler translates.", ""]
    else:
        (x, y), rho0 = found.pole[0], float(found.rho0[0])
        kappa, star, s = (float(v[0]) * rho0 for v in (found.kappa, found.kappa_star, found.s))
        place = f"({length(x, unit)}, {length(y, unit)})"
        lines = [
            f"Pole at {place}, diameter of the inflection circle ρ₀ = {length(rho0, unit)}.",
            f"Cubics of stationary curvature: ρ₀/R = {_ratio(kappa)}, ρ₀/R* = {_ratio(star)}, ρ₀/S = {_ratio(s)}"
            " (Allievi 1895).",
        ]
    series, order = getattr(guide, "series", ""), getattr(guide, "order", None)
    if order is None or series in ("", "own"):
        lines.append("The user's own linkage, refined from no series.")
    else:
        touch = "exactly" if order >= EXACT_ORDER else f"with contact of order {order}"
        lines.append(f"Refined from series {series}, which guides the point {touch} in its design position.")
    return [line for line in lines if line]


def _ratio(value: float) -> str:
    """Format a number with four digits, rounding errors as 0."""
    return f"{0.0 if abs(value) < 1e-9 else value:.4g}".replace("-", "−")


def _provenance(guide: Guide, code: str) -> str:
    number = getattr(guide, "id", None)
    parts = [f"code {code}", f"guide {number} of the catalogue" if number is not None else "", describe_path(guide)]
    parts += ["" if guide.unit else ASSUMPTION, f"mechanism-catalogue {__version__}"]
    return " · ".join(part for part in parts if part)
