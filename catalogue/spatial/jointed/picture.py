"""Compose a picture: links, bodies, joints, guides, wheels, springs and paths in some poses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...kinematics.types import Array
from ..drawing import scene as seen
from . import elements as e
from .axle import Wheel
from .hard_points import numbers
from .located_guide import LocatedGuide

if TYPE_CHECKING:
    from .mechanism import Mechanism
    from .motion import Motion


@dataclass(frozen=True)
class Proportions:
    """Numbers of points, and lengths [sizes of the mechanism].

    Attributes
    ----------
    round : int
        Points of a wheel's rim; so many that its chords are invisible.
    mesh : int
        Points of a guide along each coordinate.
    angle : float
        Extent of a guide beyond the path of its point [rad].
    beyond : float
        Extent of a guide beyond the path of its point [lengths of the path].
    coil, turns : float, int
        Radius and number of turns of a spring.
    stub : float
        Half the length of a shaft, or of an arm of a cross, that has no hard point.
    """

    round: int = 73
    mesh: int = 25
    angle: float = 0.5
    beyond: float = 0.12
    coil: float = 0.02
    turns: int = 8
    stub: float = 0.22


PROPORTIONS = Proportions()


class Poses:
    """Points and directions of bodies in the poses drawn: of a motion, or the design pose alone.

    Vehicles are drawn in axes of ISO 8855, z upwards; `signs` (3,) convert coordinates to them.
    """

    def __init__(self, mechanism: Mechanism, motion: Motion | None, signs: Array) -> None:
        self.mechanism, self.motion, self.signs = mechanism, motion, signs
        self.which = _drawn_poses(motion) if motion else [0]

    def point(self, body: str, at: Any) -> Array:
        """Return a point of a body, (p, 3)."""
        if self.motion is None or body == e.GROUND:
            return np.asarray(self.signs * np.repeat(numbers(at, "a point"), len(self.which), axis=0))
        return np.asarray(self.signs * self.motion.point(body, at)[self.which])

    def direction(self, body: str, vector: Any) -> Array:
        """Return a unit vector of a body, (p, 3)."""
        v = numbers(vector, "a direction")
        v = v / np.sqrt((v * v).sum())
        if self.motion is None or body == e.GROUND:
            return np.asarray(self.signs * np.repeat(v, len(self.which), axis=0))
        return np.asarray(self.signs * self.motion.direction(body, v)[self.which])


def _drawn_poses(motion: Motion) -> list[int]:
    """Return the numbers of the pose nearest to the design pose and of the ghosts.

    Ghosts are the ends of a motion; a closed motion has them at its thirds.
    """
    good = np.flatnonzero(np.isfinite(motion.states[0]).all(1))
    if not len(good):
        return [0]
    system = motion.curve.system
    last = system.scalars[-len(motion.drives) :]
    design = system.evaluate(system.design[None])[1][0, -len(last) :]
    off = motion.values[good] / [scalar.unit for scalar in last] - design
    first = int(good[(off**2).sum(1).argmin()])
    rotation, shift = system.poses(motion.states[0])
    apart = (
        np.abs(rotation[0, good[0]] - rotation[0, good[-1]]).max()
        + np.abs(shift[0, good[0]] - shift[0, good[-1]]).max()
    )
    ends = [int(good[0]), int(good[-1])] if apart > 1e-6 else [int(good[len(good) // 3]), int(good[2 * len(good) // 3])]
    return [first, *(k for k in dict.fromkeys(ends) if k != first)]


def scene(
    mechanism: Mechanism,
    motion: Motion | None = None,
    wheels: Sequence[Wheel] = (),
    points: Mapping[str, tuple[str, Any]] | None = None,
    title: str = "",
    springs: Mapping[str, e.Length] | None = None,
) -> seen.Scene:
    """Compose the scene of a mechanism in its design pose, or of a motion with ghosts."""
    poses = Poses(mechanism, motion, wheels[0].signs if wheels else np.ones(3))
    every = [numbers(getattr(x, k), k) for x in mechanism.elements for k in ("at", "from_", "to") if _has_field(x, k)]
    size = float(np.ptp(np.concatenate(every), axis=0).max()) or 1.0  # all joints may coincide
    names = ["left wheel" if w.beside()[0] > 0 else "right wheel" for w in wheels]
    if len(set(names)) < len(wheels):
        names = [f"{w.carrier} centre" for w in wheels]
    elif len(wheels) == 1:
        names = ["wheel centre"]
    centres = {name: (w.carrier, w.centre) for name, w in zip(names, wheels, strict=True)}
    follow = {**centres, **(points or {})}
    rings = [_ring(poses, wheel) for wheel in wheels]
    along = _poses_along_drive(motion, poses.which[0]) if motion else slice(None)
    paths = {name: motion.point(body, at)[along] * poses.signs for name, (body, at) in follow.items()} if motion else {}
    balls, fixed = _joints(mechanism, poses)
    bodies = _bodies(mechanism, poses, size, follow)
    curves, patches = _guides(mechanism, poses, size)
    curves += [(name, _coil(poses, spring, PROPORTIONS.coil * size)) for name, spring in (springs or {}).items()]
    return seen.Scene(
        [
            seen.Link(x.name, np.stack([poses.point(x.a, x.from_), poses.point(x.b, x.to)], axis=1))
            for x in mechanism.elements
            if isinstance(x, e.Link)
        ],
        bodies,
        _axes(mechanism, poses, bodies, size),
        balls,
        fixed,
        curves,
        patches,
        rings,
        paths,
        title or _title(mechanism),
        _note(motion),
        mechanism.unit,
    )


def _poses_along_drive(motion: Motion, drawn: int) -> Array:
    """Return the poses of a grid along its first drive, through the drawn pose; else all."""
    values = motion.values
    if len(values) < np.prod([len(np.unique(column)) for column in values.T]) or not motion.others:
        return np.arange(len(values))
    return np.flatnonzero((values[:, 1:] == values[drawn, 1:]).all(1))


def _has_field(x: Any, field: str) -> bool:
    return getattr(x, field, None) is not None and not (isinstance(x, e.Prismatic | e.Fixed) and not np.any(x.at))


def _title(mechanism: Mechanism) -> str:
    bodies = [b for b in mechanism.system().bodies[1:] if not b.endswith(" (point)")]
    return ", ".join(bodies)


def _note(motion: Motion | None) -> str:
    if motion is None:
        return "design pose"
    if motion.others:
        return f"{len(motion.drive)} poses of {', '.join(map(e.title, motion.drives))}; others as ghosts"
    drive = motion.drive_shown[np.isfinite(motion.states[0]).all(1)]
    if not len(drive):
        return "no pose"
    if isinstance(motion.driven, e.Sum):
        return f"{e.title(motion.driven)} from {drive[0]:.5g} to {drive[-1]:.5g} {motion.drive_unit}; others as ghosts"
    kind = type(motion.driven).__name__.lower()
    what = (
        getattr(motion.driven, "body", "") or getattr(motion.driven, "link", "") or getattr(motion.driven, "guide", "")
    )
    return f"{kind} of {what} from {drive[0]:.5g} to {drive[-1]:.5g} {motion.drive_unit}; others as ghosts".replace(
        "of  ", ""
    )


def _points_of_bodies(mechanism: Mechanism) -> dict[str, list[Any]]:
    """Return the hard points of each body."""
    out: dict[str, list[Any]] = {}
    for x in mechanism.elements:
        if isinstance(x, e.Link):
            out.setdefault(x.a, []).append(x.from_)
            out.setdefault(x.b, []).append(x.to)
        elif isinstance(x, e.Revolute | e.Cylindrical | e.Spherical | e.Prismatic | e.OnGuide):
            here = [getattr(x, k) for k in ("at", "to") if _has_field(x, k)]
            out.setdefault(x.body, []).extend(here)
            if isinstance(x, e.OnGuide) and _is_line_on_body(x):
                out.setdefault(x.on, []).append(x.origin)
            if not isinstance(x, e.OnGuide | e.Prismatic):
                out.setdefault(x.on, []).extend(here)
    return out


def _bodies(mechanism: Mechanism, poses: Poses, size: float, follow: Mapping[str, tuple[str, Any]]) -> list[seen.Body]:
    attached = _points_of_bodies(mechanism)
    for body, at in follow.values():
        attached.setdefault(body, []).append(at)
    out = []
    for name in mechanism.system().bodies[1:]:
        at = attached.get(name, [])
        distinct = list({tuple(np.ravel(p).tolist()): p for p in at}.values())
        if not distinct:
            continue
        points = np.stack([poses.point(name, p) for p in distinct], axis=1)
        out.append(seen.Body(name, points, _rods(mechanism, poses, name, distinct, size)))
    return out


def _rods(mechanism: Mechanism, poses: Poses, body: str, at: list[Any], size: float) -> Array:
    """Return arms and shaft of a body such as a Cardan joint's, (p, r, 2, 3)."""
    middle, rods = np.asarray(at[0], float), []
    for x in mechanism.elements:
        for b, axis in ((x.a, x.axis_a), (x.b, x.axis_b)) if isinstance(x, e.KeepAngle) else ():
            if b == body:
                v = np.asarray(axis, float) / np.linalg.norm(axis) * PROPORTIONS.stub * size
                rods.append((middle - v, middle + v))
    shaft = _shaft(mechanism, body, size)
    if rods and shaft is not None:
        rods.append((middle, middle + shaft))
    pairs = [np.stack([poses.point(body, a), poses.point(body, b)], axis=1) for a, b in rods]
    return np.stack(pairs, axis=1) if pairs else np.zeros((len(poses.which), 0, 2, 3))


