"""Series general: any linkage with a finite pole whose cubics do not degenerate.

That is, s, kappa and kappa* are other than zero.  With a = S/R, b = S/R* and the tangents t of
their rays, all four principal pairs have t1 + t2 + t3 + t4 = a + b and t1 t2 t3 t4 = a b; the
undulation point stands on the ray t = -a, the cuspidation point on t = -b.  Inversion turns (a, b)
into (b, a) up to a mirror image and leaves the tangents; the series is its own inverse.  e1 is the
sum of the four tangents, e3 that of their products in threes.
"""

from collections.abc import Callable, Iterator

import numpy as np

from catalogue.plugin import (
    PR,
    RP,
    Array,
    Guided,
    Instant,
    Linkage,
    Member,
    Parameter,
    Parameters,
    Posed,
    Series,
    alike,
    angles,
    hookimpl,
    linkage_of,
    ray_pair,
    roots,
    slide_pair,
    slider_pair,
    without,
)

Derive = Callable[[Parameters], Parameters]

KAPPA = Parameter("kappa", ((-3.0, -1.1), (-0.9, -0.1), (0.1, 2.5)), "rho0/R, curvature of the fixed cubic")
KAPPA_REAL = Parameter("kappa", ((-3.0, -1.1), (0.1, 2.5)), KAPPA.meaning)
PSI = Parameter("psi", angles((12, 78)), "tan(psi) = |S|/rho0 [rad]")
PHI_1 = Parameter("phi1", angles((-83, -5), (5, 83)), "direction of pair 1 [rad]")
PHI_1_LEFT = Parameter("phi1", angles((5, 83)), PHI_1.meaning)
PHI_2 = Parameter("phi2", angles((-81, -6), (6, 81)), "direction of pair 2 [rad]")
CHI = Parameter("chi", angles((-165, -100), (-80, 80), (100, 165)), "kappa + kappa* = sin(phi1 + phi2)/cos(chi) [rad]")
ALPHA = Parameter("alpha", angles((-80, -48), (-42, -10), (10, 42), (48, 80)), "tan(alpha) = S/R, or S/R* [rad]")


# -- linkages --------------------------------------------------------------------------------------
def crank(p: Parameters, name: str) -> Array:
    """Place a crank on a named ray."""
    return ray_pair(p["kappa"], p["s"], np.tan(p[name]))


def slider(p: Parameters, name: str) -> Array:
    """Place a slider on a ray through the undulation."""
    return slider_pair(np.cos(p[name]), np.sin(p[name]))


def slide(p: Parameters, name: str) -> Array:
    """Place a slide on a ray through the cuspidation."""
    return slide_pair(np.cos(p[name]), np.sin(p[name]))


def four_bar(p: Parameters) -> Array:
    """Build linkages of two cranks."""
    return linkage_of(crank(p, "phi1"), crank(p, "phi2"))


def with_slider(p: Parameters) -> Array:
    """Build linkages of crank and slider."""
    return linkage_of(crank(p, "phi1"), slider(p, "phi2"))


def with_slide(p: Parameters) -> Array:
    """Build linkages of crank and slide."""
    return linkage_of(crank(p, "phi1"), slide(p, "phi2"))


def with_both(p: Parameters) -> Array:
    """Build linkages of slider and slide."""
    return linkage_of(slider(p, "phi1"), slide(p, "phi2"))


# -- conditions ------------------------------------------------------------------------------------
def inverse(derive: Derive) -> Derive:
    """Apply the condition to the inverse motion."""

    def derived(p: Parameters) -> Parameters:
        there = derive({**p, "kappa": -1 - p["kappa"]} if "kappa" in p else p)
        return {**there, "s": -there["s"], **({"kappa": -1 - there["kappa"]} if "kappa" in there else {})}

    return derived


def cubics(a: Array, b: Array) -> dict[str, Array]:
    """Return the cubics from S/R and S/R*; as rho0 = 1, S = b - a."""
    return {"kappa": a / (b - a), "s": 1 / (b - a)}


def free(p: Parameters) -> dict[str, Array]:
    """Impose no condition."""
    return {"s": 1 / np.tan(p["psi"])}


def slide_ray(p: Parameters) -> dict[str, Array]:
    """Impose no condition besides the slide: t2 = -b."""
    return {**free(p), "phi2": np.arctan(-(p["kappa"] + 1) * np.tan(p["psi"]))}


def both_rays(p: Parameters) -> dict[str, Array]:
    """Impose no condition besides slider and slide: t1 = -a, t2 = -b."""
    return {**slide_ray(p), "phi1": np.arctan(-p["kappa"] * np.tan(p["psi"]))}


