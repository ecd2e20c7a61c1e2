"""One answer from a collection, as users see it."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import CatalogueError, PluginError
from ..foreign_code import foreign
from ..kinematics.types import Complexes
from .spec import COLUMNS, Collection, Parameters


@dataclass(frozen=True, eq=False)
class CollectionCandidate:
    """A verified mechanism of a collection, with its path from the origin along +x.

    Attributes
    ----------
    id : int
        Number of the stored specimen; 0 for one made for the request.
    family, series, configuration : str
    special : tuple of str
        Names of the well-known cases to which it belongs.
    stroke, deviation : float
        Stroke, and deviation from the line or circle over it on the finite motion [length].
    radius : float or None
        Radius of the circle; None for a straight line.
    metrics : dict
        Metrics of the collection; lengths in the user's unit.
    parameters : mapping
        All parameters of the mechanism, placed along +x from the origin.
    unit : str or None
        Unit of all lengths: mm, cm, m, in or ft; None if unknown.
    start, along : (float, float), float
        Start [length] and direction [deg] of the path of a planar mechanism; its parameters
        describe it with the path along +x from the origin.
    reverse, over : bool
        Whether a planar mechanism is mirrored across the middle of the path, in the line of the
        path.
    """

    id: int
    collection: Collection = field(repr=False)
    family: str
    series: str
    configuration: str
    special: tuple[str, ...]
    stroke: float
    deviation: float
    radius: float | None
    metrics: dict[str, float]
    parameters: Parameters = field(repr=False)
    unit: str | None = None
    start: tuple[float, float] = (0.0, 0.0)
    along: float = 0.0
    reverse: bool = False
    over: bool = False

    @property
    def is_placed(self) -> bool:
        """Whether its path does not run along +x from the origin."""
        return any(self.start) or bool(self.along)

    @property
    def is_mirrored(self) -> bool:
        """Whether it is a mirror image of the mechanism of its parameters."""
        return self.reverse != self.over

    def turned(self, u: Complexes) -> Complexes:
        """Rotate directions from the frame of the parameters to that of the requested path."""
        seen = np.conj(u) if self.is_mirrored else u
        return np.asarray((-seen if self.reverse else seen) * np.exp(1j * np.radians(self.along)))

    def placed(self, z: Complexes) -> Complexes:
        """Move places from the frame of the parameters to that of the requested path [length]."""
        start = complex(*self.start) + self.turned(np.array(-self.stroke if self.reverse else 0.0))
        return np.asarray(start + self.turned(z))

    def to_dict(self) -> dict[str, Any]:
        """Convert to plain numbers, lists and strings, a column for each metric."""
        own = {name: getattr(self, name) for name in COLUMNS}
        own |= {"collection": self.collection.name, "special": list(self.special)}
        own |= {"start": list(self.start), "along": self.along} if self.is_placed else {}
        own |= {name: True for name in ("reverse", "over") if getattr(self, name)}
        parameters = own.pop("parameters")
        return {**own, **self.metrics, "parameters": dict(parameters)}

    def plot(self, file: str | Path | None = None) -> Any:
        """Draw the mechanism, into a PNG, SVG or PDF file if given, and return the figure."""
        lent = replace(self, metrics=dict(self.metrics), parameters=deepcopy(self.parameters))
        try:
            with foreign(f"collection {self.collection.name}"):
                return self.collection.plot(lent, Path(file) if file is not None else None)
        except PluginError as error:
            if isinstance(cause := error.__cause__, CatalogueError):  # an invalid suffix, or a missing package
                raise cause from None
            name, origin = self.collection.name, self.collection.origin
            raise PluginError(f"collection {name} cannot be drawn: {error} ({origin})") from error
