"""``catalogue serve``: the page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .find import circular_arc, request_from, straight_line, to_keywords
from .options import DB, PLUGINS, option, switch

if TYPE_CHECKING:
    from ..problem.request import Request
    from ..web.wish import Form


@click.command(
    params=[
        option("--port", "N", "Port on loopback; 0: any that is free.", int, default=8095),
        switch("--browser", "Open the page in the browser."),
        DB,
        PLUGINS,
    ]
)
def serve(port: int, browser: bool, db: Path | None, plugins: Sequence[str]) -> None:
    """Serve the page: a form with the constraints of `find`, answers that move, own linkages dragged, exports.

    Open the address that is printed: its token lets your browser in, and nobody else on this machine. The database is
    only read, and nothing is fetched from anywhere.

    \b
    catalogue serve
    """
    from ..api import open
    from ..web.server import serve as served

    with open(db, plugins=plugins) as catalogue:
        path, form = catalogue.database.path, wish_form([*catalogue.registry.series])
    served(path, form, plugins, port, browser=browser)


def wish_form(series: Sequence[str]) -> Form:
    """Return the form of the commands that find guides along a path; what there is to choose from besides."""
    from ..kinematics.linkage import FAMILIES
    from ..problem.criteria import CRITERIA
    from ..web.wish import Form

    choices = {"family": tuple(FAMILIES), "series": tuple(series), "rank_by": CRITERIA}
    return Form({"straight-line": straight_line, "circular-arc": circular_arc}, asked, choices)


def asked(command: str, options: dict[str, Any]) -> tuple[Request, dict[str, Any]]:
    """Return the request and the keywords of `Catalogue.find` that the options of a command say."""
    request = request_from(options, curved=command == "circular-arc")
    to_keywords(options)
    return request, options
