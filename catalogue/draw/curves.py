"""Curves over the drive: deviation, speed, transmission angle, mechanical advantage."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..guides.kinds import has_bars, has_stroke
from ..kinematics.types import Floats
from ..paper import COUPLER, FAINT, GREY, INK, PATH, SANS, SERIF, blank, kind_of, write
from ..units import LENGTH
from .poses import output
from .words import describe_guide, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..guides.kinds import Guide
    from ..guides.own_chain import OwnChain
    from ..guides.placed import PlacedGuide

#: Positions of a curve: every half degree of a full turn.
SAMPLES = 721


class CurveLayout(NamedTuple):
    """Layout of the figure of curves [inch]."""

    width: float = 8.0  #: width of the figure
    left: float = 0.85  #: left margin
    right: float = 0.35  #: right margin
    title: float = 0.75  #: height of the title
    height: float = 1.25  #: height of a curve
    labels: float = 0.55  #: height of its labels
    #: Largest drawn value over the median: an advantage is unbounded near a dead point.
    tallest: float = 6.0


LAYOUT = CurveLayout()

#: Unit of angles.
DEGREES = "°"


class Curve(NamedTuple):
    """One quantity over the drive."""

    name: str  #: name with unit
    values: Floats
    colour: str
    zero: bool  #: whether the axis begins at zero


class Drive(NamedTuple):
    """The drive from the start of a motion: its quantity, bar and unit."""

    what: str
    of: str
    unit: str
    values: Floats

    @property
    def name(self) -> str:
        """Text for an axis."""
        return f"{self.what} of {self.of} from the start"

    @property
    def label(self) -> str:
        """Text for an axis, with unit."""
        return f"{self.name} [{self.unit}]"

    @property
    def mark(self) -> str:
        """Unit or sign that follows a value."""
        return self.unit if self.unit == DEGREES else f" {self.unit}"


def curves(guide: Guide) -> tuple[Drive, list[Curve]]:
    """Compute the curves of a guide in its unit, over its drive."""
    return _chain_curves(guide) if has_bars(guide) else _linkage_curves(guide)


def _chain_curves(one: OwnChain) -> tuple[Drive, list[Curve]]:
    """Compute speed and transmission angle of many bars; for a stretch the deviation too."""
    moved = one.motion(SAMPLES)
    found = []
    if has_stroke(one):
        unit = f" [{one.unit}]" if one.unit else ""
        found = [Curve(f"deviation{unit}", one.deviations(moved.points[one.point]), PATH, False)]
    per = "1" if moved.pushed else f"{one.unit or LENGTH}/rad"
    found.append(Curve(f"speed of {one.point} [{per}]", np.abs(moved.velocities[one.point]), COUPLER, True))
    if one.chain.structure.dyads:
        found.append(Curve("transmission angle [°]", moved.transmission, INK, True))
    what = "way" if moved.pushed else "angle"
    unit = one.unit or LENGTH if moved.pushed else DEGREES
    return Drive(what, one.drive, unit, moved.drive - moved.drive[0]), _with_finite_values(found)


def _with_finite_values(found: list[Curve]) -> list[Curve]:
    return [one for one in found if np.isfinite(one.values).any()]


def _linkage_curves(guide: PlacedGuide) -> tuple[Drive, list[Curve]]:
    moved, _ = guide.drawn_motion(SAMPLES)
    drive = moved.drive - moved.drive[0]
    length = f" [{guide.unit}]" if guide.unit else ""
    found = [Curve(f"deviation{length}", moved.deviation, PATH, False)]
    joint, pivot = output(guide, moved.points["guided"])
    if joint is not None:
        angle = np.degrees(np.unwrap(np.angle(joint - pivot)))
        found.append(Curve("angle of the rocker [°]", angle - angle[0], PATH, False))
        between = np.sin(np.angle((moved.points["guided"] - joint) / (pivot - joint)))
        found.append(Curve("transmission angle of the rod [°]", np.degrees(np.arcsin(np.abs(between))), INK, True))
    found += [
        Curve(
            f"speed of the guided point [{guide.unit or LENGTH}/rad]", np.abs(moved.velocities["guided"]), COUPLER, True
        ),
        Curve("transmission angle [°]", moved.transmission, INK, True),
        Curve("mechanical advantage", moved.advantage, GREY, True),
    ]
    name = f"crank {moved.driver}" if moved.driver else "the coupler"
    return Drive("angle", name, DEGREES, drive), _with_finite_values(found)


def draw_curves(guide: Guide, file: str | Path | None = None, *, unit: str | None = None) -> Figure:
    """Draw the curves of a guide; see `catalogue.Candidate.plot_curves`."""
    kind = None if file is None else kind_of(file)
    guide = guide.in_unit(unit)
    drive, shown = curves(guide)
    total = LAYOUT.title + LAYOUT.height * len(shown) + LAYOUT.labels
    figure = blank(LAYOUT.width, total)
    title = describe_guide(guide)
    figure.text(
        LAYOUT.left / LAYOUT.width,
        1 - 0.45 / total,
        title,
        family=SERIF,
        size=13,
        color=INK,
        gid="title",
        parse_math=False,
    )
    wide = (LAYOUT.width - LAYOUT.left - LAYOUT.right) / LAYOUT.width
    for k, one in enumerate(shown):
        low = (LAYOUT.labels + LAYOUT.height * (len(shown) - 1 - k)) / total
        axes = figure.add_axes(
            (LAYOUT.left / LAYOUT.width, low, wide, 0.68 * LAYOUT.height / total), gid=one.name.split(" [")[0]
        )
        panel(axes, drive.values, one, labelled=k == len(shown) - 1)
        if k == len(shown) - 1:
            axes.set_xlabel(drive.label, family=SANS, size=8, color=INK)
    if file is not None and kind is not None:
        write(figure, Path(file), kind)
    return figure


def panel(axes: Axes, drive: Floats, curve: Curve, *, labelled: bool = True, size: float = 8.0) -> None:
    """Draw one curve over the drive into its axes."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    values = curve.values
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    if curve.zero:
        low, high = 0.0, min(high, LAYOUT.tallest * float(np.nanmedian(values))) * 1.08
    spare = 0.0 if curve.zero else 0.08 * (high - low)
    spare = spare if high > low else max(abs(high), 1e-12)
    axes.set_facecolor("none")
    axes.axhline(0, color=FAINT, linewidth=0.8, zorder=1)
    axes.plot(drive, np.where(values > high + spare, np.nan, values), color=curve.colour, linewidth=1.5, zorder=3)
    axes.set_xlim(min(drive[0], drive[-1]), max(drive[0], drive[-1]))
    axes.set_ylim(low - spare, high + spare)
    axes.set_title(curve.name, loc="left", family=SANS, size=size, color=INK, pad=4)
    axes.yaxis.set_major_locator(MaxNLocator(3))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: plain(value)))
    axes.xaxis.set_major_locator(MaxNLocator(8, steps=[1, 1.5, 2, 3, 4.5, 6, 9, 10]))
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("bottom", "left"))
        spine.set(color=GREY, linewidth=0.8)
    axes.tick_params(labelsize=size - 0.5, labelcolor=GREY, color=GREY, width=0.8, length=3, labelfontfamily=SANS)
    axes.tick_params(axis="x", labelbottom=labelled)