def _shaft(mechanism: Mechanism, body: str, size: float) -> Array | None:
    """Return the shaft of a body with a hinge and a `KeepAngle`; None without."""
    sides = [
        sign for x in mechanism.elements if isinstance(x, e.KeepAngle) for b, sign in ((x.a, -1), (x.b, 1)) if b == body
    ]
    for x in mechanism.elements:
        if sides and isinstance(x, e.Revolute) and x.body == body and x.axis is not None:
            return np.asarray(
                sides[0] * 2 * PROPORTIONS.stub * size * np.asarray(x.axis, float) / np.linalg.norm(x.axis)
            )
    return None


def _joints(mechanism: Mechanism, poses: Poses) -> tuple[Array, Array]:
    """Return ball joints (p, b, 3), and the fixed ones (f, 3)."""
    balls, fixed = [], []
    for x in mechanism.elements:
        ends = [(x.a, x.from_), (x.b, x.to)] if isinstance(x, e.Link) else []
        if isinstance(x, e.Spherical | e.OnGuide):
            ends = [(x.body, x.at)]
        balls += [poses.point(b, p) for b, p in ends]
        fixed += [poses.point(e.GROUND, p)[0] for b, p in ends if b == e.GROUND or getattr(x, "on", "") == e.GROUND]
    empty = np.zeros((len(poses.which), 0, 3))
    return np.stack(balls, axis=1) if balls else empty, np.array(fixed).reshape(-1, 3)


