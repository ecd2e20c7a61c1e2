"""Series III.Kx and III*.Kx: the coupler (the frame) in line with one crank.

Every linkage has this form at a limit of crank 1.  kappa = 0 (kappa* = 0 in III*), as in III.KK,
with pair 1 on the pole tangent, its moving (fixed) pivot at the pole, and pair 3 on the circle K.
The other two principal pairs, [2] and [4], are on K.
"""

from collections.abc import Iterator

import numpy as np

from catalogue.plugin import (
    PR,
    RP,
    Array,
    Guided,
    Instant,
    Member,
    Parameter,
    Parameters,
    Posed,
    Series,
    alike,
    angles,
    dot,
    four_bars,
    hookimpl,
    linkage_of,
    on_ray,
    poles_by_two_cranks,
    roots,
    slide_pair,
    tangent_circle_pair,
    tangent_pair,
    without,
)

PSI = Parameter("psi", angles((12, 78)), "tan(psi) = S/rho0; the cuspidation point stands on the ray -psi [rad]")
PSI_BOTH = Parameter("psi", angles((-78, -12), (12, 78)), PSI.meaning)
PSI_REAL = Parameter("psi", angles((46, 78)), PSI.meaning)
PHI_3 = Parameter("phi3", angles((-83, -5), (5, 83)), "direction of crank 3 [rad]")
PHI_3_LEFT = Parameter("phi3", angles((6, 84)), PHI_3.meaning)
PHI_2 = Parameter("phi2", angles((-83, -5), (5, 83)), "direction of the guided pair 2 [rad]")
A_1 = Parameter("a1", ((-5.0, -0.2), (0.2, 5.0)), "rho0/r1, inverse length of crank 1")


def pivots(p: Parameters) -> Array:
    """Build crank 1 (a slider for a1 = 0) along the pole tangent, from the pole; crank 3 on K."""
    return linkage_of(tangent_pair(p["a1"]), tangent_circle_pair(1 / np.tan(p["psi"]), np.tan(p["phi3"])))


def with_slide(p: Parameters) -> Array:
    """Build pair 1 along the pole tangent, and the slide through K on the return circle."""
    return linkage_of(tangent_pair(p["a1"]), slide_pair(np.cos(p["phi3"]), np.sin(p["phi3"])))


def slider(p: Parameters) -> Parameters:
    """Make pair 1 a slider."""
    return {"a1": 0 * p["psi"]}


def slide(p: Parameters) -> Parameters:
    """Make pair 3 a slide."""
    return {"phi3": -p["psi"]}


def slider_slide(p: Parameters) -> Parameters:
    """Make pair 1 a slider and pair 3 a slide."""
    return {"a1": 0 * p["psi"], "phi3": -p["psi"]}


def pseudo_cuspidation(p: Parameters) -> Parameters:
    """Solve five positions of a line through a point, eq. (49): S/r1 = 1 + t3^2 - 2 S t3."""
    big, t3 = np.tan(p["psi"]), np.tan(p["phi3"])
    return {"a1": (1 + t3 * (t3 - 2 * big)) / big}


def pseudo_cuspidation_slider(p: Parameters) -> Parameters:
    """Solve the pseudo-cuspidation with a slider: S = 1/sin(2 phi3)."""
    return {"a1": 0 * p["phi3"], "psi": np.arctan(1 / np.sin(2 * p["phi3"]))}


def double_cuspidation(p: Parameters) -> Parameters:
    """Solve six positions: besides r1 = S/2 (not in Allievi)."""
    return {"a1": 2 / np.tan(p["psi"]), "phi3": np.pi / 4 + p["psi"] / 2}


def fifth_order(p: Parameters) -> Parameters:
    """Solve r1 = S/2 with real [2], [4]: phi2 + phi3 + phi4 = 0 and S = t2 t3 t4.

    This member is not in Allievi.
    """
    big = -np.tan(p["phi2"]) * np.tan(p["phi3"]) * np.tan(p["phi2"] + p["phi3"])
    return {"a1": 2 / big, "psi": np.arctan(big)}


def fifth_order_slide(p: Parameters) -> Parameters:
    """Solve order 5 with a slide for pair 3; [2] and [4] are perpendicular."""
    return {"a1": 2 / np.tan(p["psi"]), "phi3": -p["psi"]}


