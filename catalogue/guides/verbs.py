"""Verbs of guides: functions of rooms above, imported when first used.

Rooms import only from rooms below. A method of a guide, such as `PlacedGuide.plot`, therefore names
its function here and does not import it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

#: Module of each function.
VERBS: Mapping[str, str] = {
    "cards_html": "draw.cards",
    "draw": "draw.picture",
    "draw_curves": "draw.curves",
    "export": "export",
    "guide_html": "draw.cards",
    "guide_png": "draw.cards",
    "improve": "find.improve",
    "improve_chain": "find.improve_chain",
    "measure": "find.measure",
    "moving_svg": "draw.moving",
    "sheet": "draw.datasheet_file",
    "stretch_of": "find.specimens",
}


def verb(name: str) -> Callable[..., Any]:
    """Return the function of a verb.

    Parameters
    ----------
    name : str
        Name of the function, a key of `VERBS`.

    Returns
    -------
    callable
        Its first argument is the guide, or the data to make one from.

    Examples
    --------
    >>> from catalogue.guides.verbs import verb
    >>> verb("export").__module__
    'catalogue.export.write'
    """
    function: Callable[..., Any] = getattr(import_module(f"..{VERBS[name]}", __package__), name)
    return function
