"""Write the report of a motion as one HTML file: picture, curves, values and their meaning."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from ...errors import InvalidRequest
from ...folders import is_folder
from ...html_table import html_table
from ...markup import Markup, element, join
from ...paper import write_bytes
from .columns import GROUPS, REMARK

if TYPE_CHECKING:
    from .job import Job
    from .motion import Motion

#: Panels of one picture of curves, the limit of a sheet in `drawing.curves`.
MAX_PANELS = 24
#: Style sheet: one column of text, narrow tables of numbers.
STYLE = (
    "body{font:14px/1.45 sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#20262c}div{overflow-x:auto}"
    "img{width:100%}table{border-collapse:collapse;font-size:12px}"
    "td,th{padding:.15em .6em;border-bottom:1px solid #ccc}"
)


def report(job: Job, motion: Motion, table: pd.DataFrame, file: Path, notes: Sequence[str] = ()) -> None:
    """Write the report of a motion to an HTML file.

    Parameters
    ----------
    job : Job
    motion : Motion
    table : DataFrame
        The columns to show; the drives come first.
    file : path
        Its suffix must be ``.html``.
    notes : sequence of str
        Remarks on the motion: its ends, unused hard points.

    Raises
    ------
    InvalidRequest
        If the file cannot be written.
    MissingExtra
        Without matplotlib.
    """
    if file.suffix.lower() not in (".html", ".htm") or not is_folder(file.parent):
        raise InvalidRequest(f"a report is an HTML file in a folder that is there, not {file}")
    axes = f", axes of the points {job.wheel.axes}" if job.wheel else ""
    parts = [
        element("h1", job.title),
        element("p", f"{len(motion.drive)} positions; lengths in {job.mechanism.unit}{axes}."),
        *(element("p", note) for note in notes),
        _picture(job.plot(motion), "mechanism"),
    ]
    if not motion.others:
        curves = table[[name for name in table if not str(name).startswith(("screw axis", "pitch", "drive"))]]
        drawn = [motion.plot_curves(curves.iloc[:, k : k + MAX_PANELS]) for k in range(0, curves.shape[1], MAX_PANELS)]
        parts += [_picture(figure, "curves over the drive") for figure in drawn]
    rows = [[f"{v:.6g}" if isinstance(v, float) else v for v in row] for row in table.itertuples(index=False)]
    parts.append(element("div", html_table([f">{name}" for name in table], rows)))
    shown = [str(column).partition(" [")[0] for column in table]
    for title, group in GROUPS.items():
        known = [(k, m) for k, (_, m) in group.items() if any(f" {name}".endswith(f" {k}") for name in shown)]
        if known:
            parts += [element("h2", title), html_table(["column", "meaning"], known)]
    if job.wheels:
        parts.append(element("p", REMARK))
    head = element("head", element("meta", charset="utf-8"), element("title", job.title), element("style", STYLE))
    page = element("html", head, element("body", *parts), lang="en")
    write_bytes(b"<!DOCTYPE html>\n" + page.encode(), file)


def _picture(figure: Any, what: str) -> Markup:
    data = b64encode(figure._repr_png_()).decode()
    return join([element("img", src=f"data:image/png;base64,{data}", alt=what)])
