"""Feasible requests, made from linkages that were found without the catalogue.

    python tests/benchmarks/recall_requests.py > more_requests.json
    python tests/benchmarks/recall_requests.py --check tests/benchmarks/recall_requests.json

Random four-bars and slider-cranks carry random points; of the paths those pieces are taken that run nearly straight or
along an arc.  Many are then improved a little (`independent_programme.improved`).  The constraints of a request are
what such a linkage has, loosened by up to a tenth, so that it is an answer; how good it is comes with the request.

The stored list was made so, and stays as it is, so that results can be compared: where improvement ends depends on the
last digits, so another run, with the same seed too, makes other requests of the same kinds.  A crank that is to turn
fully is the one that drives: the linkages from which e04 and e06 were made do not meet them so, and the known ones are
of `independent_search`.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
from independent import Array, Guides, Measured, cost, measured, posed, sines, violations
from independent_programme import Task, as_pivots, improved, laid, posed_at, radius_of, sagitta_of
from measuring import arguments

#: Of the numbers that are drawn.
SEED = 20240611
#: Kinds of request and how many of each there are.
KINDS = {
    "line within a size": 11, "line with short links": 11, "line, fixed pivots in a box": 11,
    "line, all pivots in a box": 11, "line, full rotation": 11, "arc of any radius": 11, "arc of given radius": 12,
    "slider-crank": 11, "several constraints": 11,
}  # fmt: skip
STROKES = (1.0, 150.0, 0.025, 2.789770216, 40.0, 1000.0)
RANKS = ("size", "balance", "transmission", "deviation")
#: Least transmission angle [deg], least link, frame and arm, largest size, deviation and sagitta of a linkage that is
#: taken [strokes].
TRANSMISSION, LINK, SIZE, DEVIATION, SAGITTA = 25.0, 0.1, 8.0, (1e-5, 1e-2), (0.03, 0.35)
#: By which part constraints are looser than what the linkage has.
LOOSER = (0.0005, 0.1)
#: Angles of the crank at which a turn is looked at, and of a piece of path.
TURN, PIECE = 180, 9


# -- pieces of random paths -------------------------------------------------------------------------------------------
def pieces(rng: Any, circle: bool, slider: bool, count: int) -> list[Guides]:
    """Return guides, about mid-stroke, whose paths run from (0, 0) to (1, 0) along a line or arc, one of a linkage."""
    a = np.zeros(count, complex)
    b, d, p = (rng.normal(size=count) + 1j * rng.normal(size=count) for _ in range(3))
    c = np.exp(2j * np.pi * rng.random(count)) if slider else rng.normal(size=count) + 1j * rng.normal(size=count)
    spread = np.exp(rng.normal(scale=0.5, size=(3, count)))
    g = Guides(a, b * spread[0], c, b + d * spread[1], b + p * spread[2], slider)
    angle = 2 * np.pi * np.arange(-TURN // 2, TURN + TURN // 2)[:, None] / TURN
    with np.errstate(all="ignore"):
        poses = posed(g, angle)
        push = np.fmax(np.abs(sines(g, poses)[0]), 0 if slider else np.abs(sines(g, poses)[1]))
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
        one = Guides(g.a[[i]], poses.b[k, [i]], g.c[[i]], poses.d[k, [i]], poses.p[k, [i]], slider)
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


# -- sound ones, and requests made of them ----------------------------------------------------------------------------
def look(g: Guides | None, circle: bool) -> Measured | None:
    """Return the measures of a guide in strokes, if it is sound."""
    if g is None:
        return None
    m = measured(*as_pivots(g), 1.0, circle=circle)
    if m is None or not DEVIATION[0] <= m.deviation <= DEVIATION[1] or m.off > 2.5 * m.deviation:
        return None
    least = min(v for v in (m.min_link, m.max_ground, m.max_arm) if v is not None)
    if least < LINK or m.size > SIZE or m.min_transmission < TRANSMISSION or least_arm(g) < LINK:
        return None
    if circle and not (m.radius and radius_of(SAGITTA[1]) < m.radius < radius_of(SAGITTA[0])):
        return None
    return m


def least_arm(g: Guides) -> float:
    """Return the distance of the guided point from the nearer moving pivot."""
    return float(min(np.abs(g.p - g.b)[0], np.abs(g.p - g.d)[0]))


def entry(rng: Any, name: str, kind: str, rank: str, stroke: float, g: Guides, m: Measured, given: bool) -> Any:
    """Return a request that a guide answers, its lengths in strokes."""
    circle, slider = m.radius is not None, g.slider
    families = {"families": ["slider-crank"] if slider else ["four-bar"]}
    often = {} if not slider and rng.random() < 0.2 else {"pins_only": True}
    bounds: dict[str, Any] = families if slider or rng.random() < 0.5 else often
    have = {
        "max_size": m.size, "max_link": m.max_link, "max_ground": m.max_ground, "max_arm": m.max_arm,
        "min_link": m.min_link, "min_transmission": m.min_transmission, "full_rotation": True,
        "fixed_pivots_in": m.fixed, "pivots_in": m.fixed + m.moving,
    }  # fmt: skip
    boxes = ["pivots_in"] if slider else ["fixed_pivots_in", "pivots_in"]
    rest = ["max_size", "max_link", "max_arm", "min_link", "min_transmission", *([] if slider else ["max_ground"])]
    if m.turning > 0.01:
        rest.append("full_rotation")
    names = {
        "line within a size": ["max_size", "min_transmission", *pick(rng, ["min_link"])],
        "line with short links": ["max_link", "max_ground", "max_arm", "min_transmission"],
        "line, fixed pivots in a box": ["fixed_pivots_in", *pick(rng, ["min_transmission", "max_link", "min_link"])],
        "line, all pivots in a box": ["pivots_in", *pick(rng, ["min_transmission", "min_link"])],
        "line, full rotation": ["full_rotation", *pick(rng, ["max_size", "min_transmission", "min_link"])],
    }.get(kind) or [
        *rng.choice(boxes, int(rng.random() < 0.6), replace=False),
        *rng.choice(rest, int(rng.integers(2, 4)), replace=False),
    ]
    if kind == "several constraints":
        names = [rng.choice(boxes), *rng.choice(rest, int(rng.integers(2, 5)), replace=False)]
    for key in dict.fromkeys(map(str, names)):
        bounds[key] = loosened(rng, key, have[key], stroke)
    unit = stroke
    asked = rounded(m.deviation * (1 + rng.uniform(*LOOSER)) * unit)
    pivots, guided = as_pivots(g, unit)
    radius = rounded(m.radius * unit) if given and m.radius else None
    known = measured(pivots, guided, unit, circle=circle, radius=radius, turns="full_rotation" in bounds)
    assert known is not None
    if given:
        asked = rounded(known.deviation * (1 + rng.uniform(*LOOSER)))
    broken = violations(known, bounds, asked, unit)
    assert max(broken.values()) <= 0, (kind, broken)
    numbers = {
        key: getattr(known, key)
        for key in ("deviation", "radius", "size", "max_link", "min_link", "max_ground", "max_arm", "min_transmission",
                    "turning")
    }  # fmt: skip
    return {
        "name": name, "group": kind, "kind": "circular-arc" if circle else "straight-line", "stroke": unit,
        "radius": radius, "deviation": asked, "constraints": bounds, "rank_by": rank,
        "known": {"pivots": pivots, "guided": guided, **numbers,
                  "cost": cost(known, rank, unit, "full_rotation" in bounds)},
    }  # fmt: skip


def pick(rng: Any, names: list[str]) -> list[str]:
    """Return about half of the names."""
    return [n for n in names if rng.random() < 0.55]


def loosened(rng: Any, name: str, value: Any, unit: float) -> Any:
    """Return a bound a little looser than a value in strokes, in the unit of a stroke."""
    by = float(rng.uniform(*LOOSER))
    if name == "full_rotation":
        return True
    if name.endswith("_in"):
        x, y = np.real(value), np.imag(value)
        wide = max(np.ptp(x), np.ptp(y))
        low = [v.min() - wide * rng.uniform(*LOOSER) for v in (x, y)]
        high = [v.max() + wide * rng.uniform(*LOOSER) for v in (x, y)]
        return [*(rounded(v * unit, math.floor) for v in low), *(rounded(v * unit) for v in high)]
    if name == "min_transmission":
        return rounded(min(value, 89.9) * (1 - by), math.floor)
    return rounded(value * unit * (1 - by), math.floor) if name == "min_link" else rounded(value * unit * (1 + by))


def rounded(value: float, way: Any = math.ceil) -> float:
    """Return a number of six digits not below (or not above) a value."""
    if value == 0:
        return 0.0
    digits = 5 - math.floor(math.log10(abs(value)))
    return float(f"{way(float(value) * 10.0**digits) / 10.0**digits:.12g}")


def known_guides(rng: Any, circle: bool, slider: bool, turns: bool) -> Any:
    """Yield sound guides with their measures, every other of them improved for a random purpose."""
    while True:
        for i, g in enumerate(pieces(rng, circle, slider, 400)):
            first = laid(posed_at(g, 0.5), circle)
            m = look(first, circle)
            if m is None or first is None or (turns and m.turning < 0.02):
                continue
            if i % 3:
                level = 10 ** rng.uniform(*np.log10(DEVIATION))
                bounds = {"min_link": LINK + 0.02, "min_transmission": TRANSMISSION + 5, "max_size": SIZE}
                bounds |= {"full_rotation": True} if turns else {}
                task = Task(None if circle else 0.0, level, bounds, str(rng.choice(RANKS[:3])))
                bulge = sagitta_of(m.radius) if m.radius else 0.0
                better = improved(first, task, bulge, rounds=int(rng.integers(6, 30)))
                found = look(better, circle)
                if found is None or better is None or (turns and found.turning < 0.005):
                    continue
                first, m = better, found
            yield first, m


def requests(seed: int = SEED) -> list[Any]:
    """Return all requests."""
    out: list[Any] = []
    for number, (kind, count) in enumerate(KINDS.items()):
        rng = np.random.default_rng([seed, number])
        sources: dict[Any, Any] = {}
        for i in range(count):
            slider = kind == "slider-crank" or (kind == "several constraints" and i % 4 == 3)
            circle = kind.startswith("arc") or (slider and i % 3 == 2) or (kind == "several constraints" and i % 2 == 1)
            given = circle and (kind == "arc of given radius" or i % 4 == 1)
            key = circle, slider, kind == "line, full rotation"
            if key not in sources:
                sources[key] = known_guides(rng, *key)
            g, m = next(sources[key])
            code = f"{'abcdefghi'[number]}{i + 1:02d}"
            rank, stroke = RANKS[(i + number) % 4], STROKES[(i + 2 * number) % 6]
            out.append(entry(rng, code, kind, rank, stroke, g, m, given))
            print(code, kind, f"{m.deviation:.1e} size {m.size:.2f} {m.min_transmission:.0f} deg", file=sys.stderr)
    return out


def unmet(entry: dict[str, Any]) -> dict[str, float]:
    """Return what the known linkage of a request breaks, and by how much, on a fine grid along one branch."""
    known, circle, turns = entry["known"], entry["kind"] == "circular-arc", "full_rotation" in entry["constraints"]
    m = measured(known["pivots"], known["guided"], entry["stroke"], circle=circle, radius=entry["radius"], turns=turns)
    if m is None:
        return {"path": 1.0}
    broken = violations(m, entry["constraints"], entry["deviation"], entry["stroke"])
    broken["cost"] = abs(cost(m, entry["rank_by"], entry["stroke"], turns) / known["cost"] - 1) - 1e-6
    broken["place"] = (m.off - 3 * entry["deviation"]) / entry["stroke"]
    broken["bulge"] = -1.0 if m.radius is None else -m.radius
    return {name: value for name, value in broken.items() if value > 0}


def main() -> None:
    """Print a list, or what is wrong with one."""
    parser = arguments()
    parser.add_argument("--check", type=Path, help="a list whose known linkages are to be measured again")
    parser.add_argument("--seed", type=int, default=SEED)
    given = parser.parse_args()
    if given.check is None:
        print("[\n" + ",\n".join(json.dumps(r) for r in requests(given.seed)) + "\n]")
        return
    entries = json.loads(given.check.read_text())
    wrong = {e["name"]: broken for e in entries if (broken := unmet(e))}
    print(f"{len(entries)} requests, {len(entries) - len(wrong)} met by their known linkages")
    for name, broken in wrong.items():
        print(name, broken)
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
