"""Spatially guided bodies as a collection of the catalogue."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from catalogue.plugin import Collection

from .classification import SPECIAL, classify
from .draw import COINCIDENCES, draw
from .measures import METRICS, measure
from .refine import refine

if TYPE_CHECKING:
    from catalogue.plugin import CollectionCandidate


def plot(piece: CollectionCandidate, file: Path | None) -> Any:
    """Draw a mechanism; see `picture`."""
    from .picture import picture

    return picture(piece, file)


COLLECTION = Collection(
    name="spatial-guidance",
    title="Bodies guided in space by points on surfaces and curves",
    source="Mangeron, Oğuztöreli and Plitea 1970",
    plan="2",
    families={family: tuple(series) for family, series in COINCIDENCES.items()},
    metrics=METRICS,
    draw=draw,
    measure=measure,
    classify=classify,
    plot=plot,
    special=SPECIAL,
    refine=refine,
    specimens=1000,
    block=80,
)
