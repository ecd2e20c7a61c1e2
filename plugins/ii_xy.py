"""Series II.xy and II*.xy (Evans): one crank in line with the coupler, the other normal to it.

Crank 1 has its moving pivot at the pole, pair 3 stands on the pole normal.  Every point of the
inflection circle is an undulation; one, [2], is a pseudo-undulation.
"""

from collections.abc import Iterator

import numpy as np

from catalogue.plugin import (
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
    dot,
    four_bars,
    hookimpl,
    linkage_of,
    normal_pair,
    on_ray,
    slider_pair,
    tangent_pair,
    unit,
)

A_1 = Parameter("a1", ((0.25, 4.0),), "rho0/r1, inverse length of crank 1")
Q_3 = Parameter("q3", ((-4.0, -1.15), (-0.85, -0.15), (0.15, 3.0)), "rho0/r3 of the pair on the pole normal")


def pivots(p: Parameters) -> Array:
    """Place crank 1 along the pole tangent, its moving pivot at the pole; pair 3 on the normal."""
    return linkage_of(tangent_pair(p["a1"]), normal_pair(p["q3"]))


def slide(p: Parameters) -> Parameters:
    """Make pair 3 a slide."""
    return {"q3": np.full_like(p["a1"], -1.0)}


def guided(p: Parameters) -> Iterator[Guided]:
    """Yield [2] by eq. (42), (cos, sin) ~ (q3 q4, 1/r1), on the inflection circle.

    [4] follows by (33), q3 + q4 = 1. A pair that coincides with the inflection (return) pole is
    given once, as its undulation (cuspidation).
    """
    q3, q4, a1 = p["q3"], 1 - p["q3"], p["a1"]
    norm = np.hypot(q3 * q4, a1)
    straight, slot, double, slide = (np.abs(q3 - q)[:, None, None] < 1e-12 for q in (1.0, 2.0, 0.5, -1.0))
    yield Guided("[2]", np.where(straight, np.nan, slider_pair(q3 * q4 / norm, a1 / norm)), 4)
    # with q3 = 1/2, [4] is the driving pair itself; with q3 = -1 the slide is the cuspidation
    yield Guided("[4]", np.where(straight | slot | double, np.nan, normal_pair(q4)), 4)
    yield Guided("undulation", normal_pair(0 * q3), np.where(straight[:, 0, 0], 4, 3))
    yield Guided("cuspidation", np.where(slide, np.nan, normal_pair(0 * q3 - 1)), np.where(slot[:, 0, 0], 4, 3))


def classify(instant: Instant) -> tuple[Array, Array]:
    """Return residual and margin.

    The residual is the larger of the cosine of the angle between the cranks and the distance of
    moving pivot 1 from the line of pair 3.
    """
    linkage = instant.linkage
    z, ray, kind = linkage.points, linkage.rays, linkage.dyads
    cosine = np.abs((ray[:, 0].conj() * ray[:, 1]).real)
    best, margin = np.full(len(linkage), np.inf), np.full(len(linkage), np.nan)
    for one, three in ((0, 1), (1, 0)):
        off = np.abs(((z[:, one, 1] - z[:, three, 0]) * ray[:, three].conj()).imag) / linkage.size
        allowed = (kind[:, one] == RR) & ((kind[:, three] == RR) | (kind[:, three] == RP))
        residual = np.where(allowed, np.maximum(cosine, off), np.inf)
        with np.errstate(invalid="ignore", divide="ignore"):
            a1 = instant.curvature.rho0 / np.abs(z[:, one, 1] - z[:, one, 0])
            r3 = ((z[:, three, 0] - z[:, one, 1]) * ray[:, three].conj()).real
            q3 = instant.curvature.rho0 / np.abs(r3)
        here = np.where(kind[:, three] == RR, np.minimum(a1, q3), a1)
        margin = np.where(residual < best, here, margin)
        best = np.minimum(best, residual)
    return np.where(np.isfinite(best), best, np.nan), margin


def solve(posed: Posed) -> Array | None:
    """Solve for linkages with both fixed pivots and a line given: up to four.

    The guided point is an undulation point of each.
    """
    if posed.given != "fixed" or posed.path != "line":
        return None
    a, b = (posed.pivots - posed.point[:, None]).T
    half = 0.5 * dot(posed.axis, a + b)
    root = np.sqrt(half * half - dot(a, b))
    moving = []
    for pole in (posed.point + (half + root) * posed.axis, posed.point + (half - root) * posed.axis):
        for one in (0, 1):
            other = posed.pivots[:, 1 - one]
            y = unit(other - pole)
            far = on_ray(pole, other, y, dot(posed.axis, y) * posed.reciprocals(pole)[1])
            moving.append((pole, far) if one == 0 else (far, pole))
    return four_bars(posed.pivots, moving)


II_XY = Series(
    code="II.xy",
    title="one crank along the coupler, one perpendicular to it (Evans)",
    inverse="II*.xy",
    source="Allievi 1895, secs. 14, 28, eqs. (33), (42)",
    members=[
        Member("general", "four-bar", [A_1, Q_3], pivots, weight=3.0),
        Member("general", "inverted-slider-crank", [A_1], pivots, slide, weight=0.25),
    ],
    classify=classify,
    guided=guided,
    solve=solve,
)
II_STAR_XY = II_XY.inversion("II*.xy", "one crank along the frame, one perpendicular to it")


@hookimpl
def catalogue_series() -> list[Series]:
    """Return the series and its inversion."""
    return [II_XY, II_STAR_XY]
