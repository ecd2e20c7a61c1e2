"""Series II.yy and II*.yy: dead points of mode II, 1/r3 + 1/r4 = 1/rho0.

Every point of the inflection circle is an undulation.
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
    dead_points,
    hookimpl,
    linkage_of,
    normal_pair,
    off_line,
    slider_pair,
    tangent_pair,
)

Q_3 = Parameter("q3", ((0.55, 0.85), (1.15, 1.85), (2.15, 3.0)), "rho0/r3, the larger of the two")
#: Rays of the undulation circle with stored points [deg]; by symmetry one side suffices.
RAYS = (30, 60)


def pivots(p: Parameters) -> Array:
    """Place both pairs on the pole normal, q3 + q4 = 1."""
    return linkage_of(normal_pair(p["q3"]), normal_pair(1 - p["q3"]))


def slide(_: Parameters) -> Parameters:
    """Return a crank and a slide: there is no free parameter."""
    return {"q3": np.array([2.0])}


def guided(p: Parameters) -> Iterator[Guided]:
    """Yield [1] = [2], doubly at the pole, whose path is a hypercusp along the normal.

    Undulations all over the inflection circle follow, and the cuspidation at the return pole.
    """
    q3 = p["q3"]
    yield Guided("[1]", tangent_pair(0 * q3), 4)
    for degrees in RAYS:
        yield Guided(
            f"ray {degrees}", slider_pair(*(np.full_like(q3, f(np.radians(degrees))) for f in (np.cos, np.sin))), 3
        )
    yield Guided("undulation", normal_pair(0 * q3), 3)
    taken = (q3 == 2)[:, None, None]
    yield Guided("cuspidation", np.where(taken, np.nan, normal_pair(0 * q3 - 1)), 3)


def classify(instant: Instant) -> tuple[Array, Array]:
    """Return residual and margin.

    The residual is |kappa| rho0 at the nearer of the two poles of the dead point or, if larger, the
    distance from a dead point. The margin is that to II.ooo, q3 = 1, which alone has sliders.
    """
    dyads = instant.linkage.dyads
    of_family = (dyads == RR).any(1) & (dyads != PR).all(1)
    branches = dead_points(instant.linkage, beside=True)
    kappa = np.abs(branches.kappa * branches.rho0).reshape(-1, 2)
    distance = np.maximum(np.fmin.reduce(kappa, axis=1), off_line(instant.linkage))
    residual = np.where(of_family, distance, np.nan)
    return residual, np.where(np.isnan(residual), np.nan, 1.0)


II_YY = Series(
    code="II.yy",
    title="dead points with all points of the inflection circle undulating",
    inverse="II*.yy",
    source="Allievi 1895, sec. 14, eq. (33)",
    members=[
        Member("general", "four-bar", [Q_3], pivots),
        Member("general", "inverted-slider-crank", [], pivots, slide),
    ],
    classify=classify,
    guided=guided,
)
II_STAR_YY = II_YY.inversion("II*.yy", "dead points with all points of the return circle cusping")


@hookimpl
def catalogue_series() -> list[Series]:
    """Return the series and its inversion."""
    return [II_YY, II_STAR_YY]
