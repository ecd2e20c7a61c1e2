"""Independent improvement of a guide for a request: what is ranked is made least while all constraints hold.

Nothing of it comes from `catalogue`.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from independent import (
    COARSE,
    Array,
    Guides,
    Measured,
    Poses,
    Walk,
    cost,
    dot,
    least_angle,
    measured,
    posed,
    sines,
    strip,
    turning,
    violations,
    walk,
)
from scipy.optimize import minimize

#: No link, frame or arm of what is searched is shorter than this part of the stroke.
FLOOR = 0.05
#: Least sagitta of an arc whose radius is free, in chords; largest (a half circle has 0.5).
SAGITTA = (1e-4, 0.43)


# -- what is asked, in strokes ----------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Task:
    """A request, all lengths in strokes.

    Attributes
    ----------
    sagitta : float or None
        0 for a line; of the arc over its chord; None if its radius is free.
    asked : float
        Largest deviation.
    bounds : mapping
        Constraints by the names of `catalogue.Catalogue.find`.
    rank_by : str
        size, balance, transmission or deviation.
    """

    sagitta: float | None
    asked: float
    bounds: Mapping[str, Any]
    rank_by: str

    @classmethod
    def of(cls, entry: Mapping[str, Any]) -> Task:
        """Return the task of an entry of the list of requests."""
        unit, bounds = entry["stroke"], dict(entry["constraints"])
        for name, value in bounds.items():
            if name.startswith("max_") or name == "min_link":
                bounds[name] = value / unit
            elif name.endswith("_in"):
                bounds[name] = [v / unit for v in value]
        sagitta: float | None = 0.0
        if entry["kind"] != "straight-line":
            radius = entry["radius"]
            sagitta = None if radius is None else sagitta_of(radius / unit)
        return cls(sagitta, entry["deviation"] / unit, bounds, entry["rank_by"])

    @property
    def circle(self) -> bool:
        """Whether an arc is asked for."""
        return self.sagitta != 0

    @property
    def radius(self) -> float | None:
        """Of the arc, if it is given."""
        return None if not self.sagitta else radius_of(self.sagitta)

    @property
    def turns(self) -> bool:
        """Whether a crank is to turn fully."""
        return bool(self.bounds.get("full_rotation"))

    @property
    def over_turn(self) -> bool:
        """Whether the transmission angle over the turn of a crank is ranked."""
        return self.turns and self.rank_by in ("balance", "transmission")

    @property
    def kinds(self) -> tuple[bool, ...]:
        """Whether what is to be searched is a slider-crank: (False,), (True,) or both."""
        families = self.bounds.get("families") or ("four-bar", "slider-crank")
        allowed = [f == "slider-crank" for f in families if f in ("four-bar", "slider-crank")]
        return tuple(k for k in allowed if not (k and self.bounds.get("pins_only")))


def sagitta_of(radius: float) -> float:
    """Return the sagitta of an arc of chord 1 below a half circle."""
    return float(0.25 / (radius + np.sqrt(radius**2 - 0.25)))


def radius_of(sagitta: float) -> float:
    """Return the radius of an arc of chord 1."""
    return 0.5 * sagitta + 0.125 / sagitta


def error(path: Array, sagitta: Array | float) -> Array:
    """Return the signed distance of points from the line or arcs from (0, 0) to (1, 0), outward positive."""
    if np.ndim(sagitta) == 0 and sagitta == 0:
        return path.imag
    sagitta = np.asarray(sagitta)
    radius = 0.5 * sagitta + 0.125 / sagitta
    u, v = path.real - 0.5, path.imag - sagitta  # from the crown
    off: Array = (u * u + v * v + 2 * v * radius) / (np.hypot(u, v + radius) + radius)
    return off


class OutOfTime(Exception):
    """A search has had its time."""


# -- a programme ------------------------------------------------------------------------------------------------------
class Programme:
    """Improvement of one guide by sequential quadratic programming.

    Unknown are the pivots (of a slider the angle of its normal), the height of the guided point, the sagitta if it is
    free, and bounds on what is ranked: size, transmission angle over 90 degrees, deviation over the one that is asked.
    """

    def __init__(self, task: Task, slider: bool, second: bool, crank: int, stations: int = COARSE) -> None:
        """Begin: `second` says that the second crank drives, `crank` which one is to turn fully."""
        self.task, self.slider, self.second, self.crank, self.stations = task, slider, second, crank, stations
        self.free = task.sagitta is None
        self.count = (8 if slider else 9) + self.free
        self.nearer = 0  # of the moving pivots to the guided point
        self.guess: Array | None = None  # angles at the ends of the path, of the last guide that was followed
        self._ends: Array = np.zeros((2, 1))

    def guides(self, x: Array) -> tuple[Guides, Array | float]:
        """Return the linkages and sagittas of unknowns (p, n)."""
        a, b = x[0] + 1j * x[1], x[2] + 1j * x[3]
        if self.slider:
            c, d, k = np.exp(1j * x[4]), x[5] + 1j * x[6], 7
        else:
            c, d, k = x[4] + 1j * x[5], x[6] + 1j * x[7], 8
        return Guides(a, b, c, d, 0.5 + 1j * x[k], self.slider), x[k + 1] if self.free else self.task.sagitta or 0.0

    def unknowns(self, g: Guides, sagitta: float) -> Array:
        """Return the unknowns of one guide."""
        parts = [g.a.real, g.a.imag, g.b.real, g.b.imag]
        parts += [np.angle(g.c)] if self.slider else [g.c.real, g.c.imag]
        parts += [g.d.real, g.d.imag, g.p.imag, *([np.array([sagitta])] if self.free else [])]
        return np.concatenate(parts)

    def parts(self, x: Array) -> tuple[Array, ...] | None:
        """Return errors, sines, distances, links, frame, arms and margins of turning for unknowns (p, n); None if one
        of them cannot be followed."""
        g, sagitta = self.guides(x)
        if self.second:
            g = g.swapped(np.ones(len(g.p), bool))
        way = walk(g, self.stations, self.guess)
        if not way.good.all():
            return None
        self._ends = way.ends
        sine = sines(g, way.poses)[0]
        sine = sine * np.sign(sine[len(sine) // 2])
        pivots = [g.a, g.b, g.d] if self.slider else [g.a, g.b, g.c, g.d]
        along = way.poses.p[:: (len(way.poses.p) - 1) // 4]
        far = [np.abs(p - q) for i, p in enumerate(pivots) for q in (*pivots[i + 1 :], *along)]
        links = [np.abs(g.b - g.a), np.abs(g.d - g.b)] + ([] if self.slider else [np.abs(g.d - g.c)])
        frame = [] if self.slider else [np.abs(g.c - g.a)]
        arms = [np.abs(g.p - g.b), np.abs(g.p - g.d)]
        turns: list[Array] = []
        if self.task.turns:
            turns = self._turns(self.guides(x)[0])
        if self.task.over_turn:
            sine = np.concatenate([sine, self._sines_in_line(self.guides(x)[0])])
        return tuple(np.array(v).reshape(-1, x.shape[1]) for v in (error(way.poses.p, sagitta), sine, far, links, frame,
                                                                   arms, turns))  # fmt: skip

    def _turns(self, g: Guides) -> list[Array]:
        """Return the four lengths that are positive if the crank turns fully, or two of a slider-crank."""
        bar, (near, far) = np.abs(g.d - g.b), self._reaches(g)
        if self.slider:
            return [bar - near, bar - far]
        rocker = np.abs(g.d - g.c) if self.crank == 0 else np.abs(g.b - g.a)
        return [v for r in (near, far) for v in (bar + rocker - r, r - np.abs(bar - rocker))]

    def _sines_in_line(self, g: Guides) -> Array:
        """Return the sines of the transmission angles of the crank in line with the frame, or square to the line of the
        slider, where they are least, (2, n)."""
        bar, reaches = np.abs(g.d - g.b), np.stack(self._reaches(g))
        if self.slider:
            cosine: Array = reaches / bar
        else:
            rocker = np.abs(g.d - g.c) if self.crank == 0 else np.abs(g.b - g.a)
            cosine = (bar**2 + rocker**2 - reaches**2) / (2 * bar * rocker)
        sine: Array = np.sqrt(np.maximum(1 - cosine**2, 0))
        return sine

    def _reaches(self, g: Guides) -> tuple[Array, Array]:
        """Return the least and the largest distance of the crank's end from the other fixed pivot, or the line."""
        if self.slider:
            off, r = (g.c.conj() * (g.d - g.a)).real, np.abs(g.b - g.a)
            return np.abs(off - r), np.abs(off + r)
        r, frame = np.abs(g.b - g.a) if self.crank == 0 else np.abs(g.d - g.c), np.abs(g.c - g.a)
        return np.abs(frame - r), frame + r

    def rows(self, parts: tuple[Array, ...], unit: float, extra: Array) -> Array:
        """Return what must not be negative, (q, n), given size, transmission and deviation as bounds, (3, n)."""
        bent, sine, far, links, frame, arms, turns = parts
        size, angle, share = extra
        b, level = self.task.bounds, share * self.task.asked
        least = np.repeat(np.sin(0.5 * np.pi * angle)[None], len(sine), axis=0)
        if self.task.over_turn:  # over the stroke only what is asked there
            least[:-2] = np.sin(np.radians(b.get("min_transmission", 0.0)))
        out = [(level - bent) / unit, (level + bent) / unit, size - far, sine - least,
               links - max(FLOOR, b.get("min_link", 0)), frame - FLOOR, arms - FLOOR]  # fmt: skip
        if "max_link" in b:
            out.append(b["max_link"] - links)
        if "max_ground" in b:
            out.append(b["max_ground"] - frame)
        if "max_arm" in b:
            out.append(b["max_arm"] - arms[[self.nearer]])
        out.append(turns - 1e-6)
        return np.concatenate(out)

    def limits(self) -> list[tuple[float, float]]:
        """Return bounds of all unknowns."""
        task, wide = self.task, 30.0
        boxes = dict.fromkeys(("fixed", "moving"), (-wide, -wide, wide, wide))
        for key in ("fixed_pivots_in", "pivots_in"):
            box = task.bounds.get(key)
            if box is not None:
                x0, x1, y0, y1 = *sorted(box[::2]), *sorted(box[1::2])
                for name in ("fixed", "moving")[: 1 if key == "fixed_pivots_in" else 2]:
                    have = boxes[name]
                    boxes[name] = (max(have[0], x0), max(have[1], y0), min(have[2], x1), min(have[3], y1))
        sides = {k: [(v[0], v[2]), (v[1], v[3])] for k, v in boxes.items()}
        second = [(-10.0, 10.0)] if self.slider else sides["fixed"]
        out = [*sides["fixed"], *sides["moving"], *second, *sides["moving"], (-1.0, 1.0)]
        if self.free:
            out.append(SAGITTA)
        b = task.bounds
        least = 0.0 if task.over_turn else b.get("min_transmission", 0.0) / 90
        return [*out, (1.0, b.get("max_size", wide)), (least, 1.0), (0.0, 1.0)]

    def run(self, x: Array, rounds: int, tolerance: float, until: float = np.inf) -> Array | None:
        """Return better unknowns than these, with which the constraints hold to first order; None if it fails, or has
        not come to an end when `time.process_time` shows `until`."""
        n, rank = self.count, self.task.rank_by
        self.guess = None
        first = self.parts(x[:, None])
        if first is None:
            return None
        self.nearer = int(first[5][1, 0] < first[5][0, 0])
        worst = float(np.abs(first[0]).max())
        unit = self.task.asked if rank != "deviation" else float(np.clip(worst, 1e-8, self.task.asked))
        slope = np.zeros(n + 3)
        slope[n] = rank in ("size", "balance")
        slope[n + 1] = -1.0 * (rank in ("transmission", "balance"))
        slope[n + 2] = self.task.asked / unit if rank == "deviation" else 0.0
        limits = np.array(self.limits()).T
        ranked = first[1][-2:] if self.task.over_turn else first[1]
        angle = np.degrees(np.arcsin(np.clip(ranked.min(), 0, 1))) / 90
        start = np.clip(np.concatenate([x, [first[2].max(), angle, worst / self.task.asked]]), *limits)
        step = 1e-6

        nothing = self.rows(first, unit, start[n:, None])[:, 0] * 0 - 1e3  # where a path cannot be followed
        near = np.concatenate([np.eye(n), -np.eye(n)], axis=1)

        def followed(x: Array) -> tuple[Array, ...] | None:
            """Return the parts, beginning from where the ends of the path were last."""
            if self.guess is not None:
                self.guess = np.repeat(self.guess[:, :1], x.shape[1], axis=1)
            parts = self.parts(x)
            if parts is None and self.guess is not None:
                self.guess = None
                parts = self.parts(x)
            return parts

        def values(y: Array) -> Array:
            if time.process_time() > until:
                raise OutOfTime
            parts = followed(y[:n, None])
            return nothing if parts is None else self.rows(parts, unit, y[n:, None])[:, 0]

        def slopes(y: Array) -> Array:
            parts = followed(y[:n, None] + step * near)
            if parts is None:
                return np.zeros((len(nothing), n + 3))
            self.guess = self._ends
            value = self.rows(parts, unit, np.repeat(y[n:, None], 2 * n, axis=1))
            middle = tuple(v[:, [0] * 6] for v in parts)
            moved = self.rows(middle, unit, y[n:, None] + step * np.concatenate([np.eye(3), -np.eye(3)], axis=1))
            return np.hstack([value[:, :n] - value[:, n:], moved[:, :3] - moved[:, 3:]]) / (2 * step)

        def rise(y: Array) -> float:
            return float(slope @ y)

        def gradient(_: Array) -> Array:
            return slope

        sides: Any = {"type": "ineq", "fun": values, "jac": slopes}
        with np.errstate(all="ignore"):
            try:
                found = minimize(
                    rise, start, jac=gradient, method="SLSQP", bounds=limits.T.tolist(),
                    constraints=sides,
                    options={"maxiter": rounds, "ftol": tolerance},
                )  # fmt: skip
            except (ValueError, OutOfTime):
                return None
        y = np.clip(found.x, *limits)
        return y[:n] if np.isfinite(y).all() else None


