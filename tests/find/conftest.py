"""Candidates measured again, from `pivots`, `guided` and `stroke` alone, by loops closed in another way."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partialmethod
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue import Candidate, Catalogue, Found
from catalogue.problem.path import PathRequest
from catalogue.search.search import Search
from tests.conftest import BRIEF


@dataclass
class Again:
    """What a candidate is found to be, where its path runs from 0 to the stroke; lengths in its unit."""

    path: Any
    deviation: float
    radius: float
    size: float
    max_link: float
    min_link: float
    max_ground: float
    max_arm: float
    min_transmission: float
    travel: float
    fixed: list[complex]  # with the ends of rails
    moving: list[complex]  # with the ends of slots


@pytest.fixture(scope="session")
def ask(small: Catalogue, answers: Callable[..., Found]) -> Callable[..., Found]:
    """Return `small.find` by brief searches, of which each question is asked once in all the tests."""

    def asked(request: PathRequest, **wanted: Any) -> Found:
        question = ("ask", request, sorted(wanted.items(), key=lambda item: item[0]))
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Search, "__init__", partialmethod(Search.__init__, budget=BRIEF))
            return answers(question, lambda: small.find(request, **wanted))

    return asked


@pytest.fixture(scope="session")
def again(naive: SimpleNamespace) -> Callable[..., Again]:
    """Return the second measurement of a candidate; with a radius against arcs of exactly that."""

    def measure(c: Candidate, radius: float | None = None) -> Again:
        circle = c.radius is not None
        pivots, guided = at_home(c)
        loop = naive.Loop(pivots, guided)
        path = loop.over(c.stroke, 201 if circle else 1201)
        assert path is not None, f"no crank, coupler or slider leads {c.family} {c.id} through the stroke"
        if radius is not None:
            deviation, curvature = off_arc(path, c.stroke, radius), 1 / radius
        else:
            deviation, curvature = naive.narrowest_annulus(path) if circle else (naive.strip_of(path), 0.0)
        dyads = [[complex(x, y) if w else None for x, y, w in pair] for pair in pivots]
        fixed = [f for f, _ in dyads if f is not None]
        moving = [m for _, m in dyads if m is not None]
        links = [abs(f - m) for f, m in dyads if f is not None and m is not None]
        if len(moving) == 2:
            links.append(abs(moving[0] - moving[1]))
        ground = abs(fixed[0] - fixed[1]) if len(fixed) == 2 else math.nan
        arm = min((abs(guided - m) for m in moving), default=math.nan)
        slides = loop.slides(c.stroke, 1201)
        fixed += [end for kind, *ends in slides for end in ends if kind == "PR"]
        moving += [end for kind, *ends in slides for end in ends if kind == "RP"]
        reached = [complex(p) for p in path[:: len(path) // 40]] + [complex(path[-1])]
        return Again(
            path=path,
            deviation=deviation,
            radius=1 / curvature if curvature else math.inf,
            size=naive.diameter(fixed + moving + reached),
            max_link=max(links, default=math.nan),
            min_link=min(links, default=math.nan),
            max_ground=ground,
            max_arm=arm,
            min_transmission=transmission(naive, pivots, guided, c.stroke),
            travel=max((abs(one - other) for _, one, other in slides), default=math.nan),
            fixed=fixed,
            moving=moving,
        )

    return measure


def at_home(c: Candidate) -> tuple[Any, complex]:
    """Return pivots and guided point in the frame in which the path runs from 0 along the x axis."""
    turn, start = cmath.exp(-1j * math.radians(c.along)), complex(*c.start)

    def carried(x: float, y: float, w: float) -> list[float]:
        z = turn * (complex(x, y) - (start if w else 0))
        return [z.real, z.imag, w]

    guided_x, guided_y = c.guided
    x, y, _ = carried(guided_x, guided_y, 1)
    return [[carried(*pivot) for pivot in pair] for pair in c.pivots], complex(x, y)


def off_arc(path: Any, stroke: float, radius: float) -> float:
    """Return the largest distance of a path from the best-placed arc of exactly a radius, which bulges to +y.

    The arc is tilted and raised, by two searches one inside the other; the largest distance is convex in either.
    """
    z = np.asarray(path, np.clongdouble)
    apex = z[len(z) // 2]

    def largest(tilt: Any, rise: Any) -> Any:
        centre = apex + 1j * rise - radius * np.exp(1j * (np.pi / 2 + tilt))
        return np.abs(np.abs(z - centre) - radius).max()

    def least(function: Any, low: Any, high: Any) -> Any:
        part = (np.sqrt(np.longdouble(5)) - 1) / 2  # golden section
        one, two = high - part * (high - low), low + part * (high - low)
        at_one, at_two = function(one), function(two)
        for _ in range(50):
            if at_one < at_two:
                high, two, at_two = two, one, at_one
                one = high - part * (high - low)
                at_one = function(one)
            else:
                low, one, at_one = one, two, at_two
                two = low + part * (high - low)
                at_two = function(two)
        return min(at_one, at_two)

    start = np.longdouble(0)
    rough = largest(start, start)  # about the best by a factor, through one point of the path
    wide, high = 8 * rough / stroke, 4 * rough
    return float(least(lambda tilt: least(lambda rise: largest(tilt, rise), -high, high), -wide, wide))


def coupler_paths(naive: SimpleNamespace, pivots: Any, guided: complex, stroke: float, points: list[complex]) -> Any:
    """Return where points of the coupler are over the stroke, shape (points, positions)."""
    guide = naive.Loop(pivots, guided)
    for drive in guide.drives:
        ends = [guide._end(drive, x) for x in (0.0, stroke)]
        if all(e is not None for e in ends):
            break
    t = ends[0] + (ends[1] - ends[0]) * (0.5 - 0.5 * np.cos(np.pi * np.arange(401) / 400))
    return np.array([naive.Loop(pivots, point).close(drive, t) for point in points])


def transmission(naive: SimpleNamespace, pivots: Any, guided: complex, stroke: float) -> float:
    """Return the least transmission angle over the stroke [deg], the better crank driving; NaN without cranks."""
    z = np.array([[complex(x, y) for x, y, _ in pair] for pair in pivots])
    finite = np.array([[bool(w) for *_, w in pair] for pair in pivots])
    if not finite.all(1).any():
        return math.nan
    # any two points of the coupler that do not coincide tell its pose
    here, there = coupler_paths(naive, pivots, guided, stroke, [guided, guided + 1j * stroke])
    turn = (there - here) / (1j * stroke)
    best = 0.0
    for driver in (0, 1):
        driven = 1 - driver
        if not finite[driver].all():
            continue
        at = [here + turn * (z[i, 1] - guided) for i in (0, 1)]
        if finite[driven].all():
            force, ray = at[driven] - at[driver], at[driven] - z[driven, 0]
        elif finite[driven, 1]:
            force, ray = at[driven] - at[driver], z[driven, 0]
        else:
            force, ray = z[driven, 0] - at[driver], turn * z[driven, 1]
        sine = np.abs((force.conjugate() * ray).imag) / np.abs(force) / np.abs(ray)
        best = max(best, math.degrees(math.asin(min(1.0, float(sine.min())))))
    return best
