"""The database of mechanisms: tables, upgrades, bulk filling, reading by columns.

`models` has the tables, `engine` connections and migrations, `database` the opened file, `bulk` the
writing functions, `schema` the description in a file, `extract` a small file of some guides. Import
the listed names, tables included, from the room itself; it imports `kinematics` (array types),
`folders`, `errors`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .database import JOINED, PIVOT_NAMES, Database, stacked_pivots

if TYPE_CHECKING:
    from .bulk import (
        drop_indexes,
        finish,
        is_indexed,
        make_indexes,
        prepare,
        remove_batches,
        remove_named_guides,
        write_batch,
    )
    from .models import COLUMNS, PIVOTS, Base, Batch, Guide, Mechanism, Reach, Setting, SpecimenRow, joined

#: Modules of the names that need SQLAlchemy, loaded when first used.
_HOME = {
    "bulk": "drop_indexes finish is_indexed make_indexes prepare remove_batches remove_named_guides write_batch",
    "models": "COLUMNS PIVOTS Base Batch Guide Mechanism Reach Setting SpecimenRow joined",
}

__all__ = [
    "COLUMNS",
    "JOINED",
    "PIVOTS",
    "PIVOT_NAMES",
    "Base",
    "Batch",
    "Database",
    "Guide",
    "Mechanism",
    "Reach",
    "Setting",
    "SpecimenRow",
    "drop_indexes",
    "finish",
    "is_indexed",
    "joined",
    "make_indexes",
    "prepare",
    "remove_batches",
    "remove_named_guides",
    "stacked_pivots",
    "write_batch",
]


def __getattr__(name: str) -> Any:
    for home, names in _HOME.items():
        if name in names.split():
            return getattr(import_module(f".{home}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
