"""``catalogue serve``: serve the page in a browser."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .find import circular_arc, straight_line, whole_request
from .options import DB, PLUGINS, SHARE, option, switch

if TYPE_CHECKING:
    from ..problem.problem import Request
    from ..web.wish import Form


@click.command(
    params=[
        option("--port", "N", "Port on this machine; 0: any free one.", int, default=8095),
        switch("--browser", "Open the page in the browser."),
        DB,
        SHARE,
        PLUGINS,
    ]
)
def serve(port: int, browser: bool, db: Path | None, plugins: Sequence[str]) -> None:
    """Serve a page in the browser: constraints of `find`, animated answers, exports.

    Open the printed address: its token admits your browser and no other user of this machine. The
    database is only read, and the page loads nothing from other hosts.

    \b
    catalogue serve
    """
    from ..api import open
    from ..web.server import serve as served

    with open(db, plugins=plugins) as catalogue:
        path, form = catalogue.database.path, wish_form([*catalogue.registry.series])
    served(path, form, plugins, port, browser=browser)


def wish_form(series: Sequence[str]) -> Form:
    """Return the form of `find straight-line` and `circular-arc`, with choices."""
    from ..kinematics.linkage import FAMILIES
    from ..problem.criteria import CRITERIA
    from ..web.wish import Form

    choices = {"family": tuple(FAMILIES), "series": tuple(series), "rank_by": CRITERIA}
    return Form({"straight-line": straight_line, "circular-arc": circular_arc}, asked, choices)


def asked(command: str, options: dict[str, Any]) -> tuple[Request, tuple[str, ...]]:
    """Convert the options of a command to a request and the codes of its starts."""
    starts = tuple(options.pop("starts"))
    return whole_request(options, curved=command == "circular-arc"), starts
