"""Kernels of the plane that `stability.py` tries: poses, circuits, rates, lengths, transmission angles, cognates."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np

from catalogue.guidance.metrics import rotation_margin, transmission_sines
from catalogue.kinematics.circuits import circuits
from catalogue.kinematics.cognates import cognates
from catalogue.kinematics.from_lengths import from_lengths
from catalogue.kinematics.link_lengths import link_lengths
from catalogue.kinematics.linkage import PR, RP, RR
from catalogue.kinematics.motion import motion
from catalogue.kinematics.rates import rates
from catalogue.kinematics.types import Array
from tests.attacks.stability_instant import cubics, leading, pairs, pole
from tests.attacks.stability_linkages import STRESSES, Stressed
from tests.attacks.stability_reference import DIGITS, Closed, NotClosed, Row, linkages, numbers_of


def _parts(values: Array) -> Array:
    """Return complex numbers (n, m) as real and imaginary parts, (n, 2 m)."""
    return np.stack([values.real, values.imag], axis=-1).reshape(len(values), -1)


def _pair(z: Any) -> list[Any]:
    return [z.real, z.imag]


def pose(chart: int, share: float, name: str, stressed: Stressed) -> Row | None:
    """Displacement of a coupler point at a share of the way to where the chart ends."""
    inputs, finite = stressed
    lead = chart - 1 if chart else 2
    linkage, point = linkages(inputs, finite)
    if lead < 2 and (linkage.dyads[:, lead] != RR).any():
        return None
    moving = motion(linkage, chart, point)
    t = share * np.minimum(moving.interval[1], 2.0)
    given = np.column_stack([inputs, t])

    def ours(inputs: Array) -> Array:
        linkage, point = linkages(inputs, finite)
        u, v = motion(linkage, chart, point).point(point)(inputs[None, :, 10])
        return np.stack([u[0], v[0]], axis=1)

    def exact(i: int, numbers: list[Any]) -> list[Any]:
        of = Closed(numbers, finite[i], lead)
        return _pair(of.at(2 * mp.atan(numbers[10])) - of.point)

    what = ("coupler", "crank 1", "crank 2")[chart]
    return Row(f"pose, chart of {what}", name, given, ours, exact, condition=1 / np.minimum(moving.conditioning, 1))


def circuit(name: str, stressed: Stressed) -> Row | None:
    """Place of a coupler point on its circuit, at the crank's angle that the catalogue has there."""
    inputs, finite = stressed
    linkage, point = linkages(inputs, finite)
    if not (linkage.dyads == RR).any():
        return None
    found = circuits(linkage)
    found = found[np.flatnonzero(np.isfinite(found.phase))]
    lead, s = found.lead, found.phase + 0.5
    given = np.column_stack([inputs, (found.angle(s[None]) - found.angle(found.phase[None]))[0]])

    def ours(inputs: Array) -> Array:
        linkage, point = linkages(inputs, finite)
        found = circuits(linkage)
        found = found[np.flatnonzero(np.isfinite(found.phase))]
        z, w = (found.pose((found.phase + k)[None]).point(point)[0] for k in (0.5, 0.0))
        return _parts((z - w)[:, None])

    def exact(i: int, numbers: list[Any]) -> list[Any]:
        of = Closed(numbers, finite[i], int(lead[i]))
        aim = _hint[i]
        ways = []
        for side in (1, -1):
            try:
                d, turn = of.pose(numbers[10], side)
            except NotClosed:
                continue
            ways.append(d + turn * of.point - of.point)
        if not ways:
            raise NotClosed
        return _pair(min(ways, key=lambda w: abs(w - aim)))

    _hint = [mp.mpc(*map(float, row)) for row in ours(inputs)]
    size = np.abs(point - linkage.points[:, 0, 0]) + linkage.size
    return Row("place on a circuit", name, given, ours, exact, unit=np.minimum(size, 3 * linkage.size), bound=300)


