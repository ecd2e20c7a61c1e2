"""Charts of quantities over the drive, in the colours of the page."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from ..draw.curves import TALLEST, Curve, curves
from ..errors import InvalidRequest
from ..find.candidate import Candidate
from ..kinematics.types import Floats
from ..markup import Markup, element
from .cards import figure

#: Width of a chart [px]: three charts fill a page.
WIDTH = 320
#: Height of a chart [px].
HEIGHT = 130
#: Left margin, for the labels of the axis [px].
LEFT = 46
#: Right margin [px].
RIGHT = 12
#: Top margin, for the name [px].
TOP = 22
#: Bottom margin, for the labels of the axis [px].
BELOW = 30
#: Most points of a curve: one every two pixels.
POINTS = 121
#: Most intervals between ticks: labels do not touch.
TICKS = 4


def charts(one: Candidate) -> tuple[Markup, ...]:
    """Chart the quantities of a guide over its drive; none for a point that returns."""
    try:
        drive, found = curves(one)
    except InvalidRequest:
        return ()
    return tuple(chart(curve, drive.values, drive.of) for curve in found)


def chart(curve: Curve, drive: Floats, name: str) -> Markup:
    """Draw one curve as SVG, with name, unit, ticks and range."""
    some = np.linspace(0, len(drive) - 1, min(POINTS, len(drive))).astype(int)
    values, angle = curve.values[some], np.abs(drive[some] - drive[0])
    good = values[np.isfinite(values)]
    least, most = float(good.min()), float(good.max())
    high = min(most, TALLEST * float(np.median(np.abs(good)))) if curve.zero else most
    low = min(least, 0.0)
    across = (WIDTH - LEFT - RIGHT) / (angle[-1] or 1.0)
    up = (HEIGHT - TOP - BELOW) / (high - low or 1.0)
    foot = HEIGHT - BELOW
    x, y = LEFT + across * angle, foot - up * (values - low)
    shown = np.isfinite(values) & (values <= high)
    runs = np.split(np.arange(len(x)), np.flatnonzero(np.diff(shown)) + 1)
    lines = [
        element("polyline", points=" ".join(f"{x[k]:.1f},{y[k]:.1f}" for k in run)) for run in runs if shown[run[0]]
    ]
    marks = [
        part
        for value in ticks(low, high)
        for at in [f"{foot - up * (value - low):.1f}"]
        for part in (
            element("line", x1=LEFT, x2=WIDTH - RIGHT, y1=at, y2=at, class_=None if value else "zero"),
            element("text", figure(value), x=LEFT - 5, y=at, dy="0.35em", text_anchor="end"),
        )
    ]
    for value in ticks(0.0, float(angle[-1])):
        at = f"{LEFT + across * value:.1f}"
        marks.append(element("line", x1=at, x2=at, y1=foot, y2=foot + 4))
        marks.append(element("text", f"{figure(value)}°", x=at, y=foot + 14, text_anchor="middle"))
    extent = f"{figure(least)} … {figure(most)}"
    return element(
        "svg",
        element("title", f"{curve.name}: {figure(least)} to {figure(most)} over {figure(float(angle[-1]))}° of {name}"),
        element("text", curve.name, x=6, y=12, class_="name"),
        element("text", extent, x=WIDTH - RIGHT, y=12, text_anchor="end"),
        *marks,
        *lines,
        element("text", f"turn of {name}", x=WIDTH - RIGHT, y=HEIGHT - 3, text_anchor="end"),
        class_="chart",
        viewBox=f"0 0 {WIDTH} {HEIGHT}",
        role="img",
    )


def ticks(low: float, high: float) -> Iterable[float]:
    """Return round values from low to high with at most `TICKS` intervals."""
    if not high > low:
        return [low]
    rough = (high - low) / TICKS
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * part for part in (1, 2, 2.5, 5, 10) if power * part >= rough * (1 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [step * k for k in range(first, last + 1)]