def coincident(p: Parameters) -> Parameters:
    """Make [2] and [4] coincide: the discriminant of (48) vanishes."""
    big, t3 = np.tan(p["psi"]), np.tan(p["phi3"])
    return {"a1": (1 + t3 * (t3 - big) ** 2 / (4 * big)) / big}


def guided(p: Parameters) -> Iterator[Guided]:
    """Yield [2] and [4] by eq. (48), and the cuspidation at t = -S.

    t^2 + (t3 - S) t + S (S/r1 - 1)/t3 = 0. They are of order 5 iff r1 = S/2.
    """
    big, t3 = np.tan(p["psi"]), np.tan(p["phi3"])
    order = np.where(alike(p["a1"] * big, 2.0), 5, 4)
    t2, t4 = roots(big - t3, big * (big * p["a1"] - 1) / t3)
    taken = [alike(t, t3) | alike(t, -big) | alike(t, 0.0) for t in (t2, t4)]
    yield Guided("[2]", without(tangent_circle_pair(1 / big, t2), taken[0]), order)
    yield Guided("[4]", without(tangent_circle_pair(1 / big, t4), taken[1] | alike(t4, t2)), order)
    slot, pseudo = slide_pair(np.cos(p["psi"]), -np.sin(p["psi"])), alike(t2, -big) | alike(t4, -big)
    yield Guided("cuspidation", without(slot, alike(t3, -big)), np.where(pseudo, order, 3))


def classify(instant: Instant) -> tuple[Array, Array]:
    """Return residual and margin.

    The residual is the distance of moving pivot 1 from the pole. The margin is that to II
    (rho0/|S|) and dead points.
    """
    linkage, at = instant.linkage, instant.curvature
    pole = at.pole[:, 0] + 1j * at.pole[:, 1]
    allowed = (linkage.dyads != RP) & (linkage.dyads[:, ::-1] != PR) & np.isfinite(at.rho0)[:, None]
    with np.errstate(invalid="ignore"):
        away = np.where(allowed, np.abs(linkage.points[..., 1] - pole[:, None]) / linkage.size[:, None], np.inf).min(1)
        return np.where(np.isfinite(away), away, np.nan), np.minimum(np.abs(at.s) * at.rho0, np.abs(linkage.sine))


def solve(posed: Posed) -> Array | None:
    """Solve for linkages with both fixed pivots and a circle or slot given: up to four.

    The order of contact is 3.
    """
    if posed.given != "fixed" or posed.path == "line":
        return None
    moving = []
    for pole, x, which in poles_by_two_cranks(posed):
        r, r_star = posed.reciprocals(pole)
        inverse = (r_star - r) * dot(posed.axis, 1j * x)
        pair = pole, on_ray(pole, posed.pivots[:, 1 - which], 1j * x, inverse)
        moving.append(pair if which == 0 else pair[::-1])
    return four_bars(posed.pivots, moving)


III_KX = Series(
    code="III.Kx",
    title="coupler in line with a crank, the other at its limit",
    inverse="III*.Kx",
    source="Allievi 1895, sec. 15, eqs. (44)-(46), (48), (49)",
    members=[
        Member("general", "four-bar", [PSI, PHI_3, A_1], pivots, weight=3.0),
        Member("general", "slider-crank", [PSI, PHI_3], pivots, slider),
        Member("general", "inverted-slider-crank", [PSI, A_1], with_slide, slide),
        Member("general", "swinging-block", [PSI_REAL], with_slide, slider_slide, weight=0.25),
        Member("pseudo-cuspidation", "four-bar", [PSI, PHI_3], pivots, pseudo_cuspidation),
        Member("pseudo-cuspidation", "slider-crank", [PHI_3_LEFT], pivots, pseudo_cuspidation_slider, weight=0.25),
        Member("double cuspidation", "four-bar", [PSI_BOTH], pivots, double_cuspidation, weight=0.25),
        Member("fifth order", "four-bar", [PHI_2, PHI_3_LEFT], pivots, fifth_order),
        Member("fifth order", "inverted-slider-crank", [PSI], with_slide, fifth_order_slide, weight=0.25),
        Member("coincident pairs", "four-bar", [PSI, PHI_3], pivots, coincident, weight=0.5),
    ],
    classify=classify,
    guided=guided,
    solve=solve,
)
III_STAR_KX = III_KX.inversion("III*.Kx", "frame in line with a crank")


@hookimpl
def catalogue_series() -> list[Series]:
    """Return the series and its inversion."""
    return [III_KX, III_STAR_KX]
