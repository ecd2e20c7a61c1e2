"""How often machines whose pivots scatter by their allowance keep the path within the tolerance: answers of six
families, lines, arcs and dwells, drawn and moved by loops that are closed in another way.

    python tests/benchmarks/allowance.py DB [DRAWS]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linprog

import catalogue
from catalogue import CircularArc, StandStill, StraightLine

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests import naive
from tests.find.test_dwells import machines

Array = Any
#: Places of the path that are looked at, and steps to its ends.
PLACES, STEPS = 65, 12
#: Lines and arcs; ten answers of each.
REQUESTS: dict[str, tuple[Any, dict[str, Any]]] = {
    "four-bar, line": (StraightLine(150, 0.05), {"families": ["four-bar"]}),
    "slider-crank, line": (StraightLine(150, 0.05), {"families": ["slider-crank"]}),
    "inverted, line": (StraightLine(150, 0.05), {"families": ["inverted-slider-crank"]}),
    "swinging block, line": (StraightLine(150, 0.05), {"families": ["swinging-block"]}),
    "trammel, arc": (CircularArc(100, 0.05, 80), {"families": ["elliptic-trammel"]}),
    "four-bar, arc": (CircularArc(100, 0.05, 80), {"families": ["four-bar"]}),
    "Oldham, any arc": (CircularArc(100, 0.05), {"families": ["oldham"]}),
    "any arc": (CircularArc(100, 0.05), {"pins_only": True}),
}


def scattered(c: Any, scatter: float, draws: int, seed: int) -> tuple[Array, Array]:
    """Return pivots (draws, 2, 2, 3) and guided points (draws,) of machines whose coordinates are off by independent
    normal numbers; pivots at infinity stay."""
    rng = np.random.default_rng(seed)
    pivots = np.repeat(np.array(c.pivots, float)[None], draws, axis=0)
    off = scatter * rng.normal(size=(draws, 5, 2))
    pivots[..., :2] += off[:, :4].reshape(draws, 2, 2, 2) * pivots[..., 2:]
    return pivots, complex(*c.guided) + off[:, 4, 0] + 1j * off[:, 4, 1]


def along(c: Any, z: Array) -> Array:
    """Return how far along the nominal of a candidate the feet of points are, 0 at its start, 1 at its end: a line
    along the x axis, or an arc above it."""
    if c.radius is None:
        return z.real / c.stroke
    half = np.arcsin(0.5 * c.stroke / c.radius)
    centre = 0.5 * c.stroke - 1j * np.sqrt(c.radius**2 - 0.25 * c.stroke**2)
    return 0.5 - 0.5 * np.angle(-1j * (z - centre)) / half


def paths(c: Any, pivots: Array, point: Array) -> Array:
    """Return the points, (PLACES, n), in which machines run from the start to the end of the path of a candidate; NaN
    for those that do not."""
    n, found = len(pivots), None
    for chain in (naive.Chain(pivots, lead) for lead in (2, 0, 1)):
        if (chain.kinds[chain.lead] != "RR") if chain.lead < 2 else ("RR" in chain.kinds):
            continue

        def run(t: Array, chain: Any = chain) -> Array:
            with np.errstate(all="ignore"):
                return _point(chain, t, point)

        mean = _nominal(c, chain.lead, np.linspace(-3.1, 3.1, 3101))
        if mean is None:
            continue
        ends = [np.full(n, v) for v in mean]
        for goal in (0, 1):
            for _ in range(STEPS):
                x, ahead = (along(c, run(ends[goal] + step)) for step in (0.0, 1e-6))
                ends[goal] = ends[goal] - (x - goal) * 1e-6 / (ahead - x)
        share = 0.5 - 0.5 * np.cos(np.pi * np.arange(PLACES) / (PLACES - 1))
        led = run(ends[0] + (ends[1] - ends[0]) * share[:, None])
        # a machine that one link leads to a dead point is led through it by another
        found = led if found is None else np.where(np.isfinite(found).all(0), found, led)
        if np.isfinite(found).all():
            break
    assert found is not None, f"no crank or coupler leads {c.family} through the stroke"
    return found


def _point(chain: Any, t: Array, point: Array) -> Array:
    """Return where points are that machines carry, each closed as it stands at the angle 0."""
    zero = np.zeros(len(np.atleast_1d(point)))
    best = None
    for side in (1, -1):
        d, turn = chain.pose(zero, side)
        off = np.nan_to_num(np.abs(d) + np.abs(turn - 1), nan=np.inf)
        there = chain.pose(t, side)
        z = there[0] + there[1] * point
        best = (off, z) if best is None else (np.minimum(off, best[0]), np.where(off < best[0], z, best[1]))
    assert best is not None
    return best[1]


def _nominal(c: Any, lead: int, t: Array) -> tuple[float, float] | None:
    """Return the angles at which the machine as drawn is at the start and at the end; None if it is not led there."""
    pivots = np.array(c.pivots, float)[None]
    chain = naive.Chain(pivots, lead)
    with np.errstate(all="ignore"):
        x = along(c, _point(chain, t[:, None], np.array([complex(*c.guided)])))[:, 0]
    middle, found = len(t) // 2, []
    for goal in (0, 1):
        side = np.sign(goal - x[middle])
        for way in (1, -1):
            run = x[middle:] if way == 1 else x[middle::-1]
            ahead = side * (run - goal)
            reached = np.flatnonzero(~(ahead < 0))
            if len(reached) and ahead[reached[0]] >= 0 and (np.diff(side * run[: reached[0] + 1]) > 0).all():
                found.append(t[middle + way * reached[0]])
                break
    return (found[0], found[1]) if len(found) == 2 else None


def half_widths(path: Array, request: Any) -> Array:
    """Return half the widths of the narrowest strips or annuli that hold paths (m, n); with a radius the largest
    distance from the best-placed arc of exactly that."""
    if request.kind == "line":
        return _strips(path)
    return np.array([_arc(z, request.radius) for z in path.T])


def _strips(path: Array) -> Array:
    """Return half the widths of narrowest strips: the width is convex in the slope."""
    x, y = path.real, path.imag
    span = np.ptp(y, axis=0).max() / np.ptp(x, axis=0).min()
    low, high = (np.full(path.shape[1], s * 2 * span) for s in (-1, 1))
    golden = 0.5 * (5**0.5 - 1)
    for _ in range(60):
        one, two = high - golden * (high - low), low + golden * (high - low)
        less = np.ptp(y - one * x, axis=0) < np.ptp(y - two * x, axis=0)
        low, high = np.where(less, low, one), np.where(less, two, high)
    slope = 0.5 * (low + high)
    return 0.5 * np.ptp(y - slope * x, axis=0) / np.hypot(1, slope)


def _arc(z: Array, radius: float | None) -> float:
    """Return the deviation from the best arc: a linear programme of centre and radius, linearised again once."""
    if not np.isfinite(z).all():
        return float("nan")
    middle = z[len(z) // 2]
    depth = 0.5 * abs(z[-1] - z[0])
    rise = abs(middle - 0.5 * (z[0] + z[-1]))
    here = radius or (depth**2 + rise**2) / (2 * rise)
    centre = middle - 1j * here * (z[-1] - z[0]) / abs(z[-1] - z[0])
    for _ in range(3):
        ray = z - centre
        far = np.abs(ray)
        rows = np.stack([(ray / far).real, (ray / far).imag, np.ones(len(z))], axis=1)[:, : 2 if radius else 3]
        gap, bound = far - here, np.ones((len(z), 1))
        unit = np.abs(gap).max()
        found = linprog(
            [0.0] * rows.shape[1] + [1.0], A_ub=np.block([[-rows, -bound], [rows, -bound]]),
            b_ub=np.concatenate([-gap, gap]) / unit, bounds=[(None, None)] * (rows.shape[1] + 1), method="highs",
        )  # fmt: skip
        assert found.x is not None
        step = unit * found.x
        centre, here = centre + complex(step[0], step[1]), here + (0.0 if radius else step[2])
    return float(np.abs(np.abs(z - centre) - here).max())


def probability(c: Any, request: Any, draws: int, seed: int = 1) -> float:
    """Return the share of machines, drawn at the allowance of a candidate, that stay within the tolerance."""
    pivots, point = scattered(c, c.allowance, draws, seed)
    held = half_widths(paths(c, pivots, point), request) <= request.deviation
    return float(held.mean())


def main(database: str, draws: int = 2000) -> None:
    cat = catalogue.open(database)
    every = []
    for name, (request, wish) in REQUESTS.items():
        found = cat.find(request, limit=8, per_series=0, **wish)
        count = draws if request.kind == "line" else draws // 4
        shares = [probability(c, request, count) for c in found if (c.allowance or 0) > 0]
        every += shares
        told = f"{min(shares):.3f} {np.mean(shares):.3f} {max(shares):.3f}" if shares else "no answer"
        print(f"{name}: {len(shares)} answers, {told}", flush=True)
    for dwell in (StandStill(60, 1, 20), StandStill(90, 0.5, 30)):
        shares = [
            float((machines(d, d.allowance or 0.0, draws) <= dwell.residual).mean())
            for d in cat.find_dwells(dwell, pins_only=True, limit=5)
            if (d.allowance or 0) > 0
        ]
        every += shares
        told = f"{min(shares):.3f} {np.mean(shares):.3f} {max(shares):.3f}" if shares else "no answer"
        print(f"dwell of {dwell.angle:g} degrees: {len(shares)} answers, {told}", flush=True)
    print(f"{len(every)} answers: {min(every):.3f} {np.mean(every):.4f} {max(every):.3f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("database")
    parser.add_argument("draws", type=int, nargs="?", default=2000)
    given = parser.parse_args()
    main(given.database, given.draws)