def _axes(mechanism: Mechanism, poses: Poses, bodies: Sequence[seen.Body], size: float) -> list[seen.Axis]:
    out = []
    for x in mechanism.elements:
        if not isinstance(x, e.Revolute | e.Cylindrical | e.Prismatic):
            continue
        at = [getattr(x, k) for k in ("at", "to") if _has_field(x, k)]
        axis = x.axis if x.axis is not None else np.subtract(at[1], at[0])
        shaft = _shaft(mechanism, x.body, size)
        if at and shaft is not None:  # the hinge is drawn on the shaft, away from the cross
            points = poses.point(x.on, np.asarray(at[0], float) + 0.7 * shaft)[:, None]
        elif at:
            points = np.stack([poses.point(x.on, p) for p in at], axis=1)
        else:  # a slider is drawn at its body
            points = next((b.points[:, :1] for b in bodies if b.name == x.body), np.zeros((len(poses.which), 1, 3)))
        out.append(
            seen.Axis(
                points, poses.direction(x.on, axis), not isinstance(x, e.Prismatic), not isinstance(x, e.Revolute)
            )
        )
    return out


def _is_line_on_body(x: e.OnGuide) -> bool:
    """Return whether a guide is a line on a moving body, such as a strut."""
    return x.guide == "line" and x.on != e.GROUND


