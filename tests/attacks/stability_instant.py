"""Curvature theory of one position, for `stability.py`: pole, cubics, principal pairs, leading errors."""

from __future__ import annotations

from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np

from catalogue.curvature_theory.analysis import REGULAR, curvature
from catalogue.curvature_theory.leading_error import leading_error
from catalogue.kinematics.types import Array, Mask
from tests.attacks.stability_linkages import Stressed
from tests.attacks.stability_reference import Closed, NotClosed, Row, linkages
from tests.benchmarks.degenerations import Exact


def pole(name: str, stressed: Stressed) -> Row | None:
    """Pole, from the first fixed pivot."""
    return _of_instant("pole", name, stressed)


def cubics(name: str, stressed: Stressed) -> Row | None:
    """1/R, 1/R*, 1/S."""
    return _of_instant("curvature: 1/R, 1/R*, 1/S", name, stressed)


def pairs(name: str, stressed: Stressed) -> Row | None:
    """Principal pairs, on a sphere whose equator is a circle of the linkage's size about the first fixed pivot."""
    return _of_instant("principal pairs", name, stressed)


def _of_instant(kernel: str, name: str, stressed: Stressed) -> Row | None:
    inputs, finite = stressed
    if not finite.all():
        return None
    origin = linkages(inputs, finite)[0].points[:, 0, 0]

    def ours(inputs: Array) -> Array:
        linkage, _ = linkages(inputs, finite)
        at = curvature(linkage)
        regular = (at.state == REGULAR)[:, None]
        if kernel == "pole":
            found = at.pole - linkage.pivots[:, 0, 0, :2]
        elif kernel.startswith("curvature"):
            found = np.stack([at.kappa, at.kappa_star, at.s], 1)
        else:
            found = at.principal_pairs.reshape(len(inputs), 12)
            regular = regular & np.isfinite(found).all(1, keepdims=True)
        return np.where(regular, found, np.nan)

    def exact(i: int, numbers: list[Any]) -> list[Any]:
        it = Exact(np.array(numbers[:8], dtype=object).reshape(2, 2, 2))
        if kernel == "pole":
            return [(it.pole - it.centre).real, (it.pole - it.centre).imag]
        if kernel.startswith("curvature"):
            return list(it.parameters)
        if len(it.pairs) < 2 or it.clear < 1e-6:
            raise NotClosed
        mine = [(_sphere(p, origin[i], it.size), p) for p in _own(at_first[i])]
        orders = ((0, 1), (1, 0))
        ways = [
            [x for k in o for p in it.pairs[k] for x in _sphere(_homogeneous(p), origin[i], it.size)] for o in orders
        ]
        flat = [x for place, _ in mine for x in place]
        return min(ways, key=lambda way: max(abs(a - b) for a, b in zip(way, flat, strict=True)))

    def seen(i: int, values: Array) -> list[Any]:
        size = mp.mpf(float(sizes[i]))
        return [x for p in _own(values) for x in _sphere(p, origin[i], size)]

    with np.errstate(all="ignore"):
        at_first, sizes = ours(inputs), linkages(inputs, finite)[0].size
    if kernel == "principal pairs":
        there = np.flatnonzero(np.isfinite(at_first).all(1))
        if len(there) < 2:
            return None
        inputs, finite = inputs[there], finite[there]
        origin, at_first, sizes = origin[there], at_first[there], sizes[there]
        z = linkages(inputs, finite)[0].points.reshape(-1, 4)
        near = np.abs(z[:, [0, 0, 1, 2]] - z[:, [1, 2, 3, 3]]).min(1)
        one = np.ones(len(inputs))
        # they come by way of the pole, which turns with a short crank
        return Row(kernel, name, inputs, ours, exact, seen=seen, unit=one, condition=np.maximum(sizes / near, 1))
    return Row(kernel, name, inputs, ours, exact)


def _own(values: Array) -> list[tuple[Any, Any]]:
    return [(mp.mpc(float(x), float(y)), w) for x, y, w in values.reshape(4, 3)]


def _homogeneous(z: Any) -> tuple[Any, Any]:
    return z, 1


def _sphere(place: tuple[Any, Any], origin: complex, size: Any) -> list[Any]:
    z, w = place
    if not w:
        return [z.real * 0, z.real * 0, mp.mpf(1)]
    z = (z - mp.mpc(origin)) / size
    return [2 * z.real / (1 + abs(z) ** 2), 2 * z.imag / (1 + abs(z) ** 2), (abs(z) ** 2 - 1) / (abs(z) ** 2 + 1)]


def leading(order: int, name: str, stressed: Stressed) -> Row | None:
    """c2 beside the tangent (1), c3 beside the osculating circle (2)."""
    inputs, finite = stressed
    linkage, point = linkages(inputs, finite)
    with np.errstate(all="ignore"):
        normal = leading_error(linkage, point, circle=order == 2, order=order).normal

    def ours(inputs: Array) -> Array:
        linkage, point = linkages(inputs, finite)
        return leading_error(linkage, point, circle=order == 2, order=order).coefficient[:, None]

    def exact(i: int, numbers: list[Any]) -> list[Any]:
        of = _driven(numbers, finite[i])
        first, second, third = of.derivatives(3, 1e-12)
        along = first / abs(first)
        if (along.conjugate() * 1j * mp.mpc(complex(normal[i]))).real < 0:
            along = -along
        across = -1j * along
        u1, u2 = ((along.conjugate() * v / k).real for v, k in ((first, 1), (second, 2)))
        v2, v3 = ((across.conjugate() * v / k).real for v, k in ((second, 2), (third, 6)))
        c2 = v2 / u1**2
        # the third coefficient less that of the osculating circle
        return [c2] if order == 1 else [(v3 - 2 * c2 * u1 * u2) / u1**3]

    with np.errstate(all="ignore"):  # 1 / size is what the path's own terms are made of
        unit = np.maximum(np.abs(ours(inputs)[:, 0]), 1 / linkage.size**order)
    return Row(f"leading error, c{order + 1}", name, inputs, ours, exact, unit=unit, bound=1000)


def _driven(numbers: list[Any], finite: Mask) -> Closed:
    """Return a chain led by what moves everything most evenly: a crank that is not at a dead point, or the coupler."""
    cranks = [i for i in (0, 1) if finite[i].all()]
    best, most = Closed(numbers, finite, 2) if not cranks else None, mp.mpf(-1)
    for i in (*cranks, 2):
        try:
            of = Closed(numbers, finite, i)
            one, other = of.pose(mp.mpf(0), 1), of.pose(mp.mpf(0), -1)
        except NotClosed:
            continue
        apart = abs(one[1] - other[1]) + abs(one[0] - other[0]) / (abs(of.point) + 1)
        if apart > most and (cranks or i == 2):
            best, most = of, apart
    if best is None:
        raise NotClosed
    return best
