"""Series I.Gy: one crank perpendicular to a line through the pole.

That line joins the pole and the intersection of coupler and frame. One driving pair lies on the
circles of the degenerate cubics, the other on the pole normal.
"""

from collections.abc import Iterator

import numpy as np

from catalogue.plugin import (
    PR,
    RP,
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
    dot,
    four_bars,
    hookimpl,
    linkage_of,
    normal_pair,
    poles_by_two_cranks,
)

KAPPA = Parameter("kappa", ((-3.0, -1.1), (-0.9, -0.1), (0.1, 2.5)), "rho0/R, curvature of the fixed circle")
PHI_1 = Parameter("phi1", tuple(np.radians([(12, 80)]).tolist()), "direction of the pair on the circles [rad]")
Q_3 = Parameter("q3", ((-4.0, -1.15), (-0.85, -0.15), (0.15, 3.0)), "rho0/r3 of the pair on the pole normal")


def pivots(p: Parameters) -> Array:
    """Place pair 1 on the circles, pair 3 on the pole normal."""
    return linkage_of(circle_pair(p["kappa"], p["phi1"]), normal_pair(p["q3"]))


def slider(p: Parameters) -> Parameters:
    """Make pair 3 a slider, at the inflection pole."""
    return {"q3": np.zeros_like(p["kappa"])}


def slide(p: Parameters) -> Parameters:
    """Make pair 3 a slide, through the return pole."""
    return {"q3": np.full_like(p["kappa"], -1.0)}


def pseudo_undulation(p: Parameters) -> Parameters:
    """Put pair [4] at the inflection pole, eq. (31)."""
    return {"q3": 4 * p["kappa"] + 1}


def pseudo_cuspidation(p: Parameters) -> Parameters:
    """Put pair [4] at the return pole, eq. (31)*."""
    return {"q3": 4 * p["kappa"] + 2}


def opposite_circles(p: Parameters) -> Parameters:
    """Set R* = -R, with a slide: pseudo-undulation."""
    return {"kappa": np.full_like(p["phi1"], -0.5), "q3": np.full_like(p["phi1"], -1.0)}


def opposite_circles_slider(p: Parameters) -> Parameters:
    """Set R* = -R, with a slider: pseudo-cuspidation."""
    return {"kappa": np.full_like(p["phi1"], -0.5), "q3": np.zeros_like(p["phi1"])}


def guided(p: Parameters) -> Iterator[Guided]:
    """Yield [4] on the pole normal and [2] on the circles.

    q4 = 4 kappa + 1 - q3; [2] has the direction (V3 V4 sin(phi1), kappa kappa* cos(phi1)), V = q -
    kappa. Both are always real (from (24), (25)).
    """
    kappa, q3 = p["kappa"], p["q3"]
    q4 = 4 * kappa + 1 - q3
    straight, slot, driving = (np.abs(q4 - at) < 1e-12 for at in (0.0, -1.0, q3))
    yield Guided("[4]", np.where((straight | slot | driving)[:, None, None], np.nan, normal_pair(q4)), 4)
    phi2 = np.arctan2(kappa * (kappa + 1) * np.cos(p["phi1"]), (q3 - kappa) * (q4 - kappa) * np.sin(p["phi1"]))
    same = np.abs(np.sin(phi2 - p["phi1"])) < 1e-12
    yield Guided("[2]", np.where(same[:, None, None], np.nan, circle_pair(kappa, phi2)), 4)
    for label, at, raised in (("undulation", 0.0, straight), ("cuspidation", -1.0, slot)):
        taken = (q3 == at)[:, None, None]  # this is the driving pair itself
        yield Guided(label, np.where(taken, np.nan, normal_pair(np.full_like(q3, at))), np.where(raised, 4, 3))


def classify(instant: Instant) -> tuple[Array, Array]:
    """Return residual and margin.

    The residual is the cosine of the angle between the pole normal and the nearer crank, or the
    slider or slide if there is one. The margin is that to II, II*, I.yy and dead points.
    """
    linkage, at = instant.linkage, instant.curvature
    off, _ = instant.along_axes
    kind = np.sort(linkage.dyads, axis=1)
    line = (linkage.dyads == PR) | (linkage.dyads == RP)
    four_bar, one_line = (kind == RR).all(1), line.sum(1) == 1
    with np.errstate(invalid="ignore"):
        residual = np.where(four_bar, off.min(1), np.where(one_line, np.where(line, off, 0).max(1), np.nan))
        other = np.where(four_bar, off.max(1), np.where(line, 0, off).max(1))
        margin = np.min([np.abs(at.kappa * at.rho0), np.abs(at.kappa_star * at.rho0), other], axis=0)
    return residual, margin


def solve(posed: Posed) -> Array | None:
    """Solve for linkages with both fixed pivots and a circle given: up to four.

    They guide the point to order 3.
    """
    if posed.given != "fixed" or posed.path != "circle":
        return None
    moving = []
    for pole, y, which in poles_by_two_cranks(posed):
        one, other = posed.pivots[:, which], posed.pivots[:, 1 - which]
        q = dot(posed.axis, pole - posed.centre)
        h = 1 - np.abs(posed.point - posed.centre) / q
        inverse = (1 / h - 1) * -dot(posed.axis, y) / q  # over the distance of the circle from the pole
        pair = pole + y / (1 / dot(one - pole, y) + inverse), pole + h * (other - pole)
        moving.append(pair if which == 0 else pair[::-1])
    return four_bars(posed.pivots, moving)


I_GY = Series(
    code="I.Gy",
    title="one crank perpendicular to the collineation axis",
    inverse="I.Gy",
    source="Allievi 1895, secs. 12, 23, eqs. (24), (25), (31)",
    members=[
        Member("general", "four-bar", [KAPPA, PHI_1, Q_3], pivots, weight=2.0),
        Member("pseudo-undulation", "four-bar", [KAPPA, PHI_1], pivots, pseudo_undulation),
        Member("pseudo-cuspidation", "four-bar", [KAPPA, PHI_1], pivots, pseudo_cuspidation, weight=0.25),
        Member("general", "slider-crank", [KAPPA, PHI_1], pivots, slider, weight=0.5),
        Member("pseudo-cuspidation", "slider-crank", [PHI_1], pivots, opposite_circles_slider, weight=0.05),
        Member("general", "inverted-slider-crank", [KAPPA, PHI_1], pivots, slide, weight=0.5),
        Member("pseudo-undulation", "inverted-slider-crank", [PHI_1], pivots, opposite_circles, weight=0.1),
    ],
    classify=classify,
    guided=guided,
    solve=solve,
)


@hookimpl
def catalogue_series() -> list[Series]:
    """Return the series, which is its own inverse."""
    return [I_GY]
