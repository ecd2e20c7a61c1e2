# ruff: noqa: ARG005  (formulas of one shape, some of which do not use every coordinate)
"""All assemblies of a body with a point that its drivers fix, by exclusion: slow, and without a formula of the product.

The second point's curve and the third point's surface are cut into boxes.  A point moves at most as far as its chart's
tangents are long, so that a box whose middle misses a distance by more than that holds no assembly and is dropped.
Boxes that stay are halved until Newton's method, from their middle, says why: a root beside them.  What is left
unexplained is an error.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
#: Size of a box [units of length] from which Newton's method is tried, how near its root must be, in boxes; the end.
TRIED, NEAR, LEAST = 4e-3, 8.0, 1e-9
SAME = 1e-7

#: Points of Table I and of the curves, and how long the tangents are at most for |w| up to a bound.
CHARTS: dict[str, tuple[Callable[..., Any], Callable[..., Any]]] = {
    "cylinder": (lambda u, w, r, _: (r * np.cos(u), r * np.sin(u), w), lambda _, r, __: (r, 1.0)),
    "cone": (
        lambda u, w, d, _: (w * np.cos(u), w * np.sin(u), w / np.tan(d)), lambda top, d, _: (top, 1 / np.sin(d)),
    ),
    "hyperboloid:sinh": (
        lambda u, w, m, n: (m * np.cosh(w) * np.cos(u), m * np.cosh(w) * np.sin(u), n * np.sinh(w)),
        lambda top, m, n: (m * np.cosh(top), np.hypot(m * np.sinh(top), n * np.cosh(top))),
    ),
    "torus": (
        lambda u, w, p, r: ((p + r * np.sin(w)) * np.cos(u), (p + r * np.sin(w)) * np.sin(u), r * np.cos(w)),
        lambda _, p, r: (p + r, r),
    ),
    "sphere": (
        lambda u, w, r, _: (-r * np.cos(u) * np.cos(w), r * np.sin(w), r * np.sin(u) * np.cos(w)),
        lambda _, r, __: (r, r),
    ),
    "plane": (lambda u, w, *_: (w * np.cos(u), w * np.sin(u), 0 * w), lambda top, *_: (top, 1.0)),
    "circle": (lambda u, w, r, _: (r * np.cos(u), r * np.sin(u), 0 * u), lambda _, r, __: (r, 0.0)),
    "helix": (lambda u, w, r, h: (r * np.cos(u), r * np.sin(u), h * u), lambda _, r, h: (np.hypot(r, h), 0.0)),
    "line": (lambda u, w, *_: (0 * u, 0 * u, u), lambda *_: (1.0, 0.0)),
}  # fmt: skip


class Guide:
    """The guide of one point of one mechanism."""

    def __init__(self, guides: Any, i: int) -> None:
        kind = guides.kinds[guides.which[i]]
        self.name = kind.name
        self.shape = [*guides.parameters[i], 0.0, 0.0][:2]
        s, x, y, z = guides.quaternion[i] / np.linalg.norm(guides.quaternion[i])
        k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        self.frame, self.origin = np.eye(3) + 2 * s * k + 2 * k @ k, guides.origin[i]

    def point(self, u: Array, w: Array) -> Array:
        """Return points (m, 3)."""
        local = CHARTS[self.name][0](u, w, *self.shape)
        return np.asarray(self.origin + np.stack(np.broadcast_arrays(*local), axis=-1) @ self.frame.T)

    def tangents(self, top: Array) -> tuple[Array, Array]:
        """Return bounds of |X_u| and |X_w| for |w| up to `top`."""
        return tuple(np.broadcast_to(v, top.shape) for v in CHARTS[self.name][1](top, *self.shape))  # type: ignore[return-value]

    def ranges(self, centre: Array, radius: float, whole: bool) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return ranges of u and w that cover what is within a radius of a point; `whole` for w with u given."""
        far = float(np.linalg.norm(centre - self.origin)) + radius
        turn = (-np.pi, np.pi)
        if self.name in ("line", "helix"):
            high = far / (abs(self.shape[1]) if self.name == "helix" else 1.0)
            return (-high, high), (0.0, 0.0)
        w = {"circle": (0.0, 0.0), "torus": turn, "sphere": turn if whole else (-np.pi / 2, np.pi / 2)}
        if self.name == "hyperboloid:sinh":
            far = float(np.arcsinh(far / self.shape[1]))
        low = 0.0 if self.name == "plane" and not whole else -far
        return turn, w.get(self.name, (low, far))


