"""Sample random mechanisms, assembled by construction, and find what their bodies guide.

The body and its pose come first; each guide is then placed through its point. Half of the
mechanisms have guides of well-known kinds, the others guides of any kind. In some, points of the
body coincide, so that the smaller series are sampled as degenerations of the larger ones. The first
driver is an angle; two and three drivers move along a straight path, in a random ratio, so that
every specimen has one degree of freedom left.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catalogue.plugin import LENGTH, Array, Specimen
from catalogue.spatial import Guides, Mechanisms, Positions, follow, matrix, quaternion

from .classification import classified
from .measures import METRICS, Motion, fitted, known, numbers, run
from .minimum_zone import unit
from .plain_data import Strokes, plain
from .straightest_point import GAPS, POINT_SEARCH, WINDOWS, best

SURFACES = ("cylinder", "cone", "hyperboloid:sinh", "torus", "sphere", "plane")
CURVES = ("circle", "helix", "line")
#: Guides of each class, curves (c) before surfaces (s), and its degrees of freedom.
CLASSES = {
    "I": ("sssss", 1),
    "II": ("csss", 1),
    "III": ("ccs", 1),
    "IV": ("ssss", 2),
    "V": ("css", 2),
    "VI": ("sss", 3),
}
#: Well-known kinds of guides.
KNOWN: dict[str, tuple[tuple[str, ...], ...]] = {
    "I": (("sphere",) * 5, ("sphere", "sphere", "sphere", "plane", "plane"), ("cylinder",) * 5),
    "II": (("circle", "sphere", "sphere", "sphere"), ("circle", "plane", "plane", "plane")),
    "III": (
        ("circle", "circle", "cylinder"),
        ("circle", "circle", "sphere"),
        ("circle", "circle", "plane"),
        ("circle", "line", "plane"),
    ),
    "IV": (("sphere",) * 4, ("sphere", "sphere", "plane", "plane")),
    "V": (("circle", "sphere", "sphere"), ("circle", "plane", "plane")),
    "VI": (("sphere",) * 3, ("plane",) * 3),
}
#: Points that coincide with an earlier one, as (later, earlier), by the resulting series.
COINCIDENCES: dict[str, dict[str, tuple[tuple[int, int], ...]]] = {
    "I": {"1.11111": (), "1.2111": ((2, 1),), "1.221": ((2, 1), (4, 3)), "1.311": ((2, 1), (3, 1))},
    "II": {"1.2111": (), "1.221": ((2, 1),)},
    "III": {"1.221": ()},
    "IV": {"2.1111": (), "2.211": ((3, 2),)},
    "V": {"2.211": ()},
    "VI": {"3.111": ()},
}


class Drawing(NamedTuple):
    """Limits of the drives, and of the stored strokes."""

    farthest: float = 2.5  #: range of the first driver either way [rad]
    margin: float = 0.04  #: fraction of a motion omitted at either end
    deviation: float = 0.05  #: largest deviation [strokes]
    condition: float = 1000.0  #: largest condition number of the position equations
    size: float = 30.0  #: largest size [strokes]
    #: Deviation below which a guided curve is trivial [strokes]: a guide itself keeps the point on
    #: it.
    trivial: float = 1e-6


DRAWING = Drawing()


def draw(family: str, rng: np.random.Generator, count: int) -> list[Specimen]:
    """Find the lines and circles guided by `count` random mechanisms of a class.

    Up to three windows of the motion give a specimen each.
    """
    m, at, flat = mechanisms(family, rng, count)
    ratio = np.concatenate([np.ones((count, 1)), rng.uniform(-1, 1, (count, m.freedom - 1))], axis=1)
    q = np.stack([at[:, i, "uw".index(k)] for i, k in m.drivers], axis=1)
    both = np.tile(np.arange(count), 2)
    direction = np.repeat([-DRAWING.farthest, DRAWING.farthest], count)
    moved = follow(m[both], np.stack([q[both], q[both] + direction[:, None] * ratio[both]], axis=1), at[both])
    low, high = (direction * moved.end).reshape(2, count)
    sound = (moved.reached > 0).reshape(2, count).all(0)
    margin = DRAWING.margin * (high - low)
    low, high = low + margin, high - margin
    sound &= (high - low > 0.2) & (low < 0) & (high > 0)
    m, at, flat, q, ratio = m[sound], at[sound], flat[sound], q[sound], ratio[sound]
    low, high = low[sound], high[sound]
    if not len(low):
        return []
    back = follow(m, np.stack([q, q + low[:, None] * ratio], axis=1), at)
    share = low[:, None] + (high - low)[:, None] * np.linspace(0, 1, POINT_SEARCH.whole + 1)
    path = q[:, None] + share[:, :, None] * ratio[:, None]
    moved = follow(m, path, back.node(1))
    whole = np.flatnonzero(moved.reason == "")
    if not len(whole):
        return []
    positions = moved.positions[(whole[:, None] * (POINT_SEARCH.whole + 1) + np.arange(POINT_SEARCH.whole + 1)).ravel()]
    return _specimens(m[whole], path[whole], positions, flat[whole])


def _specimens(m: Mechanisms, path: Array, positions: Positions, flat: Array) -> list[Specimen]:
    n = len(m)
    rotation = np.moveaxis(matrix(positions.quaternion.T), 2, 0).reshape(n, -1, 3, 3)
    translation = positions.translation.reshape(n, -1, 3)
    found: list[tuple[Array, ...]] = []  # mechanism, point, first and last node, and whether the curve is a circle
    for circles, kind in enumerate(GAPS):
        tried = best(rotation, translation, kind, m.body.mean(1), m.diameter, exactly_guided_points(m, kind), flat)
        for (length, _), (point, first, gap) in zip(WINDOWS, tried, strict=True):
            good = np.flatnonzero(gap < 2 * DRAWING.deviation)
            found.append((good, point[good], first[good], first[good] + length, np.full(len(good), circles)))
    index, point, first, last, circles_ = (np.concatenate(column) for column in zip(*found, strict=True))
    coordinates = positions.coordinates.reshape(n, POINT_SEARCH.whole + 1, -1, 2)
    ends = np.stack([path[index, first], path[index, last]], axis=1)
    given = Strokes(m[index], ends, coordinates[index, first], point)
    motion = run(given)
    out = []
    for circles, kind in enumerate(GAPS):
        some = np.flatnonzero((circles_ == circles) & (motion.reason == ""))
        if len(some):
            out += _specimens_of_strokes(given[some], motion[some], kind)
    return out


def _specimens_of_strokes(given: Strokes, motion: Motion, kind: str) -> list[Specimen]:
    """Make specimens of the strokes whose deviation and metrics are within the limits.

    Their paths run from (0, 0, 0) to (1, 0, 0).
    """
    fit = fitted(motion, kind)
    values = numbers(given, motion, fit)
    relative = (fit.deviation + motion.missed) / fit.stroke
    fair = (
        (relative > DRAWING.trivial)
        & (relative <= DRAWING.deviation)
        & (values["condition"] <= DRAWING.condition)
        & known(motion, fit)
    )
    fair &= (values["size"] <= DRAWING.size * fit.stroke) & (values["uniformity"] > 0)
    keep = np.flatnonzero(fair)
    if not len(keep):
        return []
    placed = given[keep].moved(1 / fit.stroke[keep], fit.axes[keep], fit.start[keep])
    out = []
    for j, data, tags in zip(keep, plain(placed), classified(placed.mechanisms), strict=True):
        unit_of = {name: fit.stroke[j] if metric.unit == LENGTH else 1.0 for name, metric in METRICS.items()}
        metrics = {name: float(values[name][j] / unit_of[name]) for name in METRICS}
        out.append(Specimen(tags.family, tags.series, tags.configuration, kind, float(relative[j]), data, metrics))
    return out


def exactly_guided_points(m: Mechanisms, kind: str) -> Array:
    """Return the body points that guides may keep exactly on a line or circle.

    Shape (n, p, 3); NaN for the other points.
    """
    out = np.full(m.body.shape, np.nan)
    for i, guides in enumerate(m.guides):
        for k, where, _ in guides.each():
            if k.conditions == 2 and (k.name == kind or kind == "circle"):
                out[where, i] = m.body[where, i]
        for j in range(i):
            twice = (m.body[:, i] == m.body[:, j]).all(1)  # on two surfaces
            out[twice, i] = m.body[twice, i]
    return out


def mechanisms(family: str, rng: np.random.Generator, n: int) -> tuple[Mechanisms, Array, Array]:
    """Sample n random mechanisms of a class.

    Returns
    -------
    Mechanisms, ndarray, ndarray
        Mechanisms, coordinates of their points (n, p, 2), and a mask (n,) of those that move
        parallel to z = 0.
    """
    shape, freedom = CLASSES[family]
    body = rng.uniform(-1, 1, (n, len(shape), 3))
    patterns = list(COINCIDENCES[family].values())
    chosen = rng.choice(len(patterns), n, p=[1 - 0.15 * (len(patterns) - 1)] + [0.15] * (len(patterns) - 1))
    for c, pattern in enumerate(patterns):
        for later, earlier in pattern:
            body[chosen == c, later] = body[chosen == c, earlier]
    kinds = np.stack([rng.choice(SURFACES if letter == "s" else CURVES, n) for letter in shape], axis=1)
    if shape[0] == "c":
        kinds[:, 0] = rng.choice(CURVES[:2], n)  # the first driver is an angle
    known = rng.random(n) < 0.5
    kinds[known] = np.array(KNOWN[family])[rng.choice(len(KNOWN[family]), known.sum())]
    turn = rng.normal(size=(n, len(shape), 4))
    chance = rng.random(n)
    flat = (kinds == ("circle", "circle", "plane")).all(1) & (chance < 0.5) if family == "III" else np.zeros(n, bool)
    turn[flat] = (1, 0, 0, 0)
    point = rng.uniform(-1.5, 1.5, (n, 3))
    about = (kinds == ("circle", "circle", "sphere")).all(1) & (chance < 0.5) if family == "III" else np.zeros(n, bool)
    guides, at = [], np.full((n, len(shape), 2), np.nan)
    for i in range(len(shape)):
        made, at[:, i] = _guides_through(kinds[:, i], body[:, i], turn[:, i], rng)
        guides.append(_keep_distance(made, at[:, i], body[:, i], point, about, rng) if about.any() else made)
    drivers = [(i, "u") for i in range(freedom)]
    return Mechanisms(body, guides, drivers), at, flat


def _guides_through(kinds: Array, x: Array, turn: Array, rng: np.random.Generator) -> tuple[Guides, Array]:
    """Place guides of given kinds through points x (n, 3).

    Return the guides and the coordinates (n, 2) of the points on them.
    """
    n = len(kinds)
    p = np.exp(rng.uniform(np.log(0.3), np.log(2.0), (n, 2)))
    p[kinds == "cone", 0] = rng.uniform(0.3, 1.2, n)[kinds == "cone"]
    p[kinds == "torus", 1] = (p[:, 0] * rng.uniform(0.2, 0.8, n))[kinds == "torus"]
    p[kinds == "helix", 1] = rng.uniform(0.1, 0.5, n)[kinds == "helix"]
    u, w = rng.uniform(-np.pi, np.pi, n), rng.uniform(0.3, 1.2, n)
    local = np.zeros((n, 3))
    for kind, where, values in Guides(kinds.tolist(), p, np.zeros((n, 3)), turn).each():
        local[where] = np.stack(np.broadcast_arrays(*kind.point(u[where], w[where], values)), axis=1)
    origin = x - np.einsum("ijn,nj->ni", matrix(turn.T), local)
    curve = np.isin(kinds, CURVES)
    return Guides(kinds.tolist(), p, origin, turn), np.stack([u, np.where(curve, np.nan, w)], axis=1)


def _keep_distance(made: Guides, at: Array, x: Array, point: Array, where: Array, rng: np.random.Generator) -> Guides:
    """Modify the guides `where` to keep points x at a constant distance from a point."""
    shape, origin, turn = made.parameters.copy(), made.origin.copy(), made.quaternion.copy()
    axis = unit(rng.normal(size=x.shape))
    for kind, index, _ in made.each():
        j = index[where[index]]
        arm = x[j] - point[j]
        if kind.conditions == 2:  # a circle about an axis through the point
            foot = (arm * axis[j]).sum(1, keepdims=True) * axis[j]
            out = unit(arm - foot)
            frames = np.stack([out, np.cross(axis[j], out), axis[j]], axis=2)
            turn[j] = quaternion(np.moveaxis(frames, 0, 2)).T
            origin[j], shape[j, 0], at[j, 0] = point[j] + foot, np.sqrt(((arm - foot) ** 2).sum(1)), 0
        else:
            origin[j], shape[j, 0] = point[j], np.sqrt((arm**2).sum(1))
            local = np.einsum("ijn,ni->jn", matrix(turn[j].T), arm)
            at[j] = np.stack(kind.locate(local, shape[j].T), axis=1)
    return Guides([made.kinds[k] for k in made.which], shape, origin, turn)
