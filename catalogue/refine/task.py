"""What a refinement is asked for: the request, what may move and how, and what it may cost."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from ..guide.in_place import Nominal
from ..guide.place import near_stroke
from ..guide.span import Span
from ..guide.trace import Traced
from ..linkage import Array, Linkage
from ..query.constraints import Constraints
from ..query.lay import Answers, in_its_place, laid
from ..query.request import Request
from .derivatives import COUNT, displaced

#: Moves of a pivot nearer to the guided point than this part of the stroke are measured as if it stood there.
NEAR = 0.1
#: Guides below this deviation over stroke are exact but for rounding.
EXACT = 1e-12
#: The coordinate that never moves: the guided point is in the middle of its stroke.
ALONG = 8


class Moves(Protocol):
    """How placed guides may move: steps in p numbers each, of which 1 is a large one."""

    def basis(self, now: Answers, stroke: float) -> Array:
        """Return the derivatives (n, 10, p) of the coordinates of `derivatives` by the steps."""

    def moved(self, now: Answers, stroke: float, step: Array) -> tuple[Linkage, Array, Array]:
        """Return the linkages and guided points after steps (n, p), those that are valid, and the mask (n,) of them."""


@dataclass(frozen=True)
class Free:
    """The coordinates of the pivots and the guided point, in their distances from the guided point.

    Attributes
    ----------
    frozen : ndarray of bool, shape (10,), optional
        Which coordinates stay: x and y of A1, A1*, A2, A2*, and the guided point.  Every answer is laid along its path
        anew, which moves frozen pivots by what the path turns or shifts, less and less as the steps become short.
    """

    frozen: Array | None = None

    def basis(self, now: Answers, stroke: float) -> Array:
        linkage = now.linkage
        finite = linkage.finite.reshape(-1, 4)
        arm = np.abs(linkage.points - now.point[:, None, None]).reshape(-1, 4)
        unit = np.where(finite, np.maximum(arm, NEAR * stroke), 1.0)
        unit = np.repeat(np.concatenate([unit, np.full((len(unit), 1), stroke)], axis=1), 2, axis=1)
        unit[:, ALONG] = 0.0
        if self.frozen is not None:
            unit[:, self.frozen] = 0.0
        return unit[:, :, None] * np.eye(COUNT)

    def moved(self, now: Answers, stroke: float, step: Array) -> tuple[Linkage, Array, Array]:
        change = (self.basis(now, stroke) @ step[..., None])[..., 0]
        return displaced(now.linkage, now.point, change)


@dataclass(frozen=True)
class Parametric:
    """The parameters of a class of linkages, which the refined ones do not leave.

    Attributes
    ----------
    make : callable
        From parameters (n, p) to pivots (n, 2, 2, 3) and guided points (n,), in mid-stroke, in any frame; of a size
        that leaves the stroke the one asked for.
    read : callable
        From linkages and guided points, in any frame, to their parameters (n, p).
    """

    make: Callable[[Array], tuple[Array, Array]]
    read: Callable[[Linkage, Array], Array]

    def basis(self, now: Answers, stroke: float) -> Array:
        """By central differences; the last two are a shift across the path and a turn about the guided point."""
        q = self.read(now.linkage, now.point)
        columns = []
        for k in range(q.shape[1]):
            step = np.zeros_like(q)
            step[:, k] = 1e-5
            ends = [self._laid(now, q + sign * step) for sign in (1, -1)]
            columns.append((_coordinates(*ends[0]) - _coordinates(*ends[1])) / 2e-5)
        finite = now.linkage.finite.reshape(-1, 4)
        z = now.linkage.points.reshape(-1, 4) - np.where(finite, now.point[:, None], 0)
        zero = np.zeros((len(z), 1))
        columns.append(_pairs(np.concatenate([1j * stroke * finite, 1j * stroke + zero], axis=1)))
        columns.append(_pairs(np.concatenate([1j * z, zero], axis=1)))
        return np.stack(columns, axis=-1)

    def moved(
        self,
        now: Answers,
        stroke: float,  # noqa: ARG002, it is in the parameters
        step: Array,
    ) -> tuple[Linkage, Array, Array]:
        pivots, point = self._laid(now, self.read(now.linkage, now.point) + step[:, :-2])
        made, good = Linkage.valid(pivots)
        return made, point[good], good

    def _laid(self, now: Answers, q: Array) -> tuple[Array, Array]:
        """Return pivots and guided points as they are made, carried to where the linkages of now are."""
        (here, at), (pivots, point) = self.make(self.read(now.linkage, now.point)), self.make(q)
        z, w = (p[..., 0] + 1j * p[..., 1] for p in (here, now.linkage.pivots))
        same = here[..., 2] != 0
        arms = [np.where(same, a - b[:, None, None], 0).reshape(len(at), -1) for a, b in ((z, at), (w, now.point))]
        straight, flipped = ((a.conj() * arms[1]).sum(1) for a in (arms[0], arms[0].conj()))
        over = np.abs(flipped) > np.abs(straight) * (1 + 1e-9)
        turn = np.where(over, flipped, straight)
        turn = turn / np.abs(turn)

        def carried(v: Array, shift: Array | float) -> Array:
            flip = over.reshape(-1, *(1,) * (v.ndim - 1))
            return np.asarray(turn.reshape(flip.shape) * np.where(flip, np.conj(v - shift), v - shift))

        far = pivots[..., 2] == 0
        new = pivots[..., 0] + 1j * pivots[..., 1]
        new = np.where(far, carried(new, 0.0), carried(new, at[:, None, None]) + now.point[:, None, None])
        there = carried(point, at) + now.point
        return np.stack([new.real, new.imag, pivots[..., 2]], axis=-1), there


def _coordinates(pivots: Array, point: Array) -> Array:
    z = (pivots[..., 0] + 1j * pivots[..., 1]).reshape(len(point), 4)
    return _pairs(np.concatenate([z, point[:, None]], axis=1))


def _pairs(z: Array) -> Array:
    """Return complex numbers (n, 5) as x and y, shape (n, 10)."""
    return np.stack([z.real, z.imag], axis=-1).reshape(len(z), -1)


@dataclass(frozen=True)
class Task:
    """What is to be refined, inside what.

    Attributes
    ----------
    request : StraightLine or CircularArc
    wanted : Constraints
    price : callable
        From answers to what they cost besides their deviation, shape (n,); it hardly rises.
    rank : mapping
        Weights of the criteria that the price is made of.
    moves : Moves
    nominal : Nominal, optional
        The line or arc itself, from which distances are then measured: guides are not laid anew, but stay in place.
    """

    request: Request
    wanted: Constraints
    price: Callable[[Answers], Array] = lambda some: np.zeros(len(some.point))
    rank: Mapping[str, float] = field(default_factory=dict)
    moves: Moves = Free()
    nominal: Nominal | None = None

    @property
    def with_radius(self) -> bool:
        """Whether the radius of the nominal is a coordinate besides those of the moves."""
        return self.nominal is None and self.request.kind == "circle"

    def laid(self, rows: dict[str, Array], moved: Span) -> tuple[Answers, dict[str, Array]]:
        """Return linkages after a step as answers, and which of them satisfy each constraint."""
        if self.nominal is not None:
            return in_its_place(self.request, self.wanted, rows, moved, self.nominal)
        circle = self.request.kind == "circle"
        traced = _forward(near_stroke(moved, self.request.stroke, circle=circle))
        return laid(self.request, self.wanted, rows, moved, traced)


def _forward(traced: Traced) -> Traced:
    """Return the traces with those turned round that run backwards along the nominal: answers keep their side of it."""
    fit, back = traced.fit, traced.fit.along.real < 0
    turned = replace(
        fit,
        start=np.where(back, fit.start + fit.stroke * fit.along, fit.start),
        along=np.where(back, -fit.along, fit.along),
        curvature=np.where(back, -fit.curvature, fit.curvature),
    )
    low, high = (np.where(back, b, a) for a, b in ((traced.low, traced.high), (traced.high, traced.low)))
    return replace(traced, fit=turned, low=low, high=high)
