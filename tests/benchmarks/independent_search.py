"""An independent search for guides, and what it finds in half a minute of one core for some of the feasible requests.

    OMP_NUM_THREADS=1 python tests/benchmarks/independent_search.py --seconds 30 > recall_independent.json

It starts from nothing: it never sees the known answers, and nothing of it comes from `catalogue`.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from independent import (
    Array,
    Guides,
    Measured,
    angle_of_turn,
    arc,
    cost,
    sine_between,
    sines,
    strip,
    turning,
    violations,
)
from independent_programme import (
    FLOOR,
    SAGITTA,
    Task,
    as_pivots,
    better_driver,
    driven,
    error,
    improved,
    radius_of,
    sagitta_of,
    worth,
)
from measuring import arguments

#: Of which requests, if none are named.
SOME = "a02 a07 b06 b09 c03 c08 d04 d07 e02 e03 e04 e05 e06 e07 e10 e11 f05 f07 g02 g08 g12 h04 h08 i02 i03 i06 i10"
#: Largest violation of a constraint with which an answer counts, relative.
WITHIN = 1e-6


# -- a global search --------------------------------------------------------------------------------------------------
def starts(task: Task, slider: bool, rng: Any, arms: int = 300, each: int = 60) -> tuple[Guides, Array, Array]:
    """Return random linkages most of which nearly do what is asked, their sagittas, and marks, less is better.

    A point is led exactly along the nominal by an arm of two links, fixed somewhere; the second link is the coupler.
    Of the points that it carries, random ones are taken; about the circle (of a slider: the line) nearest to nine
    positions of such a point, another link can lead it.
    """
    b = task.bounds
    count, far = arms, 0.7 * b.get("max_size", 6.0)
    sagitta = np.full(count, task.sagitta or 0.0)
    if task.sagitta is None:
        sagitta = np.exp(rng.uniform(np.log(0.003), np.log(SAGITTA[1]), count))
    along = 0.5 - 0.5 * np.cos(np.pi * np.arange(9) / 8)[:, None]
    path = along + 0j + np.zeros(count)
    if task.circle:
        radius = radius_of(sagitta)  # type: ignore[arg-type]  # an array or a number
        path = along + 1j * (np.sqrt(radius**2 - (along - 0.5) ** 2) - radius + sagitta)
    point = path[4]

    def somewhere(box: Any, shape: Any, about: Array | complex) -> Array:
        if box is not None:
            (x0, x1), (y0, y1) = sorted(box[::2]), sorted(box[1::2])
            return np.asarray(rng.uniform(x0, x1, shape) + 1j * rng.uniform(y0, y1, shape))
        way = np.exp(rng.uniform(np.log(0.1), np.log(far), shape))
        return np.asarray(about + way * np.exp(2j * np.pi * rng.random(shape)))

    fixed, moving = b.get("fixed_pivots_in", b.get("pivots_in")), b.get("pivots_in")
    a1, b1 = somewhere(fixed, count, point), somewhere(moving, count, point)
    with np.errstate(all="ignore"):
        r, s = np.abs(b1 - a1), np.abs(point - b1)
        apart = path - a1
        apart2 = np.abs(apart) ** 2
        share = 0.5 * (1 + (r**2 - s**2) / apart2)
        side = np.sign(((point - a1).conj() * (b1 - a1)).imag)
        elbow = a1 + apart * (share + 1j * side * np.sqrt(r**2 / apart2 - share**2))
        turn = (path - elbow) / (point - b1)
        reached = np.isfinite(turn).all(0) & (r > FLOOR) & (s > FLOOR)
        a1, b1, point, path, elbow, turn, sagitta = (
            v[..., reached] for v in (a1, b1, point, path, elbow, turn, sagitta)
        )
        d = somewhere(moving, (each, len(a1)), point)
        at = path[:, None] + turn[:, None] * (d - point)
        if slider:
            middle = at.mean(0)
            rest = at - middle
            spread = (rest**2).mean(0)
            normal = 1j * np.sqrt(spread) / np.abs(np.sqrt(spread))
            bent = np.abs((normal.conj() * rest).real).max(0)
            c, ray = normal, np.broadcast_to(normal, at.shape)
        else:
            c = _centre(at)
            ray = at - c
            bent = 0.5 * np.ptp(np.abs(ray), axis=0)
        bar = at - elbow[:, None]
        first = sine_between(bar, ray)
        second = sine_between(bar, np.broadcast_to((elbow - a1)[:, None], bar.shape))
        if slider:
            second = 0 * second
        push, other = (np.where(np.abs(np.sign(first).sum(0)) < 9, 0, np.abs(first).min(0)),
                       np.where(np.abs(np.sign(second).sum(0)) < 9, 0, np.abs(second).min(0)))  # fmt: skip
        fixed_1, moving_1, fixed_2, moving_2, guided = (
            np.broadcast_to(v, d.shape).ravel() for v in (a1, b1, c, d, point)
        )
        g = Guides(fixed_1, moving_1, fixed_2, moving_2, guided, slider)
        push, other, bent = push.ravel(), other.ravel(), bent.ravel()
        turns = turning(g)
        push = np.where(turns[0] >= turns[1], push, other) if task.turns and not slider else np.maximum(push, other)
        broken = np.log10(np.maximum(bent / task.asked, 1)) + 3 * (push < 0.02)
        broken += np.maximum(np.sin(np.radians(b.get("min_transmission", 0))) - push, 0)
        pivots = [g.a, g.b, g.d] if slider else [g.a, g.b, g.c, g.d]
        ends = [np.zeros_like(g.a), np.ones_like(g.a), g.p]
        size = np.max([np.abs(p - q) for i, p in enumerate(pivots) for q in (*pivots[i + 1 :], *ends)], axis=0)
        links = np.stack([np.abs(g.b - g.a), np.abs(g.d - g.b)] + ([] if slider else [np.abs(g.d - g.c)]))
        arm = np.minimum(np.abs(g.p - g.b), np.abs(g.p - g.d))
        ground = np.zeros_like(size) if slider else np.abs(g.c - g.a)
        for name, value in (("max_size", size), ("max_link", links.max(0)), ("max_arm", arm), ("max_ground", ground)):
            if name in b:
                broken += np.log1p(np.maximum(value / b[name] - 1, 0))
        broken += np.maximum(max(FLOOR, b.get("min_link", 0.0)) - links.min(0), 0)
        if fixed is not None and not slider:
            (x0, x1), (y0, y1) = sorted(fixed[::2]), sorted(fixed[1::2])
            out = np.maximum(np.maximum(x0 - g.c.real, g.c.real - x1), np.maximum(y0 - g.c.imag, g.c.imag - y1))
            broken += np.log1p(np.maximum(out, 0) / max(x1 - x0, y1 - y0))
        if task.turns:
            broken += np.maximum(-np.nanmax(turns, axis=0), 0)
        price = {"size": size, "transmission": -push, "balance": size - push}.get(task.rank_by, np.log10(bent + 1e-9))
        mark = broken + 0.25 * price
    return g, np.broadcast_to(sagitta, d.shape).ravel(), np.where(np.isfinite(mark), mark, np.inf)


def _centre(at: Array) -> Array:
    """Return the centres of circles near points (m, ...), by linear least squares."""
    middle = at.mean(0)
    z = at - middle
    square = np.abs(z) ** 2
    xx, xy, yy = (z.real**2).sum(0), (z.real * z.imag).sum(0), (z.imag**2).sum(0)
    p, q = 0.5 * (square * z.real).sum(0), 0.5 * (square * z.imag).sum(0)
    area = xx * yy - xy * xy
    centre: Array = middle + (p * yy - q * xy + 1j * (q * xx - p * xy)) / area
    return centre


@dataclass(frozen=True)
class Best:
    """What a search has found: guide, cost and violation in strokes, and after how much processor time [s]."""

    guide: Guides
    cost: float
    violation: float
    seconds: float


def finished(g: Guides, task: Task, sagitta: float, until: float) -> tuple[Guides, float, float] | None:
    """Return a guide improved to the end, with its violation and its cost on a fine grid; None if that fails.

    The tolerance and the boxes are tightened by what the fine measurement finds broken.
    """
    now, best = task, None
    for _ in range(4):
        better = improved(g, now, sagitta, 100, 1e-10, 97, until)
        if better is None:
            break
        m, broken, price = worth(better, task)
        if m is None:
            break
        if best is None or (max(broken, 1e-7), price) < (max(best[1], 1e-7), best[2]):
            best = better, broken, price
        if broken < 1e-7:
            break
        bounds = dict(now.bounds)
        over = violations(m, task.bounds, task.asked, 1.0)
        for name in ("fixed_pivots_in", "pivots_in"):
            if over.get(name, 0.0) > 0:
                x0, x1, y0, y1 = *sorted(bounds[name][::2]), *sorted(bounds[name][1::2])
                by = min(1.2 * over[name] + 1e-9, 0.4 * (x1 - x0), 0.4 * (y1 - y0))
                bounds[name] = [x0 + by, y0 + by, x1 - by, y1 - by]
        share = min(1.0, task.asked / m.deviation)
        now = Task(task.sagitta, now.asked * share * (1 - 1e-6), bounds, task.rank_by)
        g = better
    return best


def search(request: Task | Mapping[str, Any], seconds: float, seed: int = 0) -> Best | None:
    """Return the best guide found for a request from nothing, None if none was.

    Parameters
    ----------
    request : Task or entry of the list of requests
    seconds : float
        Of processor time, with one thread; the last improvement may take one more.

    Feasible ones are better than others, and by their cost; others by their largest violation (Deb's rules).
    """
    task = request if isinstance(request, Task) else Task.of(request)
    rng, begin = np.random.default_rng(seed), time.process_time()
    kept: list[tuple[float, float, Guides, float]] = []  # violation (0 if within 1e-3), cost, guide, sagitta
    best: Best | None = None
    waiting: dict[bool, list[tuple[Guides, float]]] = {k: [] for k in task.kinds}
    while time.process_time() - begin < seconds:
        slider = bool(rng.choice(task.kinds))
        again = len(kept) > 3 and rng.random() < (0.6 if kept[0][0] == 0 else 0.3)
        if again:
            _, _, g, sagitta = kept[int(len(kept) * rng.random() ** 2)]
            g = shaken(g, rng, 10 ** rng.uniform(-2.3, -0.3))
        else:
            if not waiting[slider]:
                some, bulges, mark = starts(task, slider, rng)
                order = np.argsort(mark)[:200]
                order = order[np.isfinite(mark[order])]
                good = better_driver(some[order])[1].good
                chosen: list[int] = []
                for i in order[good]:  # no two of one arm
                    if all(some.a[i] != some.a[j] for j in chosen):
                        chosen.append(int(i))
                waiting[slider] = [(some[[i]], float(bulges[i])) for i in chosen[:6]]
            if not waiting[slider]:
                continue
            g, sagitta = waiting[slider].pop(0)
        better = improved(g, task, sagitta, 40, until=begin + seconds)
        if better is None:
            continue
        sagitta = _sagitta(better, task, sagitta)
        broken, price = roughly(better, task, sagitta)
        if not np.isfinite(broken):
            continue
        broken = 0.0 if broken < 1e-3 else broken
        if not any(abs(broken - k[0]) + abs(price - k[1]) < 1e-5 for k in kept):
            kept = sorted([*kept, (broken, price, better, sagitta)], key=lambda k: k[:2])[:16]
        if broken < 0.1 and (best is None or best.violation > 1e-6 or price < best.cost - 1e-5 * abs(best.cost)):
            done = finished(better, task, sagitta, begin + seconds + 1)
            if done is not None and (
                best is None or (max(done[1], 1e-6), done[2]) < (max(best.violation, 1e-6), best.cost)
            ):
                best = Best(done[0], done[2], done[1], time.process_time() - begin)
                kept = sorted([*kept, (max(done[1] - 1e-6, 0.0), done[2], done[0], _sagitta(done[0], task, sagitta))],
                              key=lambda k: k[:2])[:16]  # fmt: skip
    return best


def shaken(g: Guides, rng: Any, by: float) -> Guides:
    """Return one guide with its pivots moved at random by about a part of the stroke."""

    def move(z: Array) -> Array:
        moved: Array = z + by * (rng.normal(size=1) + 1j * rng.normal(size=1)) / np.sqrt(2)
        return moved

    c = g.c * np.exp(1j * by * rng.normal(size=1)) if g.slider else move(g.c)
    return Guides(move(g.a), move(g.b), c, move(g.d), g.p, g.slider)


def roughly(g: Guides, task: Task, sagitta: float) -> tuple[float, float]:
    """Return about how much one laid guide breaks a task (deviation relative), and its cost, on a coarse grid."""
    use, way = driven(g, task.turns)
    if not way.good[0]:
        return np.inf, np.inf
    h = g.swapped(use) if use[0] else g
    sine = np.abs(sines(h, way.poses)[0]).min()
    path = way.poses.p[:, 0]
    bent = strip(path.real + 1j * error(path, sagitta))[0]  # as if shifted and turned to lie best
    links = [abs(g.b - g.a)[0], abs(g.d - g.b)[0]] + ([] if g.slider else [abs(g.d - g.c)[0]])
    fixed = [complex(g.a[0])] + ([] if g.slider else [complex(g.c[0])])
    moving, point = [complex(g.b[0]), complex(g.d[0])], complex(g.p[0])
    points = np.array([*fixed, *moving, *path[::6]])
    m = Measured(
        bent, None, float(np.abs(points[:, None] - points).max()), max(links),
        min(links), None if g.slider else abs(fixed[0] - fixed[1]), min(abs(point - q) for q in moving),
        float(np.degrees(np.arcsin(min(sine, 1)))), angle_of_turn(h, 181), float(np.nanmax(turning(g))), fixed, moving,
        0.0,
    )  # fmt: skip
    broken = violations(m, task.bounds, task.asked, 1.0)
    broken["deviation"] /= task.asked
    broken["floor"] = FLOOR - min(v for v in (m.min_link, m.max_ground, m.max_arm) if v is not None)
    return max(0.0, *broken.values()), cost(m, task.rank_by, 1.0, task.turns)


def _sagitta(g: Guides, task: Task, last: float) -> float:
    """Return the sagitta of the arc through both ends and the middle of a path, if it is free."""
    if task.sagitta is not None:
        return task.sagitta
    way = better_driver(g)[1]
    path = way.poses.p[:, 0]
    return float(np.clip(fitted, *SAGITTA)) if way.good[0] and (fitted := _through(path)) > 0 else last


def _through(path: Array) -> float:
    """Return the sagitta, over a chord of 1, of the best circle along a path from 0 to 1; bulging to +y."""
    _, _, radius = arc(path)
    return sagitta_of(max(radius, 0.5001))


# -- results ----------------------------------------------------------------------------------------------------------
def main() -> None:
    """Search, print."""
    parser = arguments()
    parser.add_argument("--seconds", type=float, default=30.0, help="of each")
    parser.add_argument("--names", default=SOME, help="of the requests")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    entries = {e["name"]: e for e in json.loads(Path(__file__).with_name("recall_requests.json").read_text())}
    results = {}
    for name in given.names.split():
        entry, start = entries[name], time.process_time()
        best = search(entry, given.seconds, given.seed)
        taken, known = time.process_time() - start, entry["known"]["cost"]
        found: dict[str, Any] = {"cost": None, "processor_seconds": round(taken, 2)}
        if best is not None and best.violation <= WITHIN:
            pivots, guided = as_pivots(best.guide, entry["stroke"])
            found |= {"cost": best.cost, "found_after": round(best.seconds, 2), "pivots": pivots, "guided": guided}
        results[name] = found
        print(name, entry["rank_by"], f"known {known:.6g}, found {found['cost']}, {taken:.1f} s", file=sys.stderr)
    command = f"python tests/benchmarks/independent_search.py --seconds {given.seconds:g} --seed {given.seed}"
    if given.names != SOME:
        command += f' --names "{given.names}"'
    body = ",\n".join(f"{json.dumps(name)}: {json.dumps(found)}" for name, found in results.items())
    print(f'{{"command": {json.dumps(command)},\n"results": {{\n{body}\n}}}}')


if __name__ == "__main__":
    main()
