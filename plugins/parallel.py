"""Series parallel: two parallel cranks of a four-bar, in no other relation.

The pole is at infinity.

Axes: x along the cranks, y across, unit of length y1.  Centres lie on the hyperbola x y + k = 0,
points of stationary curvature on x* y + k* = 0.  The series is its own inverse.
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
    Posed,
    Series,
    alike,
    four_bars,
    hookimpl,
    linkage_of,
    parallel_pair,
    roots,
    without,
)

K = Parameter("k", ((0.1, 5.0),), "k/y1^2, hyperbola of the fixed points")
K_STAR = Parameter("k_star", ((-4.9, -0.11), (0.11, 4.9)), "k*/y1^2, hyperbola of the moving points")
Y_2 = Parameter("y2", ((-3.0, -1.05), (-0.95, -0.1), (0.1, 0.95), (1.05, 3.0)), "y2/y1, heights of the cranks")


def pivots(p: Parameters) -> Array:
    """Place cranks at the heights 1 and y2."""
    return linkage_of(*(parallel_pair(y, p["k"], p["k_star"]) for y in (1 + 0 * p["y2"], p["y2"])))


def fifth_order(p: Parameters) -> Parameters:
    """Set k* = -k (not in Allievi)."""
    return {"k_star": -p["k"]}


def coincident(p: Parameters) -> Parameters:
    """Make [3] and [4] coincide: (y1 + y2)^2 = 4 k k*/(y1 y2)."""
    return {"k_star": p["y2"] * (1 + p["y2"]) ** 2 / (4 * p["k"])}


def guided(p: Parameters) -> Iterator[Guided]:
    """Yield [3] and [4] by eqs. (58) and (59).

    y1 + y2 + y3 + y4 = 0 and y1 y2 y3 y4 = k k*. They are of order 5 iff k* = -k.
    """
    k, star, y2 = p["k"], p["k_star"], p["y2"]
    order = np.where(alike(star / k, -1.0), 5, 4)
    y3, y4 = roots(-(1 + y2), k * star / y2)
    driving = [alike(y, 1.0) | alike(y, y2) for y in (y3, y4)]
    yield Guided("[3]", without(parallel_pair(y3, k, star), driving[0]), order)
    yield Guided("[4]", without(parallel_pair(y4, k, star), driving[1] | alike(y3, y4)), order)


def classify(instant: Instant) -> tuple[Array, Array]:
    """Return residual and margin.

    The residual is the sine of the angle between the cranks, NaN for other linkages. The margin is
    the least of |k/k0| (IV), |k*/k0| (IV*) and the distance from a parallelogram.
    """
    linkage, at = instant.linkage, instant.curvature
    lengths = ((linkage.points[..., 1] - linkage.points[..., 0]) * linkage.rays[:, :1].conj()).real
    with np.errstate(invalid="ignore", divide="ignore"):
        unequal = np.abs(lengths[:, 0] - lengths[:, 1]) / np.abs(lengths).max(1)
        margin = np.min([*(np.abs(c / (at.k_star - at.k)) for c in (at.k, at.k_star)), unequal], axis=0)
    return np.where((linkage.dyads == RR).all(1), np.abs(linkage.sine), np.nan), margin


def solve(posed: Posed) -> Array | None:
    """Solve for the linkage with parallel cranks, both fixed pivots and a circle given.

    It guides the point to order 3.
    """
    if posed.given != "fixed" or posed.path != "circle":
        return None
    local = ((posed.pivots - posed.centre[:, None]) * posed.axis.conj()[:, None]).T
    u, v = local.real, local.imag
    determinant = v[0] * u[1] - v[1] * u[0]  # determinant of the equations u_i v_i = u0 v_i + v0 u_i
    product = u * v
    u0 = (product[0] * u[1] - product[1] * u[0]) / determinant
    v0 = (v[0] * product[1] - v[1] * product[0]) / determinant
    k_star = (np.abs(posed.point - posed.centre) - u0) * v0
    moving = posed.centre + posed.axis * (u0 - k_star / (v - v0) + 1j * v)
    return four_bars(posed.pivots, [(moving[0], moving[1])])


PARALLEL = Series(
    code="parallel",
    title="two parallel cranks",
    inverse="parallel",
    source="Allievi 1895, secs. 17, 18, eqs. (52)-(60)",
    members=[
        Member("general", "four-bar", [K, K_STAR, Y_2], pivots, weight=3.0),
        Member("fifth order", "four-bar", [K, Y_2], pivots, fifth_order),
        Member("coincident pairs", "four-bar", [K, Y_2], pivots, coincident, weight=0.5),
    ],
    classify=classify,
    guided=guided,
    solve=solve,
    degenerate=False,
)


@hookimpl
def catalogue_series() -> list[Series]:
    """Return the series, which is its own inverse."""
    return [PARALLEL]
