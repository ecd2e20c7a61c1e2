"""Error against time per position of spatially guided bodies: the batch solver beside scipy on the same equations.

``python -m tests.benchmarks.spatial_work_precision`` writes ``data/reports/spatial_work_precision.md`` and ``.svg``.
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import contextlib
import io
import math
import time
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from scipy.optimize import least_squares, root

from catalogue.spatial import Link, Mechanism, Travel
from catalogue.spatial.guided import compiled as guided_compiled
from catalogue.spatial.guided.walk import ACCURACY, LIMITS
from catalogue.spatial.jointed import compiled, newton, sweeping
from tests.benchmarks.measuring import arguments, table, title
from tests.benchmarks.spatial_sweep import TRAVEL, scipy_five_links, turned
from tests.spatial.conftest import CLASSES, driven, random_mechanisms, solver
from tests.spatial.test_axles import CENTRE, INNER, OUTER

REPORT = Path(__file__).parents[2] / "data" / "reports" / "spatial_work_precision"
KINDS = ("cylinder", "cone", "hyperboloid:sinh", "torus", "sphere:zpole", "plane")
N, NODES, ARC = 300, 200, 0.1
#: Mechanisms of each class that scipy solves, with root and with least_squares.
FEW, FEWER = 3, 1
#: What a last step may be (ours), and tolerances (scipy).
OURS, THEIRS = (1e-4, 1e-6, 1e-8), (1e-4, 1e-8, 1e-12)
#: Our ways: of the whole batch, or of one mechanism after the other; by numpy, and by numba.
MINE = [(f"{way}, {many}", many == "batch", "numba" in way) for many in ("batch", "one mechanism")
        for way in ("numpy", "numba")]  # fmt: skip
BEST = MINE[0][0]
FIVE = "five-link axle"
Array = np.ndarray[Any, Any]
EXPLAINED = """\
Random mechanisms of each class ({many}) that can move {arc} rad of every driver, along {nodes} positions.  The
solver goes by numpy, or compiled by numba, warm: all mechanisms in one batch, or the first {few} of each class one
after the other.  scipy solves the first {few}
(root) and {fewer} (least_squares) of each class, from the last position, on the equations of the pose written for one
mechanism in plain numpy.

