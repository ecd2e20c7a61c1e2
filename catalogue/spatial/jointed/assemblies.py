"""Search for assemblies at a value of the drive, by Newton's method from random poses.

Random starts cannot prove that all assemblies were found; the number of hits of each says how
likely that is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kinematics.types import Array
from .curve import Curve, signature
from .motion import Motion
from .newton import newton
from .system import System
from .tree import CURVE, FREE, PRISMATIC, REVOLUTE, SURFACE

#: Largest difference of the signatures of one pose.
SAME_POSE = 1e-6
#: Largest residual of a closed assembly [units]; Newton's method ends far below it.
MAX_RESIDUAL = 1e-9
#: Largest distance of slides and free bodies from the design pose [sizes of the mechanism].
MAX_START_DISTANCE = 1.5


@dataclass(frozen=True, eq=False)
class FoundAssemblies:
    """Assemblies of one mechanism at one value of its drive.

    Attributes
    ----------
    motion : Motion
        One pose of each assembly; the design pose comes first if it is among them.
    hits : ndarray, shape (a,)
        Number of random starts that converged to each assembly.
    starts, fruitless : int
        Number of starts; number of those after the last new assembly.
    even : bool
        Whether the number of assemblies must be even: links, ball joints or revolutes close the
        loops. If the number found is odd, one was missed or two coincide.
    wanted : int
        Requested number of hits of each assembly.
    """

    motion: Motion
    hits: Array
    starts: int
    fruitless: int
    wanted: int = 1

    @property
    def even(self) -> bool:
        return len(self.hits) % 2 == 0

    @property
    def scarce(self) -> int:
        """Number of assemblies with fewer hits than requested: above 0, others may be missing."""
        return int((self.hits < self.wanted).sum())

    def remarks(self) -> list[str]:
        """Return remarks on the completeness of the count, one line each."""
        lines = [f"{len(self.hits)} found by {self.starts} random starts, none new by the last {self.fruitless}"]
        if self.scarce:
            lines.append(
                f"others may be missing: {self.scarce} of these were found less than {self.wanted} times; "
                "make more starts"
            )
        system = self.motion.curve.system
        if not self.even and system.rows and not system.redundant:
            lines.append(
                "an odd number: where links, balls and revolutes close the loops, one is missing or two coincide"
            )
        return lines


def search(curve: Curve, target: float, hits: int, most: int, seed: int) -> tuple[Array, Array, int, int]:
    """Search for assemblies; return states (a, numbers), hits, starts and fruitless starts.

    The first round has 128 starts; each round doubles their number, until each assembly has `hits`
    hits or `most` starts are made.
    """
    draw, made, batch = np.random.default_rng(seed), 0, 128
    states, names = np.empty((0, curve.system.numbers)), np.empty((0, 0))
    counts, last = np.zeros(0, int), 0
    while made < most:
        batch = min(batch, most - made)
        y = (
            np.concatenate([curve.system.design[None], _random(curve, draw, batch)])
            if not made
            else _random(curve, draw, batch)
        )
        made += batch
        found, good = newton(curve.take(np.zeros(len(y), int)), y, np.full(len(y), target))
        good &= is_closed(curve.system, found)
        when, found = made - batch + 1 + np.flatnonzero(good), found[good]
        marks = signature(curve.take(np.zeros(len(found), int)), found)
        for y_new, mark, start in zip(found, marks, when, strict=True):
            apart = np.abs(names - mark).max(1) if len(states) else np.zeros(0)
            if len(apart) and apart.min() < SAME_POSE:
                counts[apart.argmin()] += 1
            else:
                last = int(start)
                states, counts = np.concatenate([states, y_new[None]]), np.append(counts, 1)
                names = np.concatenate([names, mark[None]]) if len(names) else mark[None]
        if len(counts) and counts.min() >= hits:
            break
        batch *= 2
    return states, counts, made, made - last


def is_closed(system: System, y: Array) -> Array:
    """Return whether states (n, numbers) meet all conditions, without reversed joints."""
    with np.errstate(all="ignore"):
        rotation, shift = system.poses(y)
        ends, vectors = system.attached(rotation, shift)
        missed = np.abs(system.residual(ends, vectors, rotation, shift)[0]).max(1, initial=0)
        one, other = system.facing
        same = (vectors[0][:, one] * vectors[0][:, other]).sum(-1).min(1, initial=1) > 0
    return np.asarray((missed <= MAX_RESIDUAL) & same)


def _random(curve: Curve, draw: np.random.Generator, n: int) -> Array:
    y = np.zeros((n, curve.system.numbers))
    for p in curve.system.placed:
        for c in p.number:
            if p.joint_kind == FREE:
                y[:, c : c + 4] = draw.normal(size=(n, 4))
                y[:, c + 4 : c + 7] = draw.uniform(-MAX_START_DISTANCE, MAX_START_DISTANCE, (n, 3))
            elif p.joint_kind in (SURFACE, CURVE) and p.guide:
                for k in range(len(p.guide.start)):
                    half = p.guide.kind.spans[k]
                    y[:, c + k] = draw.uniform(-1, 1, n) * (MAX_START_DISTANCE if half is None else half)
            else:
                if p.joint_kind != PRISMATIC:
                    y[:, c] = draw.uniform(-np.pi, np.pi, n)
                if p.joint_kind != REVOLUTE:
                    y[:, c + (p.joint_kind != PRISMATIC)] = draw.uniform(-MAX_START_DISTANCE, MAX_START_DISTANCE, n)
    return curve.system.unitary(y)
