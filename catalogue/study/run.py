"""Run a study: rounds of tasks, each decided by the results of the rounds before.

Round 0 answers each request after all tighter ones, with their answers as starts. A search is run
for every second value of each bound, and for other requests where these answers do not suffice.
Round 1 repeats requests without an answer, starting from the answers to looser ones. Further rounds
repeat each request for which an answer to a tighter request is better, by the ranking of the
former, than its own answers, until there is none. Finally each request without an answer gets
advice: the change to the nearest looser request that has one. All decisions depend only on results
of earlier rounds, so that neither the engine nor a killed process changes the table.
"""

from __future__ import annotations

import json
import math
import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from ..engines import Engine
from ..errors import PluginError, WorkerKilled
from ..find.many import WARM
from ..problem.order import Order, takes_starts
from ..problem.problem import Request
from . import task
from .results_file import ResultsFile
from .task import Done


class StudyOptions(NamedTuple):
    """Options of the order of work in a study."""

    pause: float = 0.5  #: time between two writes of results [s]: a kill loses this much work
    ahead: int = 3  #: number of waiting tasks per worker
    #: largest number of rounds that repeat requests: a better start may lead to a better answer
    #: elsewhere too
    back: int = 4
    #: Difference of costs that counts: above the rounding of a guide that is placed and measured
    #: again.
    worse: float = 1e-7
    chunk: int = 64  #: number of answers whose costs a task computes
    compared: int = 64  #: number of nearest looser requests with answers that are compared for advice


STUDY = StudyOptions()


@dataclass(frozen=True)
class State:
    """State of a study, as reported after each result."""

    done: int  #: number of tasks of this round with a result
    wanted: int  #: number of tasks of this round
    round: int
    seconds: float  #: elapsed time [s]

    @property
    def left(self) -> float:
        """Estimated remaining time of this round [s]."""
        return self.seconds / self.done * (self.wanted - self.done) if self.done else math.inf


Report = Callable[[State], None]
#: Arguments of `task.answer` for a request: starts, and whether they are warm.
Starts = tuple[list[str], bool]


