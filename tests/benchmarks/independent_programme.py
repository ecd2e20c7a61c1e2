"""Independent improvement of a guide for a request: what is ranked is made least while all constraints hold.

Nothing of it comes from `catalogue`.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from independent import (
    BAR,
    COARSE,
    FAMILIES,
    SLIDE,
    SLIDER,
    Array,
    Guides,
    Walk,
    better_driver,
    dot,
    posed,
    sines,
    strip,
    turning,
    walk,
)
from independent_figures import DESIRES, Figures, apart, boxed, cost, measured, outside, violations
from scipy.optimize import minimize

#: No link, frame or arm of what is searched is shorter than this part of the stroke.
FLOOR = 0.05
#: Least sagitta of an arc whose radius is free, in chords; largest (a half circle has 0.5).
SAGITTA = (1e-4, 0.43)
#: Bounds that are lengths, besides boxes.
LENGTHS = ("max_size", "max_link", "min_link", "max_ground", "min_ground", "max_arm", "max_travel", "min_allowance")
#: Part by which an allowance must exceed its bound: it is drawn, and known to one or two per cent.
DRAWN = 0.02
#: Parts of a score that are unknowns of their own, besides size and transmission angle.
WISHES = ("min_link", "ground", "travel")


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
        size, balance, transmission, deviation or score.
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
            if name in LENGTHS:
                bounds[name] = value / unit
            elif name.endswith("_in"):
                bounds[name] = [v / unit for v in value]
            elif name == "keep_out":
                bounds[name] = [[v / unit for v in box] for box in value]
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
        return bool(self.bounds.get("full_rotation") or self.bounds.get("min_transmission_turn"))

    @property
    def over_turn(self) -> bool:
        """Whether the transmission angle over the turn of a crank is ranked."""
        return self.turns and self.rank_by in ("balance", "transmission", "score")

    @property
    def scatters(self) -> bool:
        """Whether the allowance counts."""
        return "min_allowance" in self.bounds or self.rank_by == "score"

    def using(self, share: float) -> Task:
        """Return a task that uses a share of the deviation: what is left of it makes the allowance, which a programme
        does not know."""
        return replace(self, asked=share * self.asked)

    @property
    def families(self) -> list[str]:
        """Which families are to be searched."""
        pins = self.bounds.get("pins_only")
        return [f for f in self.bounds.get("families") or FAMILIES if f in FAMILIES and not (pins and f != BAR)]

    def measured(self, g: Guides, stations: int, draws: int = 1000) -> Figures | None:
        """Return the figures of one guide, in strokes."""
        return measured(
            *as_pivots(g), 1.0, circle=self.circle, radius=self.radius, turns=self.turns, stations=stations,
            tolerance=self.asked if self.scatters else None, draws=draws,
        )  # fmt: skip


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
Parts = dict[str, Array]


class Programme:
    """Improvement of one guide by sequential quadratic programming.

    Unknown are the pivots (of a slider or slide the angle of its normal), the height of the guided point, the sagitta
    if it is free, and bounds on what is ranked: size, transmission angle over 90 degrees, deviation over the one that
    is asked; for a score on its other parts.
    """

    def __init__(self, task: Task, family: str, second: bool, crank: int, stations: int = COARSE) -> None:
        """Begin: `second` says that the second crank drives, `crank` which one is to turn fully."""
        self.task, self.family, self.second, self.crank, self.stations = task, family, second, crank, stations
        self.free = task.sagitta is None
        self.count = (9 if family == BAR else 8) + self.free
        self.extras = 3 + (len(WISHES) if task.rank_by == "score" else 0)
        self.nearer = 0  # of the moving pivots to the guided point
        self.guess: Array | None = None  # angles at the ends of the path, of the last guide that was followed
        self._ends: Array = np.zeros((2, 1))

    def guides(self, x: Array) -> tuple[Guides, Array | float]:
        """Return the linkages and sagittas of unknowns (p, n)."""
        a, b = x[0] + 1j * x[1], x[2] + 1j * x[3]
        k = 8 if self.family == BAR else 7
        if self.family == SLIDER:
            c, d = np.exp(1j * x[4]), x[5] + 1j * x[6]
        else:
            c, d = x[4] + 1j * x[5], np.exp(1j * x[6]) if self.family == SLIDE else x[6] + 1j * x[7]
        return Guides(a, b, c, d, 0.5 + 1j * x[k], self.family), x[k + 1] if self.free else self.task.sagitta or 0.0

    def unknowns(self, g: Guides, sagitta: float) -> Array:
        """Return the unknowns of one guide."""
        parts = [g.a.real, g.a.imag, g.b.real, g.b.imag]
        parts += [np.angle(g.c)] if self.family == SLIDER else [g.c.real, g.c.imag]
        parts += [np.angle(g.d)] if self.family == SLIDE else [g.d.real, g.d.imag]
        parts += [g.p.imag, *([np.array([sagitta])] if self.free else [])]
        return np.concatenate(parts)

    def parts(self, x: Array) -> Parts | None:
        """Return errors, sines, lengths and whatever else is bounded, each (k, n), for unknowns (p, n); None if one of
        them cannot be followed."""
        task = self.task
        own, sagitta = self.guides(x)
        g = own.swapped(np.ones(len(own.p), bool)) if self.second else own
        way = walk(g, self.stations, self.guess)
        if not way.good.all():
            return None
        self._ends = way.ends
        poses = way.poses
        sine = sines(g, poses)[0]
        sine = sine * np.sign(sine[len(sine) // 2])
        some = slice(None, None, (self.stations - 1) // 4)
        slides = slid(g, way)[some]
        points, along = [*own.pivots, *slides], poses.p[some]
        far = [np.abs(p - q) for i, p in enumerate(points) for q in (*points[i + 1 :], *along)]
        out: dict[str, Any] = {
            "bent": error(poses.p, sagitta), "sine": sine, "far": far, "links": own.links, "frame": own.frame,
            "arms": own.arms, "slides": [*slides.real, *slides.imag],
        }  # fmt: skip
        if len(slides):
            run = [np.abs(p - q) for i, p in enumerate(slides) for q in slides[i + 1 :]]
            out["travel"] = run
        if task.turns:
            out["turns"] = self._turns(own)
            out["turn_sine"] = self._sines_in_line(own)
        if "max_rotation" in task.bounds:
            turn = np.unwrap(np.angle(poses.turn), axis=0)
            out["rotation"] = [np.degrees(turn.max(0) - turn.min(0)) / 90]
        if "min_drive_angle" in task.bounds or "max_drive_angle" in task.bounds:
            out["drive"] = [np.degrees(np.abs(way.ends[1] - way.ends[0])) / 90]
        if "min_uniformity" in task.bounds or "min_advantage" in task.bounds:
            speed = np.abs(poses.p_slope)
            out["uniformity"] = speed / speed.max(0)
            out["advantage"] = np.abs(g.b - g.a) / speed
        if "swept_in" in task.bounds or "keep_out" in task.bounds:
            ends = segments(g, way)
            if "swept_in" in task.bounds:
                out["swept"] = -outside(task.bounds["swept_in"], np.concatenate([ends[:, 0], ends[:, 1]]))
            gaps = [apart(box, ends[:, 0], ends[:, 1]) for box in task.bounds.get("keep_out", ())]
            if gaps:
                out["gaps"] = np.concatenate(gaps)
        return {name: np.array(v, float).reshape(-1, x.shape[1]) for name, v in out.items()}

    def _turns(self, g: Guides) -> list[Array]:
        """Return the four lengths that are positive if the crank turns fully, or two of a slider-crank, one of an
        inverted one."""
        near, far = self._reaches(g)
        if self.family == SLIDE:
            return [near - np.abs(dot(g.d, g.c - g.b))]
        bar = np.abs(g.d - g.b)
        if self.family == SLIDER:
            return [bar - near, bar - far]
        rocker = np.abs(g.d - g.c) if self.crank == 0 else np.abs(g.b - g.a)
        return [v for r in (near, far) for v in (bar + rocker - r, r - np.abs(bar - rocker))]

    def _sines_in_line(self, g: Guides) -> Array:
        """Return the sines of the transmission angles of the crank in line with the frame, or square to the line of the
        slider, where they are least, (2, n)."""
        bar, reaches = np.abs(g.d - g.b), np.stack(self._reaches(g))
        if self.family == SLIDE:
            cosine: Array = dot(g.d, g.c - g.b) / reaches
        elif self.family == SLIDER:
            cosine = reaches / bar
        else:
            rocker = np.abs(g.d - g.c) if self.crank == 0 else np.abs(g.b - g.a)
            cosine = (bar**2 + rocker**2 - reaches**2) / (2 * bar * rocker)
        sine: Array = np.sqrt(np.maximum(1 - cosine**2, 0))
        return sine

    def _reaches(self, g: Guides) -> tuple[Array, Array]:
        """Return the least and the largest distance of the crank's end from the other fixed pivot, or the line."""
        if self.family == SLIDER:
            off, r = (g.c.conj() * (g.d - g.a)).real, np.abs(g.b - g.a)
            return np.abs(off - r), np.abs(off + r)
        r, frame = np.abs(g.b - g.a) if self.crank == 0 else np.abs(g.d - g.c), np.abs(g.c - g.a)
        return np.abs(frame - r), frame + r

    def rows(self, parts: Parts, unit: float, extra: Array) -> Array:
        """Return what must not be negative, (q, n), given bounds on what is ranked, (3 or 6, n)."""
        size, angle, share = extra[:3]
        b, level = self.task.bounds, share * self.task.asked
        sine, links, frame, arms, bent = (parts[k] for k in ("sine", "links", "frame", "arms", "bent"))
        least, asked = np.sin(0.5 * np.pi * angle), np.sin(np.radians(b.get("min_transmission", 0.0)))
        out = [(level - bent) / unit, (level + bent) / unit, size - parts["far"],
               sine - (asked if self.task.over_turn else least), links - max(FLOOR, b.get("min_link", 0)),
               frame - max(FLOOR, b.get("min_ground", 0)), arms - FLOOR]  # fmt: skip
        if self.task.turns:
            out += [parts["turns"] - 1e-6,
                    parts["turn_sine"] - np.sin(np.radians(b.get("min_transmission_turn", 0.0)))]  # fmt: skip
        if self.task.over_turn:
            out.append(parts["turn_sine"] - least)
        for name, part in (("max_link", links), ("max_ground", frame), ("max_arm", arms[[self.nearer]]),
                           ("max_travel", parts.get("travel"))):  # fmt: skip
            if name in b and part is not None:
                out.append(b[name] - part)
        for name, key in (("max_rotation", "rotation"), ("max_drive_angle", "drive")):
            if name in b:
                out.append(b[name] / 90 - parts[key])
        for name, key, whole in (("min_drive_angle", "drive", 90), ("min_uniformity", "uniformity", 1),
                                 ("min_advantage", "advantage", 1)):  # fmt: skip
            if name in b:
                out.append(parts[key] - b[name] / whole)
        out += [parts[key] for key in ("swept", "gaps") if key in parts]
        if len(slides := parts["slides"]):
            for name in ("fixed_pivots_in", "pivots_in"):
                if name in b and (name == "pivots_in" or self.family == SLIDER):
                    x0, x1, y0, y1 = boxed(b[name])
                    x, y = np.split(slides, 2)
                    out += [x - x0, x1 - x, y - y0, y1 - y]
        if self.task.rank_by == "score":
            wishes = dict(zip(WISHES, extra[3:], strict=True))
            out += [links - wishes["min_link"], frame - wishes["ground"]]
            if "travel" in parts:
                out.append(wishes["travel"] - parts["travel"])
        return np.concatenate(out)

    def limits(self) -> list[tuple[float, float]]:
        """Return bounds of all unknowns."""
        task, wide = self.task, 30.0
        boxes = dict.fromkeys(("fixed", "moving"), (-wide, -wide, wide, wide))
        for key in ("fixed_pivots_in", "pivots_in"):
            box = task.bounds.get(key)
            if box is not None:
                x0, x1, y0, y1 = boxed(box)
                for name in ("fixed", "moving")[: 1 if key == "fixed_pivots_in" else 2]:
                    have = boxes[name]
                    boxes[name] = (max(have[0], x0), max(have[1], y0), min(have[2], x1), min(have[3], y1))
        sides = {k: [(v[0], v[2]), (v[1], v[3])] for k, v in boxes.items()}
        turn = [(-10.0, 10.0)]
        out = [*sides["fixed"], *sides["moving"], *(turn if self.family == SLIDER else sides["fixed"])]
        out += [*(turn if self.family == SLIDE else sides["moving"]), (-1.0, 1.0)]
        if self.free:
            out.append(SAGITTA)
        b = task.bounds
        least = b.get("min_transmission_turn" if task.over_turn else "min_transmission", 0.0) / 90
        out += [(1.0, b.get("max_size", wide)), (least, 1.0), (0.0, 1.0)]
        if task.rank_by == "score":
            out += [(min(DESIRES[name]), max(DESIRES[name])) for name in WISHES]
        return out

    def rise(self, y: Array, unit: float) -> tuple[float, Array]:
        """Return the cost of unknowns and bounds, and its slope."""
        n, rank, slope = self.count, self.task.rank_by, np.zeros(len(y))
        if rank == "score":
            total, names = 0.0, ("size", "transmission", *WISHES)
            for i, name in zip([n, n + 1, *range(n + 3, len(y))], names, strict=True):
                best, worst = DESIRES[name]
                scale = 90.0 if name == "transmission" else 1.0
                part = (y[i] * scale - worst) / (best - worst)
                if part >= 1:
                    continue
                held = max(part, 0.02)
                total -= np.log(held) - (held - part) / held
                slope[i] = -scale / (best - worst) / held
            return total / len(names), slope / len(names)
        slope[n] = rank in ("size", "balance")
        slope[n + 1] = -1.0 * (rank in ("transmission", "balance"))
        slope[n + 2] = self.task.asked / unit if rank == "deviation" else 0.0
        return float(slope @ y), slope

    def run(self, x: Array, rounds: int, tolerance: float, until: float = np.inf) -> Array | None:
        """Return better unknowns than these, with which the constraints hold to first order; None if it fails, or has
        not come to an end when `time.process_time` shows `until`."""
        n, more = self.count, self.extras
        self.guess = None
        first = self.parts(x[:, None])
        if first is None:
            return None
        arms = first["arms"][:, 0]
        self.nearer = int(np.argmin(arms))
        worst = float(np.abs(first["bent"]).max())
        unit = self.task.asked
        if self.task.rank_by == "deviation":
            unit = float(np.clip(worst, 1e-8, self.task.asked))
        limits = np.array(self.limits()).T
        ranked = first["turn_sine"] if self.task.over_turn else first["sine"]
        angle = np.degrees(np.arcsin(np.clip(ranked.min(), 0, 1))) / 90
        extra = [first["far"].max(), angle, worst / self.task.asked]
        if more > 3:
            run = first["travel"].max() if "travel" in first else DESIRES["travel"][0]
            extra += [first["links"].min(), first["frame"].min(initial=1.0), run]
        start = np.clip(np.concatenate([x, extra]), *limits)
        step = 1e-6

        nothing = self.rows(first, unit, start[n:, None])[:, 0] * 0 - 1e3  # where a path cannot be followed
        near = np.concatenate([np.eye(n), -np.eye(n)], axis=1)

        def followed(x: Array) -> Parts | None:
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
                return np.zeros((len(nothing), n + more))
            self.guess = self._ends
            value = self.rows(parts, unit, np.repeat(y[n:, None], 2 * n, axis=1))
            middle = {name: v[:, [0] * 2 * more] for name, v in parts.items()}
            both = step * np.concatenate([np.eye(more), -np.eye(more)], axis=1)
            moved = self.rows(middle, unit, y[n:, None] + both)
            return np.hstack([value[:, :n] - value[:, n:], moved[:, :more] - moved[:, more:]]) / (2 * step)

        sides: Any = {"type": "ineq", "fun": values, "jac": slopes}

        def cost_of(y: Array) -> float:
            return self.rise(y, unit)[0]

        def slope_of(y: Array) -> Array:
            return self.rise(y, unit)[1]

        with np.errstate(all="ignore"):
            try:
                found = minimize(
                    cost_of, start, jac=slope_of, method="SLSQP", bounds=limits.T.tolist(),
                    constraints=sides, options={"maxiter": rounds, "ftol": tolerance},
                )  # fmt: skip
            except (ValueError, OutOfTime):
                return None
        y = np.clip(found.x, *limits)
        return y[:n] if np.isfinite(y).all() else None