def rate(order: int, drive: int, name: str, stressed: Stressed) -> Row | None:
    """Velocity (1) or acceleration (2) of a coupler point, by the angle of the drive."""
    inputs, finite = stressed
    linkage, _ = linkages(inputs, finite)
    if drive < 2 and (linkage.dyads[:, drive] != RR).any():
        return None

    def ours(inputs: Array) -> Array:
        linkage, point = linkages(inputs, finite)
        found = rates(linkage, np.full(len(inputs), drive))
        value = found.velocity_of(point) if order == 1 else found.acceleration_of(point)
        return _parts(value[:, None])

    def exact(i: int, numbers: list[Any]) -> list[Any]:
        return _pair(Closed(numbers, finite[i], drive).derivatives(2, 1e-12)[order - 1])

    what = ("velocity", "acceleration")[order - 1]
    return Row(f"{what}, {'coupler' if drive == 2 else 'crank'} drives", name, inputs, ours, exact, bound=300)


def lengths(name: str, stressed: Stressed) -> Row | None:
    """Lengths of cranks, frame and coupler."""
    inputs, finite = stressed
    kinds = linkages(inputs, finite)[0].dyads[0].tolist()
    if {*kinds} == {PR, RP}:
        return None

    def ours(inputs: Array) -> Array:
        linkage, point = linkages(inputs, finite)
        found = link_lengths(linkage, point)
        return np.stack([np.asarray(v, float) for k, v in found.items() if k.split()[0] in WORDS], axis=1)

    def exact(_: int, numbers: list[Any]) -> list[Any]:
        a, a_star, b, b_star = (mp.mpc(*numbers[2 * k : 2 * k + 2]) for k in range(4))
        found = [abs(m - f) for (f, m), kind in zip(((a, a_star), (b, b_star)), kinds, strict=True) if kind == RR]
        if PR not in kinds:
            found.append(abs(b - a))
        if RP not in kinds:
            found.append(abs(b_star - a_star))
        return found

    return Row("link lengths", name, inputs, ours, exact)


WORDS = ("crank", "frame", "coupler")


def transmission(name: str, stressed: Stressed) -> Row | None:
    """Sine of the transmission angle of the first crank in the given position, and Grashof's margin in sizes."""
    inputs, finite = stressed
    if not finite.all():
        return None

    def ours(inputs: Array) -> Array:
        linkage, _ = linkages(inputs, finite)
        z = linkage.points
        sine = transmission_sines(linkage, [z[None, :, 0, 1], z[None, :, 1, 1]], np.zeros((1, len(inputs)), complex))
        return np.stack([sine[0, 0], rotation_margin(linkage)[:, 0] / linkage.size], axis=1)

    def exact(_: int, numbers: list[Any]) -> list[Any]:
        a, a_star, b, b_star = (mp.mpc(*numbers[2 * k : 2 * k + 2]) for k in range(4))
        bar, arm = b_star - a_star, b_star - b
        angle = mp.arg(arm / bar)
        crank, frame, coupler, rocker = abs(a_star - a), abs(b - a), abs(bar), abs(arm)
        # what is left of the triangle of coupler and rocker, where crank and frame are in line
        near, far = abs(frame - crank), frame + crank
        margin = min(coupler + rocker - far, near - abs(coupler - rocker))
        size = max(abs(p - q) for p in (a, a_star, b, b_star) for q in (a, a_star, b, b_star))
        return [mp.sin(angle), margin / size]

    # a margin of 1e-9 is a change point by definition
    return Row("transmission angle, margin", name, inputs, ours, exact, method=1e-9, unit=np.ones(len(inputs)))


