"""What a data sheet of a guide says: its lengths with tolerances, pivots, limits, theory and provenance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import __version__
from ..curvature_theory.analysis import REGULAR, curvature
from ..errors import InvalidRequest, quoted
from ..guidance.allowance import PROBABILITY
from ..kinematics.linkage import PR
from ..units import ASSUMED, ASSUMPTION
from .units import decimals, fixed, length
from .words import asked, facts, family

if TYPE_CHECKING:
    from ..find.placed import PlacedGuide

#: Width and height of papers [mm].
PAPERS = {"a4": (210.0, 297.0), "letter": (215.9, 279.4)}
#: Standard deviations of a tolerance to either side.
SIDES = 2
#: Share of the machines that keep the path at the allowance [per cent].
SHARE = round(100 * PROBABILITY)
#: Order of contact of a guide that is exact.
EXACT_ORDER = 99


@dataclass(frozen=True)
class Table:
    """Rows under a heading; cells after the first are set to the right."""

    heading: str
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]
    note: str = ""


@dataclass(frozen=True)
class Content:
    """All words and numbers of a data sheet."""

    series: str
    kind: str
    code: str
    facts: list[str]
    lengths: Table
    pivots: Table
    limits: Table
    theory: list[str]
    provenance: str


def content(guide: PlacedGuide, code: str) -> Content:
    """Return what a sheet says of a guide, in its unit, and its code; lengths without a unit are taken as `ASSUMED`."""
    unit = guide.unit or ASSUMED
    configuration = getattr(guide, "configuration", "")
    return Content(
        series=getattr(guide, "series", "") or getattr(guide, "name", ""),
        kind=family(guide) + (f", configuration {configuration}" if configuration else ""),
        code=code,
        facts=facts(guide, unit),
        lengths=_lengths(guide, unit),
        pivots=_pivots(guide, unit),
        limits=Table("Limits", ("", ""), _limits(guide, unit), _stops(guide)),
        theory=_theory(guide, unit),
        provenance=_provenance(guide, code),
    )


def paper_of(name: str) -> tuple[float, float]:
    """Return width and height of a paper [mm]; `InvalidRequest` if there is none such."""
    if not isinstance(name, str) or name.lower() not in PAPERS:
        raise InvalidRequest(f"there is no paper {quoted(name)}; there are {', '.join(PAPERS)}")
    return PAPERS[name.lower()]


def _tolerance(guide: PlacedGuide, share: float) -> str:
    """Return the tolerance that the allowance gives something whose scatter is so many times that of a coordinate."""
    allowance = getattr(guide, "allowance", None)
    return "–" if allowance is None or allowance <= 0 else f"±{_two(SIDES * share * allowance)}"


def _two(value: float) -> str:
    """Return two digits of a number, rounded down: a tolerance must not be wider than what is allowed."""
    power = math.floor(math.log10(value)) - 1
    told = math.floor(value / 10.0**power * (1 + 1e-12)) * 10.0**power
    return f"{told:.{max(0, -power)}f}"


def _lengths(guide: PlacedGuide, unit: str) -> Table:
    apart = math.sqrt(2)  # the scatter of a distance of two pivots, each coordinate of which scatters by 1
    digits, tolerance = _digits(guide, unit), _tolerance(guide, apart)
    rows: list[tuple[str, ...]] = [(name, fixed(value, digits), tolerance) for name, value in guide.lengths.items()]
    return Table("Lengths", ("", unit, "tolerance"), rows, _note(guide, unit))


def _digits(guide: PlacedGuide, unit: str) -> int:
    """Return the decimals to which lengths are written: to a thousandth of a millimetre, of small guides finer."""
    size = max(abs(value) for value in guide.lengths.values())
    return max(decimals(unit), 4 - math.floor(math.log10(size)) - 1)


def _note(guide: PlacedGuide, unit: str) -> str:
    allowance = getattr(guide, "allowance", None)
    if allowance is None:
        return "tolerances: none is known, as no deviation was asked for"
    if allowance <= 0:
        return "tolerances: none is left, the deviation asked for is used up"
    told = f"each coordinate of each pivot scattering by {_two(allowance)} {unit}"
    keep = f"the allowance: {SHARE} % of machines keep the path"
    if (share := getattr(guide, "kept_share", None)) is not None:
        keep += f"; of a thousand drawn {100 * share:.1f} %"
    return f"tolerances: {SIDES} standard deviations, {told} ({keep})"


def _pivots(guide: PlacedGuide, unit: str) -> Table:
    kinds, digits, each = guide.linkage.dyads[0], _digits(guide, unit), _tolerance(guide, 1.0)
    rows: list[tuple[str, ...]] = []

    def place(name: str, at: Sequence[float], tolerance: str = "") -> tuple[str, ...]:
        return (name, *(fixed(value, digits) for value in at), tolerance)

    for i, dyad in enumerate(guide.pivots):
        for (x, y, w), star in zip(dyad, ("", "*"), strict=True):
            if w:
                rows.append(place(f"A{'₁₂'[i]}{star}", (x, y), each))
            else:
                what = "line of slider" if kinds[i] == PR else "line of slide"
                rows.append((f"{what} {i + 1}", f"{math.degrees(math.atan2(x, -y)) % 180:.4f}°", "", ""))
    rows.append(place("guided point", guide.guided))
    if hasattr(guide, "joint"):
        rows.append(place("joint of the rod", guide.joint))
        rows.append(place("pivot of the rocker", getattr(guide, "pivot", ())))
    where = "mid-stroke" if hasattr(guide, "stroke") else "the position given"
    return Table(f"Pivots in {where}", ("", f"x [{unit}]", f"y [{unit}]", "tolerance"), rows)


def _limits(guide: PlacedGuide, unit: str) -> list[tuple[str, ...]]:
    """Return what bounds the guide's use, as far as it was measured."""

    def known(name: str) -> Any:
        return getattr(guide, name, None)

    rows: list[tuple[str, ...]] = []
    for name, said in (
        ("size", "size, path included"), ("min_link", "shortest link"), ("max_link", "longest link"),
        ("max_arm", "arm of the guided point"), ("travel", "longest travel of a slide"),
        ("lift", "lift of the way back"),
    ):  # fmt: skip
        if known(name) is not None:
            rows.append((said, length(known(name), unit)))
    for name, said in (
        ("min_transmission", "least transmission angle"), ("min_transmission_turn", "the same over a turn"),
        ("drive_angle", "angle of the drive"), ("rotation", "turn of the coupler"),
    ):  # fmt: skip
        if known(name) is not None:
            rows.append((said, f"{known(name):.1f}°"))
    for name, said in (("advantage", "least mechanical advantage"), ("uniformity", "least over greatest speed")):
        if known(name) is not None:
            rows.append((said, f"{known(name):.3g}"))
    turning = known("rotates")
    if turning is not None:
        rows.append(("turns fully", " and ".join(f"crank {k}" for k in turning) or "no crank"))
    return rows


