"""Guides to draw: one of each family, an arc, an exact one; one of one's own, one that leads to infinity, a dwell."""

from __future__ import annotations

import numpy as np

import catalogue
from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.guidance.metrics import measure
from catalogue.guidance.placement import at_stroke, placed
from catalogue.guidance.trace import trace
from catalogue.guides.candidate import Candidate
from catalogue.guides.dwell import DwellCandidate
from catalogue.kinematics.linkage import Linkage


def normal(degrees: float) -> list[float]:
    return [float(np.cos(np.radians(degrees))), float(np.sin(np.radians(degrees))), 0.0]


def candidate(pivots: list[list[list[float]]], point: complex, half: float, *, circle: bool = False) -> Candidate:
    """Return the guide of a coupler point, laid over a stroke of 100."""
    guides = coupler_curve(Linkage(pivots), np.array([point]))
    linkage, guided, _ = placed(guides, trace(guides, np.array([half]), circle=circle, split=False), 100.0)
    guides = coupler_curve(linkage, guided)
    traced = at_stroke(guides, 100.0, circle=circle)
    m = measure(guides, traced)
    return Candidate(
        id=1,
        family=str(linkage.family[0]),
        series="general",
        configuration="made",
        order=3,
        stroke=100.0,
        deviation=float(traced.fit.deviation[0]),
        radius=float(1 / abs(traced.fit.curvature[0])) if circle else None,
        size=float(m.size[0]),
        max_link=None,
        max_ground=None,
        max_arm=None,
        min_transmission=float(m.min_transmission[0]),
        rotates=[],
        pivots=linkage.pivots[0].tolist(),
        guided=[float(guided[0].real), float(guided[0].imag)],
    )


MADE = {
    "four-bar": candidate([[[0, 0, 1], [0.7, 2, 1]], [[3, 0, 1], [2.3, 2.2, 1]]], 1.5 + 0.3j, 0.6),
    "slider-crank": candidate([[[0, 0, 1], [0.7, 0.9, 1]], [normal(80), [2.5, 0.2, 1]]], 1.6 - 2.8j, 0.8),
    "inverted-slider-crank": candidate([[[0, 0, 1], [0.7, 0.9, 1]], [[2, 0.2, 1], normal(62)]], 1.4 - 0.7j, 0.8),
    "swinging-block": candidate([[normal(90), [0, 0, 1]], [[1.5, 0.8, 1], normal(100)]], 3 - 0.6j, 0.8),
    "elliptic-trammel": candidate([[normal(0), [0, 1.2, 1]], [normal(90), [1, 0, 1]]], 0.2 - 0.1j, 0.4),
    "oldham": candidate([[[-1, 0, 1], normal(45)], [[1, 0, 1], normal(135)]], 0.1 + 2.5j, 1.2),
}
ARC = candidate([[[0, 0, 1], [0.7, 0.9, 1]], [[2, 0.2, 1], normal(20)]], 0.7 + 2.4j, 0.7, circle=True)
EXACT = candidate([[normal(0), [0, 1, 1]], [normal(90), [1, 0, 1]]], 1 + 0j, 0.3)  # the point of a slider
EVERY = [*MADE.values(), ARC, EXACT]
NAMES = [*MADE, "arc", "exact"]
#: A four-bar as a mechanism of many bars, and one with a long name.
BARS = catalogue.mechanism(
    {
        "joints": {"A": [0, 0], "D": [2, 0], "B": [0, 1], "C": [2, 2.5], "P": [4, 4]},
        "bars": {"frame": "AD", "crank": "AB", "coupler": "BCP", "rocker": "CD"},
        "drive": "crank",
        "point": "P",
    }
)
LONG = catalogue.mechanism(BARS.given, name="A mechanism of $many$ bars with a long name of its own")
#: A crank-rocker, a swinging block whose circuit is open, and a dwell that the catalogue found.
OWN = catalogue.guide({"crank": 40, "rocker": 100, "ground": 90, "coupler": 100, "along": 100, "across": 40})
OPEN = catalogue.guide(MADE["swinging-block"].linkage, MADE["swinging-block"].guided)
DWELL = DwellCandidate(
    id=4805, family="inverted-slider-crank", series="II*.xoy", configuration="CN", order=5, angle=164.5,
    residual=0.4870063126753219, swing=30.024349395063442, min_transmission=67.5421096622579, size=21.295536511259545,
    driver=2,
    pivots=[
        [[2.4380631046262473, 0.46255780060884266, 1.0], [-0.18639842486313846, 0.9824742374273949, 0.0]],
        [[0.0, 0.0, 1.0], [-0.9824742374273948, -0.18639842486313846, 1.0]],
    ],
    guided=[8.158529996063297, 1.5478646487941612], joint=[18.91061802833351, 3.639011276686299],
    pivot=[20.31224649165466, 0.0],
)  # fmt: skip
