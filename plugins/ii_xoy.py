"""Series II.xoy and II*.xoy: in-line slider-crank at the end of its stroke.

II.xoy is an elliptic guide, its inversion II*.xoy a conchoidal guide.  The motion is symmetric
about the line of the pivots.
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
    Series,
    hookimpl,
    linkage_of,
    normal_pair,
    slider_pair,
    tangent_pair,
)

Q_3 = Parameter("q3", ((-4.0, -1.15), (-0.85, -0.15), (0.15, 0.9), (1.1, 3.0)), "rho0/r3 of the crank")
#: Rays of the undulation circle with stored points [deg]; by symmetry one side suffices.
RAYS = (30, 60)


def pivots(p: Parameters) -> Array:
    """Place a slider at the pole, moving along the pole normal, and a pair on it."""
    return linkage_of(tangent_pair(np.zeros_like(p["q3"])), normal_pair(p["q3"]))


def slide(_: Parameters) -> Parameters:
    """Make pair 3 a slide through the return pole: there is no free parameter."""
    return {"q3": np.array([-1.0])}


def double_cuspidation(_: Parameters) -> Parameters:
    """Return six positions of a line through the return pole, eq. (39), of the inversion.

    The inversion is the conchoidal guide.
    """
    return {"q3": np.array([2.0])}


def guided(p: Parameters) -> Iterator[Guided]:
    """Yield [4] on the pole normal by (33), q3 + q4 = 1; of order 5 by symmetry.

    Every point of the inflection circle is an undulation.
    """
    q3 = p["q3"]
    q4 = 1 - q3
    slot = np.abs(q4 + 1) < 1e-12
    taken = (slot | (np.abs(q4 - q3) < 1e-12))[:, None, None]
    yield Guided("[4]", np.where(taken, np.nan, normal_pair(q4)), 5)
    for degrees in RAYS:
        yield Guided(
            f"ray {degrees}", slider_pair(*(np.full_like(q3, f(np.radians(degrees))) for f in (np.cos, np.sin))), 3
        )
    yield Guided("undulation", normal_pair(0 * q3), 3)
    slide_itself = (q3 == -1)[:, None, None]
    yield Guided("cuspidation", np.where(slide_itself, np.nan, normal_pair(0 * q3 - 1)), np.where(slot, 5, 3))


def classify(instant: Instant) -> tuple[Array, Array]:
    """Return residual and margin.

    The residual is the distance of the pivots from the slider's line; with a slide it is the larger
    of this and the cosine of the angle between both lines. The margin is the distance from II.ooo
    (fixed pivot as far as the inflection pole) and from a pivot at the pole.
    """
    linkage = instant.linkage
    z, ray, kind, finite = linkage.points, linkage.rays, linkage.dyads, linkage.finite
    swap = (kind[:, 1] == PR)[:, None]
    one = np.where(swap, ray[:, ::-1], ray)[:, 0]
    at = np.where(swap, z[:, ::-1, 1], z[:, :, 1])[:, 0]
    other = np.where(swap[..., None], z[:, ::-1], z)[:, 1]
    there = np.where(swap[..., None], finite[:, ::-1], finite)[:, 1]
    second = np.where(swap[:, 0], kind[:, 0], kind[:, 1])
    off = np.where(there, np.abs(((other - at[:, None]) * one[:, None].conj()).real), 0).max(1)
    turn = np.abs((one.conj() * np.where(swap, ray[:, ::-1], ray)[:, 1]).real)
    length = np.abs(other[:, 0] - at)
    crank, slide_ = second == RR, second == RP
    allowed = ((kind == PR).sum(1) == 1) & (crank | slide_)
    with np.errstate(invalid="ignore", divide="ignore"):
        residual = np.where(crank, off / linkage.size, np.where(slide_, np.maximum(off / length, turn), np.nan))
        r, r_star = length, np.abs(other[:, 1] - at)
        margin = np.where(crank, np.minimum(np.abs(r - 2 * r_star), np.minimum(r, r_star)) / np.maximum(r, r_star), 1.0)
    return np.where(allowed, residual, np.nan), margin


II_XOY = Series(
    code="II.xoy",
    title="in-line slider-crank at the end of its stroke (elliptic guide)",
    inverse="II*.xoy",
    source="Allievi 1895, sec. 14, eqs. (33), (39)",
    members=[
        Member("general", "slider-crank", [Q_3], pivots),
        Member("double cuspidation", "slider-crank", [], pivots, double_cuspidation),
        Member("general", "swinging-block", [], pivots, slide),
    ],
    classify=classify,
    guided=guided,
)
II_STAR_XOY = II_XOY.inversion("II*.xoy", "slide through the pole (conchoidal guide)")


@hookimpl
def catalogue_series() -> list[Series]:
    """Return the series and its inversion."""
    return [II_XOY, II_STAR_XOY]
