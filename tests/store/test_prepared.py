"""A prepared select reads what an ordinary one reads, as often as one likes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from sqlalchemy import bindparam, select

from catalogue.store import Database, Guide, Mechanism, Reach, write_batch

COLUMNS = (Reach.guide_id, Reach.level, Reach.size, Reach.min_link, Reach.kind, Mechanism.pivots)


def test_runs_read_what_a_select_reads(database: Database, sample: Callable[..., Any]) -> None:
    with database.engine.connect() as connection:
        write_batch(connection, *sample(0, 30))
    joined = (
        select(*COLUMNS).join(Guide, Guide.id == Reach.guide_id).join(Mechanism, Mechanism.id == Guide.mechanism_id)
    )
    wide = joined.where(Reach.kind.in_(["line", "slot"]), Reach.level == bindparam("level", 0)).order_by(Reach.guide_id)
    with database.preparing() as prepare:
        prepared = prepare(wide.limit(bindparam("room", 0)))
        runs = [prepared.rows({"level": level, "room": 7}) for level in (-1, -2, -1)]
        found = prepared.columns([row for run in runs for row in run])
        assert runs[0] == runs[2]
        nothing = prepared.columns(prepared.rows({"level": -12, "room": 7}))
    plain = [database.read(wide.limit(7).params(level=level)) for level in (-1, -2, -1)]
    for name, column in found.items():
        expected = np.concatenate([part[name] for part in plain])
        np.testing.assert_array_equal(column, expected)
        assert column.dtype == expected.dtype == nothing[name].dtype
        assert len(nothing[name]) == 0
