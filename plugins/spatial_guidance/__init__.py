"""Bodies guided in space by points on surfaces and curves, as a collection.

Mangeron, Oğuztöreli, Plitea 1970.  Guides and kinematics are those of `catalogue.spatial`;
``collection.definition.COLLECTION``, imported on demand, samples, measures, classifies and plots.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from catalogue.plugin import hookimpl

if TYPE_CHECKING:
    from catalogue.plugin import Collection


@hookimpl
def catalogue_collections() -> list[Collection]:
    from .collection.definition import COLLECTION

    return [COLLECTION]
