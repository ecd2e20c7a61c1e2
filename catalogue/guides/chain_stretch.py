"""Stretches of mechanisms of many bars: their paths along a line or an arc."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar

import numpy as np

from ..collections.results import CollectionCandidate
from ..guidance.circuit_curve import fitted
from ..guidance.deviation_curve import from_circle
from ..kinematics.types import Complexes, Floats
from ..problem.path import PathFrame
from .chain_motion import ChainMotion
from .guide_motion import SAMPLES, sampled
from .own_chain import GRID, OwnChain


@dataclass(frozen=True)
class ChainStretch(OwnChain):
    """A stretch of the motion of a mechanism of many bars; `joints` are in its given pose.

    Attributes
    ----------
    stroke, deviation : float
        Length of the path, and half the width of the strip or annulus that holds it [length].
    size : float
        Diameter of all joints over the stroke [length].
    radius : float or None
        Radius of the fitted or given arc [length].
    min_transmission : float
        Least transmission angle of any dyad over the stroke [deg].
    drive_from, drive_to : float
        Drive at both ends of the path, from its given pose [deg]; for a slider [length].
    start, along : list of float, float
        Start of the path [length], and its direction from the x axis [deg].
    number : int
        Number of the given mechanism, from 1.

    Examples
    --------
    >>> from catalogue import mechanism
    >>> bars = {"frame": "AD", "crank": "AB", "coupler": "BCP", "rocker": "CD"}
    >>> joints = {"A": [0, 0], "D": [2, 0], "B": [0, 1], "C": [2, 2.5], "P": [4, 4]}
    >>> lambda_ = mechanism({"joints": joints, "bars": bars, "drive": "crank", "point": "P"})
    >>> best = lambda_.measure(deviation=0.01)[0]
    >>> round(best.stroke, 2), round(best.drive_to - best.drive_from)
    (4.55, -219)
    """

    stroke: float = 0.0
    deviation: float = 0.0
    radius: float | None = None
    size: float = 0.0
    min_transmission: float = 0.0
    drive_from: float = 0.0
    drive_to: float = 0.0
    start: list[float] = field(default_factory=list)
    along: float = 0.0
    number: int = 1
    _window: tuple[float, float] = field(default=(0.0, 0.0), repr=False)
    #: no stretch is an arc near a half circle, or beyond
    is_wide: ClassVar[bool] = False
    arc_angle: ClassVar[float | None] = None
    __hash__ = OwnChain.__hash__

    @classmethod
    def columns(cls) -> list[str]:
        """Names of the printed fields."""
        return [f.name for f in fields(cls) if not f.name.startswith("_")]

    def to_dict(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in self.columns()}

    @classmethod
    def of_answer(cls, one: CollectionCandidate, given: Mapping[str, Any], window: tuple[float, float]) -> ChainStretch:
        """Make the stretch of an answer of a collection.

        Parameters
        ----------
        one : CollectionCandidate
        given : mapping
            Data of the mechanism, placed along the requested path; see `catalogue.mechanism`.
        window : (float, float)
            Phases at the start of the path and at its end [rad].
        """
        return cls.of_window(
            OwnChain.of(given, unit=one.unit),
            window,
            stroke=one.stroke,
            deviation=one.deviation,
            radius=one.radius,
            start=[float(x) for x in one.start],
            along=float(one.along),
        )

    @classmethod
    def of_window(cls, whole: OwnChain, window: tuple[float, float], **measured: Any) -> ChainStretch:
        """Make a stretch of a mechanism.

        Parameters
        ----------
        whole : OwnChain
        window : (float, float)
            Phases at the start of the path and at its end [rad].
        **measured
            Values of further fields.
        """
        bare = cls(**whole.given, **measured, _window=window)
        bare.__dict__.update({name: whole.__dict__[name] for name in ("read", "circuit") if name in whole.__dict__})
        return replace(bare, **bare.over_window())

    @property
    def run_length(self) -> float:
        """Length of the deviation's axis in drawings: the stroke."""
        return self.stroke

    @property
    def frame(self) -> PathFrame:
        """Frame of the path: its start and direction."""
        return PathFrame((self.start[0], self.start[1]), self.along)

    def over_window(self) -> dict[str, Any]:
        """Measure size, transmission angle and drive over the stretch."""
        found, structure = self.circuit, self.chain.structure
        at = found.poses(np.linspace(*self._window, GRID.positions)[:, None])
        ends = at.drive[[0, -1], 0] if structure.is_pushed else np.degrees(at.drive[[0, -1], 0])
        return {
            "size": float(at.extent[0]),
            "min_transmission": float(at.transmission.min()),
            "drive_from": float(ends[0]),
            "drive_to": float(ends[1]),
        }

    def deviations(self, z: Complexes) -> Floats:
        """Return the signed distances of places of the path from its line or arc.

        Parameters
        ----------
        z : complex ndarray, shape (m,)
            Places from the start of the path to its end [length].

        Returns
        -------
        ndarray, shape (m,)
            Distances, positive to the left of the path [length].
        """
        if self.radius is not None:
            return np.asarray(from_circle(z, (z[0], z[-1]), self.radius, max(self.deviation, np.finfo(float).tiny)))
        off = ((z - complex(*self.start)) * np.exp(-1j * np.radians(self.along))).imag
        return np.asarray(off - 0.5 * (off.max() + off.min()))

    def deviation_again(self) -> float:
        """Measure the deviation over the stretch by the minimum zone, on another grid."""
        found, at = self.circuit, np.array([self.guided_point])
        low, high = (np.array([end]) for end in sorted(self._window))
        return float(fitted(found, at, low, high, circle=self.radius is not None, radius=self.radius).deviation[0])

    def motion(
        self, samples: int = SAMPLES, *, points: Any = None, driver: Any = None, between: Any = (), whole: bool = False
    ) -> ChainMotion:
        """Compute the motion over the stroke, or over the whole circuit.

        Parameters
        ----------
        samples, points, driver, between
            See `OwnChain.motion`.
        whole : bool
            Cover the whole circuit.
        """
        if whole:
            return super().motion(samples, points=points, driver=driver, between=between)
        self._refuse_points(points, driver)
        sampled(samples)
        return ChainMotion.of(self, self.samples(*self._window).rows(np.linspace(0, 1, samples)), between)

    @property
    def drawn(self) -> tuple[float, float, float]:
        """Phases of the path to draw: at its start, at its middle, and at its end."""
        low, high = self._window
        return low, 0.5 * (low + high), high