# -- laying and measuring what was found ------------------------------------------------------------------------------
def better_driver(g: Guides) -> tuple[Array, Walk]:
    """Return which guides are better driven by their second crank, and how they go by the better one."""
    first = walk(g)
    if g.slider:
        return np.zeros(len(g.p), bool), first
    second = walk(g.swapped(np.ones(len(g.p), bool)))
    angles = [np.where(w.good, least_angle(np.nan_to_num(sines(h, w.poses)[0])), -1.0)
              for h, w in ((g, first), (g.swapped(np.ones(len(g.p), bool)), second))]  # fmt: skip
    use = angles[1] > angles[0]
    names = ("b", "d", "p", "p_slope")
    poses = Poses(*(np.where(use, getattr(second.poses, k), getattr(first.poses, k)) for k in names))
    return use, Walk(np.where(use, second.ends, first.ends), poses, np.where(use, second.good, first.good))


def driven(g: Guides, turns: bool) -> tuple[Array, Walk]:
    """Return the same; where a crank is to turn fully of that which is nearest to it."""
    if not turns or g.slider:
        return better_driver(g)
    use = np.argmax(turning(g), axis=0) == 1
    return use, walk(g.swapped(use))


def laid(g: Guides, circle: bool) -> Guides | None:
    """Return one guide laid so that its path runs from (0, 0) to (1, 0), in mid-stroke; None if that fails.

    Of a line the middle of the narrowest strip lies on the x axis, of an arc the ends of the path do.
    """
    second = bool(better_driver(g)[0][0])
    for _ in range(5):
        h = g.swapped(np.array([second])) if second else g
        way = walk(h, 401)
        if not way.good[0]:
            return None
        path = way.poses.p[:, 0]
        if circle:
            start, along = path[0], (path[-1] - path[0]) / abs(path[-1] - path[0])
        else:
            _, middle, along = strip(path)
            start = middle + along * dot(along, path[0] - middle)
        g = posed_at(h.moved(np.conj(along), -start * np.conj(along)), 0.5)
        g = g.swapped(np.array([second])) if second else g
    return g


