"""Series IV.l and IV*.l (Watt): parallel cranks perpendicular to a line of pivots.

That line is the line of fixed pivots (IV) or the coupler (IV*).  The pole is at infinity.  Axes: x
along the cranks, y across, unit of length y1.  The centring-point curve of IV is the pair of axes,
the circling-point curve a hyperbola.
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
    four_bars,
    hookimpl,
    linkage_of,
    pair,
    parallel_pair,
    point,
)

Y_2 = Parameter("y2", ((-3.0, -0.1), (0.1, 0.95), (1.05, 3.0)), "y2/y1, heights of the cranks")
K_STAR = Parameter("k", ((-5.0, -0.1), (0.1, 5.0)), "k*/y1^2 of IV, k/y1^2 of its inversion")


def pivots(p: Parameters) -> Array:
    """Place cranks at the heights 1 and y2."""
    zero = np.zeros_like(p["k"])
    return linkage_of(parallel_pair(zero + 1, zero, p["k"]), parallel_pair(p["y2"], zero, p["k"]))


def equal(p: Parameters) -> Parameters:
    """Return equal cranks of opposite sense."""
    return {"y2": np.full_like(p["k"], -1.0)}


def guided(p: Parameters) -> Iterator[Guided]:
    """Yield [3] on a circle, and [4], the slot through (x4, 0).

    y1 + y2 + y3 = 0 and y1 y2 y3 = -k* x4 (62)-(64).
    """
    k, y2 = p["k"], p["y2"]
    y3 = -(1 + y2)
    # equal cranks: [3] and [4] coincide; one crank twice the other: [3] is the driving pair itself
    double = (np.min(np.abs([y3, y3 - 1, y3 - y2]), axis=0) < 1e-12)[:, None, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        yield Guided("[3]", np.where(double, np.nan, parallel_pair(y3, 0 * k, k)), 4)
    x4 = -y2 * y3 / k
    yield Guided("[4]", pair(point(x4, 0 * k), point(1 + 0 * k, 0, 0)), 4)
    near = (np.abs(x4) < 0.05)[:, None, None]
    yield Guided("cuspidation", np.where(near, np.nan, pair(point(0 * k, 0), point(1 + 0 * k, 0, 0))), 3)


def classify(instant: Instant) -> tuple[Array, Array]:
    """Return residual and margin.

    The residual is made of the sine of the angle between the cranks, and of their cosines with the
    line of fixed pivots. The margin is that to a parallelogram, which translates.
    """
    linkage = instant.linkage
    z, ray = linkage.points, linkage.rays
    base = z[:, 1, 0] - z[:, 0, 0]
    with np.errstate(invalid="ignore"):  # two sliders
        cosine = np.abs((ray.conj() * (base / np.abs(base))[:, None]).real).max(1)
    lengths = ((z[..., 1] - z[..., 0]) * ray[:, :1].conj()).real
    margin = np.abs(lengths[:, 0] - lengths[:, 1]) / np.abs(lengths).max(1)
    return np.where((linkage.dyads == RR).all(1), np.maximum(np.abs(linkage.sine), cosine), np.nan), margin


def solve(posed: Posed) -> Array | None:
    """Solve for linkages with two given pivots.

    Both moving pivots and a slot: the linkage whose cuspidation is the slot. Both fixed pivots, and
    a circle whose centre is on a line with them, across its axis: the linkage that guides the point
    to order 4.
    """
    if posed.given == "moving" and posed.path == "slot":
        x, y = _pivot_coordinates(posed)
        foot = (x[0] * y[0] - x[1] * y[1]) / (y[0] - y[1])
        fixed = [posed.centre + posed.axis * (foot + 1j * y[i]) for i in (0, 1)]
        return four_bars(posed.pivots, [(fixed[0], fixed[1])])[..., ::-1, :]
    if posed.given == "fixed" and posed.path == "circle":
        x, y = _pivot_coordinates(posed)
        axis_height = (y[0] + y[1]) / 3  # mean of the three
        run = np.abs(posed.point - posed.centre) * -axis_height / (y - axis_height)
        run = np.where((np.abs(x) < 1e-9 * np.abs(y).sum(0)).all(0), run, np.nan)
        return four_bars(
            posed.pivots, [(posed.pivots[:, 0] + posed.axis * run[0], posed.pivots[:, 1] + posed.axis * run[1])]
        )
    return None


def _pivot_coordinates(posed: Posed) -> tuple[Array, Array]:
    """Return the given pivots along and across the axis, from the centre, shape (2, n) each."""
    local = ((posed.pivots - posed.centre[:, None]) * posed.axis.conj()[:, None]).T
    return local.real, local.imag


IV_L = Series(
    code="IV.l",
    title="parallel cranks perpendicular to the line of fixed pivots",
    inverse="IV*.l",
    source="Allievi 1895, sec. 18, eqs. (62)-(64)",
    members=[
        Member("general", "four-bar", [Y_2, K_STAR], pivots, weight=3.0),
        Member("equal cranks", "four-bar", [K_STAR], pivots, equal, weight=0.25),
    ],
    classify=classify,
    guided=guided,
    solve=solve,
)
IV_STAR_L = IV_L.inversion("IV*.l", "parallel cranks perpendicular to the coupler (Watt)")


@hookimpl
def catalogue_series() -> list[Series]:
    """Return the series and its inversion."""
    return [IV_L, IV_STAR_L]