def pseudo_undulation(p: Parameters) -> Parameters:
    """Solve five positions on a line, eq. (23), for S: t1 + t2 - b (1 + cot1 cot2) = 2a."""
    t1, t2, kappa = np.tan(p["phi1"]), np.tan(p["phi2"]), p["kappa"]
    return {"s": (kappa + 1 + (3 * kappa + 1) * t1 * t2) / (t1 * t2 * (t1 + t2))}


def pseudo_undulation_slide(p: Parameters) -> Parameters:
    """Solve five positions on a line with a slide, t2 = -b: t1 + 1/t1 = 2 (a + b)."""
    s = (2 * p["kappa"] + 1) * np.sin(2 * p["phi1"])
    return {"s": s, "phi2": np.arctan(-(p["kappa"] + 1) / s)}


def fifth_order(p: Parameters) -> Parameters:
    """Solve the condition of order 5, phi1 + ... + phi4 = 0 or e1 = e3, for kappa and S.

    It is not in Allievi.
    """
    both, product = p["phi1"] + p["phi2"], np.tan(p["phi1"]) * np.tan(p["phi2"])
    kappa = 0.5 * (np.sin(both) / np.cos(p["chi"]) - 1)
    return {"kappa": kappa, "s": (np.sin(p["chi"]) - np.cos(both)) / (2 * product * np.cos(p["chi"]))}


def fifth_order_slide(p: Parameters) -> Parameters:
    """Solve the condition of order 5 with a slide: b = -t2, a = t1 t2 cot(2 phi1 + phi2)."""
    t2 = np.tan(p["phi2"])
    return cubics(np.tan(p["phi1"]) * t2 / np.tan(2 * p["phi1"] + p["phi2"]), -t2)


def fifth_order_both(p: Parameters) -> Parameters:
    """Solve the condition of order 5 with slider and slide: a b = 1."""
    a = np.tan(p["alpha"])
    return {**cubics(a, 1 / a), "phi1": -p["alpha"], "phi2": np.arctan(-1 / a)}


def double_undulation(first: int, second: int) -> Derive:
    """Solve six positions on a line (not in Allievi) for both cranks.

    They are two of the three roots, counted from the largest, of
    t^3 - (2a + b) t^2 - ((a + 2b)/a) t + b = 0; all are real for a b > 0.
    """

    def derived(p: Parameters) -> Parameters:
        a = p["kappa"] * np.tan(p["psi"])
        b = a + np.tan(p["psi"])
        mean = (2 * a + b) / 3
        half = np.sqrt(mean**2 + (a + 2 * b) / (3 * a))
        cosine = np.clip((mean**3 + 0.5 * (mean * (a + 2 * b) / a - b)) / half**3, -1, 1)
        t1, t2 = (mean + 2 * half * np.cos((np.arccos(cosine) - 2 * np.pi * k) / 3) for k in (first, second))
        return {**free(p), "phi1": np.arctan(t1), "phi2": np.arctan(t2)}

    return derived


def double_undulation_slide(p: Parameters) -> Parameters:
    """Solve six positions on a line with a slide (not in Allievi).

    b = 1/a, a crank with t + 1/t = 2 (a + b).
    """
    a = np.tan(p["alpha"])
    c = a + 1 / a
    return {**cubics(a, 1 / a), "phi1": np.arctan(c - np.sqrt(c * c - 1)), "phi2": np.arctan(-1 / a)}


# -- guides and membership -------------------------------------------------------------------------
def guided(p: Parameters) -> Iterator[Guided]:
    """Yield [3] and [4] by eqs. (21), (22), of order 5 iff e1 = e3.

    Undulation and cuspidation follow; either may be one of these pairs.
    """
    s, kappa, t1, t2 = p["s"], p["kappa"], np.tan(p["phi1"]), np.tan(p["phi2"])
    a, b = kappa / s, (kappa + 1) / s
    total, product = a + b - t1 - t2, a * b / (t1 * t2)
    t3, t4 = roots(total, product)
    terms = np.array([t1 + t2, total, -t1 * t2 * total, -product * (t1 + t2)])
    order = np.where(np.abs(terms.sum(0)) < 1e-9 * np.abs(terms).sum(0), 5, 4)
    taken = [alike(t3, t1) | alike(t3, t2), alike(t4, t1) | alike(t4, t2) | alike(t4, t3)]
    for label, t, make in (("undulation", -a, slider_pair), ("cuspidation", -b, slide_pair)):
        pseudo, cos = [alike(t3, t), alike(t4, t)], 1 / np.sqrt(1 + t * t)
        taken = [old | new for old, new in zip(taken, pseudo, strict=True)]
        driving = alike(t1, t) | alike(t2, t)
        yield Guided(label, without(make(cos, t * cos), driving), np.where(pseudo[0] | pseudo[1], order, 3))
    for label, t, known in (("[3]", t3, taken[0]), ("[4]", t4, taken[1])):
        yield Guided(label, without(ray_pair(kappa, s, t), known), order)


