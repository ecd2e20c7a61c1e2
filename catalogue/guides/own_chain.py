"""Mechanisms of many bars that a user brings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from ..chains.chain import Chain
from ..chains.circuits import ChainCircuits, circuits
from ..chains.given import GivenChain, read_chain
from ..chains.lengths import spans
from ..collections.results import CollectionCandidate
from ..errors import InvalidRequest, quoted
from ..given import text
from ..kinematics.circuits import OPEN, TURN
from ..kinematics.sampling import Samples, resolved
from ..kinematics.splines import SPLINE, place_points
from ..kinematics.types import Complexes, Floats
from ..units import LENGTH, converted, factor, unit_or_none
from .chain_motion import ChainMotion
from .columns import CHAIN
from .common import CommonVerbs
from .guide_motion import SAMPLES, sampled
from .run import RUN
from .verbs import verb

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..problem.path import PathRequest
    from .results import ChainImprovement


@dataclass(frozen=True)
class Grid:
    """Grids on which mechanisms are measured.

    Attributes
    ----------
    positions : int
        Number of positions of a stretch at which size and transmission angle are measured.
    least : float
        Lower bound of the extent of a joint's path to which its errors are relative [size of the
        chain].
    beside : float
        Distance in phase from an end of a piece at which directions are known to half the digits
        [rad].
    """

    positions: int = 129
    least: float = 1e-3
    beside: float = 1e-7


GRID = Grid()


@dataclass(frozen=True)
class OwnChain(CommonVerbs):
    """A mechanism of many bars of your own with its guided point; made by `catalogue.mechanism`.

    Attributes
    ----------
    joints : dict of str to [x, y]
        Positions in the given pose [length].
    bars : dict of str to list of str
        Joints on each bar; one bar is the `frame`.
    drive, point : str
        Driving bar; guided joint.
    slides, gears, parallel : list
        See `catalogue.chains.given`.
    name : str
    unit : str or None
        Unit of all lengths: mm, cm, m, in or ft; None if unknown.

    Examples
    --------
    >>> from catalogue import mechanism
    >>> bars = {"frame": "AD", "crank": "AB", "coupler": "BCP", "rocker": "CD"}
    >>> joints = {"A": [0, 0], "D": [2, 0], "B": [0, 1], "C": [2, 2.5], "P": [4, 4]}
    >>> chebyshev = mechanism({"joints": joints, "bars": bars, "drive": "crank", "point": "P"})
    >>> best = chebyshev.measure(stroke=3)[0]
    >>> round(best.deviation, 4)
    0.0048
    """

    joints: dict[str, list[float]]
    bars: dict[str, list[str]]
    drive: str
    point: str
    slides: list[Any] = field(default_factory=list)
    gears: list[Any] = field(default_factory=list)
    parallel: list[Any] = field(default_factory=list)
    name: str = ""
    unit: str | None = None

    def __hash__(self) -> int:
        return hash(tuple(map(tuple, self.joints.values())))

    @classmethod
    def of(cls, given: Mapping[str, Any], *, name: str = "", unit: str | None = None) -> OwnChain:
        """Make a mechanism from plain data; see `catalogue.mechanism`.

        Parameters
        ----------
        given : mapping
        name : str
        unit : str, optional
        """
        given = {**given, **({"name": name} if name else {}), **({"unit": unit} if unit else {})}
        read = read_chain(given)
        held = dict(zip(read.chain.structure.joints, read.chain.z[:, 0].tolist(), strict=True))
        return cls(
            {joint: [z.real, z.imag] for joint, z in held.items()},
            {bar: [*joints] for bar, joints in given["bars"].items()},
            given["drive"],
            given["point"],
            [dict(one) for one in given.get("slides", ())],
            [{**one, "wheels": [*one["wheels"]]} for one in given.get("gears", ())],
            [[*one] for one in given.get("parallel", ())],
            read.name,
            read.unit,
        )

    @property
    def given(self) -> dict[str, Any]:
        """Plain data of the mechanism, in the form that `of` reads."""
        return {f.name: getattr(self, f.name) for f in fields(OwnChain)}

    @cached_property
    def read(self) -> GivenChain:
        """The chain, its guided joint and its unit."""
        return read_chain(self.given)

    @property
    def chain(self) -> Chain:
        """The chain in the given pose."""
        return self.read.chain

    @cached_property
    def circuit(self) -> ChainCircuits:
        """The circuit of the given pose, for the bar with the guided point."""
        return circuits(self.chain, min(self.chain.structure.on[self.read.point]))

    @property
    def guided_point(self) -> complex:
        """Position of the guided point in the given pose [length]."""
        return complex(self.chain.z[self.read.point, 0])

    def in_unit(self, unit: str | None) -> Self:
        """Convert all lengths to another unit.

        Parameters
        ----------
        unit : str or None
            See `PlacedGuide.in_unit`.
        """
        if unit_or_none(unit) is None or unit == self.unit:
            return self
        if self.unit is None:
            return replace(self, unit=unit)
        times = factor(self.unit, str(unit))
        lengths = {name: converted(getattr(self, name), times) for name in self._in_length}
        return replace(self, unit=unit, **lengths)

    @property
    def _in_length(self) -> list[str]:
        """Names of the fields in the unit of length."""
        driven = ("drive_from", "drive_to") if self.chain.structure.is_pushed else ()
        return [f.name for f in fields(self) if f.name in driven or (f.name in CHAIN and CHAIN[f.name].unit == LENGTH)]

    @property
    def lengths(self) -> dict[str, float]:
        """Distances of joints on a bar, and offsets of slides, by name [length]."""
        return {name: abs(end - start) for name, (start, end) in spans(self.chain).items()}

    @property
    def drive_range(self) -> tuple[float, float] | None:
        """Range of the drive from its given pose [deg or length]; None if it turns fully."""
        found = self.circuit
        if found.kind[0] == TURN:
            return None
        legs = found.leg_count[0]
        ends = np.append(found.low[:legs, 0], found.high[:legs, 0])
        ends = ends if self.chain.structure.is_pushed else np.degrees(ends)
        return float(ends.min()), float(ends.max())

    def samples(self, low: float, high: float) -> Samples:
        """Sample guided point, moving joints and directions of all bars.

        Parameters
        ----------
        low, high : float
            Phases between which to sample [rad].
        """
        structure, found = self.chain.structure, self.circuit
        moving = [j for j, bars in enumerate(structure.on) if structure.frame not in bars]
        moving = [self.read.point, *moving]

        def values(s: Floats) -> Complexes:
            at = found.poses(self._beside_ends(s)[:, None])
            return np.stack([*(at.joint(j)[:, 0] for j in moving), *at.turn[:, :, 0]], axis=1)

        scale = np.append(np.full(len(moving), np.nan), np.ones(len(structure.bars)))
        return resolved(values, low, high, scale, GRID.least * float(self.chain.size[0]))

    def _beside_ends(self, s: Floats) -> Floats:
        """Move phases (m,) off dead and change points, at which pins may coincide."""
        found, period = self.circuit, float(self.circuit.period[0])
        ends = found.bounds[np.isfinite(found.bounds[:, 0]), 0]
        ends = ends[:-1] if found.kind[0] == OPEN or len(ends) == 1 else ends
        if not len(ends):
            return s
        away = np.mod(s[:, None] - ends + 0.5 * period, period) - 0.5 * period
        off = away[np.arange(len(s)), np.abs(away).argmin(1)]
        return np.where(np.abs(off) < GRID.beside, s - off + np.copysign(GRID.beside, off), s)

    @property
    def range(self) -> tuple[float, float]:
        """Phases between which the whole motion runs."""
        start, period = float(self.circuit.phase[0]), float(self.circuit.period[0])
        return (0.0, period) if self.circuit.kind[0] == OPEN else (start, start + period)

    def spline(self) -> tuple[Floats, Floats]:
        """Place the points of a spline along the drawn path; see `splines.place_points`."""
        low, _, high = self.drawn
        samples, size = self.samples(low, high), float(self.chain.size[0])
        deviation = getattr(self, "deviation", np.inf)
        error = max(RUN.part * deviation, RUN.rounded * size) / float(samples.scale[0])
        return place_points(samples, 0, min(SPLINE.error, error))

    def motion(
        self, samples: int = SAMPLES, *, points: Any = None, driver: Any = None, between: Sequence[Sequence[str]] = ()
    ) -> ChainMotion:
        """Compute the motion over the whole circuit, from the given pose back to it.

        Parameters
        ----------
        samples : int
            Number of positions, 2 to 1,000,000.
        points, driver
            Refused: the mechanism itself states them.
        between : sequence of (str, str)
            Pairs of joints whose distances, and the ratios of these to the drive, are wanted.

        Returns
        -------
        ChainMotion

        Raises
        ------
        InvalidRequest
            If a joint or the number of samples is invalid, or points or a driver are given.
        """
        self._refuse_points(points, driver)
        sampled(samples)
        run = self.samples(*self.range)
        return ChainMotion.of(self, run.rows(np.linspace(0, 1, samples)), between)

    def _refuse_points(self, points: Any, driver: Any) -> None:
        if points:
            raise InvalidRequest("a further point of a mechanism of many bars is a joint on one bar: name it there")
        if driver is not None:
            raise InvalidRequest("the drive of a mechanism of many bars is stated in it: name another bar there")

    def plot(
        self,
        file: str | Path | None = None,
        *,
        moving: bool = False,
        unit: str | None = None,
        scale: str | None = None,
    ) -> Any:
        """Draw the mechanism with the path of its guided point.

        Parameters
        ----------
        file : path, optional
            PNG, SVG, PDF or animated GIF by suffix.
        moving : bool
            Animate an SVG, without script or matplotlib.
        unit : str, optional
            Unit to convert to.
        scale : str, optional
            Scale of an animated SVG in true millimetres, such as ``1:2``.

        Returns
        -------
        matplotlib.figure.Figure or None
            None for an animation.

        Raises
        ------
        InvalidRequest, MissingExtra
            See `PlacedGuide.plot`.
        """
        return verb("draw")(self, file, moving=moving, unit=unit, scale=scale, code=self.code)

    @property
    def drawn(self) -> tuple[float, float, float]:
        """Phases of the path to draw: at its start, in the given pose, and at its end."""
        low, high = self.range
        return low, float(self.circuit.phase[0]), high

    def to_dict(self) -> dict[str, Any]:
        """Convert the mechanism to plain numbers, lists and strings."""
        return self.given

    def improve(self, request: PathRequest, **how: Any) -> ChainImprovement:
        """Improve the mechanism over a stroke by moving its joints.

        Parameters
        ----------
        request : StraightLine or CircularArc
            Stroke, and the permitted deviation.
        **how
            Further arguments of `catalogue.find.improve_chain.improve_chain`: `hold`, `rank_by`,
            `effort`, and bounds.
        """
        found: ChainImprovement = verb("improve_chain")(self, request, **how)
        return found

    def export(self, file: str | Path | None = None, format: str | None = None, **options: Any) -> str | bytes:
        """Export the mechanism as drawing, parts, parameters, motion table or JSON.

        Parameters
        ----------
        file, format, **options
            See `PlacedGuide.export`.

        Returns
        -------
        str or bytes

        Raises
        ------
        InvalidRequest, MissingExtra
            See `PlacedGuide.export`; also if a format is for linkages of two dyads only.

        Examples
        --------
        >>> from catalogue import mechanism
        >>> bars = {"frame": "AD", "crank": "AB", "coupler": "BCP", "rocker": "CD"}
        >>> joints = {"A": [0, 0], "D": [2, 0], "B": [0, 1], "C": [2, 2.5], "P": [4, 4]}
        >>> chebyshev = mechanism({"joints": joints, "bars": bars, "drive": "crank", "point": "P"})
        >>> str(chebyshev.export(format="csv", columns=["drive", "P x"], positions=2)).split()[-1]
        '360.0,4.0'
        """
        content: str | bytes = verb("export")(self, file, format, **options)
        return content

    def sheet(self, file: str | Path, *, paper: str = "a4", unit: str | None = None, scale: str | None = None) -> None:
        """Write a data sheet: drawing to scale, lengths, joints, limits and curves over the drive.

        Parameters
        ----------
        file, paper, unit, scale
            See `PlacedGuide.sheet`.

        Raises
        ------
        InvalidRequest, MissingExtra
            See `PlacedGuide.sheet`.
        """
        verb("sheet")(self, file, paper=paper, unit=unit, scale=scale)

    def plot_curves(self, file: str | Path | None = None, *, unit: str | None = None) -> Figure:
        """Draw speed and transmission angle over the drive; for a stretch the deviation too.

        Parameters
        ----------
        file, unit
            See `plot`.
        """
        figure: Figure = verb("draw_curves")(self, file, unit=unit)
        return figure


def mechanism(given: Mapping[str, Any] | CollectionCandidate, *, name: str = "", unit: str | None = None) -> OwnChain:
    """Make a mechanism of many bars from plain data, to measure, move and draw.

    Parameters
    ----------
    given : mapping or CollectionCandidate
        Joints, bars, drive and guided point, as in a JSON file; see `catalogue.chains.given`. Or an
        answer of a collection of such mechanisms, which becomes a `ChainStretch`.
    name : str
        Name of the mechanism, for drawings.
    unit : str, optional
        Unit of all lengths: mm, cm, m, in or ft.

    Returns
    -------
    OwnChain

    Raises
    ------
    InvalidLinkage, InvalidRequest
        If a value is missing or invalid, or bars close in no group.

    Examples
    --------
    >>> from catalogue import mechanism
    >>> cardan = {
    ...     "joints": {"O": [0, 0], "A": [1, 0], "P": [2, 0]},
    ...     "bars": {"frame": ["O"], "arm": ["O", "A"], "planet": ["A", "P"]},
    ...     "gears": [{"wheels": ["frame", "planet"], "carrier": "arm", "ratio": 2}],
    ...     "drive": "arm",
    ...     "point": "P",
    ... }
    >>> mechanism(cardan, name="Cardan gears").measure(stroke=3)[0].deviation < 1e-15
    True
    """
    if isinstance(given, CollectionCandidate):
        stretch: OwnChain = verb("stretch_of")(given)
        return stretch
    if not isinstance(given, Mapping):
        raise InvalidRequest(f"a mechanism of many bars is a mapping, not {quoted(given)}")
    return OwnChain.of(given, name=text("name", name), unit=unit)