def slid(g: Guides, way: Walk) -> Array:
    """Return where the slide has been on its line, in mid-stroke, (m, n); of a four-bar (0, n)."""
    poses = way.poses
    if g.family == SLIDER:
        return poses.d
    return g.p + (g.c - poses.p) / poses.turn if g.family == SLIDE else poses.p[:0]


def segments(g: Guides, way: Walk) -> Array:
    """Return the ends of all segments of guides at the stations of a walk, as seen in the frame, (k, 2, n)."""
    poses, still = way.poses, np.ones_like(way.poses.p)
    pin = g.c * still if g.family == SLIDE else poses.d
    plate, more = [poses.b, pin, poses.p], [(g.a * still, poses.b)]
    if g.family == BAR:
        more.append((g.c * still, pin))
    else:
        at, column = slid(g, way), np.arange(len(g.p))
        run = dot(1j * (g.c if g.family == SLIDER else g.d), at)
        ends = [at[pick(run, axis=0), column] for pick in (np.argmin, np.argmax)]
        if g.family == SLIDER:
            more.append((ends[0] * still, ends[1] * still))
        else:
            plate += [poses.p + poses.turn * (end - g.p) for end in ends]
    every = [*more, *((p, q) for i, p in enumerate(plate) for q in plate[i + 1 :])]
    return np.concatenate([np.stack(pair, axis=1) for pair in every])