def classify(instant: Instant) -> tuple[Array, Array]:
    """Return the residual, which is 0, and the margin to the degenerate series.

    The margin is the least of rho0/|S| (series I), rho0/|R| (II and III), those of the inverse
    series, and the distances from dead points and parallel cranks.
    """
    linkage, at = instant.linkage, instant.curvature
    with np.errstate(invalid="ignore"):
        margin = np.min([*(np.abs(c) * at.rho0 for c in (at.s, at.kappa, at.kappa_star)), np.abs(linkage.sine)], axis=0)
    cyclic = (linkage.dyads == PR).all(1) | (linkage.dyads == RP).all(1)
    return np.where(cyclic | ~np.isfinite(at.rho0), np.nan, 0.0), margin


def members() -> Iterator[Member]:
    """Yield a member for each condition and its inverse."""
    cc, cs, cg, sg = "four-bar", "slider-crank", "inverted-slider-crank", "swinging-block"
    yield Member("general", cc, [KAPPA, PSI, PHI_1, PHI_2], four_bar, free, weight=4.0)
    yield Member("general", cg, [KAPPA, PSI, PHI_1], with_slide, slide_ray, weight=2.0)
    yield Member("general", cs, [KAPPA, PSI, PHI_1], with_slider, inverse(slide_ray), weight=2.0)
    yield Member("general", sg, [KAPPA, PSI], with_both, both_rays)
    yield Member("fifth order", sg, [ALPHA], with_both, fifth_order_both, weight=0.25)
    yield Member("fifth order", cc, [PHI_1_LEFT, PHI_2, CHI], four_bar, fifth_order, weight=2.0)
    yield Member("fifth order", cg, [PHI_1_LEFT, PHI_2], with_slide, fifth_order_slide)
    yield Member("fifth order", cs, [PHI_1_LEFT, PHI_2], with_slider, inverse(fifth_order_slide))
    for point, other, pivots, turned in (
        ("undulation", cg, with_slide, lambda derive: derive),
        ("cuspidation", cs, with_slider, inverse),
    ):
        yield Member(f"pseudo-{point}", cc, [KAPPA, PHI_1_LEFT, PHI_2], four_bar, turned(pseudo_undulation), weight=2.0)
        yield Member(f"pseudo-{point}", other, [KAPPA, PHI_1], pivots, turned(pseudo_undulation_slide))
        yield Member(f"double {point}", other, [ALPHA], pivots, turned(double_undulation_slide), weight=0.25)
        for which, two in (("upper", (0, 1)), ("outer", (0, 2)), ("lower", (1, 2))):
            name = f"double {point}, {which} cranks"
            yield Member(name, cc, [KAPPA_REAL, PSI], four_bar, turned(double_undulation(*two)))


def solve(posed: Posed) -> Array | None:
    """Solve for linkages with one given crank that guide a pair to order 4.

    Crank and pair determine the instant; its two principal pairs are the possible second dyads.
    """
    if posed.given != "crank":
        return None
    n = len(posed.axis)
    pair = [np.where(np.isnan(z), posed.axis, z) for z in (posed.centre, posed.point)]
    weight = [np.where(np.isnan(z), 0.0, 1.0) for z in (posed.centre, posed.point)]
    z = np.stack([posed.pivots, np.stack(pair, axis=-1)], axis=1)
    w = np.stack([np.ones((n, 2)), np.stack(weight, axis=-1)], axis=1)
    both, valid = Linkage.valid(np.stack([z.real, z.imag, w], axis=-1))
    out = np.full((n, 2, 2, 2, 3), np.nan)
    out[valid, :, 0] = both.pivots[:, None, 0]
    out[valid, :, 1] = Instant(both).curvature.principal_pairs
    return out


GENERAL = Series(
    code="general",
    title="no degeneration",
    inverse="general",
    source="Allievi 1895, secs. 7-10, eqs. (20)-(23)",
    members=list(members()),
    classify=classify,
    guided=guided,
    solve=solve,
    degenerate=False,
)


@hookimpl
def catalogue_series() -> list[Series]:
    """Return the series, which is its own inverse."""
    return [GENERAL]
