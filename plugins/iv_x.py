"""Series IV.x and IV*.x: a crank perpendicular to the line of a slide or slider.

Series IV has a slide, IV* a slider.  The pole is at infinity.  Axes: x along the crank, y across,
unit of length y3, the height of the crank.  Pair [4] is the slide with its fixed point (x4, 0).
Every line x = const of the moving plane is a slot of order 3 through its point of the x axis; in
IV* every point of the x axis is an undulation, concave towards the slider.
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
    Series,
    alike,
    hookimpl,
    linkage_of,
    pair,
    parallel_pair,
    point,
    roots,
    without,
)

K = Parameter("k", ((0.1, 5.0),), "k*/y3^2 of IV, k/y3^2 of its inversion: length of the crank over its height")
X_4 = Parameter("x4", ((-5.0, -0.1), (0.1, 5.0)), "x4/y3, place of the slide (slider) along the crank")


def slot(x: Array) -> Array:
    """Return the fixed point (x, 0), and the coupler line through it."""
    return pair(point(x, 0 * x), point(1 + 0 * x, 0, 0))


def pivots(p: Parameters) -> Array:
    """Place the crank at the height 1, the slide at the height 0."""
    return linkage_of(parallel_pair(1 + 0 * p["k"], 0 * p["k"], p["k"]), slot(p["x4"]))


def coincident(p: Parameters) -> Parameters:
    """Make [1] and [2] coincide: y3^2 = 4 x3* x4."""
    return {"x4": -0.25 / p["k"]}


def guided(p: Parameters) -> Iterator[Guided]:
    """Yield [1], [2] at the roots y, and the slot of order 3 through the origin.

    y^2 + y3 y + x3* x4 = 0; the roots are real iff y3^2 >= 4 x3* x4.
    """
    k, zero = p["k"], 0 * p["k"]
    y1, y2 = roots(zero - 1, -k * p["x4"])
    yield Guided("[1]", parallel_pair(y1, zero, k), 4)
    # for k x4 = 2 pair [2] is the driving crank
    yield Guided("[2]", without(parallel_pair(y2, zero, k), alike(y1, y2) | alike(y2, 1.0)), 4)
    yield Guided("cuspidation", slot(zero), 3)


def classify(instant: Instant) -> tuple[Array, Array]:
    """Return residual and margin.

    The residual is the sine of the angle between crank and normal of the slide. The margin is the
    height of the crank (dead points).
    """
    linkage = instant.linkage
    z, ray, kind = linkage.points, linkage.rays, linkage.dyads
    height = np.abs(((z[:, 0, 0] - z[:, 1, 0]) * np.where(kind == RR, ray.conj(), 0).sum(1)).imag) / linkage.size
    inside = (np.sort(kind, 1) == [RR, RP]).all(1)
    return np.where(inside, np.abs(linkage.sine), np.nan), height


IV_X = Series(
    code="IV.x",
    title="crank perpendicular to the line of the slide",
    inverse="IV*.x",
    source="Allievi 1895, sec. 18, eqs. (57)-(63)",
    members=[
        Member("general", "inverted-slider-crank", [K, X_4], pivots, weight=2.0),
        Member("coincident pairs", "inverted-slider-crank", [K], pivots, coincident, weight=0.25),
    ],
    classify=classify,
    guided=guided,
)
IV_STAR_X = IV_X.inversion("IV*.x", "crank perpendicular to the line of the slider")


@hookimpl
def catalogue_series() -> list[Series]:
    """Return the series and its inversion."""
    return [IV_X, IV_STAR_X]