def solved(guide: Guide, boxes: Array, spheres: list[tuple[Array, float]], axes: tuple[int, ...]) -> Array:
    """Return the points (k, 3) of a guide, for u, w in boxes (m, 2, 2), that are on all spheres (centre, radius)."""
    found = np.zeros((0, 3))
    while len(boxes):
        middle, half = boxes.mean(2), (boxes[..., 1] - boxes[..., 0]) / 2
        sizes = np.stack(guide.tangents(np.abs(boxes[:, 1]).max(1)), axis=1) * half
        x = guide.point(*middle.T)
        off = np.stack([np.linalg.norm(x - c, axis=1) - r for c, r in spheres], axis=1)
        size = sizes.sum(1)
        keep = (np.abs(off) <= size[:, None] + 1e-13).all(1)
        boxes, middle, sizes, size = boxes[keep], middle[keep], sizes[keep], size[keep]
        small = np.flatnonzero(size < TRIED)
        explained = np.zeros(len(boxes), bool)
        if len(small):
            at, good = newton(guide, middle[small], spheres, axes)
            roots = guide.point(*at.T)
            here = guide.point(*middle[small].T)
            explained[small] = good & (np.linalg.norm(roots - here, axis=1) < NEAR * size[small])
            for root in roots[explained[small]]:
                if not len(found) or np.linalg.norm(found - root, axis=1).min() > SAME:
                    found = np.concatenate([found, root[None]])
        boxes, sizes = boxes[~explained], sizes[~explained]
        if len(boxes) and sizes.sum(1).max() < LEAST:
            raise ArithmeticError("boxes are left that nothing explains")
        along = sizes.argmax(1)
        each = np.arange(len(boxes))
        cut = boxes[each, along].mean(1)
        low, high = boxes.copy(), boxes.copy()
        low[each, along, 1], high[each, along, 0] = cut, cut
        boxes = np.concatenate([low, high])
    return found


def newton(guide: Guide, at: Array, spheres: list[tuple[Array, float]], axes: tuple[int, ...]) -> tuple[Array, Array]:
    """Solve for the coordinates `axes` from (m, 2); tangents are differences, which costs digits of no root."""
    at, h = at.copy(), 1e-6
    for _ in range(25):
        x = guide.point(*at.T)
        f = np.stack([(((x - c) ** 2).sum(1) - r * r) for c, r in spheres], axis=1)
        columns = []
        for a in axes:
            step = h * np.eye(2)[a]
            t = (guide.point(*(at + step).T) - guide.point(*(at - step).T)) / (2 * h)
            columns.append(np.stack([2 * ((x - c) * t).sum(1) for c, _ in spheres], axis=1))
        j = np.stack(columns, axis=2)
        step = -(np.linalg.pinv(j, rcond=1e-12) @ f[..., None])[..., 0]
        step *= np.minimum(1, 0.3 / np.maximum(np.abs(step).max(1), 1e-300))[:, None]
        at[:, axes] += step
    return at, (np.abs(step).max(1) < 1e-6) & (np.abs(f).max(1) < 1e-10)


def count(mechanisms: Any, drivers: Array, i: int) -> int:
    """Return how many assemblies mechanism i has: its first point is on a driven curve, class III or V."""
    one, two, three = (Guide(g, i) for g in mechanisms.guides)
    b = mechanisms.body[i]
    d12, d13, d23 = (float(np.linalg.norm(b[j] - b[k])) for j, k in ((0, 1), (0, 2), (1, 2)))
    x1 = one.point(drivers[i, :1], np.zeros(1))[0]
    whole = len(mechanisms.drivers) == 2
    u, w = two.ranges(x1, d12, whole)
    if whole:
        u = (drivers[i, 1],) * 2
    parts = 64
    cuts = np.linspace(*(w if whole else u), parts + 1)
    boxes = np.empty((parts, 2, 2))
    boxes[:, 0], boxes[:, 1] = u, w
    boxes[:, int(whole), 0], boxes[:, int(whole), 1] = cuts[:-1], cuts[1:]
    total = 0
    for x2 in solved(two, boxes, [(x1, d12)], (int(whole),)):
        ranges = three.ranges(x1, d13, whole=False)
        total += len(solved(three, np.array(ranges)[None], [(x1, d13), (x2, d23)], (0, 1)))
    return total
