"""Nanoseconds per position of the closed form, against the straightforward ways."""

# ruff: noqa: E501  (text is wrapped as it is printed)
from __future__ import annotations

import cmath
import math
import os
from importlib.metadata import version

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # one core, for all that is compared

import numpy as np
from measuring import arguments, seconds, table, title

import catalogue.kinematics.motion as closed
from catalogue.kinematics.linkage import FAMILIES, PR, RP, RR, Linkage
from catalogue.kinematics.motion import COUPLER, CRANK_1, motion
from catalogue.kinematics.types import Array

N, M, RUNS = 4096, 64, 41
#: Passes of `Path._solve` over a block, besides the square root and the three divisions.
PASSES = 28


def linkages(family: str, count: int) -> Linkage:
    """Return random linkages whose rays cross at a fair angle."""
    draw = np.random.default_rng(1)
    pivots = np.ones((8 * count, 2, 2, 3))
    pivots[..., :2] = draw.normal(size=(8 * count, 2, 2, 2))
    for i, kind in enumerate(FAMILIES[family]):
        if kind != RR:
            pivots[:, i, 0 if kind == PR else 1, 2] = 0
    linkage, _ = Linkage.valid(pivots)
    rays = linkage.rays
    return linkage[np.flatnonzero(np.abs((rays[:, 0].conj() * rays[:, 1]).imag) > 0.3)[:count]]


def window(linkage: Linkage, chart: int) -> tuple[closed.Path, Array, Array, Array]:
    """Return the path of a point, and most of the interval of the chart."""
    moving = motion(linkage, chart)
    point = linkage.points[:, 0, 1] * 0.3 + 0.4j
    low, high = 0.9 * np.clip(moving.interval, -1, 1)
    return moving.point(point), low, high, -np.cos(np.pi * np.arange(M) / (M - 1))


def intersected(linkage: Linkage, point: Array, angle: Array) -> Array:
    """Four-bar, crank 1 driving: two circles met in complex numbers, as one would write it down; shape (m, n)."""
    (a, am), (b, bm) = linkage.points[:, 0].T, linkage.points[:, 1].T
    moving = a + np.exp(1j * angle) * (am - a)
    apart = b - moving
    square = np.abs(apart) ** 2
    coupler, crank = np.abs(bm - am), np.abs(bm - b)
    along = (square + coupler**2 - crank**2) / (2 * square)
    with np.errstate(invalid="ignore"):
        across = np.sqrt(coupler**2 / square - along**2)
    side = np.sign(((bm - am) / (b - am)).imag)
    other = moving + apart * (along + 1j * side * across)
    path: Array = moving + (other - moving) / (bm - am) * (point - am)
    return path


def one_by_one(linkage: Linkage, point: Array, angle: Array) -> list[list[complex]]:
    """The same, a position at a time."""
    out = []
    for i in range(len(linkage)):
        (a, am), (b, bm) = linkage.points[i].tolist()
        z, coupler, crank = complex(point[i]), abs(bm - am), abs(bm - b)
        side = math.copysign(1, ((bm - am) / (b - am)).imag)
        path = []
        for t in angle[:, i].tolist():
            moving = a + cmath.exp(1j * t) * (am - a)
            apart = b - moving
            square = abs(apart) ** 2
            along = (square + coupler**2 - crank**2) / (2 * square)
            other = moving + apart * (along + 1j * side * cmath.sqrt(coupler**2 / square - along**2))
            path.append(moving + (other - moving) / (bm - am) * (z - am))
        out.append(path)
    return out


def alternatives() -> None:
    """Four-bars driven by a crank: the closed form against two circles, the same positions."""
    linkage = linkages("four-bar", N)
    path, low, high, nodes = window(linkage, CRANK_1)
    t = 0.5 * (high + low) + 0.5 * (high - low) * nodes[:, None]
    angle, point = 2 * np.arctan(t), linkage.points[:, 0, 1] * 0.3 + 0.4j
    u, v = path.window(low, high, nodes)
    gap = np.abs(u + 1j * v + point - intersected(linkage, point, angle))
    assert np.nanmax(gap) < 1e-9, np.nanmax(gap)

    def blocked() -> None:
        for start in range(0, N, 128):
            part = slice(start, start + 128)
            intersected(linkage[part], point[part], angle[:, part])

    few = slice(0, 32)
    rows = [
        ("closed form, window", seconds(lambda: path.window(low, high, nodes), RUNS) / (N * M)),
        ("closed form, any parameters", seconds(lambda: path(t), RUNS) / (N * M)),
        ("two circles in numpy, all at once", seconds(lambda: intersected(linkage, point, angle), 5) / (N * M)),
        ("two circles in numpy, 8192 positions at once", seconds(blocked, 5) / (N * M)),
        ("two circles in Python", seconds(lambda: one_by_one(linkage[few], point[few], angle[:, few]), 5) / (32 * M)),
    ]
    rows += compiled()
    print(f"{N} four-bars x {M} positions, crank 1 driving, path of a coupler point; all agree within 1e-9.\n")
    base = rows[0][1]
    table(["way", "ns per position", "times"], [(n, f"{1e9 * s:.1f}", f"{s / base:.1f}") for n, s in rows])


