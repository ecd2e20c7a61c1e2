"""Texts on drawings and sheets."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ..chains import has_bars
from .units import length

if TYPE_CHECKING:
    from ..guides.placed import PlacedGuide

#: Deviation below which a guide counts as exact [strokes]: it is rounding.
EXACT_DEVIATION = 1e-12
#: Names of families in titles.
FAMILIES = {
    "four-bar": "four-bar linkage",
    "inverted-slider-crank": "inverted slider-crank",
    "swinging-block": "swinging-block slider",
    "elliptic-trammel": "elliptic trammel",
    "oldham": "Oldham linkage",
}


def family(guide: PlacedGuide) -> str:
    """Return the name of a guide's family for a title; of many bars their number."""
    one: Any = guide
    if has_bars(guide):
        return f"mechanism of {len(one.bars)} bars"
    name = str(one.linkage.family[0])
    return FAMILIES.get(name, name)


def asked(guide: PlacedGuide) -> str:
    """Describe the path or dwell of a guide; an empty text if it has none."""
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
    """Describe a guide in one line: code, number, name, kind and path."""
    number = getattr(guide, "id", None)
    name = getattr(guide, "name", "")
    series = getattr(guide, "series", "")
    which = " ".join(part for part in (code, f"guide {number}" if number is not None else "", name) if part)
    kind = " ".join(part for part in (series, family(guide)) if part)
    return " · ".join(part for part in (which, kind, asked(guide)) if part)


def facts(guide: PlacedGuide, unit: str) -> list[str]:
    """List the main numbers of a guide: stroke, radius, deviation, transmission angle."""
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
        told.append(f"minimum transmission angle {least:.0f}°")
    if has_bars(guide):
        mechanism: Any = guide
        return [f"{mechanism.drive} drives", *told]
    return told or [f"{name} {value:.4g} {unit}".rstrip() for name, value in guide.lengths.items()]


def places(guide: PlacedGuide, unit: str) -> list[str]:
    """Describe the positions of the fixed pivots; for a slider the direction of its rail."""
    own: Any = guide
    if has_bars(guide):
        at = {name: [length(v, unit) for v in own.joints[name]] for name in own.bars["frame"]}
        return [f"{name} at ({', '.join(place)})" for name, place in at.items()]
    told = []
    for i, dyad in enumerate(guide.pivots):
        x, y, w = dyad[0]
        if w:
            told.append(f"A{'₁₂'[i]} at ({length(x, unit)}, {length(y, unit)})")
        else:
            told.append(f"slider {i + 1} along {math.degrees(math.atan2(x, -y)) % 180:.4g}°")
    return told


def plain(value: float) -> str:
    """Format a number with three digits, small ones as a power of ten in matplotlib's notation."""
    size = abs(value)
    if size >= 1e-4 or not size:
        return f"{value:.3g}".replace("-", "−")
    power = math.floor(math.log10(size))
    return rf"${value / 10**power:.2f}\times 10^{{{power}}}$"
