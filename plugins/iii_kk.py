"""Series III.KK and III*.KK: a circle through the pole touches the pole normal.

The circle passes through both fixed (moving) pivots.  kappa = 0 (kappa* = 0 in III*): the
centring-point curve is this circle K, r = S cos(phi), and the pole tangent.  Three principal pairs
[2], [3], [4] have their centres on K, [1] lies on the pole tangent: its path has a cusp, whose
branches run out and back on one arc.  In III* a point of the pole tangent is guided about the pole,
and K* carries the points, among them an undulation point where it meets the inflection circle.
"""

from collections.abc import Iterator

import numpy as np

from catalogue.plugin import (
    PR,
    RR,
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
    circle_through,
    dot,
    four_bars,
    hookimpl,
    linkage_of,
    on_ray,
    slide_pair,
    tangent_circle_pair,
    tangent_pair,
    unit,
    without,
)

PSI = Parameter("psi", angles((12, 78)), "tan(psi) = S/rho0; the cuspidation point stands on the ray -psi [rad]")
PSI_BOTH = Parameter("psi", angles((-78, -33), (-27, -12), (12, 27), (33, 78)), PSI.meaning)
PHI_2 = Parameter("phi2", angles((-83, -5), (5, 83)), "direction of crank 2 [rad]")
PHI_2_LEFT = Parameter("phi2", angles((5, 83)), PHI_2.meaning)
PHI_4 = Parameter("phi4", angles((-82, -6), (6, 82)), "direction of crank 4 [rad]")


def pivots(p: Parameters) -> Array:
    """Place two cranks with their fixed pivots on K."""
    s = 1 / np.tan(p["psi"])
    return linkage_of(*(tangent_circle_pair(s, np.tan(p[name])) for name in ("phi2", "phi4")))


def with_slide(p: Parameters) -> Array:
    """Place a slide through the point where K meets the return circle, and a crank."""
    crank = tangent_circle_pair(1 / np.tan(p["psi"]), np.tan(p["phi4"]))
    return linkage_of(slide_pair(np.cos(p["phi2"]), np.sin(p["phi2"])), crank)


def slide(p: Parameters) -> Parameters:
    """Make pair 2 the slide."""
    return {"phi2": -p["psi"]}


def pseudo_cuspidation(p: Parameters) -> Parameters:
    """Solve five positions of a line through a point, eq. (47): t2 + t4 = 2 S; [3] is the slot."""
    return {"phi4": np.arctan(2 * np.tan(p["psi"]) - np.tan(p["phi2"]))}


def double_cuspidation(p: Parameters) -> Parameters:
    """Solve six positions: besides t2 t4 = -1, perpendicular cranks (not in Allievi)."""
    return {"phi2": np.pi / 4 + p["psi"] / 2, "phi4": p["psi"] / 2 - np.pi / 4}


def fifth_order(p: Parameters) -> Parameters:
    """Solve for a pair [1] of order 5 (not in Allievi): its centre is that of K.

    r1 = S/2, phi2 + phi3 + phi4 = 0 and S = t2 t3 t4.
    """
    return {"psi": np.arctan(-np.tan(p["phi2"]) * np.tan(p["phi4"]) * np.tan(p["phi2"] + p["phi4"]))}


def fifth_order_slide(p: Parameters) -> Parameters:
    """Solve for order 5 with a slide as pair 2: the crank is perpendicular to the ray of [3]."""
    return {"phi2": -p["psi"], "phi4": np.pi / 4 + p["psi"] / 2}


def guided(p: Parameters) -> Iterator[Guided]:
    """Yield [3] by eq. (45), [1] by eq. (46), and the cuspidation.

    t2 + t3 + t4 = S; S/r1 = 1 + t2 t3 t4/S. [1] is of order 5 iff r1 = S/2.
    """
    s, t2, t4 = 1 / np.tan(p["psi"]), np.tan(p["phi2"]), np.tan(p["phi4"])
    t3 = 1 / s - t2 - t4
    a1 = s * (1 + s * t2 * t3 * t4)
    order = np.where(alike(a1 / s, 2.0), 5, 4)
    on_circle, in_pole = alike(t3, -1 / s), alike(t3, 0.0)
    driving = alike(t3, t2) | alike(t3, t4)
    yield Guided("[1]", tangent_pair(a1), order)
    yield Guided("[3]", without(tangent_circle_pair(s, t3), on_circle | in_pole | driving), order)
    slot = slide_pair(np.cos(p["psi"]), -np.sin(p["psi"]))
    taken = alike(t2, -1 / s) | alike(t4, -1 / s)
    yield Guided("cuspidation", without(slot, taken), np.where(on_circle, order, 3))


def classify(instant: Instant) -> tuple[Array, Array]:
    """Return the residual rho0/|R|, and the margin.

    The margin is that to II (rho0/|S|), to III.Kx, which has a pair on the pole tangent, and to
    dead points.
    """
    linkage, at = instant.linkage, instant.curvature
    inside = (linkage.dyads != PR).all(1) & (linkage.dyads == RR).any(1) & np.isfinite(at.rho0)
    with np.errstate(invalid="ignore"):
        margin = np.min([np.abs(at.s) * at.rho0, instant.along_axes[1].min(1), np.abs(linkage.sine)], axis=0)
        return np.where(inside, np.abs(at.kappa) * at.rho0, np.nan), margin


def solve(posed: Posed) -> Array | None:
    """Solve for the linkage on given fixed pivots that guides a circle or slot.

    The order of contact is 3.
    """
    if posed.given != "fixed" or posed.path == "line":
        return None
    a, axis = posed.centre, posed.axis
    middle = circle_through(a, posed.pivots[:, 0], posed.pivots[:, 1])
    pole = a + axis * 2 * dot(axis, middle - a)
    y = 1j * unit(middle - pole)
    r, r_star = posed.reciprocals(pole)
    one, two = (on_ray(pole, posed.pivots[:, i], y, (r_star - r) * dot(axis, y)) for i in (0, 1))
    return four_bars(posed.pivots, [(one, two)])


III_KK = Series(
    code="III.KK",
    title="fixed pivots and pole on a circle that touches the pole normal",
    inverse="III*.KK",
    source="Allievi 1895, sec. 15, eqs. (44)-(47)",
    members=[
        Member("general", "four-bar", [PSI, PHI_2, PHI_4], pivots, weight=3.0),
        Member("general", "inverted-slider-crank", [PSI, PHI_4], with_slide, slide),
        Member("pseudo-cuspidation", "four-bar", [PSI, PHI_2], pivots, pseudo_cuspidation),
        Member("double cuspidation", "four-bar", [PSI_BOTH], pivots, double_cuspidation, weight=0.25),
        Member("fifth order", "four-bar", [PHI_2_LEFT, PHI_4], pivots, fifth_order),
        Member("fifth order", "inverted-slider-crank", [PSI_BOTH], with_slide, fifth_order_slide, weight=0.25),
    ],
    classify=classify,
    guided=guided,
    solve=solve,
)
III_STAR_KK = III_KK.inversion("III*.KK", "moving pivots and pole on a circle that touches the pole normal")


@hookimpl
def catalogue_series() -> list[Series]:
    """Return the series and its inversion."""
    return [III_KK, III_STAR_KK]
