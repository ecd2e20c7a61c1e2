"""Jobs for the comparison of error with run time: what is asked, and what a linkage is truly worth.

A linkage is a vector x: of the free jobs x and y of A1, A1*, A2, A2* with the guided point in (0, 0), in mid-stroke,
the path lying as it likes; with given fixed pivots x and y of A1*, A2*, and y of the guided point, the path running
from (0, 0) to (1, 0).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from catalogue import CircularArc, StraightLine
from catalogue.guidance.coupler_curve import CouplerCurve, coupler_curve
from catalogue.guidance.drive import drive_metrics
from catalogue.guidance.fixed_nominal import Nominal, in_place
from catalogue.guidance.metrics import measure
from catalogue.guidance.minimum_zone import grid, minimum_zone
from catalogue.guidance.placement import at_stroke
from catalogue.guidance.trace import Traced
from catalogue.kinematics.linkage import Linkage

Array = np.ndarray[Any, Any]
#: Positions of the crank that a plain objective looks at, and how far it turns to either side [rad].
POSITIONS, TURN = 241, 1.75
#: Places along the stroke at which errors are taken by those that want equally many of them each time.
STATIONS = 0.5 * chebyshev.chebpts2(33)
FIXED = ((-0.3, 0.5), (1.1, -0.8))


@dataclass(frozen=True)
class Job:
    """What is asked of a four-bar: a request of stroke 1 and constraints, all in strokes."""

    name: str
    text: str
    request: Any
    constraints: dict[str, Any]
    size: float

    @property
    def fixed(self) -> Any:
        """The given fixed pivots, if there are such."""
        return self.constraints.get("fixed_pivots")

    @property
    def bounds(self) -> list[tuple[float, float]]:
        """Of the vector x."""
        if self.fixed:
            return [(-self.size, self.size)] * 4 + [(-0.2, 0.2)]
        return [(-self.size, self.size)] * 8

    def linkages(self, x: Array) -> tuple[Array, Array]:
        """Return pivots (n, 2, 2, 3) and guided points (n,) of vectors (p, n)."""
        pivots = np.ones((x.shape[1], 2, 2, 3))
        if not self.fixed:
            pivots[..., :2] = x.T.reshape(-1, 2, 2, 2)
            return pivots, np.zeros(x.shape[1], complex)
        pivots[:, :, 0, :2], pivots[:, :, 1, :2] = self.fixed, x[:4].T.reshape(-1, 2, 2)
        return pivots, 0.5 + 1j * x[4]


JOBS = (
    Job("a", "wide: stroke 1, fixed pivots, sides and arm at most 4", StraightLine(1, 0.01),
        {"max_ground": 4.0, "max_link": 4.0, "max_arm": 4.0}, 6.0),
    Job("b", "compact: the same with 1.5, transmission angle at least 40 degrees", StraightLine(1, 0.01),
        {"max_ground": 1.5, "max_link": 1.5, "max_arm": 1.5, "min_transmission": 40.0}, 2.5),
    Job("c", "both fixed pivots given, at (-0.3, 0.5) and (1.1, -0.8)", StraightLine(1, 0.01),
        {"fixed_pivots": FIXED, "max_link": 4.0, "max_arm": 4.0}, 4.0),
    Job("d", "arc of radius 1 over 60 degrees, all pivots in a box of 3 x 3", CircularArc(1, 0.01, 1),
        {"pivots_in": (-1.0, -1.5, 2.0, 1.5)}, 2.0),
    Job("e", "as (a), a crank turns fully, the straight part is 40 per cent of its turn", StraightLine(1, 0.05),
        {"max_ground": 4.0, "max_link": 4.0, "max_arm": 4.0, "full_rotation": True, "min_drive_angle": 144.0}, 4.0),
    Job("f", "all pivots in a box of 2 x 1.5 about the path, transmission angle at least 35 degrees",
        StraightLine(1, 0.01), {"pivots_in": (-0.5, -0.2, 1.5, 1.3), "min_transmission": 35.0}, 2.0),
    Job("g", "arc of exactly radius 0.8, size at most 2, transmission angle at least 30 degrees",
        CircularArc(1, 0.01, 0.8), {"max_size": 2.0, "min_transmission": 30.0}, 2.0),
    Job("h", "a crank turns fully, size at most 3", StraightLine(1, 0.01),
        {"full_rotation": True, "max_size": 3.0}, 3.0),
)  # fmt: skip


# -- the truth --------------------------------------------------------------------------------------------------------
def measured(job: Job, x: Array) -> Array:
    """Return the deviations (n,) of linkages x (p, n) over a stroke of 1, on their finite motion.

    Plus 1 for each constraint that is not met; 10 where the stroke is not reached."""
    pivots, point = job.linkages(x)
    linkage, valid = Linkage.valid(pivots)
    out = np.full(len(pivots), 10.0)
    circle = job.request.kind == "circle"
    with np.errstate(all="ignore"):
        guides = coupler_curve(linkage, point[valid])
        traced = (
            in_place(guides, Nominal(1.0))
            if job.fixed
            else at_stroke(guides, 1.0, circle=circle, nodes=16, extend=False)
        )
        m = measure(guides, traced, turning=bool(job.constraints.get("full_rotation")))
        c, deviation = job.constraints, exactly(job, guides, traced) if circle else traced.fit.deviation
        lengths = [(m.max_ground, "max_ground"), (m.max_link, "max_link"), (m.max_arm, "max_arm"), (m.size, "max_size")]
        broken = sum(1.0 * ~(value <= c[name]) for value, name in lengths if name in c) + np.zeros(len(linkage))
        broken += ~(m.min_transmission >= c.get("min_transmission", 0.0))
        broken += ~(m.max_arm >= 0.05)
        if "full_rotation" in c:
            broken += ~(m.rotates > 0)
        if "min_drive_angle" in c:
            broken += ~(drive_metrics(guides, traced, m).drive_angle >= c["min_drive_angle"])
        if "pivots_in" in c:
            up = np.where(traced.fit.curvature > 0, -1.0, 1.0)[:, None]  # the arc is to bulge to +y
            flips = [(1, up)] if circle else [(1, 1), (-1, 1), (1, -1), (-1, -1)]
            broken += ~np.any([within(m.box * np.hstack([x + 0 * up, y + 0 * up] * 2), c["pivots_in"])
                               for x, y in flips], axis=0)  # fmt: skip
        value = np.where(np.isfinite(deviation), deviation + broken, 10.0)
    out[valid] = value
    return out


def exactly(job: Job, guides: CouplerCurve, traced: Traced) -> Array:
    """Return the deviations from the best-placed arc of exactly the radius asked for, bent as the path is."""
    u, v = guides.path.window(traced.low, traced.high, grid(16).nodes)
    held = np.copysign(1 / job.request.radius, traced.fit.curvature)
    return np.asarray(minimum_zone(u, v, True, grid(16), held).deviation)


def within(box: Array, region: tuple[float, float, float, float]) -> Array:
    """Return which boxes (n, 4) of two corners each, from mid-stroke, lie in a region that is given from the start."""
    x0, y0, x1, y1 = region
    (low_x, high_x), (low_y, high_y) = (np.sort(box[:, i::2], axis=1).T for i in (0, 1))
    return np.asarray((low_x >= x0 - 0.5) & (high_x <= x1 - 0.5) & (low_y >= y0) & (high_y <= y1))


# -- as one would write it --------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Path:
    """A path sampled at crank angles: the part of it within the stroke, and by how much constraints are broken."""

    u: Array
    v: Array
    reach: float
    broken: float


def sampled(job: Job, x: Array) -> Path:
    """Return the sampled path of one linkage about its reference position."""
    pivots, points = job.linkages(x[:, None])
    (a, m), (b, k) = (pivots[0, ..., 0] + 1j * pivots[0, ..., 1]).tolist()
    point, c = complex(points[0]), job.constraints
    angle = np.linspace(-TURN, TURN, POSITIONS)
    with np.errstate(all="ignore"):
        first = a + (m - a) * np.exp(1j * angle)
        base, r, s = b - first, abs(k - m), abs(k - b)
        along = (np.abs(base) ** 2 + r * r - s * s) / (2 * np.abs(base))
        across = np.sqrt(r * r - along**2)
        side = np.sign(((b - m).conjugate() * (k - m)).imag)
        second = first + (along + 1j * side * across) * base / np.abs(base)
        path = first + (second - first) / (k - m) * (point - m)
        middle = POSITIONS // 2
        tangent = path[middle + 1] - path[middle - 1]
        w = path - 0.5 if job.fixed else (path - point) * np.conj(tangent) / abs(tangent)
        w = w if w.real[middle + 1] > w.real[middle - 1] else w[::-1]
    inside = np.isfinite(w) & (np.abs(w.real) <= 0.5)
    low, high = middle, middle
    while low > 0 and inside[low - 1] and w.real[low - 1] < w.real[low]:
        low -= 1
    while high < POSITIONS - 1 and inside[high + 1] and w.real[high + 1] > w.real[high]:
        high += 1
    reach = w.real[high] - w.real[low] if high > low else 0.0
    u, v = w.real[low : high + 1], w.imag[low : high + 1]
    links = [abs(m - a), abs(k - b), abs(m - k)]
    broken = max(0.0, *(n - c["max_link"] for n in links)) if "max_link" in c else 0.0
    broken += max(0.0, abs(a - b) - c["max_ground"]) if "max_ground" in c else 0.0
    broken += max(0.0, min(abs(m - point), abs(k - point)) - c["max_arm"]) if "max_arm" in c else 0.0
    if "min_transmission" in c:
        p, q = second[low : high + 1] - first[low : high + 1], second[low : high + 1] - b
        sine = np.abs((p.conj() * q).imag) / np.abs(p) / np.abs(q)
        broken += max(0.0, np.sin(np.radians(c["min_transmission"])) - sine.min())
    if "max_size" in c:
        every = np.array([a, m, b, k, path[low], path[high]])
        broken += max(0.0, float(np.abs(every[:, None] - every).max()) - c["max_size"])
    if "min_drive_angle" in c:
        broken += max(0.0, np.radians(c["min_drive_angle"]) - (angle[1] - angle[0]) * (high - low))
    if "full_rotation" in c:
        ordered = sorted([*links, abs(a - b)])
        broken += max(0.0, ordered[0] + ordered[3] - ordered[1] - ordered[2]) + max(0.0, links[0] - ordered[0])
    if "pivots_in" in c:
        with np.errstate(all="ignore"):
            turn = np.conj(tangent) / abs(tangent)
        p = (np.array([a, m, b, k]) - point) * turn
        x0, y0, x1, y1 = c["pivots_in"]
        flips = [p, -p.conj()] if job.request.kind == "circle" else [p, -p.conj(), p.conj(), -p]
        broken += min(
            (np.maximum(np.abs(q.real + 0.5 - 0.5 * (x0 + x1)) - 0.5 * (x1 - x0), 0)
             + np.maximum(np.abs(q.imag - 0.5 * (y0 + y1)) - 0.5 * (y1 - y0), 0)).sum()
            for q in flips
        )  # fmt: skip
    return Path(u, v, float(np.nan_to_num(reach)), float(np.nan_to_num(broken, nan=10.0)))


def errors(job: Job, u: Array, v: Array) -> Array:
    """Return the errors of a path that leave the nominal its freedom: none where it is given."""
    if job.fixed:
        return v
    if job.request.kind == "circle":
        v, degree = np.abs(u + 1j * v - 1j * job.request.radius) - job.request.radius, 0
        return np.asarray(v - np.polyval(np.polyfit(u, v, degree), u))
    return np.asarray(v - np.polyval(np.polyfit(u, v, 1), u))


def plain(job: Job, x: Array) -> float:
    """Return the deviation of the sampled path over a stroke of 1, with penalties."""
    path = sampled(job, x)
    if not path.reach > 0.95:
        return 10.0 - path.reach
    found = errors(job, path.u, path.v)
    return float((np.abs(found).max() if job.fixed else 0.5 * np.ptp(found)) + path.broken)
