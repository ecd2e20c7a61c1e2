"""An independent search for guides, and what it finds for the requests of the list in some seconds of a core each.

    OMP_NUM_THREADS=1 python tests/benchmarks/independent_search.py --seconds 30 --out FILE [--names "a01 a02"]
    python tests/benchmarks/independent_search.py --merge FILE

It starts from nothing, and nothing of it comes from `catalogue`; with `--polish` it starts from the linkages of origin
instead, and improves each of them but once.  Each result is written to the file as soon as it is there, one a line;
names that are in it are not searched again.  `--merge` puts what is better than a known answer into the list.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from independent import BAR, SLIDE, SLIDER, Array, Guides, better_driver, turning
from independent_figures import ANGLES, BOUNDS, Figures, boxed, guide_of, sine_between, violations
from independent_programme import (
    DRAWN,
    FLOOR,
    SAGITTA,
    Task,
    as_pivots,
    improved,
    radius_of,
    sagitta_of,
    worth,
)
from measuring import arguments

#: Largest violation of a constraint with which an answer counts, relative.
WITHIN = 1e-6
#: Shares of the deviation that are tried where the allowance counts, which is made of what is left.
SHARES = (0.75, 0.5, 0.3)
#: The list of requests.
REQUESTS = Path(__file__).with_name("recall_requests.json")


# -- a global search --------------------------------------------------------------------------------------------------
def starts(task: Task, family: str, rng: Any, arms: int = 300, each: int = 60) -> tuple[Guides, Array, Array]:
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
            x0, x1, y0, y1 = boxed(box)
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
        if family == SLIDE:  # a fixed point that nearly runs along a line, as the coupler sees it
            c = somewhere(fixed, (each, len(a1)), point)
            d, bent = _normal(point + (c - path[:, None]) / turn[:, None])
            ray, arm = turn[:, None] * d, c - elbow[:, None]
        else:
            d = somewhere(moving, (each, len(a1)), point)
            at = path[:, None] + turn[:, None] * (d - point)
            arm = at - elbow[:, None]
            if family == SLIDER:
                c, bent = _normal(at)
                ray = np.broadcast_to(c, at.shape)
            else:
                c = _centre(at)
                ray = at - c
                bent = 0.5 * np.ptp(np.abs(ray), axis=0)
        first = sine_between(arm, ray)
        second = sine_between(arm, np.broadcast_to((elbow - a1)[:, None], arm.shape)) * (family == BAR)
        push, other = (np.where(np.abs(np.sign(sine).sum(0)) < 9, 0, np.abs(sine).min(0)) for sine in (first, second))
        rotation = np.degrees(np.ptp(np.unwrap(np.angle(turn), axis=0), axis=0))
        fixed_1, moving_1, fixed_2, moving_2, guided = (
            np.broadcast_to(v, d.shape).ravel() for v in (a1, b1, c, d, point)
        )
        g = Guides(fixed_1, moving_1, fixed_2, moving_2, guided, family)
        push, other, bent = push.ravel(), other.ravel(), bent.ravel()
        turns = turning(g)
        push = np.where(turns[0] >= turns[1], push, other) if task.turns and family == BAR else np.maximum(push, other)
        broken = np.log10(np.maximum(bent / task.asked, 1)) + 3 * (push < 0.02)
        broken += np.maximum(np.sin(np.radians(b.get("min_transmission", 0))) - push, 0)
        pivots, links = g.pivots, np.array(g.links)
        ends = [np.zeros_like(g.a), np.ones_like(g.a), g.p]
        size = np.max([np.abs(p - q) for i, p in enumerate(pivots) for q in (*pivots[i + 1 :], *ends)], axis=0)
        arms, ground = np.min(g.arms, axis=0), sum(g.frame, np.zeros_like(size))
        turned = np.broadcast_to(rotation, d.shape).ravel()
        for name, value in (("max_size", size), ("max_link", links.max(0)), ("max_arm", arms), ("max_ground", ground),
                            ("max_rotation", turned)):  # fmt: skip
            if name in b:
                broken += np.log1p(np.maximum(value / b[name] - 1, 0))
        broken += np.maximum(max(FLOOR, b.get("min_link", 0.0)) - links.min(0), 0)
        if fixed is not None and family != SLIDER:
            x0, x1, y0, y1 = boxed(fixed)
            out = np.maximum(np.maximum(x0 - g.c.real, g.c.real - x1), np.maximum(y0 - g.c.imag, g.c.imag - y1))
            broken += np.log1p(np.maximum(out, 0) / max(x1 - x0, y1 - y0))
        if task.turns:
            broken += np.maximum(-np.nanmax(turns, axis=0), 0)
        price = {"size": size, "transmission": -push, "balance": size - push, "score": size - push}.get(
            task.rank_by, np.log10(bent + 1e-9)
        )
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


def _normal(at: Array) -> tuple[Array, Array]:
    """Return the unit normals of the lines nearest to points (m, ...), by least squares, and how far these are off."""
    rest = at - at.mean(0)
    spread = (rest**2).mean(0)
    normal = 1j * np.sqrt(spread) / np.abs(np.sqrt(spread))
    return normal, np.abs((normal.conj() * rest).real).max(0)


@dataclass(frozen=True)
class Best:
    """What a search has found: guide, cost and violation in strokes, and after how much processor time [s]."""

    guide: Guides
    cost: float
    violation: float
    seconds: float


def finished(g: Guides, task: Task, sagitta: float, until: float) -> tuple[Guides, float, float] | None:
    """Return a guide improved to the end, with its violation and its cost on a fine grid; None if that fails.

    Bounds are tightened by what the fine measurement finds broken; where the allowance counts the deviation is, as more
    of it is left.
    """
    best = None
    for share in SHARES if task.scatters else (1.0,):
        now, start = task.using(share), g
        for _ in range(4):
            better = improved(start, now, sagitta, 100, 1e-10, 97, until)
            if better is None:
                break
            m, broken, price = worth(better, task, 4000)
            if m is None:
                break
            if best is None or (max(broken, 1e-7), price) < (max(best[1], 1e-7), best[2]):
                best = better, broken, price
            if broken < 1e-7:
                break
            now, start = tightened(now, task, m), better
    return best


def tightened(now: Task, task: Task, m: Figures) -> Task:
    """Return a task with bounds tightened, from those of now, by what a guide breaks of the task."""
    bounds, over = dict(now.bounds), violations(m, task.bounds, task.asked, 1.0)
    for name, by in over.items():
        if by <= 0 or name not in bounds:
            continue
        by = 1.2 * by + 1e-9
        if name == "keep_out":
            bounds[name] = [grown(box, by) for box in bounds[name]]
        elif name.endswith("_in"):
            bounds[name] = grown(bounds[name], -by)
        elif name in BOUNDS:
            unit = 90.0 if BOUNDS[name] in ANGLES else 1.0
            bounds[name] += (by if name.startswith("min_") else -by) * unit
    share = min(1.0, task.asked / m.deviation)
    wanted = (1 + DRAWN) * task.bounds.get("min_allowance", 0.0)
    if wanted > m.allowance:
        left = (task.asked - m.deviation) * wanted / max(m.allowance, 1e-9)
        share = float(np.clip((task.asked - 1.01 * left) / m.deviation, 0.3, 0.95))
    return replace(now, asked=now.asked * share * (1 - 1e-6), bounds=bounds)


def grown(box: Any, by: float) -> list[float]:
    """Return a box grown on all sides, shrunk where that is negative, by two fifths at most."""
    x0, x1, y0, y1 = boxed(box)
    wide, high = (max(by, -0.4 * (b - a)) for a, b in ((x0, x1), (y0, y1)))
    return [x0 - wide, y0 - high, x1 + wide, y1 + high]


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
    waiting: dict[str, list[tuple[Guides, float]]] = {family: [] for family in task.families}
    while time.process_time() - begin < seconds:
        family = str(rng.choice(task.families))
        again = len(kept) > 3 and rng.random() < (0.6 if kept[0][0] == 0 else 0.3)
        if again:
            _, _, g, sagitta = kept[int(len(kept) * rng.random() ** 2)]
            g = shaken(g, rng, 10 ** rng.uniform(-2.3, -0.3))
        else:
            if not waiting[family]:
                some, bulges, mark = starts(task, family, rng)
                order = np.argsort(mark)[:200]
                order = order[np.isfinite(mark[order])]
                good = better_driver(some[order])[1].good
                chosen: list[int] = []
                for i in order[good]:  # no two of one arm
                    if all(some.a[i] != some.a[j] for j in chosen):
                        chosen.append(int(i))
                waiting[family] = [(some[[i]], float(bulges[i])) for i in chosen[:6]]
            if not waiting[family]:
                continue
            g, sagitta = waiting[family].pop(0)
        share = float(rng.choice(SHARES)) if task.scatters else 1.0
        better = improved(g, task.using(share), sagitta, 40, until=begin + seconds)
        if better is None:
            continue
        sagitta = _sagitta(better, task, sagitta)
        _, broken, price = worth(better, task, 300)
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


def polished(entry: Mapping[str, Any], seconds: float = 10.0) -> Best | None:
    """Return the known linkage of an entry improved for its request, None if there is none, or nothing comes of it."""
    task, begin = Task.of(entry), time.process_time()
    if entry["known"] is None:
        return None
    g = guide_of(entry["known"]["pivots"], entry["known"]["guided"], entry["stroke"])
    done = finished(g, task, _sagitta(g, task, 0.1), begin + seconds)
    return None if done is None else Best(done[0], done[2], done[1], time.process_time() - begin)


def shaken(g: Guides, rng: Any, by: float) -> Guides:
    """Return one guide with its pivots moved at random by about a part of the stroke."""

    def move(z: Array) -> Array:
        moved: Array = z + by * (rng.normal(size=1) + 1j * rng.normal(size=1)) / np.sqrt(2)
        return moved

    def spun(z: Array) -> Array:
        return np.asarray(z * np.exp(1j * by * rng.normal(size=1)))

    c, d = (spun if g.family == SLIDER else move)(g.c), (spun if g.family == SLIDE else move)(g.d)
    return Guides(move(g.a), move(g.b), c, d, g.p, g.family)


def _sagitta(g: Guides, task: Task, last: float) -> float:
    """Return the sagitta of the arc through both ends and the middle of a path, if it is free."""
    if task.sagitta is not None:
        return task.sagitta
    m = task.measured(g, 101, 10)
    if m is None or m.radius is None or m.radius < 0.5:
        return last
    return float(np.clip(sagitta_of(m.radius), *SAGITTA))


# -- results ----------------------------------------------------------------------------------------------------------
def main() -> None:
    """Search, and write results one by one; or merge them into the list."""
    parser = arguments()
    parser.add_argument("--seconds", type=float, default=30.0, help="of each")
    parser.add_argument("--names", help="of the requests, all if not given")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--requests", type=Path, default=REQUESTS)
    parser.add_argument("--out", type=Path, help="to which results are appended")
    parser.add_argument("--polish", action="store_true", help="improve the linkages of origin instead")
    parser.add_argument("--merge", type=Path, help="results to put into the list")
    given = parser.parse_args()
    entries = json.loads(given.requests.read_text())
    if given.merge:
        merge(entries, given.merge)
        given.requests.write_text("[\n" + ",\n".join(json.dumps(e) for e in entries) + "\n]\n")
        return
    there = read(given.out) if given.out and given.out.exists() else {}
    names = given.names.split() if given.names else [e["name"] for e in entries]
    for entry in entries:
        if entry["name"] not in names or entry["name"] in there:
            continue
        start = time.process_time()
        best = polished(entry) if given.polish else search(entry, given.seconds, given.seed)
        how = "the linkage of origin, improved" if given.polish else f"an independent search of {given.seconds:g} s"
        found: dict[str, Any] = {"name": entry["name"], "cost": None, "from": how}
        if best is not None and best.violation <= WITHIN:
            pivots, guided = as_pivots(best.guide, entry["stroke"])
            found |= {"cost": best.cost, "found_after": round(best.seconds, 2), "pivots": pivots, "guided": guided}
        print(entry["name"], entry["rank_by"], f"known {(entry['known'] or {}).get('cost')}, found {found['cost']},",
              f"{time.process_time() - start:.1f} s", file=sys.stderr, flush=True)  # fmt: skip
        if given.out:
            with given.out.open("a") as file:
                file.write(json.dumps(found) + "\n")


def read(file: Path) -> dict[str, Any]:
    """Return results by the names of the requests."""
    return {found["name"]: found for found in map(json.loads, file.read_text().splitlines())}


def merge(entries: list[dict[str, Any]], file: Path) -> None:
    """Put what is better than a known answer into the entries."""
    results = read(file)
    for entry in entries:
        found, known = results.get(entry["name"]), entry["known"]
        if found and found["cost"] is not None and (known is None or found["cost"] < known["cost"]):
            entry["known"] = {key: found[key] for key in ("pivots", "guided", "cost", "from")}


if __name__ == "__main__":
    main()
