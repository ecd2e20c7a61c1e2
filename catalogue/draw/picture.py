"""Draw a guide as a picture or a film, to a file or into axes."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import InvalidRequest, quoted
from ..given import switch
from ..paper import FORMATS, kind_of, write, write_bytes
from .moving_file import moving_file
from .pen_machine import pen_ground, pen_pose
from .symbols import Pen

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..guides.kinds import Guide

#: Formats of a drawing; a GIF is always animated.
KINDS = (*FORMATS, "gif")


class Film(NamedTuple):
    """Size and pace of a film."""

    width: float = 6.0  #: width [inch]
    tall: float = 1.0  #: largest height over width
    dpi: int = 100  #: resolution [dots per inch]
    pace: int = 80  #: duration of a pose [ms]
    shortest: int = 20  #: shortest duration of an intermediate pose [ms]: viewers show no shorter ones
    #: Largest error of linear interpolation between two pictures [extent of the part's motion,
    #: rad]: no part visibly jumps.
    error: float = 0.02


FILM = Film()


def check(file: str | Path, *, moving: bool = False) -> str:
    """Check the file of a drawing before any work, and return its format.

    Raises
    ------
    InvalidRequest
        If the format is unknown or cannot be animated, or the folder does not exist.
    """
    kind = kind_of(file, KINDS)
    if moving and kind not in ("svg", "gif"):
        raise InvalidRequest(f"a .{kind} cannot move: choose .svg or .gif")
    return kind


def draw(
    guide: Guide,
    file: str | Path | None = None,
    *,
    ax: Axes | None = None,
    moving: bool = False,
    unit: str | None = None,
    scale: str | None = None,
    code: str = "",
) -> Any:
    """Draw a guide; see `catalogue.Candidate.plot`."""
    moving, guide = switch("moving", moving), guide.in_unit(unit)
    if ax is not None:
        if not hasattr(ax, "set_xlim"):
            raise InvalidRequest(f"ax must be axes of matplotlib, not {quoted(ax)}")
        from .sheet import onto

        if file is not None or moving:
            raise InvalidRequest("a drawing goes into axes or into a file: give one of them")
        onto(ax, guide)
        return ax.get_figure()
    kind = None if file is None else check(file, moving=moving)
    if moving and file is None:
        raise InvalidRequest("say to which file the moving drawing is to be written, .svg or .gif")
    if file is not None and kind == "svg" and moving:
        write_bytes(moving_file(guide, scale=scale, code=code).encode(), Path(file))
        return None
    if scale is not None:
        raise InvalidRequest("only a moving SVG and a data sheet are drawn to a scale")
    if file is not None and kind == "gif":
        write_bytes(film(guide), Path(file))
        return None
    from .sheet import sheet

    figure = sheet(guide)
    if file is not None and kind is not None:
        write(figure, Path(file), kind)
    return figure


def film(guide: Guide) -> bytes:
    """Draw an animated GIF of a guide, to and fro or round and round."""
    from ..paper import blank
    from .moving import compute_poses

    taken = compute_poses(guide, error=FILM.error)
    shown = taken.machine
    x0, y0, x1, y1 = shown.box
    border = 0.45
    inch = max((x1 - x0) / (FILM.width - 2 * border), (y1 - y0) / (FILM.tall * FILM.width - 2 * border))
    height = (y1 - y0) / inch + 2 * border
    figure = blank(FILM.width, height)
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.set_xlim(0.5 * (x0 + x1 - FILM.width * inch), 0.5 * (x0 + x1 + FILM.width * inch))
    axes.set_ylim(0.5 * (y0 + y1 - height * inch), 0.5 * (y0 + y1 + height * inch))
    pen = Pen(axes, inch / 72)
    pen_ground(pen, shown)
    standing = set(axes.get_children())
    figure.set_dpi(FILM.dpi)
    canvas = FigureCanvasAgg(figure)
    frames = []
    for pose in range(len(taken.time)):
        pen_pose(pen, shown, pose)
        canvas.draw()  # type: ignore[no-untyped-call]  # matplotlib has no types here
        dots = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]  # nor here
        frames.append(Image.fromarray(dots).convert("RGB"))
        for artist in set(axes.get_children()) - standing:
            artist.remove()
    colours = frames[0].quantize(64)
    frames = [frame.quantize(palette=colours, dither=Image.Dither.NONE) for frame in frames]
    steps = (
        np.maximum(np.diff(taken.time) / np.diff(taken.time).max() * FILM.pace, FILM.shortest)
        .round()
        .astype(int)
        .tolist()
    )
    order, duration = (frames[:-1], steps) if taken.closed else (frames + frames[-2:0:-1], steps + steps[::-1])
    out = io.BytesIO()
    order[0].save(out, "gif", save_all=True, append_images=order[1:], duration=duration, loop=0, optimize=False)
    return out.getvalue()
