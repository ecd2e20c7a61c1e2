"""Series II.ooo: cyclic (Cardanic) motion, exact in every position.

The inflection circle rolls in a fixed circle of twice its size: each of its points runs on a
straight line, its centre on a circle about the inflection pole.
"""

from collections.abc import Iterator

import numpy as np

from catalogue.plugin import (
    EXACT,
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
)

#: Rays of the stored guided points, and their least angle from the ray of a slider, which is itself
#: such a point.
RAYS = (30, 60, 90, 120, 150)
NEAR = np.radians(8.0)


def slider(phi: Array) -> Array:
    """Place a slider on the ray phi."""
    return slider_pair(np.cos(phi), np.sin(phi))


def trammel(p: Parameters) -> Array:
    """Build linkages of two sliders."""
    return linkage_of(slider(p["phi1"]), slider(p["phi2"]))


def isosceles(p: Parameters) -> Array:
    """Build slider-cranks with equal crank and coupler, and no offset of the fixed pivot."""
    return linkage_of(normal_pair(np.ones_like(p["phi2"])), slider(p["phi2"]))


def guided(p: Parameters) -> Iterator[Guided]:
    """Yield points of the inflection circle on lines, and its centre on a circle, all exact."""
    sliders = [p[name] for name in ("phi1", "phi2") if name in p]
    for degrees in RAYS:
        phi = np.full_like(sliders[0], np.radians(degrees))
        apart = np.min([np.abs(phi - other) for other in sliders], axis=0)[:, None, None]
        yield Guided(f"ray {degrees}", np.where(apart < NEAR, np.nan, slider(phi)), EXACT)
    taken = "phi1" not in p  # the centre is the crank's pin in the isosceles slider-crank
    yield Guided("centre", np.where(taken, np.nan, normal_pair(np.ones_like(sliders[0]))), EXACT)


def classify(instant: Instant) -> tuple[Array, Array]:
    """Return residual and margin.

    The residual is 0 for a trammel; for a slider-crank it is made of the difference of crank and
    coupler and the offset of the pivot.
    """
    linkage = instant.linkage
    kind = linkage.dyads
    swap = (kind[:, 0] == PR)[:, None, None]
    z = np.where(swap, linkage.points[:, ::-1], linkage.points)
    crank, coupler = np.abs(z[:, 0, 1] - z[:, 0, 0]), np.abs(z[:, 1, 1] - z[:, 0, 1])
    offset = np.abs(((z[:, 0, 0] - z[:, 1, 1]) * z[:, 1, 0].conj()).real)
    with np.errstate(invalid="ignore", divide="ignore"):
        unequal = np.maximum(np.abs(crank - coupler) / (crank + coupler), offset / crank)
    residual = np.where((kind == PR).all(1), 0.0, np.where((np.sort(kind, 1) == [RR, PR]).all(1), unequal, np.nan))
    return residual, np.abs(linkage.sine)


PHI = Parameter("phi1", tuple(np.radians([(12, 168)]).tolist()), "ray of slider 1 [rad]")
II_OOO = Series(
    code="II.ooo",
    title="cyclic motion: trammel and isosceles slider-crank",
    inverse="II*.ooo",
    source="Allievi 1895, sec. 14, sec. 26",
    members=[
        Member("general", "elliptic-trammel", [PHI, Parameter("phi2", PHI.domain, "ray of slider 2 [rad]")], trammel),
        Member(
            "isosceles",
            "slider-crank",
            [Parameter("phi2", tuple(np.radians([(12, 78)]).tolist()), "ray of the slider [rad]")],
            isosceles,
            weight=0.25,
        ),
    ],
    classify=classify,
    guided=guided,
)


@hookimpl
def catalogue_series() -> list[Series]:
    """Return the series and its inversion."""
    return [
        II_OOO,
        II_OOO.inversion("II*.ooo", "inverse cyclic motion: Oldham coupling and isosceles inverted slider-crank"),
    ]
