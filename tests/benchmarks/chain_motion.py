"""Time the motion of chains of many bars: `python tests/benchmarks/chain_motion.py [COUNT]`.

In one run, in processor time, each in the best of five rounds:

- 1,000 four-bars at 361 positions by the closed form of two dyads (`kinematics.circuits`), and as chains;
- 1,000 Watt six-bars at 361 positions as chains, with velocities and accelerations, and with derivatives by all
  coordinates of the reference pose;
- the alternative: Newton's method on the loop equations with analytic Jacobians, all mechanisms at once, from each
  position to the next (three rounds each), and `scipy.optimize.root` for one mechanism;
- the search for the circuits: dead points, change points and branches.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from measuring import wanted_count
from scipy.optimize import root

from catalogue.chains.chain import Chain, chain_of
from catalogue.chains.circuits import followed_circuits
from catalogue.chains.poses import poses
from catalogue.chains.rates import rates, slopes
from catalogue.chains.structure import Structure
from catalogue.kinematics.circuits import TURN, circuits
from catalogue.kinematics.linkage import Linkage

POSITIONS = 361
ROUNDS = 5


def best(function: Callable[[], Any]) -> tuple[float, Any]:
    """Return the least processor time of some rounds, and what came out."""
    times, found = [], None
    for _ in range(ROUNDS):
        start = time.process_time()
        found = function()
        times.append(time.process_time() - start)
    return min(times), found


def four_bars(count: int) -> Linkage:
    """Return crank-rockers."""
    rng = np.random.default_rng(1)
    crank, phi = rng.uniform(0.2, 0.5, count), rng.uniform(0, 2 * np.pi, count)
    pin = crank * np.exp(1j * phi)
    away = np.abs(1 - pin)
    along = np.angle(1 - pin)
    coupler, rocker = rng.uniform(1.2, 1.4, count), rng.uniform(1.2, 1.4, count)
    inner = np.arccos((coupler**2 + away**2 - rocker**2) / (2 * coupler * away))
    end = pin + coupler * np.exp(1j * (along + inner))
    pivots = np.ones((count, 2, 2, 3))
    for (i, k), z in {(0, 0): 0 * pin, (0, 1): pin, (1, 0): 0 * pin + 1, (1, 1): end}.items():
        pivots[:, i, k, 0], pivots[:, i, k, 1] = z.real, z.imag
    return Linkage(pivots)


def six_bars(linkage: Linkage) -> Chain:
    """Return Watt's chains on these four-bars, their dyad long enough to turn with them."""
    z, n = linkage.points, len(linkage)
    structure = Structure.of(
        {"frame": "AD", "crank": "AB", "coupler": "BCE", "rocker": "CDG", "rod": "EFP", "link": "FG"}, drive="crank"
    )
    b, c, d = z[:, 0, 1], z[:, 1, 1], z[:, 1, 0]
    e, g = c + 0.4 * (c - b), c + 0.4j * (c - d)
    middle, way = 0.5 * (e + g), (g - e) / np.abs(g - e)
    f = middle + 2j * way
    return Chain.of(structure, {"A": z[:, 0, 0], "B": b, "C": c, "D": d, "E": e, "G": g, "F": f, "P": f + np.ones(n)})


def newton(chain: Chain, drive: Any) -> Any:
    """Follow Watt's chains by Newton's method on both loops; return the angles of the four bars (m, n, 4)."""
    z = dict(zip(chain.structure.joints, chain.z, strict=True))
    bc, dc, ce, cg = z["C"] - z["B"], z["C"] - z["D"], z["E"] - z["B"], z["G"] - z["D"]
    ef, gf = z["F"] - z["E"], z["F"] - z["G"]
    crank, angles, found = z["B"] - z["A"], np.zeros((chain.z.shape[1], 4)), []
    for phi in drive:
        for _ in range(3):
            turn = np.exp(1j * angles)
            pin = z["A"] + crank * np.exp(1j * phi)
            first = pin + bc * turn[:, 0] - z["D"] - dc * turn[:, 1]
            second = pin + ce * turn[:, 0] + ef * turn[:, 2] - z["D"] - cg * turn[:, 1] - gf * turn[:, 3]
            columns = np.zeros((len(angles), 4, 4))
            for k, (one, two) in enumerate(((bc, ce), (-dc, -cg), (0 * bc, ef), (0 * bc, -gf))):
                a, b = 1j * one * turn[:, k], 1j * two * turn[:, k]
                columns[:, :, k] = np.stack([a.real, a.imag, b.real, b.imag], 1)
            off = np.stack([first.real, first.imag, second.real, second.imag], 1)
            angles = angles - np.linalg.solve(columns, off[..., None])[..., 0]
        found.append(angles)
    return np.array(found)


