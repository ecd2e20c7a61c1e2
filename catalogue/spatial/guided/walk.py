"""Move bodies on guides along paths of their drivers, from corner to corner."""

from __future__ import annotations

import numpy as np

from ...kinematics.types import Array
from ..continuation import tracing
from ..continuation.curve import Limits, Traces
from ..continuation.newton import LAST, Accuracy, corrected, newton_step
from ..continuation.tracing import BRANCH, STUCK, trace_toward
from .curve import LineCurve
from .equations import System
from .filling import fill
from .mechanism import Mechanisms
from .position import EDGE, OK, driver_units, off_edge

TURNING = "turning point"
#: Reason: a pose near which a single step is not reliable.
DOUBTFUL = "doubtful"
#: Step control for bodies on guides, whose surfaces may curve more than paths of joints.
LIMITS = Limits(
    aim=2e-3,
    refused=1e-2,
    first=0.125,
    longest=0.5,
    shortest=1e-8,
    contraction=0.2,
    at_branch=1e-5,
    bow=0.004,
    turn=float(np.cos(0.18)),
    last=LAST,
    margin=0.05,
)
#: Corrections of a pose after a single step; the first is also at most a tenth of the step.
ACCURACY = Accuracy(LAST, near=1e-2, enough=1e-6)


class Walk:
    """State of a block of n mechanisms along their paths.

    Parameters
    ----------
    mechanisms : Mechanisms
    path : ndarray, shape (n, s, k)
        Values of the drivers.
    pose : ndarray, shape (4 + f, n)
        States at the first node.
    stop : ndarray, shape (n, s)
        Corners of the path, including its ends.

    Attributes
    ----------
    states : ndarray, shape (n, s, 4 + f)
        Poses at the nodes, NaN beyond the last reached.
    reached, steps : ndarray, shape (n,)
    reason : ndarray of str, shape (n,)
        Reason for the end of a motion; empty at the end of its path.
    end : ndarray, shape (n,)
        End of the motion, in nodes from the first.
    """

    def __init__(self, mechanisms: Mechanisms, path: Array, pose: Array, stop: Array) -> None:
        n, s = path.shape[:2]
        self.mechanisms, self.system = mechanisms, System.of(mechanisms)
        self.path, self.stop = path / driver_units(mechanisms).T[:, None], stop.copy()
        self.states = np.full((n, s, len(pose)), np.nan)
        self.states[:, 0] = pose.T
        self.begin, self.leaps, self.sign = np.zeros(n, int), np.ones(n, bool), np.zeros(n)
        self.reached, self.steps, self.end = np.ones(n, int), np.zeros(n, int), np.zeros(n)
        self.reason = np.full(n, OK, dtype="U90")
        self.bounded = any(kind.bounded for g in mechanisms.guides for kind in g.kinds)

    def run(self) -> None:
        """Advance all mechanisms until each motion has ended."""
        who = np.arange(len(self.begin))
        while len(who):
            who = self._advance(who)

    def _advance(self, who: Array) -> Array:
        """Move mechanisms to the next corners of their paths; return those not ended."""
        begin, last = self.begin[who], self.path.shape[1] - 1
        ahead = self.stop[who] & (np.arange(last + 1) > begin[:, None])
        end = np.where(begin < last, ahead.argmax(1), last)
        curve, y, at, width = self._line_to_corner(who, begin, end)
        _, tangent, sign = newton_step(at[0], at[1], at[3], signed=True)
        own = np.where(self.sign[who] == 0, sign, self.sign[who])
        lost, self.sign[who] = (sign == 0) | (sign != own), own
        back = lost & self.leaps[who] & (begin > 0)  # the last node may be in another branch: repeat by steps
        self.begin[who[back]] -= 1
        self.leaps[who] &= ~back & (end == begin + 1)
        here = who[~back]
        self.reached[here], self.end[here] = begin[~back] + 1, begin[~back]
        on = np.flatnonzero(~back & ~lost & (begin < last))
        fallen = np.flatnonzero(~back & lost & (begin < last))
        self.reason[who[fallen]] = np.where(sign == 0, STUCK, BRANCH)[fallen]
        leapt = self._leap(who, end, curve, y, tangent, width, on)
        on = np.setdiff1d(on, leapt)
        if len(on):
            first = np.minimum(LIMITS.first, 1.02 * width[on] / tangent[on, -1])
            lines = curve.take(on)
            given = {"at": tuple(v[on] for v in at), "limits": LIMITS, "first": first}
            traces = trace_toward(lines, y[on], tangent[on], width[on], **given)
            self._fill(who[on], end[on], lines, traces, width[on])
        goes = np.concatenate([np.flatnonzero(back), leapt, on[self.reason[who[on]] == OK]])
        return np.asarray(who[np.sort(goes)])

    def _line_to_corner(
        self, who: Array, begin: Array, end: Array
    ) -> tuple[LineCurve, Array, tuple[Array, ...], Array]:
        """Return curves to the next corners, states and equations at their beginning, lengths."""
        numbers, q0 = self.states[who, begin], self.path[who, begin].T
        step, system = self.path[who, end].T - q0, self.system.take(who)
        y = np.concatenate([numbers, np.zeros((len(who), 1))], axis=1)
        now = system.evaluate(numbers.T, q0)
        with np.errstate(invalid="ignore"):
            width = np.maximum(np.sqrt(((now.travel * step) ** 2).sum(0)), 1e-9)
        curve = LineCurve(system, q0, step / width)
        return curve, y, curve.by_rows(now, y), width

    def _leap(
        self, who: Array, end: Array, curve: LineCurve, y: Array, tangent: Array, width: Array, on: Array
    ) -> Array:
        """Try to reach the next corner in one step; return a mask of success."""
        far = width / np.where(tangent[:, -1] > 0, tangent[:, -1], np.nan)
        some = on[self.leaps[who[on]] & (far[on] <= LIMITS.first)]
        if not len(some):
            return some
        lines, h = curve.take(some), far[some]
        guess = y[some] + h[:, None] * lines.lifted(y[some], tangent[some])
        accuracy = ACCURACY._replace(near=np.minimum(ACCURACY.near, 0.1 * h))
        with np.errstate(all="ignore"):
            found, good = corrected(lines, guess, width[some], accuracy)
        good &= ~self._is_off_edge(who[some], lines, found)
        i = who[some[good]]
        self.states[i, end[some[good]]], self.begin[i] = found[good, :-1], end[some[good]]
        self.steps[i] += 1
        return some[good]

    def _fill(self, who: Array, end: Array, curve: LineCurve, traces: Traces, width: Array) -> None:
        """Store poses at nodes of the paths along traces; record ends and their reasons."""
        self.steps[who] += traces.tried
        last, reason = traces.last, np.where(traces.reason == tracing.TURNING, TURNING, traces.reason)
        reason[reason == tracing.LONG] = STUCK
        if self.bounded:
            off = self._is_off_edge(who[traces.who], curve.take(traces.who), traces.nodes.y)
            for i in np.unique(traces.who[off]):
                last[i] = np.flatnonzero(off & (traces.who == i))[0]
                reason[i] = EDGE
        stop, begin = traces.nodes.drive[last], self.begin[who]
        count = end - begin
        of = np.repeat(np.arange(len(who)), count)
        node = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count) + begin[of] + 1
        value = self._fraction(who[of], begin[of], end[of], node) * width[of]
        found, good = np.full((len(of), len(curve.weight)), np.nan), np.zeros(len(of), bool)
        inside = np.flatnonzero(value <= stop[of])
        found[inside], good[inside] = fill(curve, traces, self.sign[who], of[inside], value[inside])
        doubt, edge = ~good & (value <= stop[of]), np.zeros(len(of), bool)
        if self.bounded and good.any():
            edge[good] = self._is_off_edge(who[of[good]], curve.take(of[good]), found[good])
        bad = ~good | edge
        i = np.flatnonzero(good)
        self.states[who[of[i]], node[i]] = found[i, :-1]
        first = np.full(len(who), len(of))
        np.minimum.at(first, of[bad], np.flatnonzero(bad))
        short = first < len(of)
        self.reached[who] = end + 1
        self.end[who], self.begin[who] = end, end
        self.leaps[who] = True
        j = first[short]
        i, k = who[short], node[j]
        self.reached[i], self.begin[i] = k, k - 1
        told = np.where(doubt[j], DOUBTFUL, np.where(edge[j], EDGE, reason[short]))
        again = (told == DOUBTFUL) & ((k - 1 > begin[short]) | (end[short] > k))
        self.stop[i[again], k[again] - 1] = self.stop[i[again], k[again]] = True
        one = np.where(k - 1 > begin[short], value[j - 1], 0.0)
        at = np.where(edge[j], value[j], stop[short])
        with np.errstate(all="ignore"):
            self.end[i] = k - 1 + np.clip((at - one) / (value[j] - one), 0, 1)
        told[told == DOUBTFUL] = STUCK
        self.reason[i[~again]] = told[~again]

    def _fraction(self, who: Array, begin: Array, end: Array, node: Array) -> Array:
        """Return nodes of a path as fractions of the distance between two corners."""
        segment = self.path[who, end] - self.path[who, begin]
        with np.errstate(all="ignore"):
            part = ((self.path[who, node] - self.path[who, begin]) * segment).sum(1) / (segment * segment).sum(1)
        return np.where(node == end, 1.0, part)

    def _is_off_edge(self, who: Array, curve: LineCurve, y: Array) -> Array:
        """Return a mask of states (n, numbers) with a point beyond the edge of its guide."""
        if not self.bounded:
            return np.zeros(len(who), bool)
        local = curve.system.local(curve.system.world(y[:, :-1].T, curve.drivers(y)))
        return off_edge(self.mechanisms[who], curve.system, local)
