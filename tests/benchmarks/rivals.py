"""Optimisers that the catalogue is compared with: each notes what it takes for better, and when.

Whatever the objective, what is noted is the deviation that `jobs.measured` finds on the finite motion.
"""

from __future__ import annotations

import contextlib
import time
import warnings
from itertools import count
from typing import Any, cast

import numpy as np
from compiled_objective import compiled
from jobs import STATIONS, Array, Job, errors, measured, plain, sampled
from scipy.interpolate import CubicSpline
from scipy.optimize import differential_evolution, least_squares, minimize

History = list[tuple[float, float]]


class OutOfTime(Exception):
    """An optimiser has had its time."""


class Watch:
    """The best that was seen, and when."""

    def __init__(self, job: Job, limit: float) -> None:
        self.job, self.start, self.limit, self.history = job, time.perf_counter(), limit, [(0.0, np.inf)]
        self.best = np.inf

    def saw(self, deviation: float) -> None:
        """Note a true deviation; stop what has had its time."""
        now = time.perf_counter() - self.start
        if deviation < self.history[-1][1]:
            self.history.append((now, deviation))
        if now > self.limit:
            raise OutOfTime

    def plain(self, x: Array) -> float:
        """The plain objective, whose successes are measured."""
        value = plain(self.job, np.asarray(x, float))
        if value < self.best:
            self.best = value
            self.saw(float(measured(self.job, np.asarray(x, float)[:, None])[0]))
        elif time.perf_counter() - self.start > self.limit:
            raise OutOfTime
        return value


def evolved_on_kernel(job: Job, limit: float) -> History:
    """Differential evolution in batches, on this catalogue's own measurement, started anew when it rests."""
    watch = Watch(job, limit)

    def objective(x: Array) -> Array:
        value = measured(job, x)
        watch.saw(float(value.min()))
        return value

    batch: Any = objective  # scipy's types know no vectorized objective,
    bounds: Any = job.bounds  # nor a list of bounds
    with contextlib.suppress(OutOfTime):
        for seed in count(1):
            differential_evolution(batch, bounds, vectorized=True, updating="deferred", popsize=40,
                                   maxiter=10**6, polish=False, seed=seed)  # fmt: skip
    return watch.history


def evolved_on_plain(job: Job, limit: float) -> History:
    """Differential evolution on a sampled path, as one would write it, started anew when it rests."""
    watch = Watch(job, limit)
    bounds: Any = job.bounds  # scipy's types know no list of bounds
    with contextlib.suppress(OutOfTime):
        for seed in count(1):
            differential_evolution(watch.plain, bounds, maxiter=10**6, seed=seed)
    return watch.history


def evolved_compiled(job: Job, limit: float) -> History:
    """Differential evolution on the plain objective compiled by numba, a population at once."""
    objective, watch = compiled(job), Watch(job, limit)
    if objective is None:
        return watch.history

    def noted(x: Array) -> Array:
        value = np.asarray(objective(x))
        if value.min() < watch.best:
            watch.best = float(value.min())
            watch.saw(float(measured(job, x[:, [int(value.argmin())]])[0]))
        elif time.perf_counter() - watch.start > limit:
            raise OutOfTime
        return value

    watch.start, batch, bounds = time.perf_counter(), cast(Any, noted), cast(Any, job.bounds)
    with contextlib.suppress(OutOfTime):
        for seed in count(1):
            differential_evolution(batch, bounds, vectorized=True, updating="deferred", maxiter=10**6, polish=False,
                                   seed=seed)  # fmt: skip
    return watch.history


def swarmed(job: Job, limit: float) -> History:
    """The particle swarm of pylinkage, if that is installed, on the same sampled path, started anew when it rests."""
    try:
        from pylinkage.optimization import particle_swarm_optimization
    except ImportError:
        return [(0.0, np.inf)]
    watch, low, high = Watch(job, limit), *np.array(job.bounds).T

    def objective(_: object, x: Array, __: object = None) -> float:
        return watch.plain(np.asarray(x))

    with contextlib.suppress(OutOfTime), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        while True:
            particle_swarm_optimization(
                objective, _NoLinkage(), dimensions=len(low), bounds=(low.tolist(), high.tolist()), n_particles=100,
                iterations=400, order_relation=min, verbose=False,
            )  # fmt: skip
    return watch.history


class _NoLinkage:
    """What the swarm asks of a linkage that the objective does not use."""

    def get_coords(self) -> list[tuple[float, float]]:
        return []

    get_num_constraints = get_constraints = get_coords


def multistarted(job: Job, limit: float) -> History:
    """Least squares from random starts, then the minimax problem by sequential quadratic programming."""
    watch, rng = Watch(job, limit), np.random.default_rng(1)
    low, high = np.array(job.bounds).T

    def residuals(x: Array) -> Array:
        if time.perf_counter() - watch.start > limit:
            raise OutOfTime
        path = sampled(job, x)
        if not path.reach > 0.97 or len(path.u) < 8:
            return np.full(len(STATIONS) + 1, 10.0 - path.reach)
        along = np.clip(STATIONS, path.u[0], path.u[-1])
        return np.append(errors(job, along, CubicSpline(path.u, path.v)(along)), path.broken)

    def note(x: Array) -> None:
        watch.saw(float(measured(job, x[:, None])[0]))

    def last(y: Array) -> Any:
        return y[-1]

    def unit_last(y: Array) -> Array:
        return np.asarray(np.eye(len(y))[-1])

    with contextlib.suppress(OutOfTime), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        while True:
            x = low + (high - low) * rng.random(len(low))
            if plain(job, x) > 1:
                continue
            x = least_squares(residuals, x, bounds=(low, high), max_nfev=60, x_scale=0.5).x
            note(x)
            level = float(np.abs(residuals(x)).max())
            if level > 1e-3:
                continue
            sides: Any = {
                "type": "ineq",
                "fun": lambda y, unit=level: np.concatenate([s * residuals(y[:-1]) / unit + y[-1] for s in (1, -1)]),
            }
            found = minimize(last, np.append(x, 1.0), jac=unit_last, constraints=sides,
                             method="SLSQP", options={"maxiter": 80, "ftol": 1e-6})  # fmt: skip
            note(found.x[:-1])
    return watch.history
