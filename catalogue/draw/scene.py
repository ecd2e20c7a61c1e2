"""Contents of a drawing as coordinates, independent of paper and colours."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..guidance.coupler_curve import CouplerCurve
from ..guidance.deviation_curve import from_circle
from ..guidance.minimum_zone import grid
from ..guidance.placement import PLACEMENT, at_stroke
from ..guidance.trace import Traced, extended
from ..kinematics.circuits import OPEN
from ..kinematics.linkage import PR, RP
from ..kinematics.types import Complexes, Floats, Integers
from .poses import Poses

if TYPE_CHECKING:
    from ..guidance.circuit_curve import CircuitCurve
    from ..guides.candidate import Candidate
    from ..guides.run import Run


class SceneOptions(NamedTuple):
    """Positions at which a scene is sampled."""

    #: Number of positions of the linkage over the stroke: odd, so that one is in mid-stroke.
    poses: int = 33
    beyond: float = 0.3  #: length of the path beyond either end of the stroke [strokes]
    nodes: int = 128  #: intervals between the points at which the deviation is drawn


SCENE = SceneOptions()


@dataclass(frozen=True)
class Scene:
    """A candidate over its stroke.

    Points are complex, positions run from 0 to the stroke [length].
    """

    kinds: Integers  #: kinds of the dyads, shape (2,): `RR`, `PR`, `RP`
    fixed: Complexes  #: fixed pivots, shape (2,); for a slider the unit normal of its line
    moving: Complexes  #: moving pivots, shape (poses, 2); for a slide the unit normal of its coupler line
    #: Corners of the coupler, shape (poses, 3): finite moving pivots, or the feet on slides' lines;
    #: last the guided point.
    coupler: Complexes
    rods: dict[int, Complexes]  #: ends of each slide's coupler line over the stroke, by dyad 0 or 1, shape (poses, 2)
    path: Complexes  #: path of the guided point, shape (p,), within `POLYLINE.error`
    before: Complexes  #: path before the start, outwards, until the linkage or the path turns
    after: Complexes  #: path after the end, outwards, until the linkage or the path turns
    position: Floats  #: positions along the stroke, shape (nodes + 1,)
    error: Floats  #: signed distances from the nominal at `position`, positive to +y [length]

    joint: Complexes | None = None  #: joints of rod and rocker of a dwell, shape (m,)
    pivot: complex = complex("nan")  #: fixed pivot of its rocker
    ghosts: tuple[int, ...] = (0, -1)  #: poses that are drawn faintly
    driver: int = 0  #: number of the driving crank; 0: none
    #: Path of the guided point over the turn of a driving crank that turns fully, shape (r,); else
    #: empty.
    turn: Complexes = field(default_factory=lambda: np.empty(0, complex))
    middle: int = SCENE.poses // 2  #: index of the pose in mid-stroke, or in the position given

    @property
    def places(self) -> Complexes:
        """Places of the fixed pivots and of the coupler's corners in the middle pose, (k,)."""
        return np.concatenate([self.fixed[self.kinds != PR], self.coupler[self.middle]])

    @property
    def box(self) -> tuple[float, float, float, float]:
        """x0, y0, x1, y1 of everything."""
        fixed = self.fixed[self.kinds != PR]
        every = [fixed, self.coupler, *self.rods.values(), self.path, self.before, self.after, self.turn]
        every += [] if self.joint is None else [self.joint, np.array([self.pivot])]
        z = np.concatenate([np.ravel(a) for a in every])
        return float(z.real.min()), float(z.imag.min()), float(z.real.max()), float(z.imag.max())


def scene_of(shown: Poses) -> Scene:
    """Make the scene of a mechanism without a stroke."""
    none = np.empty(0)
    return Scene(
        shown.kinds,
        shown.fixed,
        shown.moving,
        shown.carried(shown.home),
        {i: shown.carried(ends) for i, ends in shown.rods.items()},
        shown.path,
        none.astype(complex),
        none.astype(complex),
        none,
        none,
        shown.joint,
        shown.pivot,
        (),
        shown.driver,
        middle=shown.middle,
    )


