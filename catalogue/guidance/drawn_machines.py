"""Simulate machines with scattered pivots, and count those within tolerance.

The allowance is of first order in the scatter; here the finite motion of every machine is measured.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kinematics.linkage import Linkage
from ..kinematics.types import Complexes, Floats
from .allowance import Zone, scattered
from .circuit_curve import CircuitCurve
from .coupler_curve import CouplerCurve, coupler_curve
from .fixed_nominal import Nominal
from .minimum_zone import grid, largest
from .placement import along_path
from .sensitivity import COUNT, displaced
from .trace import Traced, over
from .wide_arc import along_circuits, traced_about


class Simulation(NamedTuple):
    """Options of simulated machines and their measurement."""

    draws: int = 1000  #: number of machines: a share of 95 % then has a standard error of 0.7 %
    seed: int = 0  #: seed of the draws: an answer has the same share every time
    nodes: int = 32  #: intervals between the Chebyshev points of a path
    rounds: int = 10  #: largest number of Newton steps for the ends of a window
    step: float = 1e-6  #: step of the difference quotient of a speed [windows]
    reached: float = 1e-7  #: error of an end at which the iteration stops [strokes]


SIMULATION = Simulation()


def kept_share(
    guides: CouplerCurve,
    traced: Traced,
    nominal: Nominal,
    zone: Zone,
    scatter: float,
    tolerance: float,
    draws: int = SIMULATION.draws,
) -> float:
    """Compute the fraction of simulated machines whose path keeps a tolerance.

    Parameters
    ----------
    guides : CouplerCurve
        One guide whose point does not return; in its frame the nominal runs from (0, 0) to (stroke,
        0).
    traced : Traced
        Trace of the guide over its stroke.
    nominal : Nominal
        Nominal between whose ends the path is measured.
    zone : Zone
        Coordinates of the nominal that are fitted to every machine.
    scatter : float
        Standard deviation of the coordinates of finite pivots and of the guided point [length].
    tolerance : float
        Largest deviation [length].

    Returns
    -------
    float
        Fraction from 0 to 1; machines that do not cover the stroke do not keep the tolerance.
    """
    linkage, point = _simulate(guides, scatter, draws)
    chart = np.repeat(guides.motion.chart, len(point))
    moved = coupler_curve(linkage, point, chart=chart, least=0.5 * nominal.stroke)
    low, high = np.stack([traced.low, traced.high]).astype(float)
    with np.errstate(all="ignore"):
        window = _window(moved, nominal, low[0], high[0])
        if zone.free:
            held = along_path(moved, -1 / nominal.radius) if zone.circle and zone.free == 2 else None
            deviation = over(moved, *window, circle=zone.circle, nodes=SIMULATION.nodes, held=held).fit.deviation
        else:
            share = 0.5 * (1 + grid(4 * SIMULATION.nodes).nodes[:, None])
            t = window[0] + (window[1] - window[0]) * share
            deviation = largest(np.abs(nominal.off(moved.motion.pose(t).point(point))))
        return float(np.count_nonzero(deviation <= tolerance) / draws)


def kept_share_over_arc(
    guides: CircuitCurve, traced: Traced, angle: float, scatter: float, tolerance: float, draws: int = SIMULATION.draws
) -> float:
    """Compute the fraction of simulated machines that keep a tolerance along a wide arc.

    Parameters
    ----------
    guides, traced
        One guide, and its trace over the arc.
    angle : float
        Angle of the arc [deg].
    scatter, tolerance, draws
        See `kept_share`.
    """
    linkage, point = _simulate(guides, scatter, draws)
    centre, radius = np.repeat(traced.fit.centre, len(point)), np.repeat(-1 / traced.fit.curvature, len(point))
    with np.errstate(all="ignore"):
        deviation = traced_about(along_circuits(linkage, point), centre, radius, angle).fit.deviation
        return float(np.count_nonzero(deviation <= tolerance) / draws)


def _simulate(guides: CouplerCurve | CircuitCurve, scatter: float, draws: int) -> tuple[Linkage, Complexes]:
    """Simulate machines of one guide, whose pivots and guided points scatter."""
    each = np.zeros(draws, int)
    steps = scatter * np.random.default_rng(SIMULATION.seed).normal(size=(draws, COUNT)) * scattered(guides.linkage)
    linkage, point, _ = displaced(guides.linkage[each], guides.point[each], steps)
    return linkage, point


def _window(guides: CouplerCurve, nominal: Nominal, low: float, high: float) -> tuple[Floats, Floats]:
    """Solve for the parameters of paths at the ends of a nominal, (n,) each.

    The iteration starts from the parameters of one path; NaN where it does not reach the ends.
    """
    n = len(guides)

    def along(t: Floats) -> Floats:
        return nominal.along(guides.motion.pose(t[None]).point(guides.point)[0])[0]

    ends = nominal.along(np.array([0.0, nominal.stroke]))[0]
    goal = ends if along(np.full(n, low)).mean() < along(np.full(n, high)).mean() else ends[::-1]
    step = SIMULATION.step * (high - low)
    found = []
    for end, wanted in zip((low, high), goal, strict=True):
        t = np.full(n, end)
        for _ in range(SIMULATION.rounds):
            missing = wanted - along(t)
            t = t + missing * step / (along(t + step) - along(t))
        found.append(np.where(np.abs(missing) < SIMULATION.reached * nominal.stroke, t, np.nan))
    return found[0], found[1]
