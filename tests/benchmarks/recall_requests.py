"""Hard requests that have an answer, made from linkages that were found without the catalogue.

    python tests/benchmarks/recall_requests.py > more_requests.json
    python tests/benchmarks/recall_requests.py --check tests/benchmarks/recall_requests.json

Random linkages carry random points; of the paths those pieces are taken that run nearly straight or along an arc, and
improved (`independent_programme.improved`) for random purposes.  Of such a pool one linkage of the best twelfth, by
the figures that a request bounds, gives its bounds, loosened by at most two per cent.  It is improved for that request;
what was ranked then becomes a bound as well, and all bounds are those of the improved linkage, loosened so again: it is
an answer.

The stored list was made so, and stays as it is, so that results can be compared: where improvement ends depends on the
last digits, so another run, with the same seed too, makes other requests of the same kinds.
"""

from __future__ import annotations

import json
import math
import sys
from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from independent import BAR, SLIDE, SLIDER, Array, Guides, posed, sines
from independent_figures import BOUNDS, Figures, apart, cost, measured, violations
from independent_programme import DRAWN, Task, as_pivots, improved, laid, posed_at, radius_of, sagitta_of
from independent_search import WITHIN, Best, polished
from measuring import arguments

#: Of the numbers that are drawn.
SEED = 20261128
STROKES = (1.0, 150.0, 0.025, 2.789770216, 40.0, 1000.0)
RANKS = ("size", "score", "transmission", "balance")
#: Least transmission angle [deg], least link, frame and arm, largest size, deviation and sagitta of a linkage that is
#: taken [strokes].
TRANSMISSION, LINK, SIZE, DEVIATION, SAGITTA = 25.0, 0.1, 4.5, (1e-5, 1e-2), (0.03, 0.35)
#: By which part constraints are looser than what the linkage has.
LOOSER = (0.0005, 0.02)
#: Linkages of a pool, twice as many of four-bars, and the part of them that requests are made of.
POOL, BEST = 84, 1 / 12
#: What the 401 positions of a search miss of a cost, relative.
COARSE = 1e-4
#: Angles of the crank at which a turn is looked at, and of a piece of path.
TURN, PIECE = 180, 9


# -- kinds of request -------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Kind:
    """What requests of a group bound: always `names`, and `more` of `others`, of linkages of the families."""

    group: str
    count: int
    names: tuple[str, ...]
    others: tuple[str, ...] = ()
    more: int = 0
    families: tuple[str, ...] = (BAR,)
    turns: bool = False


SIZES = ("max_size", "min_transmission", "min_link", "min_ground")
LINKS = ("max_link", "max_ground", "max_arm", "min_transmission", "min_link")
DRIVES = ("min_uniformity", "min_advantage", "max_drive_angle", "max_size", "min_transmission")
KINDS = (
    Kind("a size", 8, ("max_size",), SIZES[1:], 2),
    Kind("b links", 8, ("max_link", "max_ground"), LINKS[2:], 2),
    Kind("c fixed pivots in a box", 8, ("fixed_pivots_in",), ("max_link", "max_size", *SIZES[1:3]), 2),
    Kind("d all pivots in a box", 8, ("pivots_in",), ("min_transmission", "min_link", "min_ground"), 2),
    Kind("e full rotation", 5, ("full_rotation", "max_size"), LINKS[2:], 2, turns=True),
    Kind("f transmission over the turn", 7, ("min_transmission_turn",), ("max_size", *LINKS[:2], "min_link"), 2,
         (BAR, BAR, SLIDER), turns=True),
    Kind("g drive", 9, ("min_uniformity",), DRIVES[1:], 2, (BAR, BAR, SLIDE)),
    Kind("h drive, turning fully", 5, ("full_rotation", "max_drive_angle"), ("min_uniformity", "max_size", "max_link"),
         2, turns=True),
    Kind("i rotation", 6, ("max_rotation",), SIZES, 2),
    Kind("j allowance", 8, ("min_allowance",), SIZES, 1, (BAR, BAR, BAR, SLIDER)),
    Kind("k swept room", 7, ("swept_in",), ("min_transmission", "min_link"), 1, (BAR, BAR, SLIDE)),
    Kind("l zones kept out", 7, ("keep_out", "max_size"), ("min_transmission", "min_link"), 1),
    Kind("m slider-crank", 6, ("max_travel",), SIZES, 2, (SLIDER,)),
    Kind("n inverted slider-crank", 5, ("max_travel",), SIZES, 2, (SLIDE,)),
    Kind("o several", 3, ("fixed_pivots_in", "max_rotation"), ("min_uniformity", *LINKS[:4:2], "min_transmission"), 2),
)  # fmt: skip
BY_DEVIATION = Kind(
    "q by deviation", 10, ("max_size",), ("min_transmission", "min_link", "fixed_pivots_in", "max_rotation"), 2
)