def compiled() -> list[tuple[str, float]]:
    """The compiled step of pylinkage, if that is installed (with numba): crank, dyad, and the coupler point."""
    try:
        from pylinkage._numba_compat import HAS_NUMBA
        from pylinkage.solver.simulation import simulate
        from pylinkage.solver.types import JOINT_CRANK, JOINT_FIXED, JOINT_REVOLUTE, JOINT_STATIC
    except ImportError:
        return []
    positions = np.array([(0.0, 0.0), (0.0, 1.0), (3.0, 0.0), (3.0, 2.0), (2.0, 3.0)])
    kinds = np.array([JOINT_STATIC, JOINT_CRANK, JOINT_STATIC, JOINT_REVOLUTE, JOINT_FIXED], dtype=np.int32)
    parents = np.array([(-1, -1, -1), (0, -1, -1), (-1, -1, -1), (1, 2, -1), (1, 3, -1)], dtype=np.int32)
    constraints = np.array([1.0, 2 * np.pi / M, math.sqrt(10), 2.0, math.sqrt(8), 0.5])
    offsets = np.array([0, 0, 2, 2, 4], dtype=np.int32)
    order = np.array([1, 3, 4], dtype=np.int32)
    steps = 64 * M if HAS_NUMBA else M

    def run() -> Array:
        found: Array = simulate(positions.copy(), constraints, kinds, parents, offsets, order, steps, 1.0)
        return found

    assert np.isfinite(run()).all()
    name = "compiled by numba" if HAS_NUMBA else "without numba"
    return [(f"pylinkage {version('pylinkage')}, its step {name}", seconds(run, 15) / steps)]


def families() -> None:
    """The closed form in the charts of all families."""
    rows = []
    for family, kinds in FAMILIES.items():
        for chart, name in ((COUPLER, "coupler"), (CRANK_1, "crank 1")):
            if kinds == (RP, RP) or (chart == CRANK_1 and kinds[0] != RR):
                continue  # no path of a turning coupler, no crank
            linkage = linkages(family, N)
            path, low, high, nodes = window(linkage, chart)
            taken = seconds(lambda p=path, a=low, b=high, c=nodes: p.window(a, b, c), RUNS) / (len(linkage) * M)
            rows.append((f"{family}, {name}", f"{1e9 * taken:.1f}"))
    table(["family, chart", "ns per position"], rows)


def limit() -> None:
    """What sets the pace: the same work in blocks of several sizes, and the cost of its parts."""
    linkage = linkages("four-bar", N)
    path, low, high, nodes = window(linkage, COUPLER)
    usual, rows = closed.BLOCK, []
    for size in (2**k for k in range(10, 20)):
        closed.BLOCK = size
        taken = seconds(lambda: path.window(low, high, nodes), RUNS) / (N * M)
        a, b, c = (np.full(size, 1.5) for _ in range(3))
        each = [
            seconds(lambda f=f: [f() for _ in range(20)], RUNS) / (20 * size)
            for f in (lambda: np.multiply(a, b, out=c), lambda: np.sqrt(a, out=c), lambda: np.divide(a, b, out=c))  # noqa: B023, called before the loop goes on
        ]
        powers, forms = np.ones((M, 3)), np.ones((9, 3, max(size // M, 1)))
        each.append(seconds(lambda: powers @ forms, RUNS) / size)  # noqa: B023, called before the loop goes on
        kib = 15 * 8 * size // 1024
        rows.append((size, kib, *(f"{1e9 * s:.2f}" for s in (taken, *each))))
        if size == usual:
            parts = [1e9 * s for s in (each[3], each[1], 3 * each[2], PASSES * each[0], taken)]
    closed.BLOCK = usual
    print(f"Block sizes ({usual} is used); 'held' counts the 15 arrays of a block that are alive at once.\n")
    table(["positions", "held KiB", "window ns", "multiply ns", "sqrt ns", "divide ns", "9 forms ns"], rows)
    nine, root, division, passes, whole = parts
    print(
        f"What sets the limit: of {whole:.1f} ns, the matrix product of the nine forms takes {nine:.1f}, one square\n"
        f"root {root:.1f}, three divisions {division:.1f}, {PASSES} further passes at least {passes:.1f} (so much when\n"
        f"their operands are in cache already).  The rest, {whole - sum(parts[:4]):.1f} ns, is waiting for the caches:\n"
        "memory passes set the limit, not arithmetic.  Smaller blocks pay numpy's call overhead, larger ones leave the\n"
        "cache."
    )


if __name__ == "__main__":
    arguments().parse_args()
    title("Positions per second")
    alternatives()
    families()
    limit()
