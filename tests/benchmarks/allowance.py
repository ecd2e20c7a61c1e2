"""How often machines whose pivots scatter by their allowance keep the path within the tolerance: answers of six
families, lines, arcs and dwells, drawn and moved by loops that are closed in another way.

    python tests/benchmarks/allowance.py DB [DRAWS]
"""

from __future__ import annotations

import argparse
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import catalogue
from catalogue import CircularArc, StandStill, StraightLine

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests import naive
from tests.find.test_dwells import machines

Array = Any
#: Places of the path that are looked at, and steps to its ends.
PLACES, STEPS = 129, 12
#: Machines that are drawn at once: their paths take 50 MB.
TOGETHER = 2000
#: How far a share may be from 0.95, of which 6,000 draws leave 0.003.
WITHIN = 0.015
#: Exchanges of places at most, and linear programmes to the centre of an arc.
EXCHANGES, NEWTON = 40, 4
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


def scattered(c: Any, scatter: float, draws: int, seed: Any) -> tuple[Array, Array]:
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
    chord = path[-1] - path[0]
    z = (path - 0.5 * (path[0] + path[-1])) * np.abs(chord) / chord
    if request.kind == "line":
        found, width = best_fit(np.stack([np.ones(z.shape), z.real]), z.imag)
        return np.asarray(width / np.hypot(1, found[1]))
    rise = z[len(z) // 2].imag
    radius = np.full(rise.shape, request.radius or np.nan)
    if request.radius is None:
        radius = (0.25 * np.abs(chord) ** 2 + rise**2) / (2 * rise)
    centre, width = 1j * (rise - radius), np.full(rise.shape, np.nan)
    for _ in range(NEWTON):
        ray = z - centre
        far = np.abs(ray)
        rows = np.stack([ray.real / far, ray.imag / far, np.ones(z.shape)])[: 2 if request.radius else 3]
        step, width = best_fit(rows, far - radius)
        centre = centre + step[0] + 1j * step[1]
        radius = radius if request.radius else radius + step[2]
    proven = np.abs(np.abs(np.abs(z - centre) - radius).max(0) - width) < 1e-3 * width
    return np.where(proven, width, np.nan)


def best_fit(rows: Array, goal: Array) -> tuple[Array, Array]:
    """Return the coefficients (k, n) of the best uniform fits of goals (m, n) by rows (k, m, n), no sum of which
    vanishes at k places, and their largest errors (n,), by exchange of one place at a time; NaN where there is none.

    A fit is proven: no other has less than the level of its places, which is that error.
    """
    k, m, n = rows.shape
    column, sign = np.arange(n), np.where(np.arange(k + 1) % 2, -1.0, 1.0)
    good = np.isfinite(goal).all(0)
    rows, goal = np.where(good, rows, rows[..., [good.argmax()]]), np.where(good, goal, 0.0)
    at = np.round((m - 1) * (0.5 - 0.5 * np.cos(np.pi * np.arange(k + 1) / k))).astype(int)[:, None].repeat(n, 1)
    found, worst, level = np.zeros((n, k + 1)), np.full(n, np.inf), np.zeros(n)
    for _ in range(EXCHANGES):
        left = np.concatenate([rows[:, at, column].transpose(2, 1, 0), np.tile(sign, (n, 1))[..., None]], axis=2)
        found = np.linalg.solve(left, goal[at, column].T[..., None])[..., 0]
        error = goal - np.einsum("nk,kmn->mn", found[:, :k], rows)
        new = np.abs(error).argmax(0)
        worst, level = np.abs(error[new, column]), np.abs(found[:, k])
        if (worst <= level * (1 + 1e-6) + 1e-15).all():
            break
        at = _exchanged(at, new, (error[new, column] > 0) == (found[:, k] > 0))
    assert (worst <= level * (1 + 1e-3) + 1e-12).all(), "an exchange has not ended"
    return found[:, :k].T, np.where(good, worst, np.nan)


def _exchanged(at: Array, new: Array, as_first: Array) -> Array:
    """Return ascending places (k, n), where errors alternate, with a new one instead of that which keeps them so;
    `as_first` tells where the error has there the sign that it has at the first place."""
    k, column, at = len(at), np.arange(at.shape[1]), at.copy()
    before = (at <= new).sum(0) - 1
    out = np.where((before % 2 == 0) == as_first, before, before + 1)
    out = np.where(before < 0, np.where(as_first, 0, -1), out)
    at[:, out < 0] = np.roll(at[:, out < 0], 1, axis=0)
    at[:, out == k] = np.roll(at[:, out == k], -1, axis=0)
    at[np.clip(out, 0, k - 1), column] = new
    return at


def probability(c: Any, request: Any, draws: int, seed: int = 1) -> float:
    """Return the share of machines, drawn at the allowance of a candidate, that stay within the tolerance."""
    held = 0
    for first in range(0, draws, TOGETHER):
        pivots, point = scattered(c, c.allowance, min(TOGETHER, draws - first), [seed, first])
        held += int(np.count_nonzero(half_widths(paths(c, pivots, point), request) <= request.deviation))
    return held / draws


def is_capped(c: Any) -> bool:
    """Return whether an answer has the largest allowance that is told, a hundredth of its shortest crank or coupler;
    of a dwell of its rod or rocker too."""
    z = [[complex(x, y) if w else None for x, y, w in pair] for pair in c.pivots]
    bars = [tuple(z[0]), tuple(z[1]), (z[0][1], z[1][1])]
    if hasattr(c, "joint"):
        bars += [(complex(*c.guided), complex(*c.joint)), (complex(*c.joint), complex(*c.pivot))]
    lengths = [abs(a - b) for a, b in bars if a is not None and b is not None]
    return bool(lengths) and c.allowance > 0.00999 * min(lengths)


def main(database: str, draws: int = 6000) -> int:
    """Print the shares of all answers; return 1 where one of them is none of 95 per cent, else 0."""
    cat = catalogue.open(database)
    asked: list[tuple[str, list[Any], Any]] = [
        (name, list(cat.find(request, limit=8, per_series=0, **wish)), partial(probability, request=request))
        for name, (request, wish) in REQUESTS.items()
    ]
    for dwell in (StandStill(60, 1, 20), StandStill(90, 0.5, 30)):
        found = cat.find_dwells(dwell, pins_only=True, limit=5)
        asked.append((f"dwell of {dwell.angle:g} degrees", list(found), partial(_standing, residual=dwell.residual)))
    every: list[float] = []
    outside = 0
    for name, answers, share_of in asked:
        answers = [c for c in answers if (c.allowance or 0) > 0]
        shares = [share_of(c, draws=draws, seed=len(every) + i) for i, c in enumerate(answers)]
        every += shares
        told = f"{min(shares):.4f} {np.mean(shares):.4f} {max(shares):.4f}" if shares else "no answer"
        print(f"{name}: {len(shares)} answers, {told}", flush=True)
        for c, share in zip(answers, shares, strict=True):
            capped = is_capped(c)
            if abs(share - 0.95) > WITHIN:
                wrong = share < 0.95 or not capped
                outside += wrong
                print(
                    f"  {c.code} {c.family}: {share:.4f}{', capped' * capped}{'' if wrong else ', may be'}", flush=True
                )
    print(f"{len(every)} answers: {min(every):.4f} {np.mean(every):.4f} {max(every):.4f}; {outside} outside")
    return int(outside > 0)


def _standing(d: Any, residual: float, draws: int, seed: int) -> float:
    """Return the share of four-bars, drawn at the allowance of a dwell, whose rocker keeps its residual."""
    return float((machines(d, d.allowance, draws, seed) <= residual).mean())


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("database")
    parser.add_argument("draws", type=int, nargs="?", default=6000)
    given = parser.parse_args()
    sys.exit(main(given.database, given.draws))
