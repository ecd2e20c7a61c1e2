"""Placed guides of any origin: circuits, motion, drawings and exports."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from ..errors import InvalidRequest
from ..kinematics.circuits import COUPLER, SWING, TURN, circuits
from ..kinematics.linkage import RR, Linkage
from ..units import converted, factor, power, unit_or_none
from .columns import CANDIDATE, Column
from .common import CommonVerbs
from .guide_motion import SAMPLES, GuideMotion, sampled
from .run import Run
from .verbs import verb

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..problem.path import PathRequest
    from .results import Improvement


#: Message for a chain that closes in one position only.
IMMOBILE = (
    "the chain just closes, in one position only: the linkage cannot move; make a link a little longer or shorter"
)
#: Length over the longest length below which it counts as 0: it is rounding.
ROUNDING = 1e-12


@dataclass(frozen=True)
class Circuit:
    """One circuit of a linkage: the positions it reaches without disassembly.

    Attributes
    ----------
    lead : str
        Link whose angle parametrises the circuit: ``crank 1``, ``crank 2`` or ``coupler``.
    motion : str
        Motion of this link: ``turns`` (fully), ``swings`` (between dead points), ``open`` (from
        infinity to infinity) or ``stands`` (cannot move).
    low, high : float
        Range of its angle, from the x axis; for the coupler from the given position [deg].
    given : bool
        Whether the given position is on this circuit.
    joined : bool
        Whether it crosses the other circuit at change points: only a guard prevents a change of
        circuit.
    """

    lead: str
    motion: str
    low: float
    high: float
    given: bool
    joined: bool = False


class PlacedGuide(CommonVerbs):
    """Base of all placed guides: a linkage with a guided point.

    Attributes
    ----------
    pivots, guided : list
        [[A1, A1*], [A2, A2*]], each [x, y, w] with w = 0 at infinity, and the guided point [x, y],
        in one position [length].
    pole : list of float or None
        Pole of the branch of motion, if this position is a change point [length].
    unit : str or None
        Unit of all lengths: mm, cm, m, in or ft; None if unknown.

    Examples
    --------
    >>> from catalogue import guide
    >>> links = {"crank": 100, "rocker": 250, "ground": 220, "coupler": 250}
    >>> mine = guide(links | {"along": 125, "across": 80})
    >>> [(one.lead, one.motion) for one in mine.circuits]
    [('crank 1', 'turns'), ('crank 1', 'turns')]
    >>> mine.in_unit("mm").in_unit("cm").lengths["frame"]
    22.0
    """

    pivots: list[list[list[float]]]
    guided: list[float]
    pole: list[float] | None
    unit: str | None
    meanings: ClassVar[Mapping[str, Column]] = CANDIDATE  #: columns whose units apply to the fields

    def __hash__(self) -> int:
        return hash(tuple(np.ravel(self.pivots).tolist()))

    def in_unit(self, unit: str | None) -> Self:
        """Convert all lengths of the guide to another unit.

        Parameters
        ----------
        unit : str or None
            Unit to convert to: mm, cm, m, in or ft.  Lengths of unknown unit are taken to be in
            it.  None converts nothing.

        Returns
        -------
        PlacedGuide
            Guide of the same class.

        Raises
        ------
        InvalidRequest
            If the unit is unknown.
        """
        if unit_or_none(unit) is None or unit == self.unit:
            return self
        times = Fraction(1) if self.unit is None else factor(self.unit, str(unit))
        held = {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]  # all are dataclasses
        powers = {name: power(self.meanings[name].unit) for name in held if name in self.meanings}
        changed = {name: converted(held[name], times**n) for name, n in powers.items() if n and times != 1}
        return replace(self, **changed, unit=unit)  # type: ignore[type-var]

    @property
    def linkage(self) -> Linkage:
        """The linkage in the given position."""
        return Linkage(self.pivots)

    @cached_property
    def lengths(self) -> dict[str, float]:
        """Link lengths and coordinates of the guided point in the coupler, by name [length, deg].

        See `kinematics.link_lengths`.
        """
        from ..kinematics.link_lengths import link_lengths

        pivots = np.asarray(self.pivots, float)
        finite = pivots[..., 2] == 1
        _, power = np.frexp(np.abs(pivots[finite][:, :2]).max())
        # unit of length in which squares do not overflow, even for strokes of 1e300
        unit = np.ldexp(1.0, min(int(power), 1022))
        pivots[finite, :2] /= unit
        found = link_lengths(Linkage(pivots), np.array([complex(*self.guided) / unit]))
        told = {name: float(unit * value[0]) for name, value in found.items()}
        least = ROUNDING * max(map(abs, told.values()))
        return {name: 0.0 if abs(value) <= least else value for name, value in told.items()}

    @property
    def circuits(self) -> list[Circuit]:
        """All circuits; that of the given position comes first."""
        found = circuits(self.linkage)
        axis = np.degrees(np.angle(found.closure.arm))
        stuck, joined = found.is_immobile, found.is_joined
        told = []
        for k in range(len(found)):
            led, kind = int(found.lead[k]), int(found.kind[k])
            offset = 0.0 if led == COUPLER else float(axis[k])
            low, high = 0.0, 360.0
            if kind != TURN:
                swing = abs(float(found.half[k])) if kind == SWING else float(found.half[k])
                low, high = (math.degrees(float(found.centre[k]) + side * swing) for side in (-1, 1))
            told.append(
                Circuit(
                    "coupler" if led == COUPLER else f"crank {led + 1}",
                    "stands" if stuck[k] else ("turns", "swings", "open")[kind],
                    low + offset if kind != TURN else 0.0,
                    high + offset if kind != TURN else 360.0,
                    bool(np.isfinite(found.phase[k])),
                    bool(joined[k]),
                )
            )
        return told

    @property
    def is_immobile(self) -> bool:
        """Whether the chain closes in one position only."""
        return bool(circuits(self.linkage).is_immobile.any())

    @property
    def dead_points(self) -> dict[str, list[float]]:
        """Dead points of each crank: angles from the x axis, 0 to 360 [deg]."""
        return _stops(self.linkage, dead=True)

    @property
    def change_points(self) -> dict[str, list[float]]:
        """Change points of each crank: angles from the x axis, 0 to 360 [deg]."""
        return _stops(self.linkage, dead=False)

    def motion(
        self, samples: int = SAMPLES, *, points: Mapping[str, Any] | None = None, driver: int | None = None
    ) -> GuideMotion:
        """Compute the motion over the whole circuit, from the given position back to it.

        An open circuit runs from infinity to infinity.

        Parameters
        ----------
        samples : int
            Number of positions, 2 to 1,000,000.  They are uniform in the phase (for a crank that
            turns fully: in its angle), but denser where a point moves more than four times its
            average step. So no point moves more than 8/(samples - 1) of its path between two
            positions, and no link turns more than this fraction of its rotation; (4 + k)/(samples -
            1) for k points and links.
        points : mapping of str to (x, y), optional
            Further coupler points by name, in the given position [length].
        driver : int, optional
            Number of the driving crank, 1 or 2; 0: the coupler.  Default: the lead of the circuit.

        Returns
        -------
        GuideMotion

        Raises
        ------
        InvalidRequest
            If a point, the driver or the number of samples is invalid, or the chain cannot move.
        """
        found = circuits(self.linkage)[:1]
        if found.is_immobile.any():
            raise InvalidRequest(IMMOBILE)
        run = Run.whole(self, found, points)
        return run.motion(run.rows(sampled(samples)), driver)

    def run(
        self,
        *,
        whole: bool = False,  # noqa: ARG002  # a guide without a stroke always covers its circuit
        points: Mapping[str, Any] | None = None,
    ) -> Run:
        """Return the range of motion to draw: the stroke if there is one, else the circuit.

        Parameters
        ----------
        whole : bool
            Cover the circuit even for a guide with a stroke; for an open circuit its nearby part.
        points : mapping of str to (x, y), optional
            Further coupler points by name, in the given position [length].

        Raises
        ------
        InvalidRequest
            See `motion`.
        """
        return Run.whole(self, circuits(self.linkage)[:1], points).near()

    def drawn_motion(
        self, samples: int, *, whole: bool = False, points: Mapping[str, Any] | None = None
    ) -> tuple[GuideMotion, bool]:
        """Compute the motion over the `run`; tell also whether it is closed.

        Parameters
        ----------
        samples : int
            Number of positions; see `motion`.
        whole : bool
            Cover the circuit even for a guide with a stroke.
        points : mapping of str to (x, y), optional
            Further coupler points by name, in the given position [length].

        Returns
        -------
        GuideMotion, bool

        Raises
        ------
        InvalidRequest
            See `motion`.
        """
        run = self.run(whole=whole, points=points)
        return run.motion(run.rows(sampled(samples)), getattr(self, "driver", None)), run.closed

    def plot(
        self,
        file: str | Path | None = None,
        *,
        ax: Axes | None = None,
        moving: bool = False,
        unit: str | None = None,
        scale: str | None = None,
    ) -> Any:
        """Draw the linkage at mid-stroke with ghosts at the ends, its path and the deviation.

        With `moving` animate it. A guide without a stroke is drawn in the given position, with the
        path over its circuit.

        Parameters
        ----------
        file : path, optional
            PNG, SVG, PDF or animated GIF by suffix.  The file depends on the guide alone.
        ax : matplotlib.axes.Axes, optional
            Draw linkage and path into these axes instead, to one scale in both directions.
        moving : bool
            Animate an SVG, without script or matplotlib, with check boxes for pole, inflection
            circle, cubics, centrodes, velocity.
        unit : str, optional
            Unit to convert to, as in `export`.  An animated SVG of unknown unit is in millimetres,
            with a note; a still names no unit.
        scale : str, optional
            Scale of an animated SVG in true millimetres, such as ``1:2``; default: the largest
            standard scale that fits a sheet.

        Returns
        -------
        matplotlib.figure.Figure or None
            Independent of pyplot and of a display; None for an animation.

        Raises
        ------
        InvalidRequest
            If suffix, folder, unit or scale is invalid, or the linkage does not cover the stroke.
        MissingExtra
            Without matplotlib: ``pip install "mechanism-catalogue[plot]"``.
        """
        return verb("draw")(self, file, ax=ax, moving=moving, unit=unit, scale=scale, code=self.code)

    def plot_curves(self, file: str | Path | None = None, *, unit: str | None = None) -> Figure:
        """Plot deviation, speed, transmission angle and mechanical advantage over the drive.

        For a dwell, also plot the angle of the rocker.

        Parameters
        ----------
        file : path, optional
            PNG, SVG or PDF by suffix.
        unit : str, optional
            Unit to convert to, as in `plot`.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InvalidRequest, MissingExtra
            See `plot`.
        """
        figure: Figure = verb("draw_curves")(self, file, unit=unit)
        return figure

    def sheet(self, file: str | Path, *, paper: str = "a4", unit: str | None = None, scale: str | None = None) -> None:
        """Write a one-page data sheet for the workshop.

        It has a drawing to scale, lengths and pivots with tolerances from the allowance, limits,
        curves over the drive, theory and provenance.

        Parameters
        ----------
        file : path
            PDF or HTML by suffix; HTML is animated and needs no matplotlib.
        paper : str
            ``a4`` or ``letter``.
        unit : str, optional
            Unit to convert to, as in `export`; an unknown unit is taken as millimetres, with a
            note.
        scale : str, optional
            Scale of the drawing in true millimetres, such as ``1:2``; default: the largest standard
            scale that fits.

        Raises
        ------
        InvalidRequest
            If paper, unit or scale is invalid; see also `plot`.
        MissingExtra
            For a PDF without matplotlib.
        """
        verb("sheet")(self, file, paper=paper, unit=unit, scale=scale)

    def export(
        self,
        file: str | Path | None = None,
        format: str | None = None,
        *,
        unit: str | None = None,
        bar_width: float | None = None,
        hole: float | None = None,
        positions: int = 73,
        columns: Sequence[str] = (),
        over: str | None = None,
    ) -> str | bytes:
        """Export the guide for CAD or other programs, to a file if one is named.

        Parameters
        ----------
        file : path, optional
            Its suffix selects the format: ``.dxf``, ``.json``, ``.csv``, ``.xlsx``, ``.parquet``,
            ``.txt`` (solidworks), ``.FCMacro`` (freecad), ``.step``, ``.py`` (pylinkage).
        format : str, optional
            ``dxf``: linkage, path, dimensions and parts to cut.  ``json``: all data, for the
            commands. ``csv``, ``xlsx``, ``parquet``: the motion table.  ``solidworks``, ``fusion``:
            named parameters.  ``step``: the parts as solids.  ``freecad``, ``pylinkage``: scripts.
        unit : str, optional
            Unit to convert to: mm, cm, m, in or ft; default: that of the guide.  An unknown unit is
            taken as millimetres, with a note, by ``dxf``, ``step``, ``freecad``, ``solidworks`` and
            ``fusion``; the other formats name none.
        bar_width, hole : float, optional
            Width of the bars and diameter of the holes [length].
        positions : int
            Rows of the motion table.
        columns : sequence of str
            Columns of the motion table, by the start of their headings; all if empty.
        over : str, optional
            Range of the motion: ``stroke`` or ``circuit``; default: the stroke, if there is one.

        Returns
        -------
        str or bytes
            Content of the file; bytes for a workbook and Parquet.

        Raises
        ------
        InvalidRequest
            If the format is unknown, the file cannot be written, holes overlap, or the format
            cannot represent the guide: pylinkage moves four-bars and slider-cranks, away from
            change points.
        MissingExtra
            Without a needed package: ``pip install "mechanism-catalogue[cad]"``, ``[parquet]`` or
            ``[step]``.
        """
        how = {"bar_width": bar_width, "hole": hole, "positions": positions, "columns": columns, "over": over}
        content: str | bytes = verb("export")(self, file, format, unit=unit, **how)
        return content

    def improve(self, request: PathRequest, **how: Any) -> Improvement:
        """Optimise the guide from where it is, and compare it with the best of a catalogue.

        Parameters
        ----------
        request : StraightLine or CircularArc
            Stroke and tolerance.
        **how
            Further arguments of `catalogue.improve`.
        """
        found: Improvement = verb("improve")(self, request, **how)
        return found


def _stops(linkage: Linkage, *, dead: bool) -> dict[str, list[float]]:
    """Compute the dead points, or change points, of each crank [deg]."""
    from ..kinematics.closure import Closure

    told = {}
    for i in np.flatnonzero(linkage.dyads[0] == RR):
        closure = Closure.of(linkage, np.array([i]))
        axis, angles = float(np.angle(closure.arm[0])), []
        for which, at in zip((closure.dead if dead else closure.change)[:, 0], closure.at[:, 0], strict=True):
            if which:
                angles += [axis + at, axis - at]
        told[f"crank {i + 1}"] = sorted({round(math.degrees(a) % 360, 9) for a in angles})
    return told