def _stops(guide: PlacedGuide) -> str:
    """Return in one line the dead points, from which no crank can drive."""
    told = [
        f"{crank} at {', '.join(f'{angle:.1f}' for angle in angles)}°"
        for crank, angles in guide.dead_points.items() if angles
    ]  # fmt: skip
    return f"dead points: {'; '.join(told)} from the x axis" if told else "no crank has a dead point"


def _theory(guide: PlacedGuide, unit: str) -> list[str]:
    """Return the theory of the position given in three lines."""
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
        lines.append("A linkage of one's own: no series was its start.")
    else:
        touch = "exactly" if order >= EXACT_ORDER else f"with contact of order {order}"
        lines.append(f"Its ancestor in series {series} guides the point {touch} in its design position.")
    return [line for line in lines if line]


def _ratio(value: float) -> str:
    """Return a number to four digits, rounding as nothing."""
    return f"{0.0 if abs(value) < 1e-9 else value:.4g}".replace("-", "−")


def _provenance(guide: PlacedGuide, code: str) -> str:
    number = getattr(guide, "id", None)
    parts = [f"code {code}", f"guide {number} of the catalogue" if number is not None else "", asked(guide)]
    parts += ["" if guide.unit else ASSUMPTION, f"mechanism-catalogue {__version__}"]
    return " · ".join(part for part in parts if part)
