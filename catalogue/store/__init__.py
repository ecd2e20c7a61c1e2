"""The database of mechanisms: its tables, how it is opened and upgraded, filled in bulk and read by columns.

`models` has the tables, `engine` the connections, `database` the opened file, `bulk` what writes, `guides` and
`columns` what reads, `prepared` selects that run many times, `upgrade` the migrations, `errors` what can befall a file.
Import from the room itself what it lists, the tables too; it imports `kinematics` (array types), `folders`, `errors`.
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
from .database import Database
from .guides import COLUMNS, joined
from .models import Base, Batch, Guide, Mechanism, Reach, Setting, SpecimenRow
from .prepared import Prepared
from .settings import get_setting, set_setting

__all__ = [
    "COLUMNS",
    "Base",
    "Batch",
    "Database",
    "Guide",
    "Mechanism",
    "Prepared",
    "Reach",
    "Setting",
    "SpecimenRow",
    "drop_indexes",
    "finish",
    "get_setting",
    "is_indexed",
    "joined",
    "make_indexes",
    "prepare",
    "remove_batches",
    "remove_named_guides",
    "set_setting",
    "write_batch",
]
