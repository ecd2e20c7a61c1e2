"""Mechanisms in space for `stability.py`: guided bodies, function generators, an axle with its rates and forces.

The guided bodies and their exact closures are those of `tests/benchmarks/spatial_stability.py`.  A function generator
is closed by  c0 + c1 cos + c2 sin = 0,  the axle by a quaternion and six distances; forces are solved from them.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np

from catalogue.errors import CatalogueError
from catalogue.kinematics.types import Array
from catalogue.spatial import Joint, Link, Load, Mechanism, Revolute, Travel, reactions
from catalogue.spatial.guided import compiled
from catalogue.spatial.guided.position import driver_units
from tests.attacks.stability_reference import EPS, NotClosed, Row
from tests.benchmarks import spatial_stability as guided

M = mp.matrix
#: Hard points of an axle: five inner, five outer, the wheel's centre.
INNER = np.array([(-120, 450, 230), (130, 440, 240), (-150, 400, -60), (140, 390, -70), (90, 420, -10)], float)
OUTER = np.array([(-10, 690, 210), (15, 695, 215), (-20, 720, -90), (25, 715, -95), (110, 700, -5)], float)
CENTRE = np.array([(0, 760, 0)], float)
FORCE, CONTACT = (-2000.0, 1500.0, 4000.0), (5.0, 765.0, -310.0)


# -- guided bodies ----------------------------------------------------------------------------------------------------
def bodies(n: int) -> Iterator[Row]:
    """Positions, and derivatives by the first driver, near what is stiff; positions at the end of a sweep, too."""
    for kind, (make, distances) in guided.KINDS.items():
        for near in distances[::2]:
            batch, at = make(near, n)
            name = f"{kind.partition(',')[0]}, {near:.0e}"
            for order, what in enumerate(("position", "velocity", "acceleration")):
                yield _guided(order, f"guided body: {what}", name, batch, at)
            for way, taken in (("swept", None), ("compiled sweep", compiled.fast(batch))):
                if taken or way == "swept":
                    yield swept(f"guided body: position, {way}", name, batch, at, near)


def swept(kernel: str, name: str, batch: Any, at: Any, near: float) -> Row:
    """Row of the positions at the end of a sweep that leads away from these and back, of enough nodes to be compiled
    where that is in the kernel's name."""
    nodes = compiled.MIN_POSITIONS if "compiled" in kernel else compiled.MIN_POSITIONS // (2 * len(batch))
    back = 0.05 * min(near, 1.0) * (1 - np.abs(np.linspace(-1, 1, nodes + 1)))
    path = at.drivers[:, None] - back[:, None] * driver_units(batch).T[:, None]
    return _guided(0, kernel, name, batch, guided.S.follow(batch, path, at).node(nodes))


def _guided(order: int, kernel: str, name: str, batch: Any, at: Any) -> Row:
    """The input is 1; another number stands for another rounding of all numbers of the mechanism."""
    rates = np.zeros((batch.freedom, 2))
    rates[0, 0] = 1
    solved = np.flatnonzero(at.success)
    found = np.full((len(batch), 3 * len(batch.guides)), np.nan)
    if len(solved):
        points = at.points if order == 0 else guided.S.jets(batch, at, rates).points[:, :, order]
        found[solved] = points.reshape(len(batch), -1)[solved]
    starts = {int(i): guided.start_of(batch, at, int(i)) for i in solved}

    def exact(i: int, numbers: list[Any]) -> list[Any]:
        if i not in starts:
            raise NotClosed
        draw = None if numbers[0] == 1 else np.random.default_rng(int(abs(numbers[0] - 1) / EPS * 2**20) % 2**32)
        closure = guided.Exact(batch, i, draw)
        q = [mp.mpf(float(v)) for v in at.drivers[i]]

        def points(step: Any) -> list[Any]:
            try:
                x = closure.solve(starts[i], [q[0] + step, *q[1:]])
            except ArithmeticError:
                raise NotClosed from None
            return [v for p in closure.points(x) for v in p]

        with mp.workdps(guided.DIGITS + 10):
            h = mp.mpf(10) ** -22
            if order == 0:
                return points(mp.mpf(0))
            ahead, behind = points(h), points(-h)
            if order == 1:
                return [(a - b) / (2 * h) for a, b in zip(ahead, behind, strict=True)]
            return [(a - 2 * c + b) / h**2 for a, b, c in zip(ahead, behind, points(mp.mpf(0)), strict=True)]

    unit = batch.diameter if order == 0 else None
    one = np.ones((len(batch), 1))
    condition = np.where(np.isfinite(at.condition), np.maximum(at.condition, 1), 1)
    many = condition if order else np.ones(len(batch))
    return Row(
        kernel, name, one, lambda _: found, exact, unit=unit, condition=many, timed=False, roundings=1, bound=1e3
    )


