"""Views of a guide in a notebook."""

from __future__ import annotations

from contextlib import suppress

from ..errors import InvalidRequest
from .verbs import verb


class NotebookViews:
    """Views of a guide for notebooks; None where it cannot be drawn."""

    def _repr_html_(self) -> str | None:
        """Return the animated guide with one line of description."""
        with suppress(InvalidRequest):
            html: str = verb("guide_html")(self)
            return html
        return None

    def _repr_svg_(self) -> str | None:
        """Return the animated guide for viewers without HTML."""
        with suppress(InvalidRequest):
            svg: str = verb("moving_svg")(self, layers=("names",))
            return svg
        return None

    def _repr_png_(self) -> bytes | None:
        """Return a still for viewers without SVG; None without matplotlib."""
        with suppress(InvalidRequest):
            png: bytes | None = verb("guide_png")(self)
            return png
        return None
