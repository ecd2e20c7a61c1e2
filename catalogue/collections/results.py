"""Answers from a collection as users see them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from .spec import COLUMNS, Collection, Parameters

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class CollectionCandidate:
    """A verified mechanism of a collection, laid so that its path begins at the origin and ends on +x at the stroke.

    Attributes
    ----------
    id : int
        Of the stored specimen.
    family, series, configuration : str
    special : tuple of str
        Well-known cases that it is one of.
    stroke, deviation : float
        Deviation from the line or circle, measured on the finite motion over the stroke, in the user's unit.
    radius : float or None
        Of the circle; None for a straight line.
    metrics : dict
        What the collection measures; lengths in the user's unit.
    parameters : mapping
        All of the mechanism, as laid.
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

    def to_dict(self) -> dict[str, Any]:
        """Return the candidate as plain Python numbers, lists and strings, a column for each metric."""
        own = {name: getattr(self, name) for name in COLUMNS}
        own |= {"collection": self.collection.name, "special": list(self.special)}
        parameters = own.pop("parameters")
        return {**own, **self.metrics, "parameters": dict(parameters)}

    def plot(self, file: str | Path | None = None) -> Any:
        """Draw it, to a PNG, SVG or PDF by the suffix of the file if there is one, and return the figure."""
        return self.collection.plot(self, Path(file) if file is not None else None)


@dataclass(frozen=True, eq=False)
class CollectionResults(Sequence[CollectionCandidate]):
    """The answer of a collection to a request: candidates, best first."""

    collection: Collection
    pieces: list[CollectionCandidate]
    explanation: Callable[[], str] = field(repr=False)

    def __len__(self) -> int:
        return len(self.pieces)

    def __iter__(self) -> Iterator[CollectionCandidate]:
        return iter(self.pieces)

    @overload
    def __getitem__(self, index: int) -> CollectionCandidate: ...
    @overload
    def __getitem__(self, index: slice) -> list[CollectionCandidate]: ...
    def __getitem__(self, index: int | slice) -> CollectionCandidate | list[CollectionCandidate]:
        return self.pieces[index]

    @property
    def columns(self) -> list[str]:
        """Names of what each candidate is printed as."""
        return [*COLUMNS[:-1], *self.collection.metrics, COLUMNS[-1]]

    def to_pandas(self) -> pd.DataFrame:
        """Return one row per candidate."""
        import pandas as pd

        return pd.DataFrame([p.to_dict() for p in self.pieces], columns=self.columns)

    def to_json(self) -> str:
        """Return a JSON list of the candidates."""
        return json.dumps([p.to_dict() for p in self.pieces], indent=1, allow_nan=False)

    def explain(self) -> str:
        """Say how the answer came about; for an empty one which bound excluded the most, and the nearest miss."""
        return self.explanation()
