"""Minimax refinement of placed guides on their finite motion, inside the constraints of a request.

Sequential quadratic programming.  Each round linearises the distance from the nominal at Chebyshev points and all
constraints (`linear`), asks for the steps that make the largest distance least on leashes of several lengths (`step`),
follows each by a second one from where it led, which corrects what was left out of the linearisation (so that long
steps along curved valleys are possible), and lays and measures all of them on the finite motion.  On the way a guide
may break a constraint, at a price; what is returned satisfies all of them.  A deviation is never taken from the linear
model.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import reduce

import numpy as np

from ..guide.span import span
from ..linkage import Array
from ..query.lay import Answers, merged, together
from .limits import NAMES, excess
from .linear import linearised
from .step import minimax_step
from .task import EXACT, Task

#: First leash, in the units of `task.Moves`; what it is multiplied by; the leash of the second step as a part of that.
LEASH, LADDER, SECOND = 0.1, (0.2, 0.7, 2.5), 0.5
#: A guide rests when its leash is shorter than this.
SHORT = 1e-5
#: Most rounds.
ROUNDS = 5
#: By how much the price of a guide, its deviation apart, may rise.
SLACK = 0.05
#: How far inside the constraints the linear problem stays [strokes, radians].
MARGIN = 1e-6
#: Cheapest price of a broken constraint: rise of the logarithm of the deviation, per stroke or radian.
PENALTY = 20.0


def refined(found: Answers, task: Task, rounds: int = ROUNDS) -> tuple[Answers, Array]:
    """Return guides with their deviation made as small as the constraints allow, from where they stand.

    Points that return are left as they are.

    Parameters
    ----------
    found : Answers
        Placed guides that satisfy the constraints, or nearly; those that never do are returned as they are.
    task : Task
    rounds : int
        Most rounds.

    Returns
    -------
    found : Answers
    ceiling : ndarray, shape (n,)
        Price that each could not exceed.
    """
    n = len(found.point)
    ceiling = task.price(found) + SLACK
    resting = span(found.linkage, found.point, pole=found.pole).cusp
    open_ = np.flatnonzero((found.traced.relative > EXACT) & ~resting)
    now, leash, penalty = found, np.full(n, LEASH), np.full(n, PENALTY)
    broken = excess(found, task.request, task.wanted)
    best = np.where(broken > 0, np.inf, found.traced.fit.deviation.astype(float))
    for _ in range(rounds):
        if not len(open_):
            break
        here, most = now[open_], ceiling[open_]
        with np.errstate(all="ignore"):  # what cannot be stepped or traced is NaN, and is not sound
            tries, dual = _round(here, leash[open_], most, task)
        penalty[open_] = np.maximum(penalty[open_], 2 * dual)
        dear = task.price(tries.guides) - most[tries.of]
        over = excess(tries.guides, task.request, task.wanted) + np.maximum(dear, 0)
        cost = np.where(tries.sound, tries.logarithm + penalty[open_][tries.of] * over, np.inf)
        before = _logarithm(here) + penalty[open_] * broken[open_]
        first = _least(cost, tries.of)
        first = first[cost[first] < before[tries.of[first]] - 1e-9]
        gained = open_[tries.of[first]]
        now = merged(now, tries.guides[first], _mask(gained, n))
        broken[gained] = over[first]
        factor = np.full(n, LADDER[0] ** 2)
        factor[gained] = np.array(LADDER)[tries.rung[first]]
        leash[open_] = np.minimum(leash[open_] * factor[open_], 1.0)

        clean = tries.clean & (dear <= 0)
        first = _least(np.where(clean, tries.logarithm, np.inf), tries.of)
        first = first[clean[first]]
        at = open_[tries.of[first]]
        deviation = tries.guides.traced.fit.deviation[first].astype(float)
        better = deviation < best[at]
        best[at[better]] = deviation[better]
        found = merged(found, tries.guides[first[better]], _mask(at[better], n))
        open_ = open_[leash[open_] > SHORT]
    return found, ceiling


@dataclass(frozen=True)
class _Tries:
    """Guides after steps.

    `of`: which guide each comes of; `rung`: of the ladder of leashes; `sound`: it has a path as is wanted; `clean`: it
    satisfies all constraints.
    """

    guides: Answers
    of: Array
    rung: Array
    sound: Array
    clean: Array

    @property
    def logarithm(self) -> Array:
        return _logarithm(self.guides)

    def __getitem__(self, index: Array) -> _Tries:
        return _Tries(*(getattr(self, f.name)[index] for f in fields(self)))

    def followed_by(self, other: _Tries) -> _Tries:
        rest = (np.concatenate([getattr(self, f.name), getattr(other, f.name)]) for f in fields(self)[1:])
        return _Tries(together(self.guides, other.guides), *rest)


def _round(here: Answers, leash: Array, most: Array, task: Task) -> tuple[_Tries, Array]:
    """Return what comes of one and of two steps, on all leashes, and the largest multiplier of a constraint."""
    n, ladder = len(here.point), np.array(LADDER)
    start = _Tries(here, np.arange(n), np.zeros(n, int), np.ones(n, bool), np.ones(n, bool))
    one, dual = _stepped(start, (ladder[:, None] * leash).ravel(), most, task)
    one = _Tries(one.guides, one.of % n, one.of // n, one.sound, one.clean)
    dual = dual.reshape(len(ladder), n).min(0)
    led = one[np.isfinite(one.logarithm)]
    if not len(led.of):
        return one, dual
    two, _ = _stepped(led, SECOND * leash[led.of] * ladder[led.rung], most, task)
    two = _Tries(two.guides, led.of[two.of], led.rung[two.of], two.sound, two.clean)
    return one.followed_by(two), dual


def _stepped(start: _Tries, leash: Array, most: Array, task: Task) -> tuple[_Tries, Array]:
    """Return what comes of a step of each guide on each of its leashes (a multiple of n); `of` counts the leashes.

    Also the largest multiplier of a constraint, for each leash."""
    here = start.guides
    guides = span(here.linkage, here.point, pole=here.pole)
    times = len(leash) // len(here.point)
    problem = linearised(here, guides, task, most[start.of] - task.price(here)).inside(MARGIN).repeated(times)
    found = minimax_step(problem, leash)
    at = np.tile(np.arange(len(here.point)), times)
    many = here[at]
    step = np.nan_to_num(found.step[:, :-1] if task.with_radius else found.step)
    linkage, point, valid = task.moves.moved(many, task.request.stroke, step)
    moved = span(linkage, point, pole=many.pole[valid], chart=guides.motion.chart[at[valid]])
    rows = {name: values[at[valid]] for name, values in here.rows.items()}
    made, checks = task.laid(rows, moved)
    hard = [passed for name, passed in checks.items() if name not in NAMES]
    sound, clean = (reduce(np.logical_and, some) for some in (hard, checks.values()))
    of = np.flatnonzero(valid)
    return _Tries(made, of, np.zeros(len(of), int), sound & np.isfinite(_logarithm(made)), clean), found.dual


def _logarithm(guides: Answers) -> Array:
    with np.errstate(all="ignore"):
        return np.asarray(np.log(guides.traced.fit.deviation.astype(float)))


def _mask(index: Array, count: int) -> Array:
    mask = np.zeros(count, bool)
    mask[index] = True
    return mask


def _least(value: Array, group: Array) -> Array:
    """Return the index of the least value of each group."""
    order = np.lexsort((value, group))
    return np.asarray(order[np.unique(group[order], return_index=True)[1]])
