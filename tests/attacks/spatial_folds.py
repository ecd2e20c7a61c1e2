"""Random mechanisms in space led through all dead points of their drive, and back again from where they came to.

``python -m tests.attacks.spatial_folds [COUNT]`` writes ``data/reports/spatial_folds.md``; the tests try a sample.
Each mechanism is followed over its circuit, then backwards from a pose far along it: the way back must pass the same
dead points and end in the design pose.  An RSSR's dead points must besides be roots of the discriminant of its closed
input-output equation, which the path following knows nothing of.
"""

from __future__ import annotations

import os
import sys

os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import contextlib
import io
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from catalogue.spatial import Cylindrical, Joint, Link, Mechanism, Revolute, Spherical, Travel
from catalogue.spatial.continuation.curve import Trace
from catalogue.spatial.continuation.dead_points import split_folds
from catalogue.spatial.continuation.tracing import March
from catalogue.spatial.jointed.circuit import Circuit
from catalogue.spatial.jointed.curve import Curve, signature
from tests.benchmarks.measuring import table, title, wanted_count

REPORT = Path(__file__).parents[2] / "data" / "reports" / "spatial_folds.md"
#: How many mechanisms of each sort are followed at once, a thousand in all.
SHARES = {"RSSR": 800, "RSCR": 100, "five links": 100}
#: How near to the design pose the way back must come, in what tells poses apart; how far off a discriminant may be.
BACK, CLOSED = 0.02, 1e-8
#: How near each other, of the way, the dead points that are passed forwards and backwards must be.
NEAR = 0.04
EXPLAINED = """\
Random mechanisms, driven by a crank or the travel of a point, followed over their whole circuit, through the dead
points of the drive, then led backwards from a pose two thirds along it.  `jumped`: the way back did not end in the
design pose; `other folds`: it passed other dead points; `false folds`: of an RSSR a dead point that is no root of the
discriminant of its closed equation.  `open`: circuits that ended with a reason.
"""
Array = np.ndarray[Any, Any]


def drawn(sort: str, n: int, draw: np.random.Generator) -> tuple[Mechanism, Any, dict[str, Array]]:
    """Return a batch of random mechanisms, what drives it, and the numbers of an RSSR."""
    p, axis = draw.uniform(-1, 1, (12, n, 3)), draw.normal(size=(3, n, 3))
    if sort == "five links":
        five = Mechanism([Link("ground", a, "body", b) for a, b in zip(p[:5], p[5:10], strict=True)])
        return five, Travel("body", p[10], axis[0]), {}
    first: list[Any] = [Revolute("crank", p[0], axis=axis[0]), Revolute("rocker", p[1], axis=axis[1])]
    if sort == "RSSR":
        first.append(Link("crank", p[2], "rocker", p[3]))
    else:
        first += [Cylindrical("coupler", p[2], axis=axis[2], on="rocker"), Spherical("coupler", p[3], on="crank")]
    return Mechanism(first), Joint("crank"), {"p": p, "axis": axis}


def discriminant(numbers: dict[str, Array], i: int, angle: float) -> float:
    """Return that of A cos v + B sin v = C for the rocker of an RSSR at an angle of its crank, over its terms."""
    (a, b, end, other), (k, m) = numbers["p"][:4, i], numbers["axis"][:2, i]
    k, m = k / np.linalg.norm(k), m / np.linalg.norm(m)
    arm = end - a
    out = a + arm * np.cos(angle) + np.cross(k, arm) * np.sin(angle) + k * (k @ arm) * (1 - np.cos(angle))
    reach = other - b
    along, across, third = m * (m @ reach), reach - m * (m @ reach), np.cross(m, reach)
    d = b + along - out
    one, two, rest = 2 * d @ across, 2 * d @ third, d @ d + across @ across - ((other - end) ** 2).sum()
    return float((one**2 + two**2 - rest**2) / (one**2 + two**2 + rest**2 + (d @ d) ** 2))