def _ring(poses: Poses, wheel: Wheel) -> Array:
    n = wheel.outboard()
    first = np.cross(n, np.eye(3)[np.abs(n).argmin()])
    first /= np.linalg.norm(first)
    turn = np.linspace(0, 2 * np.pi, PROPORTIONS.round)[:, None]
    rim = np.asarray(wheel.centre, float) + wheel.rolling_radius() * (
        np.cos(turn) * first + np.sin(turn) * np.cross(n, first)
    )
    return np.stack([poses.point(wheel.carrier, p) for p in rim], axis=1)


def _coil(poses: Poses, spring: e.Length, radius: float) -> Array:
    """Return a helix between the ends of a spring, (p, m, 3)."""
    first, second = poses.point(spring.a, spring.from_), poses.point(spring.b, spring.to)
    along = second - first
    across = np.cross(along, np.eye(3)[np.abs(along).argmin(1)])
    across /= np.sqrt((across * across).sum(1, keepdims=True))
    beside = np.cross(along, across)
    beside /= np.sqrt((beside * beside).sum(1, keepdims=True))
    part = np.linspace(0, 1, 12 * PROPORTIONS.turns + 1)
    wide = radius * np.clip(np.minimum(part, 1 - part) * 2 * PROPORTIONS.turns, 0, 1)  # straight at both ends
    turned = (
        (np.cos(2 * np.pi * PROPORTIONS.turns * part) * wide)[:, None],
        (np.sin(2 * np.pi * PROPORTIONS.turns * part) * wide)[:, None],
    )
    line = first[:, None] + part[:, None] * along[:, None]
    return np.asarray(line + turned[0] * across[:, None] + turned[1] * beside[:, None])


def _guides(mechanism: Mechanism, poses: Poses, size: float) -> tuple[list[tuple[str, Array]], list[tuple[str, Array]]]:
    """Return curves (p, m, 3) and patches (p, m, m, 3) of guides."""
    curves: list[tuple[str, Array]] = []
    patches: list[tuple[str, Array]] = []
    for x in mechanism.elements:
        if not isinstance(x, e.OnGuide):
            continue
        guide, passed = _in_users_unit(x), poses.point(x.body, x.at)
        here = passed - poses.point(x.on, guide.origin)
        axes = np.stack([poses.direction(x.on, v) for v in guide.frame.T], axis=2)  # (p, 3, 3)
        local = (np.swapaxes(axes, 1, 2) @ here[..., None])[..., 0].T
        shape = np.repeat(guide.shape[:, None], local.shape[1], axis=1)
        held = _is_line_on_body(x)  # drawn from where it is held
        sides = [
            _side(
                np.append(values, 0.0) if held else values,
                guide.kind.spans[k] == np.pi and "uw"[k] not in guide.kind.lengths,
                size,
            )
            for k, values in enumerate(guide.kind.locate(local, shape)[: 3 - guide.kind.conditions])
        ]
        mesh = np.meshgrid(*sides, indexing="ij")
        u, w = mesh[0].ravel(), mesh[-1].ravel()
        shapes = np.repeat(guide.shape[:, None], len(u), axis=1)
        flat = np.stack(np.broadcast_arrays(*guide.kind.point(u, w, shapes), u)[:3], axis=1)
        world = np.stack([poses.point(x.on, guide.origin + guide.frame @ q) for q in flat], axis=1)
        if guide.kind.conditions == 2:
            curves.append((x.name, world))
        else:
            patches.append((x.name, world.reshape(len(world), *mesh[0].shape, 3)))
    return curves, patches


def _in_users_unit(x: e.OnGuide) -> LocatedGuide:
    """Return a guide in the user's unit."""
    from ..geometry.guides import Guides
    from ..geometry.rotation import matrix

    guides = Guides(x.guide, x.parameters, x.origin, x.quaternion)
    kind, _, p = guides.each()[0]
    return LocatedGuide(kind, p[:, 0], matrix(guides.quaternion.T)[:, :, 0], guides.origin[0], ())


def _side(values: Array, angle: bool, size: float) -> Array:
    values = np.unwrap(values) if angle else values
    more = PROPORTIONS.angle if angle else PROPORTIONS.beyond * size
    return np.linspace(values.min() - more, values.max() + more, PROPORTIONS.mesh)