# -- function generators ----------------------------------------------------------------------------------------------
def generators(n: int) -> Iterator[Row]:
    """RSSR: angle of the rocker over that of the crank, with two derivatives."""
    stresses = {
        "random": (1.0, 1.0, 0.0), "crank 1e-06 of the rest": (1e-6, 1.0, 0.0),
        "coordinates 1e-150": (1.0, 1e-150, 0.0),
        "coordinates 1e+150": (1.0, 1e150, 0.0), "coordinates 1e+08": (1.0, 1e8, 0.0), "offset 1e+04": (1.0, 1.0, 1e4),
        "offset 1e+08": (1.0, 1.0, 1e8),
    }  # fmt: skip
    draw = np.random.default_rng(3)
    made = np.concatenate([np.repeat([[4, 0.2, 1.0]], n, 0), np.repeat([[1, 0, 0.3]], n, 0),
                           np.repeat([[4.2, 0.5, 4.0]], n, 0)], axis=1) + draw.normal(size=(n, 9)) * 0.15  # fmt: skip
    for name, (crank, scale, away) in stresses.items():
        inputs = made.copy()
        inputs[:, 3:6] *= crank
        inputs = scale * np.column_stack([np.zeros((n, 3)), inputs]) + away
        for order, what in enumerate(("angle", "velocity", "acceleration")):
            exact = partial(_rocker, order)
            yield Row(f"function generator: {what}", name, np.column_stack([inputs, np.full(n, 0.7)]),
                      partial(_generated, order), exact, bound=1000, timed=False, unit=np.ones(n))  # fmt: skip
    # beside a dead point of the crank: the rod in line with the rocker's way
    for near in (1e-3, 1e-6, 1e-9):
        inputs = np.column_stack([np.zeros((n, 3)), made])
        ends = [_end(row) for row in inputs]
        some = np.isfinite(ends)
        if some.sum() > 1:
            given = np.column_stack([inputs, np.subtract(ends, near)])[some]
            yield Row("function generator: angle", f"dead point, {near:.0e} rad", given, partial(_generated, 0),
                      partial(_rocker, 0), bound=1000, timed=False, unit=np.ones(n))  # fmt: skip


def _mechanism(row: Array) -> Mechanism:
    crank, rocker, a, b = row[:12].reshape(4, 3)
    return Mechanism([Revolute("crank", crank, axis=(0, 0, 1)), Revolute("rocker", rocker, axis=(0, 1, 0)),
                      Link("crank", a, "rocker", b)])  # fmt: skip


def _generated(order: int, inputs: Array) -> Array:
    out = np.full((len(inputs), 1), np.nan)
    for i, row in enumerate(inputs):
        try:
            found = _mechanism(row).sweep(Joint("crank"), [row[12]]).joint("rocker", order=order)
            out[i] = np.ravel(found)[order]
        except CatalogueError:
            continue  # a reason is told
    return out


def _end(row: Array) -> float:
    """Return where a sweep of the crank ends before 3 rad, NaN if it does not."""
    ends = _mechanism(row).sweep(Joint("crank"), [0.0, 3.0]).ends[0]
    return float("nan") if ends[1] is None else float(ends[1][0])


def _rocker(order: int, _: int, numbers: list[Any]) -> list[Any]:
    angle = numbers[12]
    if order == 0:
        return [_rocker_at(numbers, angle)]
    with mp.workdps(90):
        h = mp.mpf(10) ** -20
        ahead, here, behind = (_rocker_at(numbers, angle + k * h) for k in (1, 0, -1))
        return [(ahead - behind) / (2 * h) if order == 1 else (ahead - 2 * here + behind) / h**2]


