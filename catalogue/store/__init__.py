"""The database of mechanisms: its tables, how it is opened and upgraded, filled in bulk and read by columns.

`models` has the tables, `engine` connections and migrations, `database` the opened file, `bulk` what writes, `schema`
what a file says of itself, `extract` a small file of some guides.  Import from the room itself what it lists, the
tables too; it imports `kinematics` (array types), `folders`, `errors`.
"""

from __future__ import annotations

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
from .database import COLUMNS, Database, joined, stacked_pivots
from .models import PIVOTS, Base, Batch, Guide, Mechanism, Reach, Setting, SpecimenRow

__all__ = [
    "COLUMNS",
    "PIVOTS",
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
