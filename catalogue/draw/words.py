"""What drawings and sheets say of a guide."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from .units import length

if TYPE_CHECKING:
    from ..find.placed import PlacedGuide

#: Deviations below this part of the stroke are rounding: the guide is exact.
EXACT_DEVIATION = 1e-12
#: Names of families as they stand in a title.
FAMILIES = {
    "four-bar": "four-bar linkage",
    "inverted-slider-crank": "inverted slider-crank",
    "swinging-block": "swinging-block slider",
    "elliptic-trammel": "elliptic trammel",
    "oldham": "Oldham linkage",
}


def family(guide: PlacedGuide) -> str:
    """Return the family of a guide as it stands in a title."""
    name = str(guide.linkage.family[0])
    return FAMILIES.get(name, name)


def asked(guide: PlacedGuide) -> str:
    """Return what a guide is for: its line or arc, or its dwell; empty if it has none."""
    if (stroke := getattr(guide, "stroke", None)) is not None:
        radius = guide.radius  # type: ignore[attr-defined]  # what has a stroke has a radius or None
        unit = f" {guide.unit}" if guide.unit else ""
        line = f"a straight line of {stroke:g}{unit}"
        if radius is not None:
            line = f"an arc of chord {stroke:g}{unit}, radius {radius:.4g}{unit}"
            line += f", {guide.arc_angle:.4g}°" if getattr(guide, "is_wide", False) else ""  # type: ignore[attr-defined]
        deviation = guide.deviation  # type: ignore[attr-defined]
        return f"{line}, exact" if deviation < EXACT_DEVIATION * stroke else f"{line}, deviation {deviation:.3g}{unit}"
    if (angle := getattr(guide, "angle", None)) is not None:
        return f"a dwell of {angle:.4g}° within {guide.residual:.3g}°, swing {guide.swing:.4g}°"  # type: ignore[attr-defined]
    return ""


def described(guide: PlacedGuide, code: str = "") -> str:
    """Return one line that says which guide it is and what it does."""
    number = getattr(guide, "id", None)
    name = getattr(guide, "name", "")
    series = getattr(guide, "series", "")
    which = " ".join(part for part in (code, f"guide {number}" if number is not None else "", name) if part)
    kind = " ".join(part for part in (series, family(guide)) if part)
    return " · ".join(part for part in (which, kind, asked(guide)) if part)


def facts(guide: PlacedGuide, unit: str) -> list[str]:
    """Return what a guide does, in short: stroke, radius, deviation, transmission angle, as far as it has them."""
    told = []
    if (stroke := getattr(guide, "stroke", None)) is not None:
        told.append(f"stroke {length(stroke, unit)}")
        if (radius := getattr(guide, "radius", None)) is not None:
            told.append(f"radius {length(radius, unit)}")
            if getattr(guide, "is_wide", False):
                told.append(f"{guide.arc_angle:.4g}°")  # type: ignore[attr-defined]
        deviation = guide.deviation  # type: ignore[attr-defined]
        told.append("exact" if deviation < EXACT_DEVIATION * stroke else f"deviation {deviation:.3g} {unit}".rstrip())
    if (angle := getattr(guide, "angle", None)) is not None:
        residual, swing = guide.residual, guide.swing  # type: ignore[attr-defined]
        told.append(f"dwell of {angle:.4g}° of the crank within {residual:.3g}°, swing {swing:.4g}°")
    if (least := getattr(guide, "min_transmission", None)) is not None:
        told.append(f"least transmission angle {least:.0f}°")
    return told or [f"{name} {value:.4g} {unit}".rstrip() for name, value in guide.lengths.items()]


def places(guide: PlacedGuide, unit: str) -> list[str]:
    """Return where the fixed pivots stand; of a slider the direction of its line."""
    told = []
    for i, dyad in enumerate(guide.pivots):
        x, y, w = dyad[0]
        if w:
            told.append(f"A{'₁₂'[i]} at ({length(x, unit)}, {length(y, unit)})")
        else:
            told.append(f"slider {i + 1} along {math.degrees(math.atan2(x, -y)) % 180:.4g}°")
    return told


def plain(value: float) -> str:
    """Return a number with three digits, small ones as a multiple of a power of ten in matplotlib's notation."""
    size = abs(value)
    if size >= 1e-4 or not size:
        return f"{value:.3g}".replace("-", "−")
    power = math.floor(math.log10(size))
    return rf"${value / 10**power:.2f}\times 10^{{{power}}}$"
