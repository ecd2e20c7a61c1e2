"""Error against run time of the deviation of a straight guide: work and precision."""

# ruff: noqa: E501  (text is wrapped as it is printed)
from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"
sys.path.insert(0, str(Path(__file__).parents[1]))

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np
from measuring import arguments, seconds, table, title
from naive import Loop, mpf, narrowest_strip

from catalogue.guidance.coupler_curve import CouplerCurve, coupler_curve
from catalogue.guidance.trace import extended, trace
from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.types import Array
from catalogue.plugin.registry import Registry

#: Half strokes, as parts of the longest.
PARTS = (0.9, 0.5, 0.2, 0.08, 0.03, 0.01, 0.003, 0.001)
DRIVES = ("coupler", "crank", "other crank")


def guides() -> tuple[CouplerCurve, Array]:
    """Return four linkages of each of two series with their Ball point, at eight half strokes each: 64 guides."""
    pivots, points = [], []
    for code, label in (("I.GG", "undulation"), ("II.xy", "[2]")):
        series = Registry().get(code)
        member = series.members[0]
        share = np.random.default_rng(8).random((200, len(member.parameters)))
        free = {p.name: p.spread(share[:, i]) for i, p in enumerate(member.parameters)}
        (guided,) = [g for g in series.guided(member.complete(free)) if g.label == label]
        z = guided.pairs[:, 1]
        linkage = Linkage(member.synthesise(free))
        here = coupler_curve(linkage, np.divide(z[:, 0] + 1j * z[:, 1], z[:, 2]))
        fair = np.flatnonzero((here.extent.min(0) > 0.5) & (linkage.size < 8))[:4]
        pivots.append(linkage.pivots[fair])
        points.append(here.point[fair])
    here = coupler_curve(Linkage(np.concatenate(pivots)), np.concatenate(points))
    half = np.outer(PARTS, here.extent.min(0)).ravel()
    again = np.tile(np.arange(len(here)), len(PARTS))
    return here[again], half


def reference(here: CouplerCurve, low: Array, high: Array) -> Array:
    """Return the deviation over the same windows of the parameter from loops closed in 50 digits.

    The path at 161 Chebyshev points, less its chord, is scaled before it becomes double; the interpolant is read at
    8001 points, and the narrowest strip of those found from their convex hull.
    """
    out = []
    nodes = 160
    with mp.workdps(50):
        for i in range(len(here)):
            loop = Loop(here.linkage.pivots[i], complex(here.point[i]), exact=True)
            drive = DRIVES[here.motion.chart[i]]
            a, b = mpf(low[i]), mpf(high[i])
            angles = [2 * mp.atan((a + b) / 2 - (b - a) / 2 * mp.cos(mp.pi * k / nodes)) for k in range(nodes + 1)]
            path = [loop.close(drive, angle) for angle in angles]
            chord = path[-1] - path[0]
            w = [(p - path[0]) / chord for p in path]
            scale = max(abs(p.imag) for p in w)
            u = np.array([float(p.real) for p in w])
            v = np.array([float(p.imag / scale) for p in w])
            x = -np.cos(np.pi * np.arange(nodes + 1) / nodes)
            fine = -np.cos(np.pi * np.arange(8001) / 8000)
            u, v = (np.polynomial.Chebyshev.fit(x, f, nodes, domain=(-1, 1))(fine) for f in (u, v))
            out.append(narrowest_strip(u, v, float(scale)) * float(abs(chord)))
    return np.array(out)


def main() -> None:
    """Print the table."""
    arguments().parse_args()
    title("Accuracy of the deviation against time")
    here, half = guides()
    exact = trace(here, half, circle=False, split=False, nodes=64)
    true = reference(here, exact.low, exact.high)
    relative = true / (2 * half)
    many = np.tile(np.arange(len(here)), 25)
    rows = []
    for name, kind, nodes in (
        *((f"double, {n} intervals", float, n) for n in (8, 16, 32, 64)),
        *((f"extended, {n} intervals", np.longdouble, n) for n in (16, 32)),
    ):
        set_ = here if kind is float else extended(here)
        found = trace(set_, half.astype(kind), circle=False, split=False, nodes=nodes)
        error = np.abs(found.fit.deviation / true - 1).astype(float)
        batch, halves = set_[many], half[many].astype(kind)
        taken = seconds(lambda b=batch, h=halves, n=nodes: trace(b, h, circle=False, split=False, nodes=n), 7)
        worst = [np.max(error[(relative >= a) & (relative < b)], initial=0) for a, b in LEVELS]
        rows.append((name, f"{1e6 * taken / len(many):.1f}", *(f"{w:.0e}" for w in worst)))
    counts = [int(((relative >= a) & (relative < b)).sum()) for a, b in LEVELS]
    print(
        f"Largest relative error of the deviation of {len(here)} straight guides (Ball points of I.GG and II.xy,\n"
        "without splitting), by their deviation over stroke, against loops closed in 50 digits.  Intervals that do not\n"
        f"resolve a path are doubled and doubled again by `trace` itself.  Time per guide in batches of {len(many)}.\n"
    )
    table(["precision", "us per guide", *(f"{a:.0e} ... {b:.0e}" for a, b in LEVELS)], rows)
    print("Guides in each column: " + ", ".join(map(str, counts)) + ".")


LEVELS = ((1e-4, 1.0), (1e-6, 1e-4), (1e-9, 1e-6), (1e-12, 1e-9), (1e-18, 1e-12))

if __name__ == "__main__":
    main()
