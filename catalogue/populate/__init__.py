"""Filling the database: draw linkages of each series, trace what they guide, keep what is in proportion.

`fill` drives, `plan` shares out, `workers` runs blocks in processes; of a block, `elements` chooses what is worth
tracing, `cover` what is kept, `rows` measures; `named_guides` adds those of the literature, `collect` the specimens of
collections.  Import `fill` and `Progress` from the room, the rest from the modules; they import `plugin`, `series`,
`store` and what lies below.
"""

from .fill import Progress, fill

__all__ = ["Progress", "fill"]
