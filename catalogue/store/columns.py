"""Reading whole columns: straight from the driver's cursor to arrays, with no object per row kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from sqlalchemy import Boolean, Connection, Float, Integer, LargeBinary, Numeric, Select
from sqlalchemy.types import TypeEngine

from ..kinematics.types import Array

_CHUNK = 50_000  # rows held as Python objects at a time


def read_columns(
    connection: Connection, select: Select[Any], bound: Mapping[str, Any] | None = None
) -> dict[str, Array]:
    """Return the columns of a Core select, by name.

    Parameters
    ----------
    connection : Connection
        Where to read.
    select : Select
        What to read, as single columns with distinct names (not as ORM entities).
    bound : mapping, optional
        Values of the select's bound parameters: to build a select once costs less than to build it for each value.

    Returns
    -------
    dict of ndarray, shape (n,)
        REAL as float64 with NaN for NULL, INTEGER as int64, comparisons as bool, TEXT as str objects (None for
        NULL).  BLOB as float64, shape (n, k), k being the number of little-endian doubles in each.

    Raises
    ------
    TypeError
        If an INTEGER or BLOB is NULL (say in the select what stands for it).
    ValueError
        If the BLOBs of a column differ in length (families of different kinds in one select).
    """
    types: list[TypeEngine[Any]] = [column.type for column in select.selected_columns]
    result = connection.execute(select, bound)
    names, cursor = list(result.keys()), result.cursor
    assert cursor is not None  # a select has rows
    parts: list[list[Array]] = [[as_array(kind, ())] for kind in types]
    while rows := cursor.fetchmany(_CHUNK):
        for part, kind, values in zip(parts, types, zip(*rows, strict=True), strict=True):
            part.append(as_array(kind, values))
    result.close()
    return {name: np.concatenate(part[1:] or part) for name, part in zip(names, parts, strict=True)}


def as_array(kind: TypeEngine[Any], values: Sequence[Any]) -> Array:
    """Return the values of one column as an array of the dtype that its SQL type asks for."""
    if isinstance(kind, LargeBinary):
        if len({len(value) for value in values}) > 1:
            raise ValueError("the blobs of one column differ in length")
        flat = np.frombuffer(b"".join(values), dtype="<f8")
        return flat.reshape(len(values), -1) if values else flat.reshape(0, 0)
    if isinstance(kind, Boolean):
        return np.array(values, dtype=np.bool_)
    if isinstance(kind, Integer):
        return np.array(values, dtype=np.int64)
    if isinstance(kind, (Float, Numeric)):
        return np.array(values, dtype=np.float64)
    return np.array(values, dtype=object)
