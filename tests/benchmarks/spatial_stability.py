# ruff: noqa: ARG005  (formulas of one shape, some of which do not use every coordinate)
"""Digits that spatial positions, velocities and accelerations lose near what is stiff, against 60 digits.

``python -m tests.benchmarks.spatial_stability [COUNT]`` writes ``data/reports/spatial_stability.md``.  The reference is
another formulation, the closure with a quaternion and all coordinates, written with mpmath from Table I.  Beside each
loss of a position stands the inherent one: what other roundings of the mechanism's numbers do to the exact position.
"""

from __future__ import annotations

import os
import sys

os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import contextlib
import io
from pathlib import Path
from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np

from tests.benchmarks.measuring import table, title, wanted_count
from tests.spatial.conftest import driven, random_mechanisms, solver

REPORT = Path(__file__).parents[2] / "data" / "reports" / "spatial_stability.md"
DIGITS, EPS = 60, float(np.finfo(float).eps)
NEAR = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
SCALES = (1e-6, 1e-3, 1.0, 1e3, 1e6)
EXPLAINED = """\
{n} random mechanisms a row.  Digits lost are log10(error/2.2e-16), median/worst: of points in diameters of the body, of
their derivatives by the first driver relative to the largest component, against {digits} digits on the same numbers.
Inherent: what two other roundings of all numbers of the mechanism do to the exact position, the larger.  Condition: the
median.  Beside an apex, or inside a torus that closes, a rounding of the point turns the tangent plane: rates lose it.
Mechanisms that are not solved are counted with the reason that is given.
"""
PAST = """\
Past a dead point nothing is computed: a path ends at the turning point, whose driver value `follow` reports to its last
digits, and a position asked for beyond it is refused with the reason `past a dead point`."""
S = solver()
M = mp.matrix
CHARTS: dict[str, Any] = {
    "cylinder": lambda u, w, r: (r * mp.cos(u), r * mp.sin(u), w),
    "cone": lambda u, w, d: (w * mp.cos(u), w * mp.sin(u), w * mp.cot(d)),
    "hyperboloid:sinh": lambda u, w, m, n: (m * mp.cosh(w) * mp.cos(u), m * mp.cosh(w) * mp.sin(u), n * mp.sinh(w)),
    "torus": lambda u, w, p, r: ((p + r * mp.sin(w)) * mp.cos(u), (p + r * mp.sin(w)) * mp.sin(u), r * mp.cos(w)),
    "sphere": lambda u, w, r: (-r * mp.cos(u) * mp.cos(w), r * mp.sin(w), r * mp.sin(u) * mp.cos(w)),
    "plane:cartesian": lambda u, w: (u, w, mp.mpf(0)),
    "plane": lambda u, w: (w * mp.cos(u), w * mp.sin(u), mp.mpf(0)),
    "circle": lambda u, w, r: (r * mp.cos(u), r * mp.sin(u), mp.mpf(0)),
    "helix": lambda u, w, r, h: (r * mp.cos(u), r * mp.sin(u), h * u),
    "line": lambda u, w: (mp.mpf(0), mp.mpf(0), u),
}


def rotation(q: Any) -> Any:
    """Return the rotation matrix of a quaternion of any length."""
    s, x, y, z = q
    k = 2 / (s * s + x * x + y * y + z * z)
    return M([[1 - k * (y * y + z * z), k * (x * y - s * z), k * (x * z + s * y)],
              [k * (x * y + s * z), 1 - k * (x * x + z * z), k * (y * z - s * x)],
              [k * (x * z - s * y), k * (y * z + s * x), 1 - k * (x * x + y * y)]])  # fmt: skip


