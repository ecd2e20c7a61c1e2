"""Methods common to all guides: code, measurement, views in a notebook."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

from ..errors import InvalidRequest
from .verbs import verb

if TYPE_CHECKING:
    from .results import Measured


class CommonVerbs:
    """Base of all guides; views in a notebook are None where a guide cannot be drawn."""

    @property
    def code(self) -> str:
        """Code of this guide, by which `catalogue.recall` restores it once stored.

        See `Results.remember`.
        """
        from .codes import code_of, record, text_of

        return code_of(text_of(record(self)))

    def measure(self, **asked: Any) -> Measured:
        """Find the straightest, or most circular, stretches of the guided point.

        Parameters
        ----------
        **asked
            Arguments of `catalogue.measure`.

        Returns
        -------
        Measured
        """
        found: Measured = verb("measure")(self, **asked)
        return found

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
