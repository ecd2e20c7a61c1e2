# Series my.x0: slider-crank with its coupler perpendicular to the line of the slider.
import numpy as np

from catalogue.plugin import (
    Guided,
    Member,
    Parameter,
    Series,
    hookimpl,
    linkage_of,
    normal_pair,
    slider_pair,
    tangent_pair,
)

A_1 = Parameter("a1", ((0.25, 4.0),), "rho0/r1, inverse length of the crank")
PHI_2 = Parameter("phi2", ((0.2, 1.37), (1.77, 2.94)), "ray of the slider [rad]")


def pivots(p):
    return linkage_of(tangent_pair(p["a1"]), slider_pair(np.cos(p["phi2"]), np.sin(p["phi2"])))


def guided(p):
    c = p["a1"] / np.tan(p["phi2"])  # eq. (40): q^2 - q + cot(phi2)/r1 = 0, imaginary roots are NaN
    q = 0.5 + np.sqrt(np.where(c <= 0.25, 0.25 - c, np.nan))
    return [Guided("[3]", normal_pair(q), 4), Guided("[4]", normal_pair(c / q), 4)]


def classify(instant):
    linkage, slider = instant.linkage, instant.linkage.dyads == 1
    turn = np.exp(1j * np.angle(np.diff(linkage.points[:, :, 1]) * linkage.rays.conj()))  # of the coupler off the rays
    residual = np.where(linkage.family == "slider-crank", np.where(slider, np.abs(turn.imag), 0).max(1), np.nan)
    return residual, np.where(slider, 1, np.abs((turn**2).imag)).min(1)


@hookimpl
def catalogue_series():
    member = Member("general", "slider-crank", [A_1, PHI_2], pivots)
    return [Series("my.x0", "coupler square to the guide", "my*.x0", "Allievi 1895, (40)", [member], classify, guided)]