def cognate(name: str, stressed: Stressed) -> Row | None:
    """Displacement of the first cognate's point where its shared crank has turned as the given coupler, and the first
    crank of that, or its coupler, by 0.02 rad."""
    inputs, finite = stressed
    linkage, point = linkages(inputs, finite)
    if (linkage.dyads[:, 0] != RR).any() or (linkage.dyads[:, 1] == RP).any():
        return None
    _, of, number = cognates(linkage, point)
    some = of[number == 1]
    if len(some) < 2:
        return None
    inputs, finite = inputs[some], finite[some]
    turned = mp.mpf("0.02")

    def ours(inputs: Array) -> Array:
        linkage, point = linkages(inputs, finite)
        made, of, number = cognates(linkage, point)
        out = np.full((len(inputs), 10), np.nan)
        first = number == 1
        out[of[first]] = numbers_of(made[first], point[of[first]])
        return out

    def exact(i: int, numbers: list[Any]) -> list[Any]:
        d, turn, point = moved(numbers, i)
        return _pair(d + (turn - 1) * point)

    def moved(numbers: list[Any], i: int) -> tuple[Any, Any, Any]:
        shape = Closed(numbers, finite[i], lead[i])
        return *shape.pose(turned), shape.point

    def seen(i: int, values: Array) -> list[Any]:
        given = [mp.mpf(float(v)) for v in inputs[i]]
        (_, turn, _), aim = moved(given, i), mp.mpc(*exact(i, given))
        shape = Closed([mp.mpf(float(v)) for v in values], finite[i], 0)
        ways = []  # where the coupler's turn is stationary, the cognate's crank is at a dead point
        for side in (1, -1):
            with contextlib.suppress(NotClosed):
                d, other = shape.pose(mp.arg(turn), side)
                ways.append(d + (other - 1) * shape.point)
        return _pair(min(ways, key=lambda w: abs(w - aim))) if ways else [mp.mpf("inf")] * 2

    lead = []
    with mp.workdps(DIGITS):
        for i in range(len(inputs)):
            lead.append(0)
            try:
                moved([mp.mpf(float(v)) for v in inputs[i]], i)
            except NotClosed:
                lead[i] = 2

    return Row("cognate's path", name, inputs, ours, exact, seen=seen, bound=1000)


def closures(n: int) -> Iterator[Row]:
    """From lengths: of link ratios and units that are extreme, the lengths of what comes out."""
    draw = np.random.default_rng(5)
    for ratio, unit in ((1.0, 1.0), (1e3, 1.0), (1e6, 1.0), (1.0, 1e-150), (1.0, 1e150)):
        crank = draw.uniform(0.5, 1, n) / ratio
        ground, coupler = draw.uniform(1, 2, n), draw.uniform(1.5, 2, n)
        rocker = ground + (coupler - ground) * draw.uniform(0.4, 0.6, n) + 0.5 * ground
        given = unit * np.stack([ground, crank, coupler, rocker], axis=1)

        def ours(inputs: Array) -> Array:
            names = ("ground", "crank", "coupler", "rocker")
            made = from_lengths({**dict(zip(names, inputs.T, strict=True)), "angle": 70.0})
            return made.pivots[..., :2].reshape(len(inputs), 8)

        def exact(_: int, numbers: list[Any]) -> list[Any]:
            ground, crank, coupler, rocker = numbers
            angle = 70 * mp.pi / 180
            return [ground, crank, coupler, rocker, crank * mp.cos(angle), crank * mp.sin(angle)]

        def seen(_: int, values: Array) -> list[Any]:
            a, a_star, b, b_star = (mp.mpc(*map(float, values[2 * k : 2 * k + 2])) for k in range(4))
            return [abs(b - a), abs(a_star - a), abs(b_star - a_star), abs(b_star - b), *_pair(a_star - a)]

        name = f"crank 1/{ratio:.0e}" if ratio > 1 else f"unit {unit:.0e}"
        yield Row("from lengths", name, given, ours, exact, seen=seen)


def rows(n: int, stresses: dict[str, Callable[[int], Stressed]] = STRESSES) -> Iterator[Row]:
    """Yield all rows of these kernels."""
    kernels: list[Callable[[str, Stressed], Row | None]] = [
        *(partial(pose, chart, share) for chart in (0, 1, 2) for share in (0.3,)),
        partial(pose, 1, 1 - 1e-6), circuit, *(partial(rate, order, drive) for order in (1, 2) for drive in (0, 2)),
        pole, cubics, pairs, partial(leading, 1), partial(leading, 2), lengths, transmission, cognate,
    ]  # fmt: skip
    for name, make in stresses.items():
        stressed = make(n)
        for kernel in kernels:
            row = kernel(name, stressed)
            if row is not None:
                yield row
    yield from closures(n)
