"""Candidates measured again, from `pivots`, `guided` and `stroke` alone, by loops closed in another way."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue import Candidate


@dataclass
class Again:
    """What a candidate is found to be; lengths in its unit."""

    path: Any
    deviation: float
    radius: float
    size: float
    max_link: float
    min_link: float
    max_ground: float
    max_arm: float
    min_transmission: float
    fixed: list[complex]
    moving: list[complex]


@pytest.fixture(scope="session")
def again(naive: SimpleNamespace) -> Callable[[Candidate], Again]:
    """Return the second measurement of a candidate."""

    def measure(c: Candidate) -> Again:
        circle = c.radius is not None
        loop = naive.Loop(c.pivots, complex(*c.guided))
        path = loop.over(c.stroke, 201 if circle else 1201)
        assert path is not None, f"no crank, coupler or slider leads {c.family} {c.id} through the stroke"
        deviation, curvature = naive.narrowest_annulus(path) if circle else (naive.strip_of(path), 0.0)
        dyads = [[complex(x, y) if w else None for x, y, w in pair] for pair in c.pivots]
        fixed = [f for f, _ in dyads if f is not None]
        moving = [m for _, m in dyads if m is not None]
        links = [abs(f - m) for f, m in dyads if f is not None and m is not None]
        if len(moving) == 2:
            links.append(abs(moving[0] - moving[1]))
        reached = [complex(p) for p in path[:: len(path) // 40]] + [complex(path[-1])]
        return Again(
            path=path,
            deviation=deviation,
            radius=1 / curvature if curvature else math.inf,
            size=naive.diameter(fixed + moving + reached),
            max_link=max(links, default=math.nan),
            min_link=min(links, default=math.nan),
            max_ground=abs(fixed[0] - fixed[1]) if len(fixed) == 2 else math.nan,
            max_arm=min(abs(complex(*c.guided) - m) for m in moving),
            min_transmission=transmission(naive, c),
            fixed=fixed,
            moving=moving,
        )

    return measure


def transmission(naive: SimpleNamespace, c: Candidate) -> float:
    """Return the least transmission angle over the stroke [deg], the better crank driving; NaN without cranks."""
    z = np.array([[complex(x, y) for x, y, _ in pair] for pair in c.pivots])
    finite = np.array([[bool(w) for *_, w in pair] for pair in c.pivots])
    if not finite.all(1).any():
        return math.nan
    point = complex(*c.guided)
    # any two points of the coupler that do not coincide tell its pose
    one, other = (naive.Loop(c.pivots, p) for p in (point, point + 1j * c.stroke))
    for drive in one.drives:
        ends = [naive.Loop(c.pivots, point)._end(drive, x) for x in (0.0, c.stroke)]
        if all(e is not None for e in ends):
            break
    t = ends[0] + (ends[1] - ends[0]) * (0.5 - 0.5 * np.cos(np.pi * np.arange(401) / 400))
    here, turn = one.close(drive, t), (other.close(drive, t) - one.close(drive, t)) / (1j * c.stroke)
    best = 0.0
    for driver in (0, 1):
        driven = 1 - driver
        if not finite[driver].all():
            continue
        at = [here + turn * (z[i, 1] - point) for i in (0, 1)]
        if finite[driven].all():
            force, ray = at[driven] - at[driver], at[driven] - z[driven, 0]
        elif finite[driven, 1]:
            force, ray = at[driven] - at[driver], z[driven, 0]
        else:
            force, ray = z[driven, 0] - at[driver], turn * z[driven, 1]
        sine = np.abs((force.conjugate() * ray).imag) / np.abs(force) / np.abs(ray)
        best = max(best, math.degrees(math.asin(min(1.0, float(sine.min())))))
    return best