def _rocker_at(numbers: list[Any], angle: Any) -> Any:
    crank, rocker, a, b = (numbers[3 * k : 3 * k + 3] for k in range(4))
    rod = sum((p - q) ** 2 for p, q in zip(a, b, strict=True))
    x, y = a[0] - crank[0], a[1] - crank[1]

    def at(angle: Any) -> tuple[Any, Any, Any]:
        """Return c0, c1, c2 of the rocker's angle: its end turns about the y axis."""
        p = [crank[0] + x * mp.cos(angle) - y * mp.sin(angle), crank[1] + x * mp.sin(angle) + y * mp.cos(angle), a[2]]
        u, w = b[0] - rocker[0], b[2] - rocker[2]
        gx, gz = p[0] - rocker[0], p[2] - rocker[2]
        c0 = u * u + w * w + gx * gx + gz * gz + (b[1] - p[1]) ** 2 - rod
        # turned by psi about y: (u cos + w sin, w cos - u sin)
        return c0, -2 * (u * gx + w * gz), -2 * (w * gx - u * gz)

    def ways(angle: Any) -> list[Any]:
        c0, c1, c2 = at(angle)
        long = mp.sqrt(c1 * c1 + c2 * c2)
        if abs(c0) > long:
            raise NotClosed
        return [mp.atan2(c2, c1) + side * mp.acos(-c0 / long) for side in (1, -1)]

    def near(psi: Any) -> Any:
        return (psi + mp.pi) % (2 * mp.pi) - mp.pi

    start = [abs(near(w)) for w in ways(mp.mpf(0))]
    return near(ways(angle)[0 if start[0] < start[1] else 1])


# -- an axle ----------------------------------------------------------------------------------------------------------
def axles(n: int) -> Iterator[Row]:
    """Five links: where the contact point goes, its rates by the travel of the centre, forces in links and drive."""
    draw, points = np.random.default_rng(4), np.concatenate([INNER, OUTER, CENTRE])
    made = np.stack([points + draw.normal(size=points.shape) * 5 for _ in range(n)])

    def beside(near: float) -> Array:
        moved = made.copy()
        moved[:, 1], moved[:, 6] = (
            moved[:, 0] + near * (moved[:, 1] - moved[:, 0]),
            moved[:, 5] + near * (moved[:, 6] - moved[:, 5]),
        )
        return moved

    stresses: dict[str, tuple[Array, float]] = {
        "random": (made, 1.0), "coordinates 1e-150": (1e-150 * made, 1e-150),
        "coordinates 1e+150": (1e150 * made, 1e150),
        "offset 1e+08 mm": (made + 1e8, 1.0), "two links nearly one, 1e-03": (beside(1e-3), 1.0),
        "two links nearly one, 1e-06": (beside(1e-6), 1.0),
    }  # fmt: skip
    for name, (hard, unit) in stresses.items():
        inputs = np.column_stack([hard.reshape(n, -1), np.full(n, 30.0 * unit)])
        for order, what in enumerate(("position", "velocity", "acceleration", "forces")):
            exact = partial(_forces if order == 3 else partial(_contact, order), unit)
            yield Row(
                f"axle: {what}",
                name,
                inputs,
                partial(_driven, order, unit),
                exact,
                bound=1000,
                timed=False,
                roundings=1,
            )


def _driven(order: int, unit: float, inputs: Array) -> Array:
    out = np.full((len(inputs), 6 if order == 3 else 3), np.nan)
    for i, row in enumerate(inputs):
        hard = row[:33].reshape(11, 3)
        contact = hard[10] + unit * np.subtract(CONTACT, CENTRE[0])
        try:
            mechanism = Mechanism([Link("ground", hard[k], "wheel", hard[5 + k], name=str(k)) for k in range(5)])
            motion = mechanism.sweep(Travel("wheel", hard[10]), [row[33]])
            if order == 3:
                found = reactions(motion, [Load("wheel", FORCE, contact)])
                out[i] = found[[*(f"{k} [N]" for k in range(5)), "drive [N]"]].to_numpy()[0]
            else:
                point = motion.point("wheel", contact, order)
                out[i] = (point[0] - contact if not order else point[0, order]) * (1 if order < 2 else unit)
                if not order:
                    out[i] /= unit
        except CatalogueError:
            continue
    return out


