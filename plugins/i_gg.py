"""Series I.GG: the coupler is parallel to the line of the fixed pivots.

Both driving pairs lie on the circles of the degenerate cubics, r = R sin(phi) and r* = R* sin(phi);
two further principal pairs lie on the pole normal, and Ball's point is the inflection pole.
"""

from collections.abc import Iterator

import numpy as np

from catalogue.plugin import (
    RR,
    Array,
    Guided,
    Instant,
    Member,
    Parameter,
    Parameters,
    Posed,
    Series,
    circle_pair,
    circle_through,
    dot,
    equidistant,
    four_bars,
    hookimpl,
    linkage_of,
    mirror_images,
    normal_pair,
    product,
    real_roots,
)

KAPPA = Parameter("kappa", ((-3.0, -1.1), (-0.9, -0.1), (0.1, 2.5)), "rho0/R, curvature of the fixed circle")
PHI_1 = Parameter("phi1", tuple(np.radians([(12, 84), (96, 168)]).tolist()), "direction of crank 1 [rad]")
PHI_2 = Parameter("phi2", PHI_1.domain, "direction of crank 2 [rad]")

PHI_1_LEFT = Parameter("phi1", PHI_1.domain[:1], PHI_1.meaning)
KAPPA_30 = Parameter("kappa", ((-3.0, -1.1), (-0.3, -0.05), (0.05, 2.5)), KAPPA.meaning)


def pivots(p: Parameters) -> Array:
    """Place two cranks on the circles."""
    return linkage_of(circle_pair(p["kappa"], p["phi1"]), circle_pair(p["kappa"], p["phi2"]))


def symmetric(p: Parameters) -> Parameters:
    """Return cranks symmetric about the pole normal."""
    return {"phi2": np.pi - p["phi1"]}


def pseudo_undulation(p: Parameters) -> Parameters:
    """Solve five positions on a line at the inflection pole, eq. (29).

    cot(phi2) = -(1 + 2 kappa/kappa*) tan(phi1).
    """
    return {"phi2": np.arctan2(1.0, -(1 + 2 * p["kappa"] / (p["kappa"] + 1)) * np.tan(p["phi1"]))}


def double_undulation(p: Parameters) -> Parameters:
    """Solve six positions on a line, eq. (30) (Roberts).

    cot(phi1) = -cot(phi2) = sqrt(1 + 2 kappa/kappa*).
    """
    phi = np.arctan2(1.0, np.sqrt(1 + 2 * p["kappa"] / (p["kappa"] + 1)))
    return {"phi1": phi, "phi2": np.pi - phi}


def guided(p: Parameters) -> Iterator[Guided]:
    """Yield the principal pairs on the pole normal by eqs. (24), (25).

    They are real iff (kappa + kappa*)^2 >= 4 kappa kappa* c (27). Symmetric cranks raise even
    orders on the pole normal by one.
    """
    kappa, star = p["kappa"], p["kappa"] + 1
    c = 1 / (np.tan(p["phi1"]) * np.tan(p["phi2"]))
    even = np.abs(np.sin(p["phi1"] + p["phi2"])) < 1e-12
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt((kappa + star) ** 2 - 4 * kappa * star * c)
        large = 0.5 * (kappa + star + np.copysign(root, kappa + star))
        small = kappa * star * c / large
    # a pair at the inflection (return) pole is the pseudo-undulation (pseudo-cuspidation)
    straight = np.minimum(np.abs(kappa + large), np.abs(kappa + small)) < 1e-12
    slot = np.minimum(np.abs(star + large), np.abs(star + small)) < 1e-12
    for label, v in (("[3]", large), ("[4]", small)):
        q = kappa + v
        taken = ((np.abs(q) < 1e-12) | (np.abs(q + 1) < 1e-12))[:, None, None]
        yield Guided(label, np.where(taken, np.nan, normal_pair(q)), np.where(even, 5, 4))
    yield Guided("undulation", normal_pair(np.zeros_like(kappa)), np.where(straight, np.where(even, 5, 4), 3))
    yield Guided("cuspidation", normal_pair(np.full_like(kappa, -1)), np.where(slot, np.where(even, 5, 4), 3))


def classify(instant: Instant) -> tuple[Array, Array]:
    """Return residual and margin.

    The residual is the sine of the angle between coupler and line of fixed pivots. The margin is
    that to II, II*, I.Gy and dead points.
    """
    linkage, at = instant.linkage, instant.curvature
    z = linkage.points
    fixed, moving = z[:, 1, 0] - z[:, 0, 0], z[:, 1, 1] - z[:, 0, 1]
    with np.errstate(invalid="ignore", divide="ignore"):
        residual = np.abs((fixed.conj() * moving).imag) / (np.abs(fixed) * np.abs(moving))
        cubics = np.abs(at.kappa * at.rho0), np.abs(at.kappa_star * at.rho0)
        margin = np.min([*cubics, instant.along_axes[0].min(1), np.abs(linkage.sine)], axis=0)
    return np.where((linkage.dyads == RR).all(1), residual, np.nan), margin


