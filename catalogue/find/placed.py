"""Guides that stand somewhere, whatever they came from: their circuits, and their motion over the drive."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
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
from .guide_motion import SAMPLES, GuideMotion, sampled
from .run import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..problem.request import Request
    from .improve import Improvement
    from .measure import Measured


#: What a chain is told to be that closes in one position only.
IMMOBILE = (
    "the chain just closes, in one position only: the linkage cannot move; make a link a little longer or shorter"
)
#: A length is 0 but for rounding if it is no more than this part of the longest.
ROUNDING = 1e-12


@dataclass(frozen=True)
class Circuit:
    """One circuit of a linkage: what it reaches without being taken apart.

    Attributes
    ----------
    lead : str
        What its positions are told by: ``crank 1``, ``crank 2`` or ``coupler``.
    motion : str
        ``turns`` (fully), ``swings`` (between dead points), ``open`` (from infinity to infinity) or ``stands`` (cannot
        move).
    low, high : float
        Range of the lead's angle from the x axis [deg]; of the coupler, from the given position.
    given : bool
        Whether the linkage is given in a position of this circuit.
    joined : bool
        Whether it crosses the other circuit at the change points: only a guard keeps the linkage from flipping over.
    """

    lead: str
    motion: str
    low: float
    high: float
    given: bool
    joined: bool = False


class PlacedGuide:
    """What all guides have that stand somewhere: a linkage of given pivots with a guided point.

    Attributes
    ----------
    pivots, guided : list
        [[A1, A1*], [A2, A2*]], each [x, y, w], and the guided point [x, y], in one position [the user's unit].
    pole : list of float or None
        Where the linkage is at a change point in that position: the pole of the branch on which it moves.
    unit : str or None
        Of all its lengths: mm, cm, m, in or ft; None if it is not known.
    """

    pivots: list[list[list[float]]]
    guided: list[float]
    pole: list[float] | None
    unit: str | None
    meanings: ClassVar[Mapping[str, Column]] = CANDIDATE  #: by whose units its fields are converted

    def __hash__(self) -> int:
        return hash(tuple(np.ravel(self.pivots).tolist()))

    def in_unit(self, unit: str | None) -> Self:
        """Return the guide with all its lengths in another unit; where none is known, they are taken to be in it.

        None leaves it as it is.  Which fields are lengths, and which powers of them, their columns declare.

        Raises
        ------
        InvalidRequest
            If there is no such unit.
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
        """The linkage, in the position given."""
        return Linkage(self.pivots)

    @cached_property
    def lengths(self) -> dict[str, float]:
        """Lengths of the links and place of the guided point in the coupler, by name; see `kinematics.link_lengths`.
        What is `ROUNDING` of the longest is 0."""
        from ..kinematics.link_lengths import link_lengths

        pivots = np.asarray(self.pivots, float)
        finite = pivots[..., 2] == 1
        _, power = np.frexp(np.abs(pivots[finite][:, :2]).max())
        unit = np.ldexp(1.0, min(int(power), 1022))  # in which squares are numbers, of strokes of 1e300 too
        pivots[finite, :2] /= unit
        found = link_lengths(Linkage(pivots), np.array([complex(*self.guided) / unit]))
        told = {name: float(unit * value[0]) for name, value in found.items()}
        least = ROUNDING * max(map(abs, told.values()))
        return {name: 0.0 if abs(value) <= least else value for name, value in told.items()}

    @property
    def circuits(self) -> list[Circuit]:
        """All circuits; that of the given position first."""
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
        """Whether the chain just closes, in one position only."""
        return bool(circuits(self.linkage).is_immobile.any())

    @property
    def dead_points(self) -> dict[str, list[float]]:
        """Angles of each crank from the x axis at which it is at a dead point, where it cannot drive [deg, 0 to
        360), on all circuits."""
        return _stops(self.linkage, dead=True)

    @property
    def change_points(self) -> dict[str, list[float]]:
        """Angles of each crank from the x axis at which all pivots lie on one line, and the linkage may change its
        branch [deg, 0 to 360)."""
        return _stops(self.linkage, dead=False)

    def motion(
        self, samples: int = SAMPLES, *, points: Mapping[str, Any] | None = None, driver: int | None = None
    ) -> GuideMotion:
        """Return the motion over the whole circuit of the given position, beginning and ending there; from infinity to
        infinity where the coupler leads there.

        Parameters
        ----------
        samples : int
            Positions, 2 at least.  They are even in the phase, of a crank that turns fully in its angle, but crowd
            where something runs more than four times as far from one to the next as it does on average.  So no point
            runs farther from one to the next than 8/(samples - 1) of its whole way, no link turns farther than that
            part of its whole turn; than (4 + k)/(samples - 1) where k points and links move.
        points : mapping of str to (x, y), optional
            Further coupler points by name, where they are in the given position.
        driver : int, optional
            Number of the crank that drives, 1 or 2; 0: the coupler.  If not given that which leads, see `circuits`.

        Raises
        ------
        InvalidRequest
            If a point is no pair of numbers, there is no such crank, samples are fewer than 2 or more than a
            million, or the chain cannot move.
        """
        found = circuits(self.linkage)[:1]
        if found.is_immobile.any():
            raise InvalidRequest(IMMOBILE)
        run = Run.whole(self, found, points)
        return run.motion(run.rows(sampled(samples)), driver)

    def run(
        self,
        *,
        whole: bool = False,  # noqa: ARG002  # what has no stroke always runs over its circuit
        points: Mapping[str, Any] | None = None,
    ) -> Run:
        """Return the run that a drawing shows: over the stroke, or where there is none, or the `whole` is asked for,
        over the circuit; of one that leads to infinity the part that is near.

        Raises
        ------
        InvalidRequest
            As of `motion`.
        """
        return Run.whole(self, circuits(self.linkage)[:1], points).near()

    def drawn_motion(
        self, samples: int, *, whole: bool = False, points: Mapping[str, Any] | None = None
    ) -> tuple[GuideMotion, bool]:
        """Return the motion over the `run` at even rows, see `motion`, and whether it ends where it began.

        Raises
        ------
        InvalidRequest
            As of `motion`.
        """
        run = self.run(whole=whole, points=points)
        return run.motion(run.rows(sampled(samples)), getattr(self, "driver", None)), run.closed

    def plot(
        self, file: str | Path | None = None, *, ax: Axes | None = None, moving: bool = False,
        unit: str | None = None, scale: str | None = None,
    ) -> Any:  # fmt: skip
        """Draw the linkage in mid-stroke with ghosts at the ends, its path and the deviation; or let it move.

        What has no stroke is drawn in the position given, with the path over its circuit.

        Parameters
        ----------
        file : path, optional
            PNG, SVG, PDF or GIF by its suffix; a GIF moves.  The same guide gives the same file.
        ax : matplotlib.axes.Axes, optional
            Axes into which the linkage and its path are drawn instead, to one scale in both directions.
        moving : bool
            Whether an SVG moves: it needs no script and no matplotlib, and has check boxes for pole, inflection circle,
            cubics, centrodes, velocity.
        unit : str, optional
            To which the guide is converted, as in `export`; where none is known a moving SVG takes its lengths as
            millimetres and says so, a still names none.
        scale : str, optional
            Of a moving SVG in true millimetres, as ``1:2``; the largest usual one that fits a sheet if not given.

        Returns
        -------
        matplotlib.figure.Figure or None
            Of its own: pyplot does not know it, and no display is needed.  None for what moves.

        Raises
        ------
        InvalidRequest
            If the suffix is none of these, the folder does not exist or cannot be written, there is no such unit or
            scale, or the linkage does not lead its guided point over the whole stroke.
        MissingExtra
            Without matplotlib: ``pip install "mechanism-catalogue[plot]"``.
        """
        from ..draw import draw

        return draw(self, file, ax=ax, moving=moving, unit=unit, scale=scale, code=self.code)

    def _repr_html_(self) -> str | None:
        """What a notebook shows: the guide moves."""
        from ..draw.cards import guide_html

        with suppress(InvalidRequest):
            return guide_html(self)
        return None

    def _repr_svg_(self) -> str | None:
        """The same for what shows no HTML."""
        from ..draw import moving_svg

        with suppress(InvalidRequest):
            return moving_svg(self, layers=("names",))
        return None

    def _repr_png_(self) -> bytes | None:
        """A still for what shows neither; None without matplotlib."""
        from ..draw.cards import guide_png

        with suppress(InvalidRequest):
            return guide_png(self)
        return None

    def plot_curves(self, file: str | Path | None = None, *, unit: str | None = None) -> Figure:
        """Draw deviation, speed of the guided point, transmission angle and mechanical advantage over the drive; of a
        dwell the angle of the rocker too.

        Parameters
        ----------
        file : path, optional
            PNG, SVG or PDF by its suffix.
        unit : str, optional
            To which the guide is converted, as in `plot`.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InvalidRequest, MissingExtra
            As of `plot`.
        """
        from ..draw.curves import draw_curves

        return draw_curves(self, file, unit=unit)

    def sheet(self, file: str | Path, *, paper: str = "a4", unit: str | None = None, scale: str | None = None) -> None:
        """Write a data sheet of one page: the drawing to a stated scale, lengths and pivots with tolerances from the
        allowance, limits, curves over the drive, theory and provenance.

        Parameters
        ----------
        file : path
            PDF or HTML by its suffix; in HTML the guide moves, and no matplotlib is needed.
        paper : str
            ``a4`` or ``letter``.
        unit : str, optional
            To which the guide is converted, as in `export`; where none is known, lengths are taken as millimetres, and
            the sheet says so.
        scale : str, optional
            Of the drawing in true millimetres, as ``1:2``; the largest usual one that fits if not given.

        Raises
        ------
        InvalidRequest
            If there is no such paper, unit or scale, or as of `plot`.
        MissingExtra
            For a PDF, as of `plot`.
        """
        from ..draw.datasheet_file import sheet

        sheet(self, file, paper=paper, unit=unit, scale=scale)

    @property
    def code(self) -> str:
        """Letters and digits that tell this guide from all others; by them it is picked up again once it has been
        remembered, see `Results.remember`."""
        from .answers import record, text_of
        from .codes import code_of

        return code_of(text_of(record(self)))

    def measure(self, **asked: Any) -> Measured:
        """Return where the guided point runs straightest, or nearest to a circle; see `catalogue.measure`."""
        from .measure import measure

        return measure(self, **asked)

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
        """Return the guide for CAD or another program, and write it to a file if one is named, in place of one there.

        Parameters
        ----------
        file : path, optional
            Its suffix names the format, if that is not given: ``.dxf``, ``.json``, ``.csv``, ``.xlsx``, ``.parquet``,
            ``.txt`` (solidworks), ``.FCMacro`` (freecad), ``.step``, ``.py`` (pylinkage).
        format : str, optional
            ``dxf``: linkage, path, dimensions and parts to cut.  ``json``: all that is known, which the commands read.
            ``csv``, ``xlsx``, ``parquet``: the motion as a table.  ``solidworks``, ``fusion``: parameters by name.
            ``step``: the parts as solids.  ``freecad``, ``pylinkage``: scripts.
        unit : str, optional
            To which the guide is converted: mm, cm, m, in or ft; of a guide without a unit, that of its lengths.  If
            not given that of the guide.  Where neither has one, ``dxf``, ``step``, ``freecad``, ``solidworks`` and
            ``fusion`` take its lengths as millimetres and say so; the others name no unit.
        bar_width, hole : float, optional
            Width of the bars, diameter of the holes [that unit].
        positions, columns, over
            Rows of the table of the motion; its columns by the beginnings of their headings; ``stroke`` or ``circuit``.

        Returns
        -------
        str or bytes
            What was written; a workbook and Parquet are bytes.

        Raises
        ------
        InvalidRequest
            If the format is not known, the file cannot be written, holes meet, or the guide cannot be given so:
            pylinkage moves four-bars and slider-cranks, away from change points.
        MissingExtra
            Without what the format needs: ``pip install "mechanism-catalogue[cad]"``, ``[parquet]`` or ``[step]``.
        """
        from ..export import export

        how = {"bar_width": bar_width, "hole": hole, "positions": positions, "columns": columns, "over": over}
        return export(self, file, format, unit=unit, **how)

    def improve(self, request: Request, **how: Any) -> Improvement:
        """Return the guide as it is, refined, and beside the best of a catalogue; see `catalogue.improve`."""
        from .improve import improve

        return improve(self, request, **how)


def _stops(linkage: Linkage, *, dead: bool) -> dict[str, list[float]]:
    """Return by crank the angles from the x axis at which it is dead, or at a change point [deg]."""
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