def posed_at(g: Guides, x: float) -> Guides:
    """Return the guides with the guided point at an x."""
    angle = np.zeros((1, len(g.p)))
    now = posed(g, angle)
    with np.errstate(all="ignore"):
        for _ in range(8):
            angle = angle + (x - now.p.real) / now.p_slope.real
            now = posed(g, angle)
    return Guides(g.a, now.b[0], g.c, now.d[0], now.p[0], g.slider)


def as_pivots(g: Guides, stroke: float = 1.0) -> tuple[list[Any], list[float]]:
    """Return the pivots (2, 2, 3) and the guided point of one guide, in the unit of a stroke."""

    def at(z: Array, w: float = 1.0) -> list[float]:
        unit = stroke if w else 1.0
        return [float(z[0].real * unit), float(z[0].imag * unit), w]

    return [[at(g.a), at(g.b)], [at(g.c, 0.0 if g.slider else 1.0), at(g.d)]], at(g.p)[:2]


def worth(g: Guides, task: Task) -> tuple[Measured | None, float, float]:
    """Return the measures of one guide, its largest violation of a task, and its cost, in strokes."""
    pivots, guided = as_pivots(g)
    m = measured(pivots, guided, 1.0, circle=task.circle, radius=task.radius, turns=task.turns, stations=401)
    if m is None:
        return None, np.inf, np.inf
    broken = violations(m, task.bounds, task.asked, 1.0)
    broken["floor"] = FLOOR - min(v for v in (m.min_link, m.max_ground, m.max_arm) if v is not None)
    if task.circle and (m.radius or 0.0) < 0:
        broken["bulge"] = 1.0
    broken["deviation"] /= task.asked  # relative
    return m, max(broken.values()), cost(m, task.rank_by, 1.0, task.turns)


def improved(
    g: Guides,
    task: Task,
    sagitta: float = 0.0,
    rounds: int = 60,
    tolerance: float = 1e-6,
    stations: int = COARSE,
    until: float = np.inf,
) -> Guides | None:
    """Return one guide improved for a task, laid; None if it fails."""
    use, way = driven(g, task.turns)
    if not way.good[0]:
        return None
    crank = int(np.nanargmax(turning(g)[:, 0]))
    programme = Programme(task, g.slider, bool(use[0]), crank, stations)
    x = programme.run(programme.unknowns(g, sagitta), rounds, tolerance, until)
    if x is None:
        return None
    h, _ = programme.guides(x[:, None])
    return laid(h, task.circle)