def solve(posed: Posed) -> Array | None:
    """Solve for linkages with both fixed pivots given.

    For a pair on the pole normal there are two linkages, which guide it to order 3; for a pair on
    the circles of the cubics one more. For pivots symmetric to the axis those of order 5 follow by
    symmetry (Roberts).
    """
    if posed.given != "fixed":
        return None
    (one, two), axis = posed.pivots.T, posed.axis
    start = np.where(np.isnan(posed.centre), posed.point, posed.centre)
    middle = equidistant(start, axis, one, two)
    poles = [middle + side * np.abs(middle - one) * axis for side in (1, -1)]
    found = []
    for pole in poles:
        r, r_star = posed.reciprocals(pole)
        found.append((pole, 1 / (1 + 2 * dot(axis, middle - pole) * (r_star - r))))
    if posed.path == "circle":
        pole = start + axis * 2 * dot(axis, circle_through(start, one, two) - start)
        found.append((pole, dot(axis, posed.point - pole) / dot(axis, start - pole)))
    if posed.path != "slot":
        found += _symmetric_solutions(posed, start)
    return four_bars(posed.pivots, [(q + h * (one - q), q + h * (two - q)) for q, h in found])


def _symmetric_solutions(posed: Posed, start: Array) -> list[tuple[Array, Array]]:
    """Solve for poles and ratios of linkages with fixed pivots symmetric to the axis, at +-w."""
    (one, two), axis = posed.pivots.T, posed.axis
    w, foot = 0.5 * np.abs(one - two), 0.5 * (one + two)
    both = mirror_images(start, axis, one, two)
    if posed.path == "line":
        slope, none, all_ = dot(axis, posed.point - foot) / w, np.zeros_like(w), np.ones_like(w)
        t = real_roots(np.stack([-all_, -slope, -all_, 3 * slope, 4 * all_ + none], axis=-1)).T
        q, h = -w * t, 0.5 * (1 / t**2 - 1)
    else:
        a, b = dot(axis, posed.centre - foot), dot(axis, posed.point - foot)
        q = real_roots(_quintic(a, b, w)).T
        alpha = -q / (w * w + q * q)
        h = alpha / (alpha + 1 / (b - q) - 1 / (a - q))
        h = np.where(np.min(np.abs([q, q - a, q - b]), axis=0) > 1e-9 * (w + np.abs(a - b)), h, np.nan)
    return [(np.where(both, foot + axis * x, np.nan), y) for x, y in zip(q, h, strict=True)]


def _quintic(a: Array, b: Array, w: Array) -> Array:
    """Return the ascending coefficients of (26) for cot(phi1) = -cot(phi2) in the pole's height."""
    one = np.ones_like(a)
    q, r, t = (np.stack(c, axis=-1) for c in ((0 * one, one), (a, -one), (b, -one)))
    d, e = (np.stack([sign * w * w, 0 * one, one], axis=-1) for sign in (1, -1))
    gap = (a - b)[:, None]
    parts = [
        product(q, t, d, d),
        4 * product(q, q, r, t, d),
        -gap * product(q, d, d),
        2 * product(q, q, q, r, r, t),
        product(q, e, r, r, t),
        -gap * product(e, r, d),
    ]
    return np.asarray(sum(np.pad(p, ((0, 0), (0, 7 - p.shape[1]))) for p in parts))[:, :6]


I_GG = Series(
    code="I.GG",
    title="coupler parallel to the line of fixed pivots",
    inverse="I.GG",
    source="Allievi 1895, secs. 12, 22, eqs. (24)-(30)",
    members=[
        Member("general", "four-bar", [KAPPA, PHI_1, PHI_2], pivots, weight=2.0),
        Member("symmetric", "four-bar", [KAPPA, PHI_1_LEFT], pivots, symmetric),
        Member("pseudo-undulation", "four-bar", [KAPPA, PHI_1], pivots, pseudo_undulation),
        Member("double undulation", "four-bar", [KAPPA_30], pivots, double_undulation, weight=0.25),
    ],
    classify=classify,
    guided=guided,
    solve=solve,
)


@hookimpl
def catalogue_series() -> list[Series]:
    """Return the series, which is its own inverse."""
    return [I_GG]
