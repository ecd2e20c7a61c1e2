"""Texts on drawings and sheets."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from ..guides.kinds import has_bars, has_stroke, is_dwell
from .units import length

if TYPE_CHECKING:
    from ..guides.candidate import Candidate
    from ..guides.chain_stretch import ChainStretch
    from ..guides.kinds import Guide

#: Largest deviation of an exact guide, by rounding [strokes].
EXACT_DEVIATION = 1e-12
#: Digits and sign of an exponent.
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: Names of families in titles.
FAMILIES = {
    "four-bar": "four-bar linkage",
    "inverted-slider-crank": "inverted slider-crank",
    "swinging-block": "swinging-block slider",
    "elliptic-trammel": "elliptic trammel",
    "oldham": "Oldham linkage",
}


def is_exact(guide: Candidate | ChainStretch) -> bool:
    """Tell whether the deviation of a guide is rounding."""
    return guide.deviation < EXACT_DEVIATION * guide.stroke


def family(guide: Guide) -> str:
    """Return the name of a guide's family for a title; of many bars their number."""
    if has_bars(guide):
        return f"mechanism of {len(guide.bars)} bars"
    name = str(guide.linkage.family[0])
    return FAMILIES.get(name, name)


def describe_path(guide: Guide) -> str:
    """Describe the path or dwell of a guide; an empty text if it has none."""
    if has_stroke(guide):
        unit = f" {guide.unit}" if guide.unit else ""
        line = f"a straight line of {guide.stroke:g}{unit}"
        if guide.radius is not None:
            line = f"an arc of chord {guide.stroke:g}{unit}, radius {guide.radius:.4g}{unit}"
            line += f", {guide.arc_angle:.4g}°" if guide.is_wide else ""
        return f"{line}, exact" if is_exact(guide) else f"{line}, deviation {guide.deviation:.3g}{unit}"
    if is_dwell(guide):
        return f"a dwell of {guide.angle:.4g}° within {guide.residual:.3g}°, swing {guide.swing:.4g}°"
    return ""


def describe_guide(guide: Guide, code: str = "") -> str:
    """Describe a guide in one line: code, number, name, kind and path."""
    number = getattr(guide, "id", None)
    name = getattr(guide, "name", "")
    series = getattr(guide, "series", "")
    which = " ".join(part for part in (code, f"guide {number}" if number is not None else "", name) if part)
    kind = " ".join(part for part in (series, family(guide)) if part)
    return " · ".join(part for part in (which, kind, describe_path(guide)) if part)


def facts(guide: Guide, unit: str, small: Callable[[float], str] = "{:.3g}".format) -> list[str]:
    """List the main numbers of a guide: stroke, radius, deviation, transmission angle.

    `small` formats a deviation.
    """
    told = []
    if has_stroke(guide):
        told.append(f"stroke {length(guide.stroke, unit)}")
        if guide.radius is not None:
            told.append(f"radius {length(guide.radius, unit)}")
            if guide.is_wide:
                told.append(f"{guide.arc_angle:.4g}°")
        told.append("exact" if is_exact(guide) else f"deviation {small(guide.deviation)} {unit}".rstrip())
    if is_dwell(guide):
        told.append(f"dwell of {guide.angle:.4g}° of the crank within {guide.residual:.3g}°, swing {guide.swing:.4g}°")
    if (least := getattr(guide, "min_transmission", None)) is not None:
        told.append(f"minimum transmission angle {least:.0f}°")
    if has_bars(guide):
        return [f"{guide.drive} drives", *told]
    return told or [f"{name} {value:.4g} {unit}".rstrip() for name, value in guide.lengths.items()]


def places(guide: Guide, unit: str) -> list[str]:
    """Describe the positions of the fixed pivots; for a slider the direction of its rail."""
    if has_bars(guide):
        at = {name: [length(v, unit) for v in guide.joints[name]] for name in guide.bars["frame"]}
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
    """Format a number with three digits, small and large ones with a power of ten."""
    size = abs(value)
    if 1e-4 <= size < 1e5 or not size:
        return f"{float(f'{value:.3g}'):g}".replace("-", "−")
    digits, power = f"{value:.2e}".split("e")
    digits = digits.rstrip("0").rstrip(".").replace("-", "−")
    ten = "10" + str(int(power)).translate(SUPERSCRIPTS)
    return ten if digits == "1" else f"{digits} × {ten}"
