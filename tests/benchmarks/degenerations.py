"""Digits lost near every degeneration, against 100 digits on the same rounded pivots.

Beside each loss stands the inherent one: what another rounding of the pivots does to the exact result.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np

from catalogue.curvature_theory.analysis import DEAD_POINT, REGULAR, curvature
from catalogue.curvature_theory.instant import Instant
from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.types import Array
from catalogue.plugin.registry import Registry
from catalogue.series.pairs import linkage_of, normal_pair, parallel_pair, ray_pair, tangent_pair
from tests.benchmarks.measuring import wanted_count

NEAR = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14)
QUANTITIES = ("pole", "axes", "kappa, kappa*, s", "principal pairs", "residuals")
#: They are not compared where a linkage counts as having parallel rays; at a dead point the pairs are not either.
OF_THE_POLE = QUANTITIES[:3]
EPS = float(np.finfo(float).eps)
ALL = -np.log10(EPS)
#: Other roundings of the pivots that are tried for the inherent loss.
ROUNDINGS = 4
DIGITS = 100
Draw = np.random.Generator


# -- linkages near a degeneration --------------------------------------------------------------------------------
def rays(kappa: Array, s: Array, draw: Draw) -> Array:
    """Two cranks on the cubics, on rays that are clear of the axes and of each other."""
    first = draw.uniform(0.3, 1.2, len(s))
    second = first + draw.uniform(0.5, 1.2, len(s))
    return linkage_of(ray_pair(kappa, s, np.tan(first)), ray_pair(kappa, s, np.tan(second)))


def free(draw: Draw, n: int) -> Array:
    return draw.uniform(0.3, 1.5, n)


def parallel(near: float, draw: Draw, n: int) -> Array:
    k, k_star = draw.uniform(0.3, 0.9, n), draw.uniform(1.2, 2, n)
    pivots = linkage_of(
        parallel_pair(np.ones(n), k, k_star),
        parallel_pair(draw.uniform(-2, -0.5, n), k, k_star),
    )
    crank = pivots[:, 1, 1, :2] - pivots[:, 1, 0, :2]
    pivots[:, 1, 1, :2] += near * np.stack([-crank[:, 1], crank[:, 0]], axis=1)
    return pivots


def orthogonal(near: float, draw: Draw, n: int) -> Array:
    """Crank 1 perpendicular to the coupler, which is in line with crank 2, but for a shift of the moving pivots."""
    pivots = linkage_of(tangent_pair(free(draw, n)), normal_pair(draw.uniform(0.15, 0.45, n)))
    pivots[:, :, 1, :2] += near * draw.uniform(0.3, 1, (n, 2, 2))
    return pivots


def dead_point(near: float, draw: Draw, n: int) -> Array:
    """Four-bars on one line, then crank 1 turned and the loop closed again."""
    a: Array
    c: Array
    d: Array
    e: Array
    while True:
        a, c, d = draw.uniform(-1, 1, 4 * n), draw.uniform(0.5, 2, 4 * n), draw.uniform(2, 3, 4 * n)
        e = d + draw.uniform(0.3, 1, 4 * n) * np.sign(draw.normal(size=4 * n))
        mobile = (a - c) * (d - e) * (a - d) * (c - e) > 0.05
        mobile &= np.abs(c - e) > 0.2
        if mobile.sum() >= n:
            break
    a, c, d, e = (v[mobile][:n].astype(np.longdouble) for v in (a, c, d, e))
    moved = a + (c - a) * np.exp(1j * np.longdouble(near))
    apart = d - moved
    along = (np.abs(apart) ** 2 + (e - c) ** 2 - (d - e) ** 2) / (2 * np.abs(apart))
    height = np.sqrt(np.maximum((e - c) ** 2 - along**2, 0))
    last = moved + apart / np.abs(apart) * (along + 1j * height)
    pivots = np.ones((n, 2, 2, 3))
    for i, pair in enumerate(((a + 0j, moved), (d + 0j, last))):
        for k, z in enumerate(pair):
            pivots[:, i, k, 0], pivots[:, i, k, 1] = z.real, z.imag
    return pivots


KINDS: dict[str, Callable[[float, Draw, int], Array]] = {
    "generic": lambda near, draw, n: rays(free(draw, n), free(draw, n), draw),  # noqa: ARG005, all makers are called alike
    "s (series I)": lambda near, draw, n: rays(free(draw, n), np.full(n, near), draw),
    "kappa (III)": lambda near, draw, n: rays(np.full(n, near), free(draw, n), draw),
    "kappa* (III*)": lambda near, draw, n: rays(np.full(n, near - 1), free(draw, n), draw),
    "kappa, s (II.xy)": orthogonal,
    "kappa*, s (II*.xy)": lambda near, draw, n: orthogonal(near, draw, n)[:, :, ::-1],
    "angle of the cranks (pole far)": parallel,
    "dead point": dead_point,
}


def linkages(kind: str, near: float, n: int, seed: int) -> Linkage:
    """Return n random linkages at a distance from a degeneration, placed anywhere."""
    draw = np.random.default_rng(seed)
    linkage = Linkage(KINDS[kind](near, draw, n))
    turn = np.exp(1j * draw.uniform(-np.pi, np.pi, n)) * draw.uniform(0.5, 2, n)
    return linkage.moved(turn, draw.normal(size=(n, 2)) @ np.array([1, 1j]))


# -- the instant in 100 digits --------------------------------------------------------------------------------
class Exact:
    """Pole, axes, parameters, pairs and residuals of one four-bar, as the definitions have them."""

    def __init__(self, pivots: Array) -> None:
        with mp.workdps(DIGITS):
            z = [[mp.mpc(mp.mpf(p[0]), mp.mpf(p[1])) for p in dyad] for dyad in pivots]
            e = [(m - f) / abs(m - f) for f, m in z]
            cross = (mp.conj(e[0]) * e[1]).imag
            q = z[0][0] + e[0] * (mp.conj(z[1][0] - z[0][0]) * e[1]).imag / cross
            r, r_star = ([(mp.conj(e[i]) * (z[i][k] - q)).real for i in (0, 1)] for k in (0, 1))
            m = [a * b / (a - b) for a, b in zip(r, r_star, strict=True)]
            diameter = 1j * (m[1] * e[0] - m[0] * e[1]) / cross
            rho0 = abs(diameter)
            y = diameter / rho0
            x = -1j * y
            cos, sin = ([(mp.conj(u) * v).real for v in e] for u in (x, y))
            h = (sin[1] / r[1] - sin[0] / r[0]) / (cos[0] * sin[1] - cos[1] * sin[0])
            s, kappa = h * cos[0] * cos[1], sin[0] * (1 / r[0] - h * cos[1])
            star = kappa + 1 / rho0
            every = [*z[0], *z[1]]
            self.size = max(abs(a - b) for a in every for b in every)
            self.centre = z[0][0]
            self.pole, self.x, self.parameters = q, x, (kappa, star, s)
            b = kappa + star - h * (cos[0] * sin[1] + cos[1] * sin[0])
            product = kappa * star * cos[0] * cos[1] / (sin[0] * sin[1])
            square = b * b - 4 * product
            self.clear = float(abs(square) / (b * b + abs(product)))
            self.pairs = []
            for v in ((b + mp.sqrt(square)) / 2, (b - mp.sqrt(square)) / 2) if square > 0 else ():
                ray = mp.mpc(s, v) / abs(mp.mpc(s, v))
                inverse = [(p + v) / ray.imag for p in (kappa, star)]
                self.pairs.append([(q + (x * ray.real + y * ray.imag) / w) for w in inverse])
            base, bar = z[1][0] - z[0][0], z[1][1] - z[0][1]
            slope = max(abs((mp.conj(v) * base).real) / abs(base) for v in e)
            self.residuals = {
                "I.GG": abs((mp.conj(base) * bar).imag) / abs(base) / abs(bar),
                "IV.l": max(abs(cross), slope),
            }


def chordal(one: Any, other: Any, centre: Any, unit: Any) -> float:
    """Distance on the sphere of unit diameter."""
    z, w = (one - centre) / unit, (other - centre) / unit
    return float(abs(z - w) / mp.sqrt((1 + abs(z) ** 2) * (1 + abs(w) ** 2)))


def apart(ours: list[list[Any]], theirs: list[list[Any]], centre: Any, unit: Any) -> float:
    """Largest chordal distance of two pairs, in the better of their orders."""
    orders = ((0, 1), (1, 0))
    return min(
        max(chordal(ours[i][k], theirs[j][k], centre, unit) for i, j in enumerate(order) for k in (0, 1))
        for order in orders
    )


def errors(found: dict[str, Any], exact: Exact) -> dict[str, float]:
    """Return the error of each quantity, NaN where there is nothing to compare."""
    with mp.workdps(DIGITS):
        unit = max(abs(p) for p in exact.parameters)
        out = {
            "pole": chordal(found["pole"], exact.pole, exact.centre, exact.size),
            "axes": float(abs(found["x"] - exact.x)),
            "kappa, kappa*, s": float(
                max(abs(p - w) for p, w in zip(found["parameters"], exact.parameters, strict=True)) / unit
            ),
            "residuals": float(max(abs(found["residuals"][k] - w) for k, w in exact.residuals.items())),
            "principal pairs": np.nan,
        }
        if exact.clear > 1e-3 and exact.pairs:
            real = len(found["pairs"]) == 2
            out["principal pairs"] = apart(found["pairs"], exact.pairs, exact.centre, exact.size) if real else np.inf
        return out


def lost(error: float) -> float:
    """Return the digits that an error costs, between none and all."""
    return float(np.clip(np.log10(max(error, EPS) / EPS), 0, ALL)) if not np.isnan(error) else np.nan


def measure(kind: str, near: float, n: int, seed: int = 1) -> dict[str, dict[str, Array]]:
    """Return the digits lost of each quantity, ``ours`` and ``inherent``, shape (n,).

    NaN where the linkage is taken for one with parallel rays (pole, axes, parameters) or at a dead point (pairs too).
    The inherent loss of a linkage is the median, and of the worst the largest, of several other roundings.
    """
    linkage = linkages(kind, near, n, seed)
    at = curvature(linkage)
    residuals = {code: Registry().get(code).classify(Instant(linkage))[0] for code in ("I.GG", "IV.l")}
    draw = np.random.default_rng(seed + 1)
    out: dict[str, dict[str, list[Any]]] = {q: {"ours": [], "inherent": [], "largest": []} for q in QUANTITIES}
    for i in range(n):
        pivots = linkage.pivots[i]
        exact = Exact(pivots)
        given = {
            "pole": mp.mpc(*at.pole[i]),
            "x": mp.mpc(*at.axes[i, 0]),
            "parameters": [mp.mpf(float(v[i])) for v in (at.kappa, at.kappa_star, at.s)],
            "pairs": [[_point(p) for p in pair] for pair in at.principal_pairs[i] if np.isfinite(pair).all()],
            "residuals": {code: mp.mpf(float(r[i])) for code, r in residuals.items()},
        }
        without = () if at.state[i] == REGULAR else QUANTITIES[:4] if at.state[i] == DEAD_POINT else OF_THE_POLE
        ours = errors(given, exact)
        others = [errors(vars(_rounded_again(pivots, draw)), exact) for _ in range(ROUNDINGS)]
        for q in QUANTITIES:
            losses = [lost(o[q]) for o in others]
            out[q]["ours"].append(np.nan if q in without else lost(ours[q]))
            out[q]["inherent"].append(np.nan if np.isnan(losses).any() else np.median(losses))
            out[q]["largest"].append(np.nan if np.isnan(losses).any() else max(losses))
    return {q: {k: np.array(v) for k, v in two.items()} for q, two in out.items()}


def _point(p: Array) -> Any:
    """A pivot as a number of mpmath; one at infinity far out in its direction."""
    return mp.mpc(*p[:2]) * (1 if p[2] else mp.mpf(10) ** 40)


def _rounded_again(pivots: Array, draw: Draw) -> Exact:
    with mp.workdps(DIGITS):
        return Exact(pivots.astype(object) * (mp.mpf(1) + EPS * draw.uniform(-0.5, 0.5, pivots.shape).astype(object)))


def rows(n: int, near: tuple[float, ...] = NEAR, kinds: Any = KINDS) -> list[tuple[str, float, int, dict[str, Any]]]:
    """Return per kind and distance how many count as degenerate, and of each quantity what `summary` says."""
    out = []
    for kind in kinds:
        for eps in near[:1] if kind == "generic" else near:
            found = measure(kind, eps, n)
            here = {q: summary(two) for q, two in found.items()}
            out.append((kind, eps, int(np.isnan(found["pole"]["ours"]).sum()), here))
    return out


def summary(two: dict[str, Array]) -> tuple[float, float, float, float] | None:
    """Return median and worst, ours and inherent, over what is compared."""
    there = ~np.isnan(two["ours"]) & ~np.isnan(two["inherent"])
    if there.sum() < 5:
        return None
    ours, inherent, largest = (two[k][there] for k in ("ours", "inherent", "largest"))
    return float(np.median(ours)), float(ours.max()), float(np.median(inherent)), float(largest.max())


def excess(values: tuple[float, float, float, float] | None) -> float:
    """Return by how many digits the median, or the worst, is worse than the inherent one."""
    return 0.0 if values is None else max(values[0] - values[2], values[1] - values[3])


def plot(found: list[tuple[str, float, int, dict[str, Any]]], path: Path) -> None:
    """Draw the medians against the distance: ours as marks, the inherent ones as lines."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "stability"
    import matplotlib.pyplot as plt

    kinds = [k for k in KINDS if k != "generic"]
    figure, axes = plt.subplots(2, 4, figsize=(13, 6), sharex=True, sharey=True, layout="constrained")
    colours = dict(zip(QUANTITIES, ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#555555"), strict=True))
    for ax, kind in zip(axes.flat, kinds, strict=False):
        for q, colour in colours.items():
            here = [(eps, v[q]) for k, eps, _, v in found if k == kind and v[q] is not None]
            if here:
                x = [eps for eps, _ in here]
                ax.semilogx(x, [v[2] for _, v in here], color=colour, lw=1.2)
                ax.semilogx(x, [v[0] for _, v in here], "o", color=colour, ms=4, mfc="white")
        ax.set_title(kind, fontsize=10)
        ax.grid(alpha=0.25)
    axes[0, 0].invert_xaxis()
    axes[0, 0].set_ylim(-0.5, 16)
    for ax in axes[:, 0]:
        ax.set_ylabel("digits lost (median)")
    for ax in axes[-1]:
        ax.set_xlabel("distance from the degeneration")
    last = axes.flat[len(kinds)]
    last.axis("off")
    for q, colour in colours.items():
        last.plot([], [], "-o", color=colour, mfc="white", label=q)
    last.legend(loc="center", frameon=False, title="marks: catalogue\nlines: inherent in the pivots")
    figure.savefig(path, metadata={"Date": None})


def main() -> None:
    """Write the table and the plot."""
    n = wanted_count(40)
    folder = Path(__file__).parents[2] / "data" / "reports"
    found = rows(n)
    cells = []
    for kind, eps, taken, here in found:
        texts = ["–" if v is None else f"{v[0]:.1f}/{v[1]:.1f} · {v[2]:.1f}/{v[3]:.1f}" for v in here.values()]
        cells.append([kind, f"{eps:.0e}", *texts, str(taken or "")])
    head = ["near", "distance", *QUANTITIES, "taken for the limit"]
    worst = max(((excess(v), k, e, q) for k, e, _, here in found for q, v in here.items()), key=lambda w: w[0])
    lines = ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *cells)]
    text = f"""# Digits lost near the degenerations

`python -m tests.benchmarks.degenerations` writes this table and the plot.

Each row: {n} random four-bars, placed at random, their pivots rounded to double precision.  Digits lost are
log10(error/2.2e-16) against the definitions evaluated in {DIGITS} digits on the same rounded pivots.  In a cell:
median/worst of the catalogue · median/worst that is inherent, found by rounding the exact pivots otherwise
({ROUNDINGS} times).

Errors: poles and principal pairs on the sphere (chordal, the size of the linkage as unit); axes as an angle; kappa,
kappa*, s relative to the largest of the three; residuals of membership (series I.GG and IV.l) absolute.  Principal
pairs that are imaginary, or nearly coincide, are left out.

Taken for the limit: below an angle of 1e-8 rays count as parallel, the pole as infinitely far and the axes as along
the rays, which is off by that angle; near a dead point, where the pivots carry no digit of kappa any more,
NaN is returned (`dead_points` has the two branches).

Farthest above the inherent loss: {worst[0]:.1f} digits ({worst[3]}, near {worst[1]}, {worst[2]:.0e}).  A pivot
farther than 5e14 lengths counts as infinitely far, which is worth up to one digit at 1e-14.

![median digits lost](degenerations.svg)

"""
    (folder / "degenerations.md").write_text(text + "\n".join(lines) + "\n", "utf-8")
    plot(found, folder / "degenerations.svg")
    print("\n".join(lines))
    print(f"worst excess: {worst}")


if __name__ == "__main__":
    main()