# -- laying and measuring what was found ------------------------------------------------------------------------------
def driven(g: Guides, turns: bool) -> tuple[Array, Walk]:
    """Return the same as `better_driver`; where a crank is to turn fully of that which is nearest to it."""
    if not turns or g.family != BAR:
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
    return Guides(g.a, now.b[0], g.c, now.d[0], now.p[0], g.family)


def as_pivots(g: Guides, stroke: float = 1.0) -> tuple[list[Any], list[float]]:
    """Return the pivots (2, 2, 3) and the guided point of one guide, in the unit of a stroke."""

    def at(z: Array, w: float = 1.0) -> list[float]:
        unit = stroke if w else 1.0
        return [float(z[0].real * unit), float(z[0].imag * unit), w]

    second = [at(g.c, float(g.family != SLIDER)), at(g.d, float(g.family != SLIDE))]
    return [[at(g.a), at(g.b)], second], at(g.p)[:2]


def worth(g: Guides, task: Task, draws: int = 1000) -> tuple[Figures | None, float, float]:
    """Return the figures of one guide, its largest violation of a task, and its cost, in strokes."""
    m = task.measured(g, 401, draws)
    if m is None:
        return None, np.inf, np.inf
    broken = violations(m, task.bounds, task.asked, 1.0)
    broken["floor"] = FLOOR - min(v for v in (m.min_link, m.ground, m.max_arm) if v is not None)
    if task.circle and (m.radius or 0.0) < 0:
        broken["bulge"] = 1.0
    broken["deviation"] /= task.asked  # relative
    if "min_allowance" in broken:
        broken["min_allowance"] = 1 + DRAWN - m.allowance / task.bounds["min_allowance"]
    return m, max(broken.values()), cost(m, task.rank_by, 1.0, task.turns, task.asked)


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
    programme = Programme(task, g.family, bool(use[0]), crank, stations)
    x = programme.run(programme.unknowns(g, sagitta), rounds, tolerance, until)
    if x is None:
        return None
    h, _ = programme.guides(x[:, None])
    return laid(h, task.circle)
