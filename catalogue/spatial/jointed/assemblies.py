"""All ways to put a mechanism together at a value of its drive, by Newton's method from random poses.

Random starts cannot prove that nothing was missed; how often each assembly was found says how likely that is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kinematics.types import Array
from .motion import Motion
from .system import CURVE, FREE, PRISMATIC, REVOLUTE, SURFACE
from .tracing import Curve, newton, signature

#: Poses are one if what tells them apart differs by less.
SAME = 1e-6
#: How far slides and free bodies may be from the design pose, in the size of the mechanism.
FAR = 1.5


@dataclass(frozen=True, eq=False)
class FoundAssemblies:
    """Assemblies of one mechanism at one value of its drive.

    Attributes
    ----------
    motion : Motion
        One pose for each, that of the design first if it is among them.
    hits : ndarray, shape (a,)
        How many of the random starts came to it.
    starts : int
    """

    motion: Motion
    hits: Array
    starts: int


def search(curve: Curve, target: float, hits: int, most: int, seed: int) -> tuple[Array, Array, int]:
    """Return states (a, numbers), hits and the number of starts: 128 at first, then twice as many, until each was found
    `hits` times or `most` starts were made."""
    draw, made, batch = np.random.default_rng(seed), 0, 128
    states, names = np.empty((0, curve.system.numbers)), np.empty((0, 0))
    counts = np.zeros(0, int)
    while made < most:
        y = (
            np.concatenate([curve.system.design[None], _random(curve, draw, batch)])
            if not made
            else _random(curve, draw, batch)
        )
        made += batch
        found, good = newton(curve.take(np.zeros(len(y), int)), y, np.full(len(y), target))
        found = found[good]
        marks = signature(curve.take(np.zeros(len(found), int)), found)
        for y_new, mark in zip(found, marks, strict=True):
            apart = np.abs(names - mark).max(1) if len(states) else np.zeros(0)
            if len(apart) and apart.min() < SAME:
                counts[apart.argmin()] += 1
            else:
                states, counts = np.concatenate([states, y_new[None]]), np.append(counts, 1)
                names = np.concatenate([names, mark[None]]) if len(names) else mark[None]
        if len(counts) and counts.min() >= hits:
            break
        batch *= 2
    return states, counts, made


def _random(curve: Curve, draw: np.random.Generator, n: int) -> Array:
    y = np.zeros((n, curve.system.numbers))
    for p in curve.system.placed:
        for c in p.number:
            if p.sort == FREE:
                y[:, c : c + 4] = draw.normal(size=(n, 4))
                y[:, c + 4 : c + 7] = draw.uniform(-FAR, FAR, (n, 3))
            elif p.sort in (SURFACE, CURVE) and p.guide:
                for k in range(len(p.guide.start)):
                    half = p.guide.kind.spans[k]
                    y[:, c + k] = draw.uniform(-1, 1, n) * (FAR if half is None else half)
            else:
                if p.sort != PRISMATIC:
                    y[:, c] = draw.uniform(-np.pi, np.pi, n)
                if p.sort != REVOLUTE:
                    y[:, c + (p.sort != PRISMATIC)] = draw.uniform(-FAR, FAR, n)
    return curve.system.unitary(y)