class _Axle:
    def __init__(self, numbers: list[Any], unit: float) -> None:
        u = mp.mpf(unit)
        self.hard = [M([v / u for v in numbers[3 * k : 3 * k + 3]]) for k in range(11)]
        self.centre, self.zero = self.hard[10], self.hard[10]
        self.length = [mp.norm(a - b) for a, b in zip(self.hard[:5], self.hard[5:10], strict=True)]
        self.contact = M([mp.mpf(float(a - b)) for a, b in zip(CONTACT, CENTRE[0], strict=True)])
        self.x = [mp.mpf(1), *[mp.mpf(0)] * 6]

    def places(self, x: list[Any]) -> tuple[Any, Any]:
        return guided.rotation(x[:4]), M(x[4:7]) * 100

    def residual(self, x: list[Any], travel: Any) -> Any:
        r, t = self.places(x)
        f = [sum(v * v for v in x[:4]) - 1]
        for a, b, long in zip(self.hard[:5], self.hard[5:10], self.length, strict=True):
            away = self.zero + t + r * (b - self.zero) - a
            f.append(((away.T * away)[0] - long * long) / 1e4)
        return M([*f, (t[2] - travel) / 100])

    def solve(self, travel: Any, x: list[Any], digits: int) -> list[Any]:
        h = mp.mpf(10) ** -(digits // 2)
        for _ in range(50):
            f = self.residual(x, travel)
            columns = [(self.residual([v + h * (k == j) for k, v in enumerate(x)], travel) - f) / h for j in range(7)]
            step = mp.lu_solve(M([[c[i] for c in columns] for i in range(7)]), -f)
            x = [v + d for v, d in zip(x, step, strict=True)]
            if mp.norm(step, mp.inf) < mp.mpf(10) ** -(digits * 2 // 3):
                return x
        raise NotClosed

    def reach(self, travel: Any, digits: int = 50) -> list[Any]:
        x = self.x
        for k in (1, 2, 3):
            x = self.solve(travel * k / 3, x, digits)
        return x

    def at(self, x: list[Any]) -> Any:
        r, t = self.places(x)
        return t + r * self.contact - self.contact


def _contact(order: int, unit: float, _: int, numbers: list[Any]) -> list[Any]:
    with mp.workdps(70):
        axle, travel = _Axle(numbers, unit), numbers[33] / mp.mpf(unit)
        x = axle.reach(travel, 70)
        if order == 0:
            return list(axle.at(x))
        h = mp.mpf(10) ** -12
        ahead, behind = (axle.at(axle.solve(travel + s * h, x, 70)) for s in (1, -1))
        return list((ahead - behind) / (2 * h) if order == 1 else (ahead - 2 * axle.at(x) + behind) / h**2)


def _forces(unit: float, _: int, numbers: list[Any]) -> list[Any]:
    """Return forces of links, tension positive, and of the drive along z, from forces and moments that vanish."""
    axle = _Axle(numbers, unit)
    r, t = axle.places(axle.reach(numbers[33] / mp.mpf(unit)))
    rows = []
    for a, b in zip(axle.hard[:5], axle.hard[5:10], strict=True):
        end = t + r * (b - axle.zero)
        way = a - axle.zero - end
        rows.append((way / mp.norm(way), end))
    rows.append((M([0, 0, 1]), t))

    def cross(p: Any, q: Any) -> list[Any]:
        return [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]

    load, at = M([mp.mpf(v) for v in FORCE]), t + r * axle.contact
    left = M([[*way, *cross(end, way)] for way, end in rows]).T
    return list(mp.lu_solve(left, -M([*load, *cross(at, load)])))


def rows(n: int) -> Iterator[Row]:
    """Yield all rows of these kernels."""
    yield from generators(n)
    yield from axles(n)
    yield from bodies(n)
