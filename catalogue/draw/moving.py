"""Animated guides as SVG without a script, for pages and files; no matplotlib is needed.

Links are rotated and translated, never redrawn, so none can stretch; they meet in every pose
because all poses were measured together.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidRequest
from ..guides.kinds import has_bars
from ..markup import NOTHING, Markup, element
from .chain_poses import ChainPoses, chain_poses
from .frame import Frame
from .moving_layers import LAYERS, Layers, layers_of
from .moving_style import STYLE
from .poses import POSE_COUNT, Poses, poses
from .svg import Clock, number
from .svg_machine import svg_machine
from .words import describe_guide

if TYPE_CHECKING:
    from ..guides.kinds import Guide

#: Size of a point of the symbols over the width of a drawing.
POINT = 1 / 340
#: Layers that stand above the machine.
ABOVE = ("pole", "velocity", "names")
_numbers = count(1)


def moving_svg(
    guide: Guide,
    *,
    width: float = 360.0,
    height: float | None = None,
    layers: Collection[str] = (),
    hidden: Collection[str] = (),
    points: Mapping[str, object] | None = None,
    turn: bool = False,
    still: bool = False,
    seconds: float = 5.0,
    count: int | None = None,
    title: str | None = None,
    prefix: str | None = None,
    style: bool = True,
) -> Markup:
    """Draw an animated guide as one self-contained ``<svg>`` element, for a page or a file.

    It moves without a script (SMIL), over its stroke to and fro, or round and round.  In a page,
    ``svg.setCurrentTime(t)`` scrubs it, ``svg.pauseAnimations()`` and ``svg.unpauseAnimations()``
    pause and resume it.  Over a stroke t = 0 is the start of the path, ``seconds`` / 2 its end;
    over a turn the given position is at 0 and ``seconds``.

    Parameters
    ----------
    guide : Guide
        A candidate, a guide of your own or a dwell, or a mechanism of many bars; a guide without a
        stroke moves over its circuit.
    width, height : float
        Size [px].  Default height: as needed, 0.3 to 1 of the width; the drawing is centred.
    layers : collection of str
        Layers besides the linkage and its path, of `LAYERS`: ``pole``, ``circle`` (inflection
        circle), ``cubics`` (circling-point curve on the coupler, centring-point curve on the
        ground, both of the given position), ``centrodes``, ``velocity`` (of the guided point),
        ``turn`` (path over the whole circuit), ``names`` (of the pivots).  Of many bars the last
        three.
    hidden : collection of str
        Layers hidden at first: the class ``hide-NAME`` of the root hides a layer, so
        ``svg.classList.toggle("hide-pole")`` acts as a check box.
    points : mapping of str to (x, y), optional
        Further coupler points with paths to draw, in the given position [length].
    turn : bool
        Cover the whole circuit instead of the stroke.
    still : bool
        Draw the given position without motion.
    seconds : float
        Period [s].
    count : int, optional
        Number of poses; see `poses.poses`.
    title : str, optional
        Title of the drawing (``<title>``, for screen readers and tooltips); default: a description.
    prefix : str, optional
        Prefix of element names, so that a page can hold several drawings; default: a unique one.
    style : bool
        Include the style sheet `STYLE`; a page of several drawings needs it once.

    Returns
    -------
    Markup
        A text.  The root has the class ``guide-drawing``; elements have the classes ``frame``
        (bearings, guide lines), ``path``, ``link`` with ``crank``, ``crank driver``, ``coupler``,
        ``slider``, ``slide``, ``output``, and ``layer`` with the layer's name.  Colours are the
        properties ``--guide-paper``, ``--guide-ink``, ``--guide-grey``, ``--guide-faint``,
        ``--guide-coupler``, ``--guide-coupler-face``, ``--guide-crank``, ``--guide-crank-face``,
        ``--guide-driver``, ``--guide-driver-face``, ``--guide-path``, ``--guide-theory``; where a
        page sets none they are those of the plates on light paper.

    Raises
    ------
    InvalidRequest
        If a layer is unknown or a size not positive; see also `poses.poses`.
    """
    known = layers_of(guide)
    if unknown := [name for name in (*layers, *hidden) if name not in known]:
        raise InvalidRequest(f"there is no layer {unknown[0]!r} of a drawing; there are {', '.join(known)}")
    if not (0 < width < np.inf and (height is None or 0 < height < np.inf) and 0 < seconds < np.inf):
        raise InvalidRequest("width, height and seconds of a drawing must be positive")
    shown = compute_poses(guide, count, turn=turn, points=points)
    frame = Frame.around(shown.machine, width, height, max(0.6, width * POINT))
    clock = Clock(seconds, shown.closed, shown.middle, still, shown.time)
    prefix = f"guide-{next(_numbers)}-" if prefix is None else prefix
    return drawing(guide, shown, frame, clock, layers, hidden, title or describe_guide(guide), prefix, style=style)


def compute_poses(
    guide: Guide,
    count: int | None = None,
    *,
    turn: bool = False,
    points: Mapping[str, Any] | None = None,
    error: float = POSE_COUNT.error,
) -> Poses | ChainPoses:
    """Compute the poses of a guide, or of a mechanism of many bars; see `poses.poses`.

    Raises
    ------
    InvalidRequest
        See `poses.poses`; also if further points of many bars are given.
    """
    if not has_bars(guide):
        return poses(guide, count, turn=turn, points=points, error=error)
    if points:
        raise InvalidRequest("a further point of a mechanism of many bars is a joint on one bar: name it there")
    return chain_poses(guide, count, turn=turn, error=error)


def drawing(
    guide: Guide,
    shown: Poses | ChainPoses,
    frame: Frame,
    clock: Clock,
    layers: Collection[str],
    hidden: Collection[str],
    title: str,
    prefix: str,
    *,
    style: bool = True,
    clip: tuple[float, float] | None = None,
    inside: Markup = NOTHING,
    **root: str,
) -> Markup:
    """Draw poses in a frame, with `inside` on top.

    The theory is clipped between two heights of the paper; `root` holds further attributes of the
    root.
    """
    wanted = [name for name in LAYERS if name in layers]
    every = Layers(guide, shown, frame, clock)
    drawn = {name: every.drawn(name) for name in wanted}
    window, clipped = NOTHING, {}
    if clip is not None:
        place = {"y": number(clip[0]), "height": number(clip[1] - clip[0])}
        window = element("clipPath", element("rect", x="0", width="100%", **place), id=f"{prefix}window")
        clipped = {"clip_path": f"url(#{prefix}window)"}
    below, above = svg_machine(shown.machine, frame, clock)
    size = {"width": number(frame.width), "height": number(frame.height)} | root
    kind = " ".join(["guide-drawing", *(f"hide-{name}" for name in wanted if name in hidden)])
    return element(
        "svg",
        element("title", title, id=f"{prefix}title"),
        element("style", STYLE) if style else NOTHING,
        element("rect", class_="paper", width="100%", height="100%"),
        window,
        element("g", *(drawn[name] for name in wanted if name not in ABOVE), **clipped),
        below,
        above,
        *(drawn[name] for name in wanted if name in ABOVE),
        inside,
        xmlns="http://www.w3.org/2000/svg",
        class_=kind,
        viewBox=f"0 0 {number(frame.width)} {number(frame.height)}",
        role="img",
        aria_labelledby=f"{prefix}title",
        **size,
        style=f"--guide-point:{number(frame.point, 4)}px",
    )


__all__ = ["LAYERS", "STYLE", "Frame", "drawing", "moving_svg"]
