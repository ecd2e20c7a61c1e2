"""``catalogue serve``: serve the page in a browser."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .find import circular_arc, request_from, straight_line, to_keywords
from .options import DB, PLUGINS, option, switch

if TYPE_CHECKING:
    from ..problem.path import PathRequest
    from ..web.wish import Form


@click.command(
    params=[
        option("--port", "N", "Port on this machine; 0: any free one.", int, default=8095),
        switch("--browser", "Open the page in the browser."),
        DB,
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


def asked(command: str, options: dict[str, Any]) -> tuple[PathRequest, dict[str, Any]]:
    """Convert the options of a command to a request and keywords of `Catalogue.find`."""
    request = request_from(options, curved=command == "circular-arc")
    to_keywords(options)
    return request, options