def back(curve: Curve, circuits: list[Circuit]) -> list[tuple[bool, bool]]:
    """Return whether the ways back end in the design poses, and whether they pass the same dead points."""
    traces = [c.trace for c in circuits]
    first = np.array([int(np.argmin(np.abs(t.s))) for t in traces])  # an open circuit was followed both ways from there
    last = np.array([len(t.s) - 1 for t in traces])
    begin = np.minimum(first + np.maximum(2 * (last - first) // 3, 1), last)
    far = np.array([t.s[b] - t.s[a] for t, a, b in zip(traces, first, begin, strict=True)])
    y, tangent = (np.stack([getattr(t, k)[b] for t, b in zip(traces, begin, strict=True)]) for k in ("y", "tangent"))
    march = March(curve, y, -tangent)
    for _ in range(2000):
        march.end((march.last[0] > 1.03 * far[march.who]) | (march.h < 1e-7))
        if not len(march.who):
            break
        march.step()
    return [
        _met(circuits[i], int(first[i]), split_folds(circuits[i].curve, march.trace(i)), float(far[i]))
        if far[i]
        else (True, True)
        for i in range(len(circuits))
    ]


def _met(circuit: Circuit, first: int, again: Trace, far: float) -> tuple[bool, bool]:
    trace = circuit.trace
    s = np.linspace(0.97 * far, min(1.03 * far, float(again.s[-1])), 400)
    many = circuit.curve.take(np.zeros(len(s), int))
    apart = np.abs(signature(many, again.at(s)) - signature(circuit.curve, trace.y[first][None])).max(1)
    home = s[apart.argmin()]
    there, here = folds(trace) - trace.s[first], home - folds(again)
    met = all(
        np.abs(many - v).min(initial=np.inf) < NEAR * far
        for some, many in ((there, here), (here, there))
        for v in some[(some > NEAR * far) & (some < (1 - NEAR) * far)]
    )
    return bool(apart.min() < BACK), met


def folds(trace: Trace) -> Array:
    """Return the arc lengths, roughly, at which the drive turns back: of its cubic between two nodes."""
    k = np.flatnonzero(trace.slope[:-1] * trace.slope[1:] < 0)
    a, b, h = trace.slope[k], trace.slope[k + 1], trace.s[k + 1] - trace.s[k]
    m = 3 * (trace.drive[k + 1] - trace.drive[k]) / h - a - b
    # the root of a (1 - t)^2 + 2 m t (1 - t) + b t^2 between 0 and 1
    return np.asarray(trace.s[k] + h * a / (a - m + np.sign(a) * np.sqrt(m * m - a * b)))


def attacked(sort: str, n: int, seed: int) -> Counter[str]:
    """Return what happened to n mechanisms of a sort."""
    out = Counter[str]()
    mechanism, drive, numbers = drawn(sort, n, np.random.default_rng(seed))
    circuits = mechanism.circuits(drive)
    curve, *_ = mechanism._curve(drive, ())
    for i, (circuit, (home, same)) in enumerate(zip(circuits, back(curve, circuits), strict=True)):
        off = [abs(discriminant(numbers, i, v)) for v in circuit.dead_points] if sort == "RSSR" else []
        out["mechanisms"] += 1
        out["dead points"] += len(circuit.dead_points)
        out["cranks"] += circuit.crank
        out["open"] += not circuit.closed
        out["jumped"] += not home
        out["other folds"] += not same
        out["false folds"] += sum(v > CLOSED for v in off)
    return out


def main() -> None:
    """Write the table, anew after each thousand."""
    number = wanted_count(10_000)
    names = ["mechanisms", "dead points", "cranks", "open", "jumped", "other folds", "false folds"]
    found = {sort: Counter[str]() for sort in SHARES}
    for seed in range(1, 1 + -(-number // 1000)):
        for sort, n in SHARES.items():
            found[sort] += attacked(sort, n, seed)
        text = io.StringIO()
        with contextlib.redirect_stdout(text):
            title("Mechanisms in space through their dead points and back")
            print(EXPLAINED)
            table(["mechanism", *names], [[sort, *(str(f[k]) for k in names)] for sort, f in found.items()])
        REPORT.write_text(text.getvalue(), "utf-8")
        print(text.getvalue().splitlines()[-4:], file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
