"""Series II.y0 and II*.y0: slider and a pair on the pole normal, and the inversion."""

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
    Series,
    hookimpl,
    linkage_of,
    normal_pair,
    slider_pair,
    tangent_pair,
)

Q_3 = Parameter("q3", ((-4.0, -1.15), (-0.85, -0.15), (0.15, 0.9), (1.1, 3.0)), "rho0/r3 of the crank")
PHI_2 = Parameter("phi2", tuple(np.radians([(12, 80)]).tolist()), "ray of the slider [rad]")


def pivots(p: Parameters) -> Array:
    """Place pair 3 on the pole normal, and a slider on the inflection circle."""
    return linkage_of(normal_pair(p["q3"]), slider_pair(np.cos(p["phi2"]), np.sin(p["phi2"])))


def slide(p: Parameters) -> Parameters:
    """Make pair 3 a slide through the return pole."""
    return {"q3": np.full_like(p["phi2"], -1.0)}


def pseudo_cuspidation(p: Parameters) -> Parameters:
    """Return five positions of a line through the return pole: q3 = 2, q4 = -1."""
    return {"q3": np.full_like(p["phi2"], 2.0)}


def guided(p: Parameters) -> Iterator[Guided]:
    """Yield [4] on the pole normal (33) and [1] on the pole tangent (43).

    q3 + q4 = 1 and 1/r1 = q3 q4 tan(phi2): the point at the pole runs out and back on one circle
    (five positions, no order of contact at the cusp).
    """
    q3 = p["q3"]
    q4 = 1 - q3
    slot, double, slide_itself = (np.abs(q3 - q) < 1e-12 for q in (2.0, 0.5, -1.0))
    yield Guided("[4]", np.where((slot | double)[:, None, None], np.nan, normal_pair(q4)), 4)
    yield Guided("[1]", tangent_pair(q3 * q4 * np.tan(p["phi2"])), 4)
    yield Guided("undulation", normal_pair(0 * q3), 3)
    yield Guided(
        "cuspidation", np.where(slide_itself[:, None, None], np.nan, normal_pair(0 * q3 - 1)), np.where(slot, 4, 3)
    )


def classify(instant: Instant) -> tuple[Array, Array]:
    """Return residual and margin.

    The residual is the cosine of the angle between the pole normal and the crank (or slide). The
    margin is that to II.ooo, II.xoy and dead points.
    """
    linkage, at = instant.linkage, instant.curvature
    slider = linkage.dyads == PR
    other = (linkage.dyads == RR) | (linkage.dyads == RP)
    cosine, sine = instant.along_axes
    normal = at.axes[:, 1, 0] + 1j * at.axes[:, 1, 1]
    allowed = (slider.sum(1) == 1) & (other.sum(1) == 1)
    with np.errstate(invalid="ignore", divide="ignore"):
        pole = at.pole[:, 0] + 1j * at.pole[:, 1]
        r = ((linkage.points[..., 0] - pole[:, None]) * normal.conj()[:, None]).real
        q3 = at.rho0 / np.where(slider, np.nan, np.where(linkage.dyads == RR, r, -at.rho0[:, None])).T
        residual = np.where(allowed, np.where(slider, 0, cosine).max(1), np.nan)
        ray = [np.where(slider, v, np.inf).min(1) for v in (cosine, sine)]
        margin = np.min([*ray, np.abs(np.fmax.reduce(q3, axis=0) - 1)], axis=0)
    return residual, margin


II_Y0 = Series(
    code="II.y0",
    title="slider, and a crank or slide on the pole normal",
    inverse="II*.y0",
    source="Allievi 1895, sec. 14, eqs. (33), (43)",
    members=[
        Member("general", "slider-crank", [Q_3, PHI_2], pivots, weight=3.0),
        Member("pseudo-cuspidation", "slider-crank", [PHI_2], pivots, pseudo_cuspidation, weight=0.5),
        Member("general", "swinging-block", [PHI_2], pivots, slide, weight=0.5),
    ],
    classify=classify,
    guided=guided,
)
II_STAR_Y0 = II_Y0.inversion("II*.y0", "slide, and a crank or slider on the pole normal")


@hookimpl
def catalogue_series() -> list[Series]:
    """Return the series and its inversion."""
    return [II_Y0, II_STAR_Y0]