In a cell: microseconds of one processor per position / largest error of a point, in units of about the diameter of the
body, against residuals in extended precision (80 bits) on the first mechanisms.  This solver measures every position
besides (residual, condition, coordinates on the guides) and includes the step control that keeps the branch.
"""
AXLE = """
Joints and links: the travel of a five-link axle over 160 mm, 200 positions; `sweep` of one and of a hundred mechanisms,
by numpy and compiled by numba, warm; scipy on lengths and travel, six unknowns.  The error is that of the outer points,
in the size of the axle.
"""
S = solver()


class Single:
    """The equations of one mechanism in plain numpy, as lean as one would write them for scipy.

    Unknown y: Cayley vector from the last rotation, free coordinates.  Double precision, or any other for `residual`.
    """

    def __init__(self, mechanisms: Any, i: int, real: Any = float) -> None:
        one = S.System.of(mechanisms[[i]])
        index = list(one.points)
        self.real, self.arms = real, one.arms[..., 0].astype(real)
        self.frames = np.moveaxis(one.frames[:, :, index, 0], 2, 0).astype(real)  # (r, world, local)
        self.origins, self.coefficients = one.origins[:, index, 0].T.astype(real), one.quadrics[..., 0].T.astype(real)
        self.points = index
        self.tori = [
            (row, *slot.parameters[:2, 0]) for slot, row in one.others if slot.kinds[slot.which[0]].name == "torus"
        ]
        self.helices = [
            (row, *slot.parameters[:2, 0]) for slot, row in one.others if slot.kinds[slot.which[0]].name == "helix"
        ]
        self.driven = []
        for d in one.driven:
            kind, p = d.slot.kinds[d.slot.which[0]], d.slot.parameters[:, 0].astype(real)
            i = d.slot.point
            self.driven.append((d, kind, p, one.frames[:, :, i, 0].astype(real), one.origins[:, i, 0].astype(real), i))

    def place(self, which: int, free: Array, q: Array) -> tuple[Array, Array]:
        """Return a driven point, and its tangent by the free coordinate."""
        d, kind, p, frame, origin, _ = self.driven[which]
        u, w = ((free[d.column - 3] if d.column else 0.0) if k is None else q[k] for k in d.driver)
        if d.column is None:
            return origin + frame @ np.array(kind.point(u, w, p), self.real), origin
        rho, z = kind.profile(u, w, p)
        sin, cos = (math.sin, math.cos) if self.real is float else (np.sin, np.cos)
        c, s = cos(u), sin(u)
        by_w, dz, _ = kind.slopes(w, p)
        x = origin + frame @ np.array([rho * c, rho * s, z], self.real)
        return x, frame @ np.array([by_w * c, by_w * s, dz], self.real)

    def evaluate(self, y: Array, rotation: Array, q: Array, jacobian: bool) -> tuple[Array, Array | None]:
        """Return residual (m,) and Jacobian (m, m) by y."""
        y = np.asarray(y, self.real)
        free, half = y[3:], y[:3] / 2
        k = 1 / (1 + half @ half)
        cross = np.array([[0, -half[2], half[1]], [half[2], 0, -half[0]], [-half[1], half[0], 0]], self.real)
        arms = (rotation + 2 * k * (cross @ rotation + cross @ (cross @ rotation))) @ self.arms
        base, along = self.place(0, free, q)
        r, m = len(self.points), len(y)
        f, jac = np.empty(m, self.real), np.zeros((m, m), self.real) if jacobian else None
        if r:
            arm = arms[:, self.points].T
            x = ((base + arm - self.origins)[:, None] @ self.frames)[:, 0]
            a, b = self.coefficients[:, :3], self.coefficients[:, 3:6]
            value, gradient = ((a * x + b) * x).sum(1) + self.coefficients[:, 6], 2 * a * x + b
            for row, big, small in self.tori:
                value[row], gradient[row] = self._torus(x[row], big, small)
            for row, radius, advance in self.helices:
                c, s = np.cos(x[row, 2] / advance), np.sin(x[row, 2] / advance)
                value[row], value[row + 1] = x[row, 0] - radius * c, x[row, 1] - radius * s
                gradient[row], gradient[row + 1] = (1, 0, radius * s / advance), (0, 1, -radius * c / advance)
            f[:r] = value
            if jac is not None:
                normal = (self.frames @ gradient[:, :, None])[:, :, 0]
                jac[:r, :3] = np.cross(arm, normal)
                if self.driven[0][0].column:
                    jac[:r, 3] = normal @ along
        for j in range(1, len(self.driven)):
            x, t = self.place(j, free, q)
            at = slice(r + 3 * j - 3, r + 3 * j)
            arm = arms[:, self.driven[j][5]]
            f[at] = x - base - arm
            if jac is not None:
                jac[at, :3] = [[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]]
                if self.driven[0][0].column:
                    jac[at, 3] = -along
                if self.driven[j][0].column:
                    jac[at, self.driven[j][0].column] = t
        if jac is not None:
            jac[:, :3] = k * (jac[:, :3] + jac[:, :3] @ cross)  # of the rotation by the Cayley vector
        return f, jac

    def _torus(self, x: Array, big: Any, small: Any) -> tuple[Any, Array]:
        s = np.sqrt(x[0] * x[0] + x[1] * x[1])
        ratio = 2 * (s - big) / s
        return (s - big) ** 2 + (x[2] - small) * (x[2] + small), np.array([ratio * x[0], ratio * x[1], 2 * x[2]])

    def turned(self, y: Array, rotation: Array) -> Array:
        """Return the rotation after y."""
        half = np.asarray(y[:3], self.real) / 2
        cross = np.array([[0, -half[2], half[1]], [half[2], 0, -half[0]], [-half[1], half[0], 0]], self.real)
        after: Array = rotation + 2 / (1 + half @ half) * (cross @ rotation + cross @ (cross @ rotation))
        return after

    def points_at(self, rotation: Array, free: Array, q: Array) -> Array:
        """Return all points (3, p)."""
        points: Array = self.place(0, free, q)[0][:, None] + rotation @ self.arms
        return points


def refined(single: Single, lean: Single, rotation: Array, free: Array, q: Array) -> Array:
    """Return the points to the last digit of a double: residuals in extended precision, Jacobian in double."""
    rotation, free = rotation.astype(np.longdouble), free.astype(np.longdouble)
    q = q.astype(np.longdouble)
    for _ in range(4):
        y = np.concatenate([np.zeros(3, np.longdouble), free])
        f, _ = single.evaluate(y, rotation, q, jacobian=False)
        _, jac = lean.evaluate(y.astype(float), rotation.astype(float), q.astype(float), jacobian=True)
        assert jac is not None
        y = y - np.linalg.solve(jac, f.astype(float))
        rotation, free = single.turned(y, rotation), y[3:]
        u = rotation.astype(np.longdouble)
        rotation = u @ (3 * np.eye(3, dtype=np.longdouble) - u.T @ u) / 2  # keeps it orthonormal
    return single.points_at(rotation, free, q)


def reflective(f: Callable[..., Any], y: Array, tol: float) -> Any:
    def residual(v: Array) -> Any:
        return f(v)[0]

    def jacobian(v: Array) -> Any:
        return f(v)[1]

    return least_squares(residual, y, jac=jacobian, xtol=tol, ftol=tol, gtol=tol).x


Way = tuple[str, Callable[[Callable[..., Any], Array, float], Any], bool, int]
WAYS: list[Way] = [
    ("scipy root (hybr), analytic Jacobian", lambda f, y, tol: root(f, y, jac=True, tol=tol).x, True, FEW),
    ("scipy root (hybr), differences", lambda f, y, tol: root(f, y, tol=tol).x, False, FEW),
    ("scipy least_squares (trf), analytic Jacobian", reflective, True, FEWER),
    ("scipy least_squares (trf), differences", lambda f, y, tol: least_squares(f, y, xtol=tol, ftol=tol, gtol=tol).x,
     False, FEWER),
]  # fmt: skip


def setting(name: str) -> tuple[Any, Array, Array]:
    """Return mechanisms of a class that move all the way, their paths (n, s, k) and coordinates."""
    m, start = random_mechanisms(S, name, 3 * N // 2, seed=11, kinds=KINDS)
    path = driven(m, start)[:, None] + ARC * np.linspace(0, 1, NODES)[:, None]
    whole = np.flatnonzero(S.follow(m, path[:, [0, -1]], start).reason == "")[:N]
    return m[whole], path[whole], start[whole]


def measure() -> tuple[list[list[str]], list[tuple[str, str, float, float, float]], dict[str, int]]:
    """Return rows of the table, (class, way, tolerance, time, error) of all, and how many mechanisms there were."""
    found: list[tuple[str, str, float, float, float]] = []
    many = {}
    for name in CLASSES:
        m, path, start = setting(name)
        many[name] = len(m)
        solved = S.follow(m, path, start)
        shape = (len(m), NODES)
        quaternion = solved.positions.quaternion.reshape(*shape, 4)
        free = solved.positions.state[4:].T.reshape(*shape, -1)
        unit, q = m.unit, path / np.moveaxis(S.driver_units(m), -1, 0)[:, None]
        exact = np.empty((FEW, NODES, 3, len(m.curves)))
        for i in range(FEW):
            fine, lean = Single(m, i, np.longdouble), Single(m, i)
            for j in range(NODES):
                rotation = S.matrix(quaternion[i, j][:, None])[..., 0]
                exact[i, j] = refined(fine, lean, rotation, free[i, j], q[i, j])
        centre = np.stack([g.origin for g in m.guides])[m.drivers[0][0]]
        for (way, batch, fast), last in product(MINE, OURS):
            if fast and guided_compiled.kernel() is None:
                continue
            S.newton_.LAST = S.filling_.LAST = last
            S.walk_.LIMITS, S.walk_.ACCURACY = LIMITS._replace(last=last), ACCURACY._replace(last=last)
            some = [np.arange(len(m))] if batch else [np.array([i]) for i in range(FEW)]
            with mock.patch.object(guided_compiled, "MIN_POSITIONS", 0 if fast else np.inf):
                ones = [(m[i], path[i], start[i]) for i in some]
                if fast:
                    S.follow(*ones[0])
                begin = time.process_time()
                moved = [S.follow(*one) for one in ones]
                taken = time.process_time() - begin
            taken /= sum(v.reached.sum() for v in moved)
            each = np.concatenate([v.positions.points.reshape(len(v.reached), NODES, -1, 3)[:FEW] for v in moved])
            points = (each - centre[:FEW, None, None]) / unit[:FEW, None, None, None]
            error = np.nanmax(np.abs(np.moveaxis(points, -1, 2) - exact))
            found.append((name, way, last, taken, float(error)))
        S.newton_.LAST = S.filling_.LAST = 1e-8
        S.walk_.LIMITS, S.walk_.ACCURACY = LIMITS, ACCURACY
        for way, run, with_jacobian, few in WAYS:
            for tol in THEIRS:
                taken, error = 0.0, 0.0
                for i in range(few):
                    single = Single(m, i)
                    rotation, at = S.matrix(quaternion[i, 0][:, None])[..., 0], free[i, 0]
                    for j in range(1, NODES):
                        values, r0 = q[i, j], rotation

                        def f(y: Array, values: Array = values, r0: Array = r0, single: Single = single) -> Any:
                            both = single.evaluate(y, r0, values, with_jacobian)  # noqa: B023, called before the loop goes on
                            return both if with_jacobian else both[0]  # noqa: B023, called before the loop goes on

                        y = np.concatenate([np.zeros(3), at])
                        begin = time.process_time()
                        y = run(f, y, tol)
                        taken += time.process_time() - begin
                        rotation, at = single.turned(y, r0), y[3:]
                        error = max(error, float(np.abs(single.points_at(rotation, at, values) - exact[i, j]).max()))
                found.append((name, way, tol, taken / (few * (NODES - 1)), error))
    rows = [
        [way, f"{tol:.0e}", *(f"{1e6 * t:.1f} / {e:.0e}" for c, w, v, t, e in found if (w, v) == (way, tol))]
        for way, tol in dict.fromkeys((w, v) for _, w, v, _, _ in found)
    ]
    return rows, found, many


def exact_axle(motion: Any) -> Array:
    """Return where the outer points of a five-link axle are, (s, 5, 3) in units, to the last digit of a double.

    Residuals in extended precision, Jacobian in double, from the poses of a motion of one mechanism.
    """
    system = motion.curve.system
    rotation, shift = (v[0][:, 1] for v in system.poses(motion.states[0]))
    inner, outer, centre = ((np.asarray(v) - system.centre) / system.unit for v in (INNER, OUTER, CENTRE))
    lengths = ((outer - inner).astype(np.longdouble) ** 2).sum(1)
    out = []
    for r0, t0, travel in zip(rotation, shift, motion.drive / system.unit, strict=True):
        r, t = r0.astype(np.longdouble), t0.astype(np.longdouble)
        for _ in range(4):
            x = outer @ r.T + t
            e, middle = x - inner, r @ centre
            f = [*((e**2).sum(1) - lengths), middle[2] + t[2] - centre[2] - travel]
            jacobian = np.zeros((6, 6))
            jacobian[:5, :3], jacobian[:5, 3:] = np.cross(outer @ r.T, 2 * e), 2 * e
            jacobian[5] = -middle[1], middle[0], 0, 0, 0, 1
            jacobian[5, :3] = middle[1], -middle[0], 0
            step = np.linalg.solve(jacobian, -np.array(f, float))
            k = np.array([[0, -step[2], step[1]], [step[2], 0, -step[0]], [-step[1], step[0], 0]])
            r, t = r + k @ r + k @ (k @ r) / 2, t + step[3:]
            r = r @ (3 * np.eye(3) - r.T @ r) / 2  # keeps it orthonormal
        out.append(outer @ r.T + t)
    return np.array(out)


def axle() -> list[tuple[str, str, float, float, float]]:
    """Return (mechanism, way, tolerance, time, error) of sweeps of a five-link axle, one or a hundred at once."""
    travel, found = Travel("wheel", CENTRE), []
    hundred = np.array(OUTER)[:, None] + np.random.default_rng(1).normal(size=(5, 100, 3))
    hundred[:, 0] = OUTER

    def made(outer: Any) -> Mechanism:
        return Mechanism([Link("ground", a, "wheel", b) for a, b in zip(INNER, outer, strict=True)])

    exact = exact_axle(made(OUTER).sweep(travel, TRAVEL))
    system = made(OUTER).system()
    outer = np.asarray(OUTER)
    for name, kernel in (("numpy", None), ("numba", compiled.kernel())):
        if name == "numba" and kernel is None:
            continue
        for many, mechanism in ((100, made(hundred)), (1, made(OUTER))):
            with mock.patch.object(compiled, "kernel", return_value=kernel):
                mechanism.sweep(travel, TRAVEL)  # notes by what it is solved
            for last in OURS:
                times = []
                accuracy = newton.ACCURACY._replace(last=last, enough=max(last, 1e-6))
                with mock.patch.object(newton, "ACCURACY", accuracy), mock.patch.object(sweeping, "ACCURACY", accuracy):
                    for _ in range(3 if many > 1 else 30):
                        begin = time.process_time()
                        motion = mechanism.sweep(travel, TRAVEL)
                        times.append((time.process_time() - begin) / (many * len(TRAVEL)))
                sub = motion.curve.take(np.zeros(len(TRAVEL), int))
                rotation, shift = (v[0][:, 1] for v in sub.system.poses(motion.states[0]))
                points = ((outer - sub.system.centre) / sub.system.unit) @ np.swapaxes(rotation, 1, 2) + shift[:, None]
                apart = points * sub.system.unit + sub.system.centre - exact * system.unit - system.centre
                way = f"sweep by {name}, {'batch of 100' if many > 1 else 'one mechanism'}"
                found.append((FIVE, way, last, min(times), float(np.abs(apart).max() / system.unit)))
    for tol in THEIRS:
        begin = time.process_time()
        x = scipy_five_links(tol)
        taken = (time.process_time() - begin) / len(TRAVEL)
        x = np.concatenate([x[len(TRAVEL) // 2 :][::-1], x[: len(TRAVEL) // 2]])
        points = np.array([CENTRE + 100 * v[3:] + (outer - CENTRE) @ turned(v[:3])[0].T for v in x])
        error = np.abs(points - exact * system.unit - system.centre).max() / system.unit
        found.append((FIVE, WAYS[0][0], tol, taken, float(error)))
    return found


def ratio(found: list[tuple[str, str, float, float, float]], name: str, way: str) -> float:
    """Return how many times the best setting of scipy's way takes longer than ours at an error that is no larger.

    Both are allowed an error of 1e-11 of the unit.
    """
    best = [min((t for c, w, _, t, e in found if c == name and w == k and e < 1e-11), default=np.inf)
            for k in (way, BEST)]  # fmt: skip
    return best[0] / best[1]


COLOURS = ("#0072b2", "#000000", "#cc79a7", "#666666", "#d55e00", "#e69f00", "#009e73", "#999999")


def plot(found: list[tuple[str, str, float, float, float]], five: list[tuple[str, str, float, float, float]]) -> None:
    """Draw error against time, one panel a class, and one for the axle."""
    import matplotlib as mpl

    mpl.use("svg")
    mpl.rcParams["svg.hashsalt"] = "spatial"
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(2, 4, figsize=(15, 7.4), sharex=True, sharey=True, layout="constrained")
    ways = list(dict.fromkeys(w for _, w, *_ in found))
    for axes, name in zip(panels[:, :3].flat, CLASSES, strict=True):
        _draw(axes, f"class {name}", [v for v in found if v[0] == name], ways, COLOURS)
    own = list(dict.fromkeys(w for _, w, *_ in five))
    _draw(panels[0, 3], FIVE, five, own, COLOURS[:5])
    panels[0, 3].legend(fontsize=7, frameon=False, loc="upper left")
    panels[1, 3].axis("off")
    panels[1, 3].legend(
        *panels[0, 0].get_legend_handles_labels(), fontsize=8, frameon=False, loc="center", title="classes"
    )
    for axes in (*panels[-1, :3], panels[0, 3]):
        axes.set_xlabel("time per position [µs]")
        axes.tick_params(labelbottom=True)
    for axes in panels[:, 0]:
        axes.set_ylabel("largest error / unit")
    figure.savefig(REPORT.with_suffix(".svg"), metadata={"Date": None})


def _draw(axes: Any, name: str, found: Any, ways: Any, colours: Any) -> None:
    for way, colour in zip(ways, colours, strict=True):
        here = sorted((1e6 * t, max(e, 1e-17)) for _, w, _, t, e in found if w == way)
        axes.loglog(*zip(*here, strict=True), "o-", ms=4, color=colour, label=way)
    axes.set_title(name, fontsize=10)
    axes.grid(alpha=0.25)


def main() -> None:
    """Write the report."""
    arguments().parse_args()
    five = axle()
    rows, found, many = measure()
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        title("Error against time of spatial positions")
        counts = ", ".join(f"{k}: {v}" for k, v in many.items())
        print(EXPLAINED.format(many=counts, arc=ARC, nodes=NODES, few=FEW, fewer=FEWER))
        table(["way", "tolerance", *(f"class {k}" for k in CLASSES)], rows)
        print("Times that scipy takes longer than the batch by numpy, both at an error below 1e-11 (target: 50):\n")
        table(
            ["way", *(f"class {k}" for k in CLASSES)],
            [[w, *(f"{ratio(found, k, w):.0f}" for k in CLASSES)] for w, *_ in WAYS],
        )
        print(AXLE)
        table(
            ["way", "tolerance", "µs / error"], [[w, f"{v:.0e}", f"{1e6 * t:.2f} / {e:.0e}"] for _, w, v, t, e in five]
        )
        print("![error against time](spatial_work_precision.svg)")
    report = text.getvalue().replace("tests/benchmarks/spatial_work", "-m tests.benchmarks.spatial_work")
    report = report.replace("precision.py`", "precision`")
    REPORT.with_suffix(".md").write_text(report, "utf-8")
    print(report)
    plot(found, five)


if __name__ == "__main__":
    main()
