# Two series of few guides per block: cranks on the circles of I.GG, most of them too long to be kept.
import numpy as np

from catalogue.plugin import RR, Guided, Member, Parameter, Series, circle_pair, hookimpl, linkage_of, normal_pair

KAPPA = Parameter("kappa", ((0.01, 0.13),), "rho0/R")
PHI = Parameter("phi1", tuple(np.radians([(12, 84), (96, 168)]).tolist()), "direction of crank 1 [rad]")
OTHER = Parameter("phi2", PHI.domain, "direction of crank 2 [rad]")


def pivots(p):
    return linkage_of(circle_pair(p["kappa"], p["phi1"]), circle_pair(p["kappa"], p["phi2"]))


def symmetric(p):
    return {"phi2": np.pi - p["phi1"]}


def guided(p):
    even = np.abs(np.sin(p["phi1"] + p["phi2"])) < 1e-12
    return [Guided("undulation", normal_pair(np.zeros_like(p["kappa"])), np.where(even, 4, 3))]


def classify(instant):
    return np.where((instant.linkage.dyads == RR).all(1), 1.0, np.nan), np.ones(len(instant.linkage))


def series(code):
    members = [
        Member("general", "four-bar", [KAPPA, PHI, OTHER], pivots, weight=2.0),
        Member("symmetric", "four-bar", [KAPPA, PHI], pivots, symmetric),
    ]
    return Series(code, "few guides per block", code, "for the tests", members, classify, guided)


@hookimpl
def catalogue_series():
    return [series("T.few"), series("T.less")]