def scene(candidate: Candidate) -> Scene:
    """Return the scene of a candidate.

    Raises
    ------
    InvalidRequest
        If the linkage does not lead the guided point over the whole stroke.
    """
    way, candidate = candidate.frame, candidate.at_home()
    here, traced = candidate.traced
    if isinstance(here, CouplerCurve) and traced.relative[0] < PLACEMENT.fine:
        traced = at_stroke(here, candidate.stroke, circle=candidate.radius is not None)
    kinds, z = here.linkage.dyads[0], here.linkage.points[0]
    run = candidate.run()
    home = float(run.circuit.phase[0])
    middle = float(run.samples.share(home))
    share = np.interp(np.linspace(-1, 1, SCENE.poses), [-1, 0, 1], [0, middle, 1])
    pose = run.circuit.pose(run.samples.rows(share)[:, None])
    guided = pose.point(here.point)[:, 0]
    moving = np.concatenate([pose.pivot(here.linkage, i) for i in (0, 1)], axis=1)
    feet, rods = _slides(kinds, z[:, 0], moving, guided)
    corners = [feet[i] if i in feet else moving[:, i] for i in (0, 1)]
    path = run.path(run.polyline())
    turn = np.empty(0, complex)
    if candidate.driver in candidate.rotates:
        whole = candidate.run(whole=True)
        turn = whole.path(whole.polyline())
    bent = np.exp(0.5j * np.radians(candidate.arc_angle or 0.0)) if candidate.is_wide else 1.0
    before, after = _beyond(run, complex(here.tangent[0]), SCENE.beyond * candidate.stroke, complex(bent))
    position, error = _deviation(candidate, here, traced)
    shown = Scene(
        kinds,
        z[:, 0],
        moving,
        np.stack([*corners, guided], 1),
        rods,
        path,
        before,
        after,
        position,
        error,
        driver=candidate.driver or 0,
        turn=turn,
    )
    return _carried(shown, complex(way.origin), complex(way.direction))


def _carried(shown: Scene, origin: complex, direction: complex) -> Scene:
    """Move the scene to the user's frame: its path starts at `origin` in the given direction."""
    if origin == 0 and direction == 1:
        return shown

    def to(z: Complexes) -> Complexes:
        return np.asarray(origin + direction * z)

    return replace(
        shown,
        fixed=np.where(shown.kinds == PR, direction * shown.fixed, to(shown.fixed)),
        moving=np.where(shown.kinds == RP, direction * shown.moving, to(shown.moving)),
        coupler=to(shown.coupler),
        rods={i: to(ends) for i, ends in shown.rods.items()},
        path=to(shown.path),
        before=to(shown.before),
        after=to(shown.after),
        turn=to(shown.turn),
    )


def _slides(
    kinds: Integers, fixed: Complexes, moving: Complexes, guided: Complexes
) -> tuple[dict[int, Complexes], dict[int, Complexes]]:
    """Return for each slide the nearest foot on its slot, and the ends of the slot."""
    feet: dict[int, Complexes] = {}
    rods: dict[int, Complexes] = {}
    points = np.stack([moving[:, i] for i in (0, 1) if kinds[i] != RP] + [guided], 1)
    for i in (i for i in (0, 1) if kinds[i] == RP):
        normal = moving[:, i]
        height = ((points - fixed[i]) * normal.conj()[:, None]).real
        nearest = np.abs(height[0]).argmin()
        feet[i] = points[:, nearest] - height[:, nearest] * normal
        along = 1j * normal
        contact = ((fixed[i] - feet[i]) * along.conj()).real
        ends = np.array([min(contact.min(), 0), max(contact.max(), 0)])
        rods[i] = feet[i][:, None] + along[:, None] * ends
    return feet, rods


def _beyond(run: Run, middle: complex, more: float, bent: complex = 1.0) -> list[Complexes]:
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


def _deviation(candidate: Candidate, here: CouplerCurve | CircuitCurve, traced: Traced) -> tuple[Floats, Floats]:
    """Compute the deviation along the stroke, on the grid of the measurement."""
    fine = isinstance(here, CouplerCurve) and bool(traced.relative[0] < PLACEMENT.fine)
    guides = extended(here) if isinstance(here, CouplerCurve) and fine else here
    real: Any = np.longdouble if fine else float
    nodes = grid(SCENE.nodes).nodes.astype(real)
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
