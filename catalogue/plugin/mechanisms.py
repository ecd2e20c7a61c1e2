"""Make a collection of families of mechanisms of many bars: all but their definition.

Specimens are sampled over the domains of the parameters and followed round their circuits. Their
straightest and most circular stretches of several lengths are stored, placed over one stroke.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..candidates.feasibility import EXACT_DEVIATION
from ..chains.chain import Chain
from ..chains.circuits import ChainCircuits, circuits, followed_circuits
from ..collections.goal import Bound, Goal
from ..collections.results import CollectionCandidate
from ..collections.spec import Collection, Measured, Metric, Places, Specimen, Tags
from ..guidance.cells import Curves
from ..guidance.circuit_curve import fitted
from ..guidance.stretches import straightest
from ..kinematics.circuits import TURN
from ..kinematics.motion import Pose
from ..kinematics.types import Complexes, Floats, Indices
from ..series.chain_family import ChainFamily, FromFourBars
from .chain_measures import ARM, MEASURES, chain_measures, places_of
from .refine_mechanisms import MOVED, Refined, on_one_leg, refined

if TYPE_CHECKING:
    from ..problem.path import PathRequest


@dataclass(frozen=True)
class Draws:
    """Options of sampled mechanisms.

    Attributes
    ----------
    plan : str
        Name of the sampling method, to be changed whenever equal seeds would give other content.
    shares : tuple of float
        Trial strokes of stretches, over the diameter of the path.
    deviation : float
        Largest deviation of a stretch that is kept [strokes].
    size : float
        Largest size of a mechanism [strokes].
    transmission : float
        Least transmission angle [deg]: below it errors of manufacture determine the path.
    positions : int
        Number of positions of a stretch at which it is measured.
    flat : float
        Radius above which an arc counts as a line [strokes].
    last : int
        Number of final rounds of moves of a stretch: one leaves its deviation 1 % too large.
    specimens : int
        Number of guides that are drawn on first use.
    near : int
        Number of guides of each family, near a request, to refine.
    apart : float
        Least distance of a guided joint from the pins of its bars, where a mechanism may start from
        one whose further bars move idly [strokes].
    fits : int
        Number of fits of an arc of given radius, each in the scale that the previous one gave.
    """

    plan: str = "3"
    shares: tuple[float, ...] = (0.3, 0.55, 0.8)
    deviation: float = 0.02
    size: float = 40.0
    transmission: float = 5.0
    positions: int = 65
    flat: float = 50.0
    last: int = 1
    specimens: int = 1000
    near: int = 16
    apart: float = 0.05
    fits: int = 3


DRAWS = Draws()
METRICS = {**MEASURES, "sweep": Metric("stroke over the radius of the arc; 0 of a line", "1", minor=True)}


def chain_collection(name: str, title: str, source: str, families: Sequence[ChainFamily]) -> Collection:
    """Make a collection of families of mechanisms of many bars.

    Parameters
    ----------
    name, title, source : str
        See `Collection`.
    families : sequence of ChainFamily

    Returns
    -------
    Collection
    """
    made = _Made({one.name: one for one in families})
    declared = {one.name: (one.series,) for one in families}
    special = {case: ("*",) for one in families for case in one.special}
    functions = made.draw, made.measure, made.classify, made.plot
    return Collection(
        name,
        title,
        source,
        DRAWS.plan,
        declared,
        METRICS,
        *functions,
        special=special,
        refine=made.refine,
        starts=made.starts if any(one.from_four_bars for one in families) else None,
        seeds=made.seeds if any(one.seeds for one in families) else None,
        mechanism=made.mechanism,
        near=DRAWS.near,
        pinned=[one.name for one in families if not (one.structure.slides or one.structure.gears)],
        specimens=DRAWS.specimens,
    )


@dataclass(frozen=True)
class _Made:
    """Functions of a collection made from families by name."""

    families: Mapping[str, ChainFamily]

    def draw(self, family: str, rng: np.random.Generator, count: int) -> list[Specimen]:
        """Sample mechanisms of a family, and return their guides."""
        one = self.families[family]
        p = one.spread(rng.random((count, len(one.parameters))))
        chain, valid = one.chains(p)
        found, kept = followed_circuits(chain, one.bar)
        if not len(kept):
            return []
        rows = np.flatnonzero(valid)[kept]
        point = found.chain.z[one.guided]
        across = Curves.of(found, point, np.arange(len(found))).across
        made: list[Specimen] = []
        for circle in (False, True):
            if circle and one.exact and made and max(guide.deviation for guide in made) < EXACT_DEVIATION:
                break  # its points run along lines
            for share in DRAWS.shares:
                stretch = straightest(found, point, share * across, circle=circle, count=1, last=DRAWS.last)
                good = np.flatnonzero(stretch.deviation <= DRAWS.deviation * stretch.stroke)
                which, low, high = stretch.circuit[good], stretch.low[good], stretch.high[good]
                values = [{name: float(column[rows[i]]) for name, column in p.items()} for i in which.tolist()]
                laid = _Laid.of(one, found[which], low, high, circle, None, np.ones(len(good)))
                made += laid.specimens(values)
        return made

    def starts(self, pivots: Floats, point: Complexes, request: PathRequest) -> list[Mapping[str, Any]]:
        """Make mechanisms of four-bars, with either crank as the driving crank."""
        makers = {name: one.from_four_bars for name, one in self.families.items() if one.from_four_bars}
        return self._made_of_four_bars(makers, pivots, point, request)

    def seeds(self, pivots: Floats, point: Complexes, request: PathRequest) -> list[Mapping[str, Any]]:
        """Make mechanisms of four-bars whose further bars move idly."""
        makers = {name: one.seeds for name, one in self.families.items() if one.seeds}
        return self._made_of_four_bars(makers, pivots, point, request)

    def _made_of_four_bars(
        self, makers: Mapping[str, FromFourBars], pivots: Floats, point: Complexes, request: PathRequest
    ) -> list[Mapping[str, Any]]:
        z = pivots[..., 0] + 1j * pivots[..., 1]
        z, point = np.concatenate([z, z[:, ::-1]]), np.tile(point, 2)
        frame = z[:, 1, 0] - z[:, 0, 0]
        b, c, p = ((at - z[:, 0, 0]) / frame for at in (z[:, 0, 1], z[:, 1, 1], point))
        right = ((c - b) * (1 - b).conj()).imag < 0
        b, c, p = (np.where(right, at.conj(), at) for at in (b, c, p))
        made: list[Mapping[str, Any]] = []
        for name, maker in makers.items():
            one = self.families[name]
            values = {name: np.asarray(column, float) for name, column in maker(b, c, p).items()}
            joints, along = one.placed(values)
            scale = np.resize(np.abs(frame), joints.shape[1])
            chain, valid = Chain.valid(one.structure, scale * joints, along)
            found, kept = followed_circuits(chain, one.bar)
            rows, circle = np.flatnonzero(valid)[kept], request.kind == "circle"
            stroke = np.full(len(rows), float(request.stroke))
            at = straightest(
                found,
                found.chain.z[one.guided],
                stroke,
                circle=circle,
                radius=request.radius if circle else None,
                count=1,
            )
            laid = _Laid.of(one, found[at.circuit], at.low, at.high, circle, None, np.ones(len(at.low)))
            for i in laid.good.tolist():
                row = rows[at.circuit[i]]
                made.append(laid.parameters(i, {name: float(column[row]) for name, column in values.items()}))
        return made

    def refine(
        self, parameters: Sequence[Mapping[str, Any]], request: PathRequest, goal: Goal
    ) -> list[Mapping[str, Any] | None]:
        """Move mechanisms towards a goal, within the domains of their parameters.

        None for those that lead nowhere, or to a better one.
        """
        found: list[Mapping[str, Any] | None] = [None] * len(parameters)
        least = Bound("min_transmission", DRAWS.transmission, np.inf, 1.0)
        ranked = goal.rank_by if goal.rank_by in MOVED else "deviation"
        bounds = [*goal.bounds, least, Bound("size", -np.inf, DRAWS.size, 1.0)]
        goal = replace(goal, rank_by=ranked, bounds=bounds)
        apart = replace(goal, bounds=[*goal.bounds, Bound(ARM, DRAWS.apart, np.inf, 1.0)])
        for name, one in self.families.items():
            rows = [i for i, p in enumerate(parameters) if p["family"] == name]
            if rows and one.parameters and not one.exact:
                some = [parameters[i]["values"] for i in rows]
                windows = np.array([parameters[i]["window"] for i in rows]).T
                values = {key.name: np.array([p[key.name] for p in some]) for key in one.parameters}
                legs, of = on_one_leg(one, values, windows)
                if not len(of):
                    continue
                rows = [rows[k] for k in of.tolist()]
                values = {key: column[of] for key, column in values.items()}
                better = refined(one, values, legs, apart if one.seeds else goal, request)
                again = _laid_again(one, better, request.kind == "circle")
                for i, p in zip(better.of.tolist(), again, strict=True):
                    found[rows[i]] = p
        return found

    def measure(self, parameters: Sequence[Mapping[str, Any]], request: PathRequest) -> list[Measured]:
        """Place mechanisms along a path, and measure them there."""
        found: list[Measured | None] = [None] * len(parameters)
        for name, one in self.families.items():
            rows = [i for i, p in enumerate(parameters) if p["family"] == name]
            if not rows:
                continue
            some = [parameters[i] for i in rows]
            z = np.array([[complex(*p["joints"][joint]) for p in some] for joint in one.structure.joints])
            slides = range(len(one.structure.slides))
            u = np.array([[complex(*p["slides"][k]) for p in some] for k in slides]).reshape(len(slides), len(some))
            followed = circuits(Chain(one.structure, z, u), one.bar)
            low, high = (np.array([p["window"][k] for p in some]) for k in (0, 1))
            circle = request.kind == "circle"
            radius = request.radius if circle else None
            laid = _Laid.of(one, followed, low, high, circle, radius, np.full(len(some), float(request.stroke)))
            values = [p["values"] for p in some]
            for i, measured in zip(rows, laid.measured(values), strict=True):
                found[i] = measured
        return [one for one in found if one is not None]

    def classify(self, p: Mapping[str, Any]) -> Tags:
        """Return family, series, configuration and well-known cases of a mechanism."""
        one = self.families[p["family"]]
        return Tags(
            one.name,
            one.series,
            p["configuration"],
            tuple(name for name, holds in one.special.items() if holds(p["values"])),
        )

    def plot(self, candidate: CollectionCandidate, file: Path | None) -> Any:
        """Draw a mechanism in mid-stroke with its path."""
        from ..draw.picture import draw
        from ..guides.chain_stretch import ChainStretch

        return draw(ChainStretch.of_answer(candidate, *self.mechanism(candidate)), file)

    def mechanism(self, candidate: CollectionCandidate) -> tuple[dict[str, Any], tuple[float, float]]:
        """Return the data of a mechanism, and the phases of both ends of its path."""
        one, (found, (low, high)) = self.families[candidate.family], self._followed(candidate)
        structure, chain = one.structure, found.chain
        z = found.poses(np.array([[low], [high]])).joint(one.guided)[:, 0]
        ahead = ((z[1] - z[0]) * np.exp(-1j * np.radians(candidate.along))).real > 0
        given = {
            "joints": {
                name: [at.real, at.imag] for name, at in zip(structure.joints, chain.z[:, 0].tolist(), strict=True)
            },
            "bars": {name: list(joints) for name, joints in structure.bars},
            "drive": structure.drive,
            "point": one.point,
            "slides": [
                {"bar": slide.first, "slider": slide.second, "angle": float(np.degrees(np.angle(u)))}
                for slide, u in zip(structure.slides, chain.u[:, 0], strict=True)
            ],
            "gears": [
                {"wheels": [gear.first, gear.second], "carrier": gear.carrier, "ratio": gear.ratio}
                for gear in structure.gears
                if gear.ratio != 1
            ],
            "parallel": [[gear.first, gear.second] for gear in structure.gears if gear.ratio == 1],
            "name": one.name,
            "unit": candidate.unit,
        }
        return given, (low, high) if ahead else (high, low)

    def _followed(self, candidate: CollectionCandidate) -> tuple[ChainCircuits, tuple[float, float]]:
        """Return the circuit of a placed answer, and the phases of its ends."""
        p, one = candidate.parameters, self.families[candidate.family]
        z = np.array([[complex(*p["joints"][joint])] for joint in one.structure.joints])
        u = np.array([[complex(*way)] for way in p["slides"]]).reshape(-1, 1)
        found = circuits(Chain(one.structure, candidate.placed(z), candidate.turned(u)), one.bar)
        low, high = p["window"]
        if candidate.is_mirrored:
            # the crank of a mirror image turns the other way, so its phases run back from that of
            # the given pose
            home = circuits(Chain(one.structure, z, u), one.bar).phase[0]
            way = 1 if one.structure.is_pushed else -1
            low, high = (float(found.phase[0] + way * (end - home)) for end in (low, high))
        return found, (low, high)


def _laid_again(one: ChainFamily, better: Refined, circle: bool) -> list[dict[str, Any] | None]:
    """Return the parameters of refined mechanisms; None where a window is not covered."""
    made: list[dict[str, Any] | None] = [None] * len(better.of)
    chain, valid = one.chains(better.values)
    found, kept = followed_circuits(chain, one.bar)
    rows = np.flatnonzero(valid)[kept]
    legs = better.legs[rows]
    low, high = np.sort([found.phase_of(end, legs.branch) for end in legs.drive], axis=0)
    some = np.flatnonzero(np.isfinite(low) & (low < high))
    laid = _Laid.of(one, found[some], low[some], high[some], circle, None, np.ones(len(some)))
    for k, row in enumerate(rows[some].tolist()):
        idle = one.seeds is not None and laid.metrics[ARM][k] < DRAWS.apart
        if np.isfinite(laid.deviation[k]) and not idle:
            made[row] = laid.parameters(k, {name: float(column[row]) for name, column in better.values.items()})
    return made


@dataclass(frozen=True)
class _Laid:
    """n mechanisms of one family, placed along their paths; arrays of shape (n,) unless stated.

    Attributes
    ----------
    z : complex ndarray, shape (j, n)
        Joints of the mechanisms; the path runs from the origin along +x [length].
    u : complex ndarray, shape (s, n)
        Directions of the slides.
    low, high, deviation, radius : ndarray
        Phases of the path [rad]; deviation and radius there [length], NaN where it cannot be
        placed.
    places : Places
        Joints and bars over the stroke [length].
    """

    family: ChainFamily
    found: ChainCircuits
    z: Complexes
    u: Complexes
    low: Floats
    high: Floats
    stroke: Floats
    deviation: Floats
    radius: Floats
    metrics: dict[str, Floats]
    places: Places

    @classmethod
    def of(
        cls,
        family: ChainFamily,
        found: ChainCircuits,
        low: Floats,
        high: Floats,
        circle: bool,
        radius: float | None,
        stroke: Floats,
    ) -> _Laid:
        """Place mechanisms on circuits, over windows of phases, along their paths of a stroke."""
        point = found.chain.z[family.guided]
        base = np.ones(len(low))
        with np.errstate(all="ignore"):
            fit = fitted(found, point, low, high, circle=circle, radius=None)
            # the given radius applies in the scale in which the chord is the stroke, which the fit
            # changes
            for _ in range(DRAWS.fits if radius is not None else 0):
                base = base * stroke / fit.stroke
                fit = fitted(_Scaled(found, base), base * point, low, high, circle=True, radius=radius)
            factor = stroke / fit.stroke
            scale = base * factor
            z = (base * found.chain.z - fit.start) * fit.along.conj() * factor
            u = found.chain.u * fit.along.conj()
            radii = 1 / np.abs(fit.curvature / factor) if circle else np.full(len(low), np.nan)
            deviation = factor * fit.deviation
        if radius is not None:
            radii = np.full(len(low), radius)
        at = found.poses(low + (high - low) * np.linspace(0, 1, DRAWS.positions)[:, None])
        metrics = chain_measures(family, at, scale) | {"turns": (found.kind == TURN).astype(float)}
        metrics["sweep"] = np.where(np.isfinite(radii), stroke / radii, 0.0) if circle else np.zeros(len(low))
        laid = places_of(at, lambda places: (base * places - fit.start) * fit.along.conj() * factor)
        return cls(family, found, z, u, low, high, stroke, deviation, radii, metrics, laid)

    @property
    def good(self) -> Indices:
        """Numbers of the mechanisms that are good enough to keep."""
        tight = self.deviation <= DRAWS.deviation * self.stroke
        small = self.metrics["size"] <= DRAWS.size * self.stroke
        driven = self.metrics["min_transmission"] >= DRAWS.transmission
        curved = np.isnan(self.radius) | (self.radius <= DRAWS.flat * self.stroke)
        half = np.isnan(self.radius) | (self.metrics["sweep"] < 1.9)
        return np.flatnonzero(tight & small & driven & curved & half)

    def parameters(self, i: int, values: Mapping[str, float]) -> dict[str, Any]:
        """Return one mechanism completely, as plain data."""
        names = self.family.structure.joints
        return {
            "family": self.family.name,
            "configuration": "turns" if self.found.kind[i] == TURN else "swings",
            "values": dict(values),
            "joints": {name: [z.real, z.imag] for name, z in zip(names, self.z[:, i].tolist(), strict=True)},
            "slides": [[u.real, u.imag] for u in self.u[:, i].tolist()],
            "window": [float(self.low[i]), float(self.high[i])],
        }

    def specimens(self, values: Sequence[Mapping[str, float]]) -> list[Specimen]:
        """Return the good mechanisms as specimens to store."""
        kind = "line" if np.isnan(self.radius).all() else "circle"
        made = []
        for i in self.good.tolist():
            p = self.parameters(i, values[i])
            metrics = {name: float(column[i]) for name, column in self.metrics.items()}
            tags = self.family.name, self.family.series, p["configuration"]
            made.append(Specimen(*tags, kind, float(self.deviation[i]), p, metrics))
        return made

    def measured(self, values: Sequence[Mapping[str, float]]) -> list[Measured]:
        """Return the measures of all mechanisms; those without have a reason."""
        made = []
        for i in range(len(self.low)):
            if not np.isfinite(self.deviation[i]):
                made.append(Measured.no("its point does not run forward there"))
                continue
            metrics = {name: float(column[i]) for name, column in self.metrics.items()}
            radius = float(self.radius[i]) if np.isfinite(self.radius[i]) else None
            parameters = self.parameters(i, values[i])
            made.append(Measured(float(self.deviation[i]), radius, metrics, parameters, places=self.places[i]))
        return made


@dataclass(frozen=True)
class _Scaled:
    """Circuits of chains (n,), scaled."""

    found: ChainCircuits
    scale: Floats

    def pose(self, s: Floats) -> Pose:
        """Return the scaled poses."""
        here = self.found.pose(s)
        return Pose(self.scale * here.d, here.x, self.scale * here.origin)
