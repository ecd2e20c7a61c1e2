"""A still of a guide with ghosts, the path beyond its stroke, and its deviation."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..guidance.coupler_curve import CouplerCurve
from ..guidance.deviation_curve import from_circle
from ..guidance.minimum_zone import grid
from ..guidance.placement import PLACEMENT, at_stroke
from ..guidance.trace import Traced, extended
from ..guides.kinds import has_bars, has_stroke, is_candidate
from ..kinematics.circuits import OPEN
from ..kinematics.types import Complexes, Floats
from .chain_poses import still_chain_poses
from .machine import Line, LineKind, Machine, Plate
from .poses import still_poses

if TYPE_CHECKING:
    from ..guidance.circuit_curve import CircuitCurve
    from ..guides.candidate import Candidate
    from ..guides.chain_stretch import ChainStretch
    from ..guides.kinds import Guide
    from ..guides.run import Run


class StillOptions(NamedTuple):
    """Sampling of a still."""

    beyond: float = 0.3  #: length of the path beyond either end of the stroke [strokes]
    nodes: int = 128  #: intervals between the points at which the deviation is drawn


STILL = StillOptions()


def still(guide: Guide) -> Machine:
    """Make the machine of a still, with ghosts at the ends of the stroke.

    Raises
    ------
    InvalidRequest
        If a linkage does not lead its guided point over its stroke.
    """
    shown = still_chain_poses(guide).machine if has_bars(guide) else still_poses(guide).machine
    lines = [*_sweeps(shown), *shown.lines, *(_path_outside_stroke(guide) if is_candidate(guide) else [])]
    ends = {"start": 0, "end": -1} if has_stroke(guide) else {}
    seen = [*ends.values(), shown.middle]
    return replace(
        shown,
        bodies=tuple(body.only(seen) for body in shown.bodies),
        lines=tuple(lines),
        middle=len(ends),
        ghosts={name: pose for pose, name in enumerate(ends)},
    )


def _sweeps(shown: Machine) -> list[Line]:
    """Return the arcs on which the tips of cranks move."""
    return [
        Line(body.name.replace("crank", "sweep"), LineKind.SWEEP, body.places(shape.corners)[:, -1])
        for body in shown.bodies
        for shape in body.shapes
        if body.kind == "crank" and isinstance(shape, Plate)
    ]


def _path_outside_stroke(candidate: Candidate) -> list[Line]:
    """Return the path beyond both ends of the stroke and, if any, over a full turn."""
    frame, lines = candidate.frame, []
    if candidate.driver in candidate.rotates:
        whole = candidate.run(whole=True)
        lines.append(Line("path-turn", LineKind.TURN, whole.path(whole.polyline())))
    home = candidate.at_home()
    tangent = complex(_curve_at_home(home)[0].tangent[0])
    bent = complex(np.exp(0.5j * np.radians(candidate.arc_angle or 0.0))) if candidate.is_wide else 1.0
    tails = path_beyond(home.run(), tangent, STILL.beyond * candidate.stroke, bent)
    names = ("path-before", "path-after")
    return [
        *lines,
        *(
            Line(name, LineKind.BEYOND, frame.origin + frame.direction * z)
            for name, z in zip(names, tails, strict=True)
        ),
    ]


def _curve_at_home(candidate: Candidate) -> tuple[CouplerCurve | CircuitCurve, Traced]:
    """Return the curve of a candidate at home, and its stroke on it."""
    here, traced = candidate.traced
    if isinstance(here, CouplerCurve) and traced.relative[0] < PLACEMENT.fine:
        traced = at_stroke(here, candidate.stroke, circle=candidate.radius is not None)
    return here, traced


def path_beyond(run: Run, middle: complex, more: float, bent: complex = 1.0) -> list[Complexes]:
    """Extend the path beyond both ends of a run by at most `more`, until it turns.

    The length is measured along the tangent at mid-stroke, rotated by `bent` at the start and by
    its inverse at the end.
    """
    tails, half = [], 0.5 * float(run.circuit.period[0]) * np.sign(run.high - run.low)
    tangents = middle * bent, middle * bent.conjugate()
    for end, far, tangent in zip((run.low, run.high), (run.low - half, run.high + half), tangents, strict=True):
        if run.circuit.kind[0] == OPEN:
            far = min(max(far, 0.0), float(run.circuit.period[0]))
        if far == end:  # the stroke ends where the circuit does
            tails.append(run.path(np.array([end])))
            continue
        far = replace(run, low=end, high=far).until(tangent, more)
        tail = replace(run, low=end, high=far)
        z = tail.path(tail.polyline())
        ahead = np.abs(((z - z[0]) * np.conj(tangent)).real)
        if (ahead > more).any():
            last = int((ahead > more).argmax())
            share = (more - ahead[last - 1]) / (ahead[last] - ahead[last - 1])
            z[last] = z[last - 1] + share * (z[last] - z[last - 1])
        else:
            last = int(ahead.argmax())
        tails.append(z[: last + 1])
    return tails


def deviation_along(guide: Candidate | ChainStretch) -> tuple[Floats, Floats]:
    """Compute the deviation along the stroke.

    Returns
    -------
    position, error : ndarray, shape (m,)
        Positions along the stroke, and the signed distances from the nominal there, positive to the
        left of the path [length].
    """
    if has_bars(guide):
        z = guide.motion(2 * STILL.nodes + 1).points[guide.point]
        return ((z - guide.frame.origin) * guide.frame.direction.conjugate()).real, guide.deviations(z)
    candidate = guide.at_home()
    return _deviation(candidate, *_curve_at_home(candidate))


def _deviation(candidate: Candidate, here: CouplerCurve | CircuitCurve, traced: Traced) -> tuple[Floats, Floats]:
    """Compute the deviation along the stroke, on the grid of the measurement."""
    fine = isinstance(here, CouplerCurve) and bool(traced.relative[0] < PLACEMENT.fine)
    guides = extended(here) if isinstance(here, CouplerCurve) and fine else here
    real: Any = np.longdouble if fine else float
    nodes = grid(STILL.nodes).nodes.astype(real)
    u, v = guides.path.window(traced.low.astype(real), traced.high.astype(real), nodes)
    z = (guides.point + (u + 1j * v) * guides.tangent)[:, 0]
    if candidate.radius is None:
        w = (z - traced.fit.start[0]) * traced.fit.along[0].conj()
        back = traced.fit.along[0].real < 0
        position, error = (candidate.stroke - w.real, -w.imag) if back else (w.real, w.imag)
    else:
        if candidate.is_wide:
            turned = np.unwrap(np.angle(z - traced.fit.centre[0]))
            return candidate.radius * np.abs(turned - turned[0]), from_circle(
                z, (z[0], z[-1]), candidate.radius, max(float(traced.fit.deviation[0]), 1e-18 * candidate.stroke)
            )
        ends = (guides.point[0], 0.5 * (z[0] + z[-1])) if here.cusp[0] else (z[0], z[-1])
        w = (z - ends[0]) * traced.fit.along[0].conj()
        position = candidate.stroke - w.real if traced.fit.along[0].real < 0 else w.real
        error = from_circle(z, ends, candidate.radius, max(float(traced.fit.deviation[0]), 1e-18 * candidate.stroke))
        error = error * np.sign((ends[1] - ends[0]).real)
    # a path that returns is drawn in the order of the motion
    order = np.arange(len(z)) if here.cusp[0] else np.argsort(position)
    return position[order].astype(float), error[order].astype(float)
