"""Family of linkages, as a plugin declares it."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import PluginError


@dataclass(frozen=True)
class Family:
    """A family of linkages.

    Attributes
    ----------
    name : str
        Name, such as ``slider-crank``.
    title : str
        Title in one line.
    inverse : str
        Name of the family of its inversions.
    dyads : str
        Kinds of the dyads, such as ``RR.PR``.
    """

    name: str
    title: str
    inverse: str
    dyads: str

    def __post_init__(self) -> None:
        if not (self.name and self.title and self.inverse):
            raise PluginError(f"family {self.name!r}: name, title and inverse must not be empty")
