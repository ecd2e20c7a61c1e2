"""Charts of quantities over the drive, in the colours of the page."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..draw.curves import LAYOUT, Curve, curves
from ..draw.svg import ticks
from ..errors import InvalidRequest
from ..kinematics.types import Floats
from ..markup import Markup, element
from .cards import figure


class ChartLayout(NamedTuple):
    """Layout of a chart [px]."""

    width: int = 320  #: width: three charts fill a page
    height: int = 130  #: height
    left: int = 46  #: left margin, for the labels of the axis
    right: int = 12  #: right margin
    top: int = 22  #: top margin, for the name
    below: int = 30  #: bottom margin, for the labels of the axis
    points: int = 121  #: largest number of points of a curve: one every two pixels
    ticks: int = 4  #: largest number of intervals between ticks, so that labels do not touch


CHART = ChartLayout()


def charts(one: Any) -> tuple[Markup, ...]:
    """Chart the quantities of a guide over its drive; none for a point that returns."""
    try:
        drive, found = curves(one)
    except InvalidRequest:
        return ()
    return tuple(chart(curve, drive.values, drive.of) for curve in found)


def chart(curve: Curve, drive: Floats, name: str) -> Markup:
    """Draw one curve as SVG, with name, unit, ticks and range."""
    some = np.linspace(0, len(drive) - 1, min(CHART.points, len(drive))).astype(int)
    values, angle = curve.values[some], np.abs(drive[some] - drive[0])
    good = values[np.isfinite(values)]
    least, most = float(good.min()), float(good.max())
    high = min(most, LAYOUT.tallest * float(np.median(np.abs(good)))) if curve.zero else most
    low = min(least, 0.0)
    across = (CHART.width - CHART.left - CHART.right) / (angle[-1] or 1.0)
    up = (CHART.height - CHART.top - CHART.below) / (high - low or 1.0)
    foot = CHART.height - CHART.below
    x, y = CHART.left + across * angle, foot - up * (values - low)
    shown = np.isfinite(values) & (values <= high)
    runs = np.split(np.arange(len(x)), np.flatnonzero(np.diff(shown)) + 1)
    lines = [
        element("polyline", points=" ".join(f"{x[k]:.1f},{y[k]:.1f}" for k in run)) for run in runs if shown[run[0]]
    ]
    marks = [
        part
        for value in ticks(low, high, CHART.ticks)
        for at in [f"{foot - up * (value - low):.1f}"]
        for part in (
            element(
                "line", x1=CHART.left, x2=CHART.width - CHART.right, y1=at, y2=at, class_=None if value else "zero"
            ),
            element("text", figure(value), x=CHART.left - 5, y=at, dy="0.35em", text_anchor="end"),
        )
    ]
    for value in ticks(0.0, float(angle[-1]), CHART.ticks):
        at = f"{CHART.left + across * value:.1f}"
        marks.append(element("line", x1=at, x2=at, y1=foot, y2=foot + 4))
        marks.append(element("text", f"{figure(value)}°", x=at, y=foot + 14, text_anchor="middle"))
    extent = f"{figure(least)} … {figure(most)}"
    return element(
        "svg",
        element("title", f"{curve.name}: {figure(least)} to {figure(most)} over {figure(float(angle[-1]))}° of {name}"),
        element("text", curve.name, x=6, y=12, class_="name"),
        element("text", extent, x=CHART.width - CHART.right, y=12, text_anchor="end"),
        *marks,
        *lines,
        element("text", f"turn of {name}", x=CHART.width - CHART.right, y=CHART.height - 3, text_anchor="end"),
        class_="chart",
        viewBox=f"0 0 {CHART.width} {CHART.height}",
        role="img",
    )