def by_root(chain: Chain, drive: Any) -> Any:
    """Follow the first chain by `scipy.optimize.root` from each position to the next."""
    one, angles, found = chain[:1], np.zeros(4), []
    z = {name: complex(at[0]) for name, at in zip(one.structure.joints, one.z, strict=True)}

    def off(t: Any, phi: float) -> Any:
        turn, pin = np.exp(1j * t), z["A"] + (z["B"] - z["A"]) * np.exp(1j * phi)
        c = pin + (z["C"] - z["B"]) * turn[0] - z["D"] - (z["C"] - z["D"]) * turn[1]
        e = pin + (z["E"] - z["B"]) * turn[0] + (z["F"] - z["E"]) * turn[2]
        f = e - z["D"] - (z["G"] - z["D"]) * turn[1] - (z["F"] - z["G"]) * turn[3]
        return [c.real, c.imag, f.real, f.imag]

    for phi in drive:
        angles = root(off, angles, args=(phi,), tol=1e-12).x
        found.append(angles)
    return np.array(found)


def main(count: int = 1000) -> None:
    """Print the table."""
    linkage = four_bars(count)
    known = circuits(linkage)
    known = known[np.flatnonzero(np.isfinite(known.phase))]
    turns = np.linspace(0, 2 * np.pi, POSITIONS)[:, None]
    chain = chain_of(linkage, linkage.points[:, 0, 1])
    each = count * POSITIONS
    assert (known.kind == TURN).all()
    rows = []
    taken, pose = best(lambda: known.pose(known.phase + turns))
    rows.append(("four-bars, closed form of two dyads", taken / each))
    taken, at = best(lambda: poses(chain, turns, chain.branch))
    rows.append(("four-bars, as chains, all bars", taken / each))
    assert np.abs(at.turn[2] - (1 + pose.x)).max() < 1e-11
    six = six_bars(linkage)
    taken, (found, _) = best(lambda: followed_circuits(six, 4))
    rows.append(("six-bars: the circuit, per mechanism", taken / count))
    some = six[np.flatnonzero(found.kind == TURN)]
    each = len(some) * POSITIONS
    taken, at = best(lambda: poses(some, turns, some.branch))
    rows.append(("six-bars: poses", taken / each))
    taken, _ = best(lambda: rates(at))
    rows.append(("six-bars: velocities and accelerations", taken / each))
    part = some[:100]
    there = poses(part, turns, part.branch)
    taken, _ = best(lambda: slopes(there))
    rows.append(("six-bars: derivatives by 16 coordinates", taken / (len(part) * POSITIONS)))
    taken, angles = best(lambda: newton(some, turns[:, 0]))
    rows.append(("six-bars: Newton, all at once", taken / each))
    off = np.abs(np.exp(1j * angles[..., 2]) - at.turn[4])
    taken, _ = best(lambda: by_root(some, turns[:, 0]))
    rows.append(("six-bars: scipy.optimize.root", taken / POSITIONS))
    for name, seconds in rows:
        print(f"{name:45} {1e6 * seconds:9.3f} µs")
    jumped = int((off.max(0) > 1e-6).sum())
    print(f"{len(some)} of {count} six-bars turn; Newton leaves the branch of {jumped}, else agrees to {off.max():.1e}")


if __name__ == "__main__":
    main(wanted_count(1000))
