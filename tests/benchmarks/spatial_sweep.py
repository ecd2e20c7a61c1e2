"""Time of a sweep of one mechanism through its Python call, beside scipy on the same equations in the same run.

    python -m tests.benchmarks.spatial_sweep

An RSSR over a full turn, a five-link axle over 160 mm of travel, a double wishbone, batches of a hundred; 200
positions, warm, the best and the median of many calls, in microseconds of processor time a position, by numpy alone and
compiled by numba.  scipy's `root` goes from position to position, with the last as its start and derivatives in closed
form.
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any
from unittest import mock

import numpy as np
from scipy.optimize import root

from catalogue.spatial import Joint, Link, Mechanism, Revolute, Spherical, Travel
from catalogue.spatial.jointed import compiled
from tests.attacks.spatial_folds import drawn
from tests.benchmarks.measuring import arguments
from tests.spatial.test_axles import BALLS, CENTRE, INNER, LOWER, OUTER, ROD, UPPER
from tests.spatial.test_jointed import RSSR, rssr

COUNT = 200
TURN, TRAVEL = np.linspace(0, 2 * np.pi, COUNT), np.linspace(-80, 80, COUNT)


def timed(call: Callable[[], Any], repeat: int) -> tuple[float, float]:
    """Return the best and the median time of a call, in microseconds a position."""
    times = []
    for _ in range(repeat):
        begun = time.process_time()
        call()
        times.append((time.process_time() - begun) / COUNT * 1e6)
    return min(times), float(np.median(times))


def scipy_rssr() -> Any:
    """The loop equation of the RSSR, one unknown."""
    out, p = [], 0.0
    for q in TURN:

        def equation(p: Any, q: float = q) -> Any:
            e = np.array([4 + 3 * np.sin(p[0]) - np.cos(q), 0.5 - np.sin(q), 1 + 3 * np.cos(p[0])])
            return [e @ e - 25.25], [[2 * e @ np.array([3 * np.cos(p[0]), 0, -3 * np.sin(p[0])])]]

        p = root(equation, [p], jac=True, tol=1e-13).x[0]
        out.append(p)
    return np.array(out)


def scipy_five_links(tol: float = 1e-11) -> Any:
    """Five lengths and the travel for the pose of the carrier, six unknowns."""
    lengths = ((OUTER - INNER) ** 2).sum(1)
    arms = OUTER - CENTRE
    out, x = [], np.zeros(6)
    for travel in [*TRAVEL[COUNT // 2 :], *TRAVEL[: COUNT // 2][::-1]]:
        if travel == TRAVEL[COUNT // 2 - 1]:
            x = np.zeros(6)

        def equations(x: Any, travel: float = travel) -> Any:
            turn, left = turned(x[:3])
            reach = arms @ turn.T
            e = CENTRE + 100 * x[3:] + reach - INNER
            jacobian = np.zeros((6, 6))
            jacobian[:5, :3], jacobian[:5, 3:] = 2 * np.cross(reach, e) @ left, 200 * e
            jacobian[5, 5] = 100
            return [*((e**2).sum(1) - lengths), 100 * x[5] - travel], jacobian

        x = root(equations, x, jac=True, tol=tol).x
        out.append(x)
    return np.array(out)


def turned(r: Any) -> Any:
    """The rotation by a rotation vector, and its left Jacobian."""
    t = max(float(np.sqrt(r @ r)), 1e-9)
    k = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    a, b, c = np.sin(t) / t, (1 - np.cos(t)) / t**2, (t - np.sin(t)) / t**3
    square = k @ k
    return np.eye(3) + a * k + b * square, np.eye(3) + b * k + c * square


Calls = list[tuple[str, Callable[[], Any], int, int]]


def ours() -> Calls:
    """Return what is timed of this solver, with mechanisms of its own: name, call, how often, how many mechanisms."""
    five = Mechanism([Link("ground", a, "wheel", b) for a, b in zip(INNER, OUTER, strict=True)])
    arms = [Revolute("lower", LOWER[0], to=LOWER[1]), Revolute("upper", UPPER[0], to=UPPER[1])]
    balls = [Spherical("wheel", b, on=arm) for b, arm in zip(BALLS, ("lower", "upper"), strict=True)]
    wishbone = Mechanism([*arms, *balls, Link("ground", ROD[0], "wheel", ROD[1])])
    loop, travel = rssr(*RSSR), Travel("wheel", CENTRE)
    hundred = np.array(OUTER)[:, None] + np.random.default_rng(1).normal(size=(5, 100, 3))
    batch = Mechanism([Link("ground", a, "wheel", b) for a, b in zip(INNER, hundred, strict=True)])
    loops, crank, _ = drawn("RSSR", 100, np.random.default_rng(1))
    return [
        ("RSSR, full turn", lambda: loop.sweep(Joint("crank"), TURN), 60, 1),
        ("five links, 160 mm", lambda: five.sweep(travel, TRAVEL), 60, 1),
        ("double wishbone, 160 mm", lambda: wishbone.sweep(travel, TRAVEL), 60, 1),
        ("five links, with three derivatives", lambda: five.sweep(travel, TRAVEL).point("wheel", CENTRE, 3), 20, 1),
        ("five links, 100 mechanisms at once", lambda: batch.sweep(travel, TRAVEL), 9, 100),
        ("RSSR, 100 random ones at once, up to dead points", lambda: loops.sweep(crank, TURN - np.pi), 9, 100),
    ]


def by_numpy() -> Calls:
    """Return the same without numba."""
    with mock.patch.object(compiled, "kernel", return_value=None):
        calls = ours()
        for _, call, _, _ in calls:  # a mechanism notes by what it is solved when it first is
            call()
    return calls


FIRST = """
import time
from catalogue.spatial import Joint
from tests.spatial.test_jointed import RSSR, rssr
loop, begun = rssr(*RSSR), time.perf_counter()
loop.sweep(Joint("crank"), [0.0, 0.1])
print(time.perf_counter() - begun)
"""


def first_sweeps() -> list[float]:
    """Return the seconds of the first sweep of a process: where numba has to compile, and where it has compiled."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
        run = [sys.executable, "-c", FIRST]
        return [float(subprocess.run(run, env=environment, capture_output=True, check=True).stdout) for _ in range(2)]


def main() -> None:
    """Print a table."""
    arguments().parse_args()
    print("| sweep of 200 positions [us a position] | numpy, best | median | numba, best | median |")
    print("| --- | --- | --- | --- | --- |")
    for plain, fast in zip(by_numpy(), ours() if compiled.kernel() else by_numpy(), strict=True):
        both = []
        for _, call, repeat, many in (plain, fast):
            call()
            both += [f"{v / many:.2f}" for v in timed(call, repeat)]
        print(f"| {plain[0]} | {' | '.join(both)} |")
    for name, call in (("RSSR by scipy root", scipy_rssr), ("five links by scipy root", scipy_five_links)):
        call()
        best, median = timed(call, 5)
        print(f"| {name} | {best:.0f} | {median:.0f} | | |")
    if compiled.kernel():
        print("\nFirst sweep of a process: {:.0f} s to compile, {:.2f} s ever after.".format(*first_sweeps()))


if __name__ == "__main__":
    main()