@dataclass
class Run:
    """A run of a study on an engine."""

    file: ResultsFile
    pool: Engine
    report: Report = lambda _: None
    #: Round of the best evaluated answer, and its cost, by ranking and number.
    costs: defaultdict[tuple[Any, Any], dict[int, tuple[int, float]]] = field(default_factory=lambda: defaultdict(dict))

    def __post_init__(self) -> None:
        self.texts = self.file.requests()
        self.numbers = [*self.texts]
        self.requests = [Request.from_json(text) for text in self.texts.values()]
        self.order = Order.of(self.requests)
        self.nearest: dict[int, list[int]] = {}
        self.surpassed: set[int] = set()  #: requests that have a looser one
        for index, _, near in self.order.tighter():
            ones = [self.numbers[i] for i in near]
            self.nearest[self.numbers[index]] = ones if takes_starts(self.requests[index]) else []
            self.surpassed.update(ones)
        self.explored = {self.numbers[i] for i in self.order.explored()}
        self.request = dict(zip(self.numbers, self.requests, strict=True))

    def run(self) -> None:
        """Run all remaining rounds."""
        self._first_round()
        self._repeat_unanswered()
        for place in range(2, 2 + STUDY.back):
            if not self._repeat_improvable(place):
                break
        self._advise(2 + STUDY.back)

    # -- rounds ------------------------------------------------------------------------------
    def _first_round(self) -> None:
        """Answer each request once the requests it starts from are answered."""
        done = self.file.of_round(0)
        waiting = {n: {one for one in self.nearest[n] if one not in done} for n in self.nearest if n not in done}
        followers: defaultdict[int, list[int]] = defaultdict(list)
        for number, ones in waiting.items():
            for one in ones:
                followers[one].append(number)
        ready = [number for number, ones in waiting.items() if not ones]

        def finished(number: int) -> list[int]:
            free = []
            for one in followers[number]:
                waiting[one].discard(number)
                if not waiting[one]:
                    free.append(one)
            return free

        self._tasks(0, ready, len(waiting), self._warm_starts, finished)

    def _warm_starts(self, number: int) -> Starts:
        """Return the answers to the nearest tighter requests, as starts."""
        starts: list[str] = []
        for place, near in enumerate(self.nearest[number][: WARM.neighbours]):
            starts += self._kept(near, 0, None if not place else WARM.each)
        return list(dict.fromkeys(starts)), bool(starts)

    def _repeat_unanswered(self) -> None:
        """Repeat requests without an answer, from the answers to the nearest looser ones."""
        state = self.file.done(before=1)
        near: defaultdict[int, list[int]] = defaultdict(list)
        for number, ones in self.nearest.items():
            for one in ones:
                if state[one][1] == "none" and state[number][1] == "answers":
                    near[one].append(number)
        wanted = [number for number in self.numbers if number in near]

        def starts(number: int) -> Starts:
            return [text for one in near[number][: WARM.neighbours] for text in self._kept(one, 0, WARM.each)], False

        self._round(1, wanted, starts)

    def _repeat_improvable(self, place: int) -> bool:
        """Repeat requests for which a tighter one has a better answer; return False without."""
        better = self._better_tighter(place)
        if not better:
            return False
        state = self.file.done(before=place)

        def starts(number: int) -> Starts:
            own, other = (self._kept(one, state[one][0]) for one in (number, better[number]))
            return list(dict.fromkeys([other[0], *own])), True

        self._round(place, [*better], starts)
        return True

    def _better_tighter(self, place: int) -> dict[int, int]:
        """Return, by request, the number of a tighter one whose answer is better."""
        state = self.file.done(before=place)
        answered = {number: round_ for number, (round_, status, _) in state.items() if status == "answers"}
        judged = self._cost_by_ranking(answered)
        found = {}
        for index, below, _ in self.order.tighter():
            number = self.numbers[index]
            ones = [one for i in below if (one := self.numbers[i]) in answered]
            if not ones or not takes_starts(self.requests[index]):
                continue
            costs = judged[self._ranking(number)]
            least = min(ones, key=lambda one: costs[one])
            own = costs.get(number, math.inf)
            if costs[least] < own - STUDY.worse * max(1.0, abs(own)) or own == costs[least] == math.inf:
                found[number] = least
        return dict(sorted(found.items()))

    def _ranking(self, number: int) -> tuple[Any, Any]:
        """Return the arguments of the cost of a linkage: path and ranking of a request."""
        request = self.request[number]
        return request.path, (request.rank_by, request.desires, request.constraints.play)

    def _cost_by_ranking(self, answered: Mapping[int, int]) -> dict[tuple[Any, Any], dict[int, float]]:
        """Compute the costs of the best answers by their own and all looser rankings."""
        wanted: defaultdict[tuple[Any, Any], dict[int, None]] = defaultdict(dict)
        judge: dict[tuple[Any, Any], int] = {}
        for index, below, _ in self.order.tighter():
            if takes_starts(self.requests[index]):
                number = self.numbers[index]
                ranking = self._ranking(number)
                judge.setdefault(ranking, number)
                both = (number, *(self.numbers[i] for i in below))
                wanted[ranking] |= dict.fromkeys(one for one in both if one in answered)
        asked: list[tuple[tuple[Any, Any], list[int], Future[Any]]] = []
        for ranking, ones in wanted.items():
            known = self.costs[ranking]
            new = [one for one in ones if known.get(one, (-1, 0.0))[0] != answered[one]]
            for start in range(0, len(new), STUDY.chunk):
                part = new[start : start + STUDY.chunk]
                texts = self.file.records({one: answered[one] for one in part}, 1)
                best = [texts[one][0] for one in part]
                asked.append((ranking, part, self.pool.submit(task.costs, self.texts[judge[ranking]], best)))
        for ranking, part, future in asked:
            found = zip(part, future.result(), strict=True)
            self.costs[ranking].update({one: (answered[one], cost) for one, cost in found})
        return {ranking: {one: cost for one, (_, cost) in costs.items()} for ranking, costs in self.costs.items()}

    def _advise(self, place: int) -> None:
        """Add advice to requests without an answer: the nearest looser one with answers."""
        state = self.file.done(before=place)
        told = self.file.of_round(place)
        advised = {row.id for row in self.file.last() if row.advice}
        left = {number for number, (_, status, _) in state.items() if status == "none"} - told - advised
        results = []
        for index, above in self.order.looser({k for k, number in enumerate(self.numbers) if number in left}):
            answered = [i for i in above if state[self.numbers[i]][1] == "answers"]
            if answered:
                changes = [_changes(self.requests[index], self.requests[i]) for i in answered[: STUDY.compared]]
                nearest = min(changes, key=lambda one: (len(one), [change[0] for change in one]))
                done = Done(reason="no guide found", advice=(nearest,))
            elif len(above):
                reason = (
                    f"no guide found, and none for request {self.numbers[above[-1]]}, which is looser: see its advice"
                )
                done = Done(reason=reason)
            else:
                continue
            results.append((self.numbers[index], place, done))
        self.file.write(sorted(results, key=lambda one: one[0]))

    # -- tasks -------------------------------------------------------------------------------
    def _kept(self, number: int, place: int, most: int | None = None) -> list[str]:
        return self.file.records({number: place}, most)[number]

    def _round(self, place: int, wanted: Sequence[int], starts: Callable[[int], Starts]) -> None:
        done = self.file.of_round(place)
        left = [number for number in wanted if number not in done]
        self._tasks(place, left, len(left), starts, lambda _: [])

    def _tasks(
        self,
        place: int,
        ready: list[int],
        wanted: int,
        starts: Callable[[int], Starts],
        finished: Callable[[int], list[int]],
    ) -> None:
        """Run the tasks of a round as they become ready, and write their results."""
        running: dict[Future[Done], int] = {}
        unwritten: list[tuple[int, int, Done]] = []
        ready = ready[::-1]
        count, clock, written = 0, time.monotonic(), time.monotonic()
        while ready or running:
            while ready and len(running) < STUDY.ahead * self.pool.count:
                number = ready.pop()
                texts, warm = starts(number)
                advise = not place and number not in self.surpassed
                how = {"warm": warm, "follow": number not in self.explored, "advise": advise}
                future = self.pool.submit(task.answer, self.texts[number], texts, **how)
                running[future] = number
            done, _ = wait(running, timeout=STUDY.pause, return_when=FIRST_COMPLETED)
            free: list[int] = []
            for future in sorted(done, key=lambda one: running[one]):
                number = running.pop(future)
                unwritten.append((number, place, _result(future)))
                free.append(number)
            followers = [one for number in free for one in finished(number)]
            if unwritten and (followers or not running or time.monotonic() - written > STUDY.pause):
                self.file.write(unwritten)
                unwritten, written = [], time.monotonic()
            ready += sorted(followers, reverse=True)
            count += len(free)
            if free:
                self.report(State(count, wanted, place, time.monotonic() - clock))
        self.file.write(unwritten)


def _result(future: Future[Done]) -> Done:
    try:
        return future.result()
    except WorkerKilled as error:
        return Done(reason=str(error), failed=True)
    except PluginError as error:
        return Done(reason=str(error), failed=True)


def _changes(asked: Request, looser: Request) -> tuple[tuple[str, str, str], ...]:
    """Return the bounds in which a looser request differs: name, value, requested value."""
    one, other = asked.to_row(), looser.to_row()
    names = [name for name in dict.fromkeys([*one, *other]) if one.get(name) != other.get(name)]
    return tuple((name, _text(other.get(name)), _text(one.get(name))) for name in names)


def _text(value: object) -> str:
    return "" if value is None else value if isinstance(value, str) else json.dumps(value)