class Exact:
    """The closure of one mechanism: x_i(u_i, w_i) = t + R b_i; unknown quaternion, translation, free coordinates."""

    def __init__(self, m: Any, i: int, draw: Any = None) -> None:
        def given(v: Any) -> Any:
            return mp.mpf(float(v)) * (1 + (mp.mpf(EPS * draw.uniform(-0.5, 0.5)) if draw else 0))

        self.body = [M([given(v) for v in b]) for b in m.body[i]]
        self.guides = []
        for g in m.guides:
            kind = g.kinds[g.which[i]]
            p = [given(v) for v in g.parameters[i, : len(kind.parameters)]]
            self.guides.append(
                (
                    CHARTS[kind.name],
                    p,
                    M([given(v) for v in g.origin[i]]),
                    rotation([given(v) for v in g.quaternion[i]]),
                )
            )
        drivers = [(j, "uw".index(k)) for j, k in m.drivers]
        self.drivers = drivers
        self.free = [(j, a) for j in range(len(self.guides)) for a in (0, 1)
                     if (j, a) not in drivers and not (a == 1 and m.curves[j])]  # fmt: skip
        self.unit = float(m.diameter[i])

    def residual(self, x: Any, q: Any) -> Any:
        at = [[mp.mpf(0)] * 2 for _ in self.guides]
        for (j, a), v in [*zip(self.drivers, q, strict=True), *zip(self.free, x[7:], strict=True)]:
            at[j][a] = v
        r, t = rotation(x[:4]), M(x[4:7])
        out = [sum(v * v for v in x[:4]) - 1]
        for (chart, p, o, frame), (u, w), b in zip(self.guides, at, self.body, strict=True):
            out += list((o + frame * M(chart(u, w, *p)) - t - r * b) / self.unit)
        return M(out)

    def solve(self, x: Any, q: Any) -> Any:
        """Return the unknowns, by Newton's method with a difference quotient of 1e-30."""
        h = mp.mpf(10) ** -(DIGITS // 2)
        for _ in range(60):
            f = self.residual(x, q)
            columns = []
            for k in range(len(x)):
                y = list(x)
                y[k] += h * self.scale(k)
                columns.append((self.residual(y, q) - f) / h)
            step = mp.lu_solve(M([[c[r] for c in columns] for r in range(len(f))]), -f)
            x = [v + d * self.scale(k) for k, (v, d) in enumerate(zip(x, step, strict=True))]
            if mp.norm(step, mp.inf) < mp.mpf(10) ** -(DIGITS * 2 // 3):
                return x
        raise ArithmeticError("no exact position")

    def scale(self, k: int) -> Any:
        """Return the unit of an unknown: the body's size for the translation."""
        return self.unit if 4 <= k < 7 else mp.mpf(1)

    def points(self, x: Any) -> Any:
        r, t = rotation(x[:4]), M(x[4:7])
        return [t + r * b for b in self.body]


def start_of(m: Any, at: Any, i: int) -> list[Any]:
    free = [(j, a) for j in range(len(m.guides)) for a in (0, 1)
            if (j, "uw"[a]) not in m.drivers and not (a == 1 and m.curves[j])]  # fmt: skip
    values = [*at.quaternion[i], *at.translation[i], *(at.coordinates[i, j, a] for j, a in free)]
    return [mp.mpf(float(v)) for v in values]


def losses(m: Any, at: Any, i: int, draw: Any) -> dict[str, float]:
    """Return digits lost of a position, of velocity and acceleration by the first driver, and inherent ones."""
    rates = np.zeros((m.freedom, 2))
    rates[0, 0] = 1
    found = S.jets(m[[i]], at[[i]], rates).points[0]
    with mp.workdps(DIGITS + 10):
        q = [mp.mpf(float(v)) for v in at.drivers[i]]
        exact = Exact(m, i)
        x = exact.solve(start_of(m, at, i), q)
        h = mp.mpf(10) ** -22
        ahead, behind = (exact.points(exact.solve(x, [q[0] + s * h, *q[1:]])) for s in (1, -1))
        here = exact.points(x)
        first = [(a - b) / (2 * h) for a, b in zip(ahead, behind, strict=True)]
        second = [(a - 2 * c + b) / h**2 for a, b, c in zip(ahead, behind, here, strict=True)]

        def lost(mine: Any, theirs: Any, unit: Any = None) -> float:
            unit = unit or max(mp.norm(v, mp.inf) for v in theirs)
            error = max(
                abs(mp.mpf(float(a)) - b) for r, v in zip(mine, theirs, strict=True) for a, b in zip(r, v, strict=True)
            )
            return float(np.clip(np.log10(max(float(error / unit), EPS) / EPS), 0, 16))

        out = {"position": lost(at.points[i], here, exact.unit), "velocity": lost(found[:, 1], first),
               "acceleration": lost(found[:, 2], second)}  # fmt: skip
        inherent = []
        for _ in range(2):
            other = Exact(m, i, draw)
            with contextlib.suppress(ArithmeticError, ZeroDivisionError):
                moved = other.points(other.solve(x, q))
                error = max(mp.norm(a - b, mp.inf) for a, b in zip(moved, here, strict=True)) / exact.unit
                inherent.append(float(np.clip(np.log10(max(float(error), EPS) / EPS), 0, 16)))
    return {**out, "inherent": max(inherent, default=np.nan)}


# -- what is stiff ----------------------------------------------------------------------------------------------------
def dead_point(near: float, n: int) -> tuple[Any, Any]:
    """Class II at a distance in the driver from a turning point."""
    m, start = random_mechanisms(S, "II", 4 * n, seed=3)
    q = driven(m, start)
    moved = S.follow(m, q[:, None] + np.linspace(0, 1, 40)[:, None], start)
    ended = np.flatnonzero((moved.reason == "turning point") & (moved.reached > 2))[:n]
    path = np.stack(
        [moved.positions[ended * 40 + moved.reached[ended] - 1].drivers, moved.end_drivers[ended] - near], axis=1
    )
    return m[ended], S.follow(m[ended], path, moved.positions[ended * 40 + moved.reached[ended] - 1]).node(1)


def coincident(near: float, n: int) -> tuple[Any, Any]:
    """Class I with A5 beside A1."""
    return remade("I", n, lambda body, _: body[:, 0] + near)


def collinear(near: float, n: int) -> tuple[Any, Any]:
    """Class III with A3 beside the line of the others."""
    return remade("III", n, lambda body, draw: (body[:, 0] + body[:, 1]) / 2 + near * draw.uniform(0.5, 1, (n, 3)))


def remade(name: str, n: int, last: Any) -> tuple[Any, Any]:
    """Return random mechanisms whose last point is elsewhere in the body, and its guide with it."""
    draw = np.random.default_rng(7)
    m, start = random_mechanisms(S, name, n, seed=5, kinds=("cylinder", "sphere", "torus"))
    body = m.body.copy()
    body[:, -1] = last(m.body, draw)
    guide = m.guides[-1]
    origin = guide.origin + body[:, -1] - m.body[:, -1]
    kinds = [guide.kinds[c] for c in guide.which]
    other = S.Guides(kinds, guide.parameters, origin, guide.quaternion)
    made = S.Mechanisms(body, [*m.guides[:-1], other], m.drivers)
    return made, S.solve_positions(made, driven(made, start), start)


def parallel(near: float, n: int) -> tuple[Any, Any]:
    """Class II: A3 and A4 are one point on two planes at a small angle."""
    m, start = random_mechanisms(S, "II", n, seed=6, kinds=("plane:cartesian",))
    body = m.body.copy()
    body[:, 3] = body[:, 2]
    third = m.guides[2]
    turn = third.quaternion / np.linalg.norm(third.quaternion, axis=1, keepdims=True)
    tilt = np.stack([-turn[:, 1], turn[:, 0], turn[:, 3], -turn[:, 2]], axis=1)  # times i
    guides = [*m.guides[:3], S.Guides("plane:cartesian", (), third.origin, turn + near / 2 * tilt)]
    start[:, 3] = start[:, 2]
    # both planes go through the first one's local X axis: put the point on it
    shift = np.einsum("ijn,n->ni", S.matrix(turn.T)[:, 1:2], start[:, 2, 1])
    guides = [*guides[:2], *(S.Guides("plane:cartesian", (), g.origin + shift, g.quaternion) for g in guides[2:])]
    start[:, 2:, 1] = 0
    made = S.Mechanisms(body, guides, m.drivers)
    return made, S.solve_positions(made, driven(made, start), start)


def apex(near: float, n: int) -> tuple[Any, Any]:
    """Class II with A4 on a cone, near its apex."""
    return moved_last("II", n, "cone", (0.6, 1.0), near)


def closing(near: float, n: int) -> tuple[Any, Any]:
    """Class II with A4 at the inner equator of a torus, r -> p."""
    return moved_last("II", n, "torus", (1.0, 1.0 - near), -np.pi / 2)


def moved_last(name: str, n: int, kind: str, p: tuple[float, float], w: float) -> tuple[Any, Any]:
    m, start = random_mechanisms(S, name, n, seed=8, kinds=("cylinder", "sphere", "torus"))
    turn = m.guides[-1].quaternion
    shape = np.broadcast_to(np.array(p)[:, None], (2, n))
    u = start[:, -1, 0]
    local = np.stack(np.broadcast_arrays(*S.KINDS[kind].point(u, np.full(n, w), shape)))
    origin = m.body[:, -1] - np.einsum("ijn,jn->ni", S.matrix(turn.T), local)
    made = S.Mechanisms(m.body, [*m.guides[:-1], S.Guides(kind, p, origin, turn)], m.drivers)
    start[:, -1, 1] = w
    return made, S.solve_positions(made, driven(made, start), start)


def scaled(scale: float, n: int) -> tuple[Any, Any]:
    """Class I at a scale."""
    m, start = random_mechanisms(S, "I", n, seed=9, scale=scale)
    return m, S.solve_positions(m, driven(m, start), start)


KINDS = {
    "dead point, distance in the driver [rad]": (dead_point, NEAR),
    "coincident points, distance": (coincident, NEAR),
    "collinear body, height": (collinear, NEAR[:4]),
    "parallel planes, angle": (parallel, NEAR[:5]),
    "apex of a cone, distance": (apex, NEAR),
    "torus that closes, p - r": (closing, NEAR),
    "scale": (scaled, SCALES),
}


def rows(n: int) -> list[list[str]]:
    """Return a row per kind and distance: condition, median/worst digits lost, what was not solved and why."""
    out = []
    for kind, (make, distances) in KINDS.items():
        for near in distances:
            draw = np.random.default_rng(1)
            m, at = make(near, n)
            good = np.flatnonzero(at.success)
            each = []
            for i in good:
                with contextlib.suppress(ArithmeticError, ZeroDivisionError):
                    each.append(losses(m, at, int(i), draw))
            cells = [
                f"{np.nanmedian(v):.1f}/{np.nanmax(v):.1f}"
                if (v := [e[k] for e in each]) and np.isfinite(v).any()
                else "-"
                for k in ("position", "inherent", "velocity", "acceleration")
            ]
            why = ", ".join(sorted(set(at.reason[~at.success])))
            kappa = f"{np.median(at.condition[good]):.0e}" if len(good) else "-"
            left = f"{len(m) - len(good)}: {why}" if len(good) < len(m) else ""
            if len(each) < len(good):
                left += f" ({len(good) - len(each)} without reference)"
            out.append([kind, f"{near:.0e}", kappa, *cells, left])
            print(out[-1], file=sys.stderr, flush=True)
    return out


def main() -> None:
    """Write the table."""
    n = wanted_count(6)
    found = rows(n)
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        title("Digits lost by spatially guided bodies")
        print(EXPLAINED.format(n=n, digits=DIGITS))
        table(
            ["near", "distance", "condition", "position", "inherent", "velocity", "acceleration", "not solved"], found
        )
        print(PAST)
    report = text.getvalue().replace("tests/benchmarks/spatial_stability.py", "-m tests.benchmarks.spatial_stability")
    REPORT.write_text(report, "utf-8")
    print(report)


if __name__ == "__main__":
    main()
