"""Series I.yy: dead points. All pivots lie on the pole normal.

Two smooth branches of the motion cross there. One linkage at a dead point gives two members, one
per branch; each motion is symmetric about the pole normal.
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
    Series,
    circle_pair,
    dead_points,
    hookimpl,
    linkage_of,
    normal_pair,
    off_line,
)

Q_3 = Parameter("q3", ((-4.0, -1.15), (-0.85, -0.15), (0.15, 3.0)), "rho0/r3 of the first pair on the pole normal")
Q_4 = Parameter("q4", Q_3.domain, "rho0/r4 of the second pair")

#: Least margin at II.yy and II*.yy: above the largest tolerance at which pivots in double precision
#: are classified.
LEAST_MARGIN = 1e-6
#: Value of |kappa| rho0 above which a dead point is clear of II.yy: pivots with errors of 1 % of
#: the size change it by about as much.
AWAY = 0.1


def pivots(p: Parameters) -> Array:
    """Place both pairs on the pole normal."""
    return linkage_of(normal_pair(p["q3"]), normal_pair(p["q4"]))


def slider(p: Parameters) -> Parameters:
    """Make the second pair a slider."""
    return {"q4": np.zeros_like(p["q3"])}


def slide(p: Parameters) -> Parameters:
    """Make the second pair a slide."""
    return {"q4": np.full_like(p["q3"], -1.0)}


def both(_: Parameters) -> Parameters:
    """Make the pairs a slider and a slide: there is no free parameter."""
    return {"q3": np.array([0.0]), "q4": np.array([-1.0])}


def guided(p: Parameters) -> Iterator[Guided]:
    """Yield pairs on the circles, symmetric about the normal, by eq. (32).

    cot^2(phi) = -V3 V4/(kappa kappa*), kappa = (q3 + q4 - 1)/4; real iff that is positive.
    """
    q3, q4 = p["q3"], p["q4"]
    kappa = (q3 + q4 - 1) / 4
    with np.errstate(invalid="ignore", divide="ignore"):
        phi = np.arctan2(1.0, np.sqrt(-(q3 - kappa) * (q4 - kappa) / (kappa * (kappa + 1))))
        near = (np.minimum(np.abs(kappa), np.abs(kappa + 1)) < 0.02)[:, None, None]  # II.yy, II*.yy
        yield Guided("[1]", np.where(near, np.nan, circle_pair(kappa, phi)), 4)
        yield Guided("[2]", np.where(near, np.nan, circle_pair(kappa, np.pi - phi)), 4)
    for label, at in (("undulation", 0.0), ("cuspidation", -1.0)):
        taken = ((q3 == at) | (q4 == at))[:, None, None]  # the driving slider or slide
        yield Guided(label, np.where(taken, np.nan, normal_pair(np.full_like(q3, at))), 3)


def classify(instant: Instant) -> tuple[Array, Array]:
    """Return residual and margin.

    The residual is the distance from a dead point. The margin is that to II.yy and II*.yy: their
    linkages are dead points too, so that it is small there, but not 0.
    """
    linkage = instant.linkage
    lines = (linkage.dyads != RR).all(1) & (linkage.dyads[:, 0] == linkage.dyads[:, 1])
    branches = dead_points(linkage, beside=True)
    near = np.abs(np.stack([branches.kappa, branches.kappa_star]) * branches.rho0).reshape(2, -1, 2)
    away = np.nan_to_num(np.fmin.reduce(near, axis=(0, 2)), nan=AWAY)
    margin = np.clip(away, LEAST_MARGIN * AWAY, AWAY) / AWAY  # `away` may be as large as doubles permit
    return np.where(lines, np.nan, off_line(linkage)), margin


I_YY = Series(
    code="I.yy",
    title="dead points",
    inverse="I.yy",
    source="Allievi 1895, secs. 4, 13, eqs. (18), (19), (32)",
    members=[
        Member("general", "four-bar", [Q_3, Q_4], pivots, weight=3.0),
        Member("general", "slider-crank", [Q_3], pivots, slider, weight=0.5),
        Member("general", "inverted-slider-crank", [Q_3], pivots, slide, weight=0.5),
        Member("general", "swinging-block", [], pivots, both),
    ],
    classify=classify,
    guided=guided,
)


@hookimpl
def catalogue_series() -> list[Series]:
    """Return the series, which is its own inverse."""
    return [I_YY]
