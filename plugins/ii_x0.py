"""Series II.x0 and II*.x0: slider-crank with its coupler perpendicular to the guide.

The moving pivot of the crank is at the pole.  II*.x0 is the inversion.
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
    Series,
    hookimpl,
    linkage_of,
    normal_pair,
    slider_pair,
    tangent_pair,
)

A_1 = Parameter("a1", ((0.25, 4.0),), "rho0/r1, inverse length of the crank")
PHI_2 = Parameter("phi2", tuple(np.radians([(12, 84), (96, 168)]).tolist()), "ray of the slider [rad]")
PHI_2_COINCIDENT = Parameter("phi2", ((0.8, 1.4),), PHI_2.meaning)
PHI_2_OBTUSE = Parameter("phi2", PHI_2.domain[1:], PHI_2.meaning)


def pivots(p: Parameters) -> Array:
    """Place a crank along the pole tangent, with its moving pivot at the pole.

    The slider is on the inflection circle.
    """
    return linkage_of(tangent_pair(p["a1"]), slider_pair(np.cos(p["phi2"]), np.sin(p["phi2"])))


def pseudo_cuspidation(p: Parameters) -> Parameters:
    """Solve five positions of a line through the return pole, eq. (41): r1 = -cot(phi2)/2."""
    return {"a1": -2 * np.tan(p["phi2"])}


def coincident(p: Parameters) -> Parameters:
    """Make the two guided pairs coincide: 4 cot(phi2) = r1."""
    return {"a1": 0.25 * np.tan(p["phi2"])}


def guided(p: Parameters) -> Iterator[Guided]:
    """Yield [3] and [4] on the pole normal by eq. (40), q^2 - q + cot(phi2)/r1 = 0.

    They are real iff 4 cot(phi2)/r1 <= 1. Every point of the inflection circle is an undulation.
    """
    c = p["a1"] / np.tan(p["phi2"])
    square = 0.25 - c
    square = np.where(np.abs(square) < 1e-14, 0.0, square)
    q3 = 0.5 + np.sqrt(np.where(square >= 0, square, np.nan))
    q4 = c / q3
    slot = np.abs(q4 + 1) < 1e-12
    yield Guided("[3]", normal_pair(q3), 4)
    taken = (slot | (q3 == q4))[:, None, None]
    yield Guided("[4]", np.where(taken, np.nan, normal_pair(q4)), 4)
    yield Guided("undulation", normal_pair(0 * c), 3)
    yield Guided("cuspidation", normal_pair(0 * c - 1), np.where(slot, 4, 3))


def classify(instant: Instant) -> tuple[Array, Array]:
    """Return residual and margin.

    The residual is the sine of the angle between the coupler and the slider's ray. The margin is
    that to II.ooo (long crank) and II.xy.
    """
    linkage, slider = instant.linkage, instant.linkage.dyads == PR
    coupler = linkage.points[:, 1, 1] - linkage.points[:, 0, 1]
    allowed = (slider.sum(1) == 1) & (linkage.dyads == RR).any(1)
    with np.errstate(invalid="ignore", divide="ignore"):
        turn = coupler[:, None] / np.abs(coupler[:, None]) * linkage.rays.conj()
        residual = np.where(allowed, np.where(slider, np.abs(turn.imag), 0).max(1), np.nan)
        length = np.abs(linkage.points[..., 1] - linkage.points[..., 0])
        a1 = instant.curvature.rho0 / np.where(slider, np.inf, length).min(1)
        away = np.where(slider, np.inf, np.abs(turn.real)).min(1)  # crank perpendicular to the coupler: II.xy
        margin = np.minimum(a1, away)
    return residual, margin


II_X0 = Series(
    code="II.x0",
    title="slider-crank with its coupler perpendicular to the guide",
    inverse="II*.x0",
    source="Allievi 1895, sec. 14, eqs. (40), (41)",
    members=[
        Member("general", "slider-crank", [A_1, PHI_2], pivots, weight=3.0),
        Member("pseudo-cuspidation", "slider-crank", [PHI_2_OBTUSE], pivots, pseudo_cuspidation, weight=0.5),
        Member("coincident pairs", "slider-crank", [PHI_2_COINCIDENT], pivots, coincident, weight=0.25),
    ],
    classify=classify,
    guided=guided,
)
II_STAR_X0 = II_X0.inversion("II*.x0", "inverted slider-crank, its slide perpendicular to the line of fixed pivots")


@hookimpl
def catalogue_series() -> list[Series]:
    """Return the series and its inversion."""
    return [II_X0, II_STAR_X0]
