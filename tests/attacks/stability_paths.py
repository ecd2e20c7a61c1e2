"""Paths, strips and annuli, what is measured of guides, and how it changes with their pivots, for `stability.py`."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np

import catalogue
from catalogue import InvalidLinkage, InvalidRequest
from catalogue.curvature_theory.analysis import curvature
from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.guidance.fixed_nominal import Nominal, in_place
from catalogue.guidance.minimum_zone import grid, minimum_zone
from catalogue.guidance.placement import at_stroke, placed
from catalogue.guidance.sensitivity import pose_jacobian
from catalogue.kinematics.circuits import COUPLER, SWING, circuits
from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.motion import motion
from catalogue.kinematics.types import Array
from catalogue.plugin.registry import Registry
from tests.attacks.stability_linkages import STRESSES, Stressed, plain
from tests.attacks.stability_reference import DIGITS, Closed, Row, linkages, numbers_of, width
from tests.naive import narrowest_annulus

#: Intervals between the places of a path in many digits.
PIECES = 48


# -- strips and annuli of known width ---------------------------------------------------------------------------------
def zones() -> Iterator[Row]:
    """Waves about lines and arcs, whose peaks are equal and alternate: no other strip or annulus is narrower."""
    amplitudes = np.array([0.03, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15])
    for away in (0.0, 1e3, 1e8):
        yield _zone("straight", "strip" if not away else f"strip, {away:.0e} strokes off", amplitudes, np.inf, away)
    for radius in (0.6, 10.0, 1e3, 1e6, 1e9):
        yield _zone("any radius", f"annulus, radius {radius:g} strokes", amplitudes[1:-1], radius)
        yield _zone("that radius", f"arc of given radius, {radius:g} strokes", amplitudes[1:-1], radius)
    for unit in (1e-150, 1e150):
        yield _zone("straight", f"strip, unit {unit:.0e}", amplitudes, np.inf, unit=unit)
        yield _zone("any radius", f"annulus, unit {unit:.0e}", amplitudes[1:-1], 10.0, unit=unit)


def _zone(kind: str, name: str, amplitudes: Array, radius: float, away: float = 0.0, unit: float = 1.0) -> Row:
    nodes, waves = grid(32), 4 if kind == "any radius" else 3
    turn, shift = np.exp(0.7j), away * (1 + 0.3j)
    paths = []
    with mp.workdps(DIGITS):
        for a in amplitudes:
            for x in nodes.nodes:
                wave = mp.mpf(float(a)) * mp.chebyt(waves, mp.mpf(float(x)))
                if np.isinf(radius):
                    z = mp.mpc(mp.mpf(float(x)) / 2, wave)
                else:
                    half = mp.asin(mp.mpf(1) / (2 * radius))
                    z = mp.mpc(0, 1) * ((radius + wave) * mp.expj(-half * mp.mpf(float(x))) - radius)
                paths.append(complex(unit * (z * mp.mpc(turn) + mp.mpc(shift))))
    path = np.array(paths).reshape(len(amplitudes), -1)

    def ours(inputs: Array) -> Array:
        u, v = (np.ascontiguousarray(inputs[:, i::2].T) for i in (0, 1))
        held = np.full(len(inputs), -1 / (radius * unit)) if kind == "that radius" else None
        return (minimum_zone(u, v, kind == "any radius", nodes, held).deviation / unit)[:, None]

    def exact(i: int, _: list[Any]) -> list[Any]:
        return [mp.mpf(float(amplitudes[i]))]

    given = np.stack([path.real, path.imag], axis=2).reshape(len(path), -1)
    # peaks are read off parabolas: 1e-4 of the deviation; a rounding of coordinates counts where they stand
    return Row("minimum zone", name, given, ours, exact, method=1e-4 * amplitudes, unit=np.full(len(path), 1 + away),
               roundings=1)  # fmt: skip


# -- deviation, size, transmission on the finite motion ---------------------------------------------------------------
def traced(share: float, kind: str, stressed: Stressed, name: str) -> Row | None:
    """Deviation over a share of the farthest window about the reference position (`kind` line, arc or cusp)."""
    inputs, finite = stressed
    linkage, point = linkages(inputs, finite)
    if kind == "cusp":
        with np.errstate(all="ignore"):
            pole = curvature(linkage).pole
        if not np.isfinite(pole).all():
            return None
        inputs = np.column_stack([inputs[:, :8], pole])
        point = pole @ [1, 1j]
    curve = coupler_curve(linkage, point)
    with np.errstate(all="ignore"):
        stroke = share * 1.9 * curve.extent.min(0) * (0.5 if kind == "cusp" else 1.0)
        found = at_stroke(curve, stroke, circle=kind == "arc")
    some = np.flatnonzero(np.isfinite(found.fit.deviation) & (curve.cusp == (kind == "cusp")) & (stroke > 0))
    if len(some) < 2:
        return None
    lead = np.array([2, 0, 1])[curve.motion.chart[some]]
    finite = finite[some]
    given = np.column_stack([inputs, stroke, found.low, found.high])[some].astype(float)

    def ours(inputs: Array) -> Array:
        linkage, point = linkages(inputs, finite)
        found = at_stroke(coupler_curve(linkage, point), inputs[:, 10], circle=kind == "arc")
        return np.asarray(found.fit.deviation.astype(float)[:, None])

    def exact(i: int, numbers: list[Any]) -> list[Any]:
        of, (a, b) = Closed(numbers, finite[i], int(lead[i])), numbers[11:13]
        places = [of.at(2 * mp.atan((a + b) / 2 - (b - a) / 2 * mp.cos(mp.pi * k / PIECES))) for k in range(PIECES + 1)]
        return [mp.mpf(narrowest_annulus(places)[0] if kind == "arc" else width(places))]

    deviation = found.fit.deviation[some].astype(float)
    unit = stroke[some] if share > 1e-4 else np.maximum(stroke[some], linkage.size[some] * 1e-9)
    left = {"line": 2e-4, "arc": 3e-3, "cusp": 1e-3}[kind]
    return Row(f"deviation, {kind}", name, given, ours, exact, method=left * deviation / unit, unit=unit, roundings=1)


def windows(n: int) -> Iterator[Row]:
    for share in (1e-9, 1e-6, 1e-3, 0.3, 0.9, 1.0):
        for family in ("four-bar", "slider-crank"):
            row = traced(share, "line", plain(n, family, seed=7), f"{family}, {share:g} of the longest")
            if row:
                yield row
    # where its branches part widely, a cusped path has a narrower strip across them, which is not sought
    for kind, shares in (("arc", (1e-3, 0.3, 0.9)), ("cusp", (0.03, 0.2))):
        for share in shares:
            row = traced(share, kind, plain(n, seed=8), f"four-bar, {share:g} of the longest")
            if row:
                yield row


def stretches(n: int, stressed: Stressed, name: str) -> Iterator[Row]:
    """What `measure` tells of the straightest stretch over half a size, or over half of what the point runs: deviation,
    size, transmission angle."""
    inputs, finite = stressed
    numbers, told, flags, leads, shares = [], [], [], [], []
    linkage, point = linkages(inputs, finite)
    even = 0.5 - 0.5 * np.cos(np.pi * np.arange(PIECES + 1) / PIECES)
    for i in range(n):
        with contextlib.suppress(InvalidRequest, InvalidLinkage):
            guide = catalogue.guide(linkage.pivots[i].tolist(), (float(point[i].real), float(point[i].imag)))
            all_round = circuits(linkage[[i]])
            phases = np.linspace(0, all_round.period, 65)
            run = all_round.pose(phases).point(point[[i]].repeat(len(all_round)))
            farthest = float(np.nanmax(abs(run - run[0])))
            for one in catalogue.measure(guide, stroke=0.5 * min(float(linkage.size[i]), farthest), limit=1):
                found = circuits(one.linkage)[:1]
                if found.closure.change.any():
                    continue  # it goes straight through a change point, where the reference would turn aside
                s = found.phase[0] + np.array(one._window)
                if found.kind[0] == SWING and np.sin(s[0]) * np.sin(s[1]) <= 0:
                    continue  # the lead turns back on the way: it is no parameter
                turned = found.angle(s[:, None])[:, 0] - found.angle(found.phase[None])[0]
                along = found.angle((s[0] + (s[1] - s[0]) * even)[:, None])[:, 0]  # dense where the lead slows down
                shares.append((along - along[0]) / (along[-1] - along[0]))
                at = np.array([complex(*one.guided)])
                numbers.append(np.r_[numbers_of(one.linkage, at)[0], turned])
                told.append([one.deviation, one.size, one.min_transmission, one.stroke])
                flags.append(finite[i])
                leads.append(2 if found.lead[0] == COUPLER else int(found.lead[0]))
    if len(told) < 2:
        return
    given, values = np.array(numbers), np.array(told)

    def path(i: int, numbers: list[Any]) -> tuple[Closed, list[tuple[Any, Any]]]:
        of, (a, b) = Closed(numbers, flags[i], leads[i]), numbers[10:12]
        return of, [of.pose(a + (b - a) * mp.mpf(share)) for share in shares[i].tolist()]

    def deviation(i: int, numbers: list[Any]) -> list[Any]:
        of, poses = path(i, numbers)
        return [mp.mpf(width([d + turn * of.point for d, turn in poses]))]

    def size(i: int, numbers: list[Any]) -> list[Any]:
        of, poses = path(i, numbers)
        places = [of.chain.fixed[k] for k in (0, 1) if flags[i][k][0]]
        places += [of.chain.moving[k] for k in (0, 1) if flags[i][k][1]]
        for k in (0, 1):  # rails, and slots as the coupler has them in mid-stroke
            if not flags[i][k][0]:
                places += ends([d + turn * of.chain.moving[k] for d, turn in poses])
            elif not flags[i][k][1]:
                places += ends([(of.chain.fixed[k] - d) / turn for d, turn in poses])
        run = [d + turn * of.point for d, turn in poses]
        apart = [abs(p - q) for p in places for q in (*places, *run)]
        return [max([*apart, abs(run[0] - run[-1])])]

    def angle(i: int, numbers: list[Any]) -> list[Any]:
        of, poses = path(i, numbers)
        (a, b), (a_star, b_star) = of.chain.fixed, of.chain.moving
        least = []
        for fixed, pin, other in ((b, b_star, a_star), (a, a_star, b_star)):
            each = [mp.arg((d + turn * pin - fixed) / (turn * (pin - other))) for d, turn in poses]
            least.append(min(abs(mp.asin(mp.sin(v))) for v in each))
        return [max(least) * 180 / mp.pi]

    def row(kernel: str, column: int, exact: Callable[[int, list[Any]], list[Any]], unit: Array, left: Any) -> Row:
        return Row(
            kernel, name, given, lambda _: values[:, [column]], exact, method=left, unit=unit, timed=False, roundings=1
        )

    yield row("measure: deviation", 0, deviation, values[:, 3], 2e-4 * values[:, 0] / values[:, 3])
    yield row("measure: size", 1, size, values[:, 1], 5e-3)
    if np.all(flags):
        yield row("measure: transmission angle", 2, angle, np.full(len(values), 90.0), 1e-3)


def ends(places: list[Any]) -> list[Any]:
    """Return the ends of places on a line."""
    one = max(places, key=lambda z: abs(z - places[0]))
    return [one, max(places, key=lambda z: abs(z - one))]


def fixed_nominal(code: str, stroke: float) -> Row:
    """Largest distance from the line itself, of guides of a series laid along it and moved aside by a part of it."""
    series = Registry().get(code)
    member = series.members[0]
    share = np.random.default_rng(8).random((200, len(member.parameters)))
    free = {p.name: p.spread(share[:, i]) for i, p in enumerate(member.parameters)}
    z = next(iter(series.guided(member.complete(free)))).pairs[:, 1]
    curve = coupler_curve(Linkage(member.synthesise(free)), np.divide(z[:, 0] + 1j * z[:, 1], z[:, 2]))
    curve = curve[np.flatnonzero((curve.extent.min(0) > 0.5) & (curve.linkage.size < 8))[:4]]
    linkage, point, _ = placed(curve, at_stroke(curve, 0.8 * curve.extent.min(0), circle=False), stroke)
    linkage, point = linkage.moved(1.0, 0.01j * stroke), point + 0.01j * stroke
    with np.errstate(all="ignore"):
        found = in_place(coupler_curve(linkage, point), Nominal(stroke))
    finite, lead = linkage.finite, np.array([2, 0, 1])[coupler_curve(linkage, point).motion.chart]
    given = np.column_stack([numbers_of(linkage, point), found.low, found.high])

    def ours(inputs: Array) -> Array:
        linkage, point = linkages(inputs, finite)
        return in_place(coupler_curve(linkage, point), Nominal(stroke)).fit.deviation[:, None]

    def exact(i: int, numbers: list[Any]) -> list[Any]:
        of, (a, b) = Closed(numbers, finite[i], int(lead[i])), numbers[10:12]
        run = [of.at(2 * mp.atan((a + b) / 2 - (b - a) / 2 * mp.cos(mp.pi * k / PIECES))) for k in range(PIECES + 1)]
        x, fine = -np.cos(np.pi * np.arange(PIECES + 1) / PIECES), np.linspace(-1, 1, 4001)
        off = np.array([float(p.imag / stroke) for p in run])
        ends = sorted((run[0].real, run[-1].real))
        assert abs(ends[0]) < 1e-8 * stroke > abs(ends[1] - stroke)
        return [mp.mpf(np.abs(np.polynomial.Chebyshev.fit(x, off, PIECES, domain=(-1, 1))(fine)).max()) * stroke]

    unit = np.full(len(linkage), stroke)
    return Row("fixed nominal", f"{code}, stroke {stroke:g}", given, ours, exact, method=2e-6, unit=unit, roundings=1)


def jacobian(name: str, stressed: Stressed) -> Row | None:
    """How far the guided point moves across its path, at its place along it, by each coordinate of the pivots."""
    inputs, finite = stressed
    linkage, point = linkages(inputs, finite)
    chart = np.argmax(np.nan_to_num([motion(linkage, k, point).conditioning for k in range(3)]), axis=0)
    moving = motion(linkage, chart, point)
    t = 0.2 * np.minimum(moving.interval[1], 2.0)
    steps = np.stack([t, t * (1 + 1e-6)])
    with np.errstate(all="ignore"):
        way = np.diff(moving.pose(steps).point(point), axis=0)[0]
        heading = np.angle(way)
    given = np.column_stack([inputs, t, heading])
    lead = np.array([2, 0, 1])[chart]

    def ours(inputs: Array) -> Array:
        linkage, point = linkages(inputs, finite)
        many = np.resize(chart, len(inputs))
        by = pose_jacobian(motion(linkage, many, point), point, inputs[None, :, 10], np.exp(1j * inputs[:, 11]))
        return np.asarray(by.across[0][:, np.flatnonzero(columns)])

    def exact(i: int, numbers: list[Any]) -> list[Any]:
        angle, heading = 2 * mp.atan(numbers[10]), mp.expj(numbers[11])
        of = Closed(numbers, finite[i], int(lead[i]))
        here, h = of.at(angle), mp.mpf(10) ** -18
        size = mp.mpf(float(linkage.size[i]))
        speed = (of.at(angle + h) - of.at(angle - h)) / (2 * h)
        out = []
        for k in np.flatnonzero(columns):
            ways = []
            for side in (1, -1):
                moved = list(numbers[:10])
                moved[k] += side * h * size
                other = Closed(moved, finite[i], int(lead[i]))
                other.side = of.side
                # along the nominal it is where it was: one step of Newton, and another for what that leaves
                a = angle
                for _ in range(4):
                    a -= (heading.conjugate() * (other.at(a) - here)).real / (heading.conjugate() * speed).real
                ways.append((heading.conjugate() * (other.at(a) - here)).imag)
            out.append((ways[0] - ways[1]) / (2 * h * size))
        return out

    columns = np.repeat(np.r_[finite.all(0).reshape(4), True], 2)
    return Row("sensitivity", name, given, ours, exact, bound=1000)


def rows(n: int, stresses: dict[str, Callable[[int], Stressed]] = STRESSES) -> Iterator[Row]:
    """Yield all rows of these kernels."""
    yield from zones()
    yield from windows(n)
    for code, stroke in (("I.GG", 1.0), ("II.xy", 1.0), ("II.xy", 1e-150), ("II.xy", 1e150)):
        yield fixed_nominal(code, stroke)
    for name, make in stresses.items():
        stressed = make(n)
        row = jacobian(name, stressed)
        if row:
            yield row
        yield from stretches(n, stressed, name)
