"""Curves over the drive, each a small drawing in the colours of the page."""

from __future__ import annotations

import numpy as np

from ..draw.curves import TALLEST, Curve, curves
from ..errors import InvalidRequest
from ..find.candidate import Candidate
from ..kinematics.types import Floats
from .cards import figure

#: Width, height and margins of a chart, and points of a curve at most.
WIDTH, HEIGHT, LEFT, TOP, POINTS = 320, 120, 6, 20, 121
#: What stands for the unit until the page knows it.
UNIT = "UNIT"


def charts(one: Candidate) -> tuple[str, ...]:
    """Return the curves of a guide over its drive; none where its point returns."""
    try:
        name, drive, found = curves(one, UNIT)
    except InvalidRequest:
        return ()
    return tuple(chart(curve, drive, name) for curve in found)


def chart(curve: Curve, drive: Floats, name: str) -> str:
    """Return one curve as SVG: its name with its unit, its greatest and least value."""
    some = np.linspace(0, len(drive) - 1, min(POINTS, len(drive))).astype(int)
    values, angle = curve.values[some], drive[some]
    good = values[np.isfinite(values)]
    least, most = float(good.min()), float(good.max())
    high = min(most, TALLEST * float(np.median(np.abs(good)))) if curve.zero else most
    low = min(least, 0.0)
    x = LEFT + (WIDTH - 2 * LEFT) * (angle - angle[0]) / (angle[-1] - angle[0] or 1.0)
    y = TOP + (HEIGHT - 2 * TOP) * (high - values) / (high - low or 1.0)
    zero = TOP + (HEIGHT - 2 * TOP) * high / (high - low or 1.0)
    shown = np.isfinite(values) & (values <= high)
    runs = np.split(np.arange(len(x)), np.flatnonzero(np.diff(shown)) + 1)
    lines = "".join(
        f'<polyline points="{" ".join(f"{x[k]:.1f},{y[k]:.1f}" for k in run)}"/>' for run in runs if shown[run[0]]
    )
    span = f"{figure(abs(float(drive[-1] - drive[0])))}° of {name}"
    return (
        f'<svg class="chart" viewBox="0 0 {WIDTH} {HEIGHT}" role="img"><title>{curve.name}: {figure(least)} to '
        f'{figure(most)} over {span}</title><text x="{LEFT}" y="12">{curve.name}</text>'
        f'<text x="{WIDTH - LEFT}" y="12" text-anchor="end">{figure(least)} … {figure(most)}</text>'
        f'<line x1="{LEFT}" x2="{WIDTH - LEFT}" y1="{zero:.1f}" y2="{zero:.1f}"/>{lines}'
        f'<text x="{LEFT}" y="{HEIGHT - 4}">start</text>'
        f'<text x="{WIDTH - LEFT}" y="{HEIGHT - 4}" text-anchor="end">after {span}</text></svg>'
    )