# -- pieces of random paths -------------------------------------------------------------------------------------------
def pieces(rng: Any, circle: bool, family: str, count: int) -> list[Guides]:
    """Return guides, about mid-stroke, whose paths run from (0, 0) to (1, 0) along a line or arc, one of a linkage."""
    a = np.zeros(count, complex)
    b, c, d, p = (rng.normal(size=count) + 1j * rng.normal(size=count) for _ in range(4))
    normal = np.exp(2j * np.pi * rng.random(count))
    spread = np.exp(rng.normal(scale=0.5, size=(3, count)))
    c = normal if family == SLIDER else c
    end = normal if family == SLIDE else b + d * spread[1]
    g = Guides(a, b * spread[0], c, end, b + p * spread[2], family)
    angle = 2 * np.pi * np.arange(-TURN // 2, TURN + TURN // 2)[:, None] / TURN
    with np.errstate(all="ignore"):
        poses = posed(g, angle)
        push = np.fmax(np.abs(sines(g, poses)[0]), np.abs(sines(g, poses)[1]) if family == BAR else 0)
    best, where = np.full(count, np.inf), np.zeros((count, 2), int)
    for width in (24, 32, 48, 64, 96):
        for start in range(0, TURN, 4):
            at = start + width * np.arange(PIECE) // (PIECE - 1)
            with np.errstate(all="ignore"):
                path = poses.p[at]
                w = (path - path[0]) / (path[-1] - path[0])
                bent = roughness(w, circle)
                fine = (np.diff(w.real, axis=0) > 0).all(0) & (push[start : start + width + 1].min(0) > 0.4)
                bent = np.where(fine & np.isfinite(bent) & (bent > 3e-6), bent, np.inf)
            better = bent < best
            best = np.where(better, bent, best)
            where[better] = start, start + width
    out = []
    for i in np.flatnonzero(best < 2 * DEVIATION[1]):
        low, high = where[i]
        path = poses.p[low : high + 1, i]
        factor = 1 / (path[-1] - path[0])
        x = ((path - path[0]) * factor).real
        k = low + int(np.argmin(np.abs(x - 0.5)))
        one = Guides(g.a[[i]], poses.b[k, [i]], g.c[[i]], poses.d[k, [i]], poses.p[k, [i]], family)
        one = one.moved(factor, -path[0] * factor)
        crown = ((path[len(path) // 2] - path[0]) * factor).imag
        out.append(one.mirrored() if circle and crown < 0 else one)
    return out


def roughness(w: Array, circle: bool) -> Array:
    """Return about how far paths (m, n) from 0 to 1 are from a line, or from the circle through both ends and their
    middle, which is none of a sagitta that is not asked for."""
    if not circle:
        return np.asarray(0.5 * np.ptp(w.imag, axis=0))
    middle = w[len(w) // 2]
    radius = np.abs(middle) * np.abs(1 - middle) / (2 * np.abs(middle.imag))
    centre = 0.5 - 1j * np.sign(middle.imag) * np.sqrt(np.maximum(radius**2 - 0.25, 0))
    off = np.abs(np.abs(w - centre) - radius).max(0) / 2
    return np.where((radius > 0.53) & (radius < radius_of(SAGITTA[0])), off, np.inf)


# -- a pool of sound ones ---------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Sound:
    """A linkage that requests can be made of, with its figures in strokes."""

    guide: Guides
    figures: Figures

    @classmethod
    def of(cls, g: Guides | None, circle: bool, turns: bool) -> Sound | None:
        """Return a guide with its figures if it is sound."""
        if g is None:
            return None
        m = measured(*as_pivots(g), 1.0, circle=circle, turns=turns, stations=201)
        if m is None or not DEVIATION[0] <= m.deviation <= DEVIATION[1] or m.off > 2.5 * m.deviation:
            return None
        lengths = [*g.links, *g.frame, *g.arms]
        if min(float(v[0]) for v in lengths) < LINK or m.size > SIZE or m.transmission < TRANSMISSION:
            return None
        if circle and not (m.radius and radius_of(SAGITTA[1]) < m.radius < radius_of(SAGITTA[0])):
            return None
        if turns and (m.turning < 0.01 or m.transmission_turn < 5):
            return None
        return cls(g, m)

    @cached_property
    def forgiven(self) -> float:
        """Allowance for twice the deviation, over the deviation."""
        own = measured(*as_pivots(self.guide), 1.0, circle=self.figures.radius is not None, stations=401,
                       tolerance=2 * self.figures.deviation, draws=1000)  # fmt: skip
        return own.allowance / self.figures.deviation if own is not None else 0.0

    def rated(self, name: str) -> float:
        """Return a figure that a constraint bounds, less is harder to have."""
        m, places = self.figures, places_of(name, self.figures)
        if places is not None:
            return extent(places)
        if name == "min_allowance":
            return -self.forgiven
        value = getattr(m, BOUNDS.get(name, name), None) or 0.0
        return -value if name.startswith("min_") else float(value)


def places_of(name: str, m: Figures) -> Array | None:
    """Return the places that a box bounds, None of other constraints."""
    if not name.endswith("_in"):
        return None
    if name == "swept_in":
        return m.segments.ravel()
    return m.fixed if name == "fixed_pivots_in" else np.concatenate([m.fixed, m.moving])


def extent(z: Array) -> float:
    """Return half the perimeter of the box about places."""
    return float(np.ptp(z.real) + np.ptp(z.imag))


def pool(rng: Any, circle: bool, family: str, turns: bool, count: int) -> list[Sound]:
    """Return sound linkages, nearly all improved for random purposes."""
    out: list[Sound] = []
    while len(out) < count:
        for i, g in enumerate(pieces(rng, circle, family, 400)):
            first = laid(posed_at(g, 0.5), circle)
            if first is None:
                continue
            found = Sound.of(first, circle, turns)
            if i % 8:
                level = 10 ** rng.uniform(np.log10(3 * DEVIATION[0]), np.log10(DEVIATION[1]))
                bounds: dict[str, Any] = {"min_link": LINK + 0.02, "max_size": float(rng.uniform(1.2, SIZE))}
                bounds["min_transmission"] = float(rng.uniform(TRANSMISSION + 5, 55))
                if rng.random() < 0.3:
                    bounds["max_rotation"] = float(rng.uniform(10, 60))
                if rng.random() < 0.3:
                    bounds["min_uniformity"] = float(rng.uniform(0.6, 0.95))
                if turns:
                    bounds["min_transmission_turn"] = float(rng.uniform(10, 40))
                    bounds["min_transmission"] = 0.0
                task = Task(
                    None if circle else 0.0, level, bounds, str(rng.choice(("size", "balance", "transmission")))
                )
                m = found.figures if found else None
                bulge = sagitta_of(m.radius) if m and m.radius else 0.1 if circle else 0.0
                found = Sound.of(improved(first, task, bulge, rounds=int(rng.integers(12, 40))), circle, turns)
            if found is not None:
                out.append(found)
            if len(out) == count:
                break
    return out


def best(some: list[Sound], names: list[str]) -> list[Sound]:
    """Return the best twelfth of a pool by figures that are bounded, and the deviation: by the mean of their ranks."""
    values = np.array([[s.rated(name) for s in some] for name in ("deviation", *names)])
    ranks = np.argsort(np.argsort(values, axis=1), axis=1).mean(0)
    return [some[i] for i in np.argsort(ranks)[: max(1, round(BEST * len(some)))]]


# -- requests made of them --------------------------------------------------------------------------------------------
def entry(rng: Any, name: str, kind: Kind, names: list[str], rank: str, stroke: float, s: Sound, given: bool) -> Any:
    """Return a request that a guide answers."""
    m, g, circle = s.figures, s.guide, s.figures.radius is not None
    pivots, guided = as_pivots(g, stroke)
    turns = "full_rotation" in names or "min_transmission_turn" in names
    radius = rounded(m.radius * stroke) if given and m.radius else None
    own = measured(pivots, guided, stroke, circle=circle, radius=radius, turns=turns)
    assert own is not None
    wide = (1.3, 2.5) if "min_allowance" in names or rank == "score" else (1 + LOOSER[0], 1 + LOOSER[1])
    asked = rounded(own.deviation * rng.uniform(*wide))
    known = measured(pivots, guided, stroke, circle=circle, radius=radius, turns=turns, tolerance=asked)
    assert known is not None
    bounds: dict[str, Any] = {"families": [g.family]}
    if g.family == BAR and rng.random() < 0.5:
        bounds = {"pins_only": True}
    for key in names:
        bounds[key] = loosened(rng, key, known)
    broken = violations(known, bounds, asked, stroke)
    assert max(broken.values()) <= 0, (name, broken)
    return {
        "name": name, "group": kind.group[2:], "kind": "circular-arc" if circle else "straight-line", "stroke": stroke,
        "radius": radius, "deviation": asked, "constraints": bounds, "rank_by": rank,
        "known": {"pivots": pivots, "guided": guided, "cost": cost(known, rank, stroke, turns, asked),
                  "from": "the linkage of origin"},
    }  # fmt: skip


def tightened(rng: Any, first: dict[str, Any], best: Best | None) -> dict[str, Any]:
    """Return a request as tight as the improved linkage of a first one allows: what that ranked is bounded too, and
    another figure is ranked; the first one itself where nothing came of the improvement."""
    if best is None or best.violation > WITHIN or first["rank_by"] == "deviation":
        return first
    task, circle, stroke = Task.of(first), first["kind"] == "circular-arc", first["stroke"]
    pivots, guided = as_pivots(best.guide, stroke)
    over = "min_transmission_turn" if task.turns else "min_transmission"
    rank, more = {"size": ("transmission", ["max_size"]), "transmission": ("size", [over])}.get(
        first["rank_by"], (first["rank_by"], [])
    )
    known = measured(pivots, guided, stroke, circle=circle, radius=first["radius"], turns=task.turns,
                     tolerance=first["deviation"] if task.scatters else None)  # fmt: skip
    if known is None:
        return first
    asked = (
        first["deviation"] if task.scatters else rounded(known.deviation * rng.uniform(1 + LOOSER[0], 1 + LOOSER[1]))
    )
    bounds = {name: value for name, value in first["constraints"].items() if name in ("families", "pins_only")}
    for name in dict.fromkeys([*(n for n in first["constraints"] if n not in bounds), *more]):
        bounds[name] = loosened(rng, name, known)
    if max(violations(known, bounds, asked, stroke).values()) > 0:
        return first
    price = cost(known, rank, stroke, task.turns, asked)
    origin = {"pivots": pivots, "guided": guided, "cost": price, "from": "the linkage of origin"}
    return first | {"deviation": asked, "constraints": bounds, "rank_by": rank, "known": origin}


def loosened(rng: Any, name: str, m: Figures) -> Any:
    """Return a bound a little looser than what a guide has, in the unit of its figures."""
    by = float(rng.uniform(*LOOSER))
    if name == "full_rotation":
        return True
    if name == "keep_out":
        return [zone(rng, m) for _ in range(int(rng.integers(1, 3)))]
    if (z := places_of(name, m)) is not None:
        wide = max(np.ptp(z.real), np.ptp(z.imag))
        low = [v.min() - wide * rng.uniform(*LOOSER) for v in (z.real, z.imag)]
        high = [v.max() + wide * rng.uniform(*LOOSER) for v in (z.real, z.imag)]
        return [*(rounded(v, math.floor) for v in low), *(rounded(v) for v in high)]
    value = float(getattr(m, BOUNDS[name]))
    if name == "min_allowance":
        by += 0.03  # it is drawn, not computed
    return rounded(value * (1 - by), math.floor) if name.startswith("min_") else rounded(value * (1 + by))


def zone(rng: Any, m: Figures) -> list[float]:
    """Return a box near a linkage, whose sides have grown until they nearly touched it or were a third of its size."""
    p, q = m.segments[..., 0], m.segments[..., 1]
    z = m.segments.ravel()

    def free(box: list[float]) -> bool:
        return bool(apart(box, p, q).min() > 0)

    while True:
        x, y = rng.uniform(z.real.min(), z.real.max()), rng.uniform(z.imag.min(), z.imag.max())
        small = 0.02 * m.size
        box = [x - small, y - small, x + small, y + small]
        if not free(box):
            continue
        touched = 0
        for side in rng.permutation(4):
            low, high = 0.0, m.size / 3
            sign = -1 if side < 2 else 1

            def grown(by: float, box: list[float] = box, side: int = int(side), sign: int = sign) -> list[float]:
                return [v + sign * by * (i == side) for i, v in enumerate(box)]

            if not free(grown(high)):
                touched += 1
                for _ in range(30):
                    middle = 0.5 * (low + high)
                    low, high = (middle, high) if free(grown(middle)) else (low, middle)
                high = low
            box = grown(high)
        if touched < 2:
            continue
        wide = min(box[2] - box[0], box[3] - box[1])
        box = [v + (1 if i < 2 else -1) * wide * rng.uniform(*LOOSER) for i, v in enumerate(box)]
        return [*(rounded(v) for v in box[:2]), *(rounded(v, math.floor) for v in box[2:])]


def rounded(value: float, way: Any = math.ceil) -> float:
    """Return a number of six digits not below (or not above) a value."""
    if value == 0:
        return 0.0
    digits = 5 - math.floor(math.log10(abs(value)))
    return float(f"{way(float(value) * 10.0**digits) / 10.0**digits:.12g}")


def requests(seed: int = SEED, count: int = POOL) -> list[Any]:
    """Return all requests that are made of known linkages."""
    out: list[Any] = []
    pools: dict[Any, list[Sound]] = {}
    used: Counter[int] = Counter()  # no linkage is the origin of more than two
    for number, kind in enumerate((*KINDS, BY_DEVIATION)):
        rng = np.random.default_rng([seed, number])
        for i in range(kind.count):
            family = kind.families[i % len(kind.families)]
            circle = i % 5 in (1, 3)
            rank = "deviation" if kind is BY_DEVIATION else RANKS[(i + number) % len(RANKS)]
            key = circle, family, kind.turns
            if key not in pools:
                more = count * (2 if family == BAR and not kind.turns else 1)
                pools[key] = pool(np.random.default_rng([seed, 99, len(pools)]), *key, more)
                print(key, file=sys.stderr, flush=True)
            others = [n for n in kind.others if not (rank == "transmission" and n == "min_transmission")
                      and not (rank == "size" and n == "max_size")
                      and not (family != BAR and n in ("max_ground", "min_ground"))]  # fmt: skip
            names = [*kind.names, *map(str, rng.choice(others, min(kind.more, len(others)), replace=False))]
            left = [s for s in pools[key] if used[id(s)] < 2]
            found = best(left, names)
            s = found[int(rng.integers(len(found)))]
            used[id(s)] += 1
            code, stroke = f"{kind.group[0]}{i + 1:02d}", STROKES[(i + 2 * number) % 6]
            first = entry(rng, code, kind, names, rank, stroke, s, circle and i % 5 == 3)
            out.append(tightened(rng, first, polished(first)))
            print(
                code, names, rank, f"{s.figures.deviation:.1e} size {s.figures.size:.2f}", file=sys.stderr, flush=True
            )
    return out


def unmet(entry: dict[str, Any]) -> dict[str, float]:
    """Return what the known linkage of a request breaks, and by how much, on a fine grid along one branch."""
    known, circle, stroke = entry["known"], entry["kind"] == "circular-arc", entry["stroke"]
    task = Task.of(entry)
    m = measured(known["pivots"], known["guided"], stroke, circle=circle, radius=entry["radius"], turns=task.turns,
                 tolerance=entry["deviation"] if task.scatters else None)  # fmt: skip
    if m is None:
        return {"path": 1.0}
    broken = violations(m, entry["constraints"], entry["deviation"], stroke)
    price = cost(m, entry["rank_by"], stroke, task.turns, entry["deviation"])
    missed = DRAWN if entry["rank_by"] == "score" else COARSE
    broken["cost"] = abs(price - known["cost"]) - missed * max(abs(known["cost"]), entry["rank_by"] != "deviation")
    broken["place"] = (m.off - 3 * entry["deviation"]) / stroke
    broken["bulge"] = -1.0 if m.radius is None else -m.radius
    return {name: value for name, value in broken.items() if value > WITHIN}


def main() -> None:
    """Print a list, or what is wrong with one."""
    parser = arguments()
    parser.add_argument("--check", type=Path, help="a list whose known linkages are to be measured again")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--pool", type=int, default=POOL, help="linkages of each pool")
    given = parser.parse_args()
    if given.check is None:
        print("[\n" + ",\n".join(json.dumps(r) for r in requests(given.seed, given.pool)) + "\n]")
        return
    entries = json.loads(given.check.read_text())
    wrong = {e["name"]: broken for e in entries if (broken := unmet(e))}
    print(f"{len(entries)} requests, {len(entries) - len(wrong)} met by their known linkages")
    for name, broken in wrong.items():
        print(name, broken)
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
