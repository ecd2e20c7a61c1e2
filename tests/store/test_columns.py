"""Columns come back as arrays of the right kind."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from sqlalchemy import func, select

from catalogue.errors import DatabaseError
from catalogue.store import PIVOTS, Batch, Database, Guide, Mechanism, Reach, stacked_pivots, write_batch


@pytest.fixture
def filled(database: Database, sample: Callable[..., Any]) -> Database:
    """Return a database with one batch of four mechanisms."""
    with database.engine.connect() as connection:
        write_batch(connection, *sample(0))
    return database


def test_each_type_has_its_dtype(filled: Database) -> None:
    read = filled.read(
        select(
            Mechanism.id,
            Mechanism.family,
            Mechanism.name,
            Mechanism.kappa,
            (Mechanism.kappa > 0).label("positive"),
            (Mechanism.kappa * 2).label("twice"),
            (Mechanism.id / 2).label("half"),
        ).order_by(Mechanism.id)
    )
    assert {name: column.dtype.kind for name, column in read.items()} == {
        "id": "i",
        "family": "O",
        "name": "O",
        "kappa": "f",
        "positive": "b",
        "twice": "f",
        "half": "f",
    }
    assert list(read["name"]) == [None] * 4
    np.testing.assert_array_equal(read["positive"], read["kappa"] > 0)
    np.testing.assert_array_equal(read["half"], read["id"] / 2)


def test_null_is_not_a_number(filled: Database) -> None:
    assert np.isnan(filled.read(select(Reach.__table__.c["min_link"]))["min_link"]).all()


def test_aggregates_keep_their_type(filled: Database) -> None:
    read = filled.read(
        select(func.count().label("n"), func.max(Reach.__table__.c["size"]).label("most")).select_from(Reach)
    )
    assert read["n"].dtype == np.int64
    assert read["most"].dtype == np.float64


def test_no_rows_have_the_same_dtypes(filled: Database) -> None:
    columns = (Mechanism.id, Mechanism.family, Mechanism.kappa, *PIVOTS)
    read = filled.read(select(*columns).where(Mechanism.id < 0))
    full = filled.read(select(*columns))
    assert {len(column) for column in read.values()} == {0}
    assert {name: column.dtype for name, column in read.items()} == {
        name: column.dtype for name, column in full.items()
    }
    assert stacked_pivots(read).shape == (0, 2, 2, 3)


@pytest.mark.parametrize("chunk", [1, 2, 3, 4, 5])
def test_chunks_are_joined(filled: Database, monkeypatch: pytest.MonkeyPatch, chunk: int) -> None:
    query = select(Mechanism.id, Mechanism.kappa, Mechanism.parameters)
    whole = filled.read(query)
    monkeypatch.setattr("catalogue.store.database._CHUNK", chunk)
    for name, column in filled.read(query).items():
        np.testing.assert_array_equal(column, whole[name])


def test_columns_of_two_tables_are_told_apart_by_labels(filled: Database) -> None:
    query = select(Mechanism.id.label("mechanism"), Guide.id.label("guide")).join_from(Guide, Mechanism)
    read = filled.read(query.order_by(Guide.id))
    np.testing.assert_array_equal(read["mechanism"], [1, 1, 2, 2, 3, 3, 4, 4])
    np.testing.assert_array_equal(read["guide"], np.arange(1, 9))


def test_null_integer_is_refused(filled: Database) -> None:
    with filled.begin() as connection:
        connection.exec_driver_sql("UPDATE mechanism SET batch_id = NULL WHERE id = 2")
    with pytest.raises(
        DatabaseError, match=r"is damaged \(impossible: .* is no column of numbers\): put it elsewhere and run"
    ):
        filled.read(select(Mechanism.batch_id))
    query = select(func.coalesce(Mechanism.batch_id, 0).label("batch")).order_by(Mechanism.id)
    assert list(filled.read(query)["batch"]) == [1, 0, 1, 1]


def test_pivots_are_stacked_as_they_were_written(filled: Database, sample: Callable[..., Any]) -> None:
    read = filled.read(select(*PIVOTS).order_by(Mechanism.id))
    np.testing.assert_array_equal(stacked_pivots(read), sample(0)[1]["pivots"])


def test_parameters_are_bound(filled: Database) -> None:
    query = select(Batch.kept).where(Batch.series.in_(["I.GG", "II.ooo"]), Batch.number == 0)
    assert list(filled.read(query)["kept"]) == [4]
