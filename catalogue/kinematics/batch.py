"""Batches: index, join and replace records of arrays with a common axis of n entries."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, Self, TypeVar, cast

import numpy as np

from .linkage import Linkage
from .types import Array, Indices, Mask

T = TypeVar("T")


@cache
def names(kind: type) -> tuple[str, ...]:
    """Return the names of the fields of a dataclass."""
    return tuple(field.name for field in fields(kind))


def mapped(function: Any, *batches: Any) -> Any:
    """Apply a function to the arrays of batches with equal fields, and return a batch.

    A batch is an array, a `Linkage`, None, or a dataclass or dict of these.
    """
    first = batches[0]
    if isinstance(first, np.ndarray):
        return function(*batches)
    if first is None:
        return None
    if isinstance(first, Linkage):
        return Linkage.trusted(np.asarray(function(*(b.pivots for b in batches))))
    if isinstance(first, dict):
        return {name: mapped(function, *(b[name] for b in batches)) for name in first}
    if is_dataclass(first):
        made: Any = type(first)
        return made(*(mapped(function, *(getattr(b, name) for b in batches)) for name in names(made)))
    return function(*batches)


def take(batch: T, index: object) -> T:
    """Select rows of a batch.

    Parameters
    ----------
    batch : ndarray, Linkage, None, or dataclass or dict of these
        Arrays of shape (n, ...).
    index : mask, indices or slice
    """
    return cast(T, mapped(lambda values: values[index], batch))


def join(*batches: T) -> T:
    """Concatenate batches along their first axis."""
    return cast(T, mapped(lambda *values: np.concatenate(values), *batches))


def put(batch: T, where: Mask | Indices, by: T) -> T:
    """Replace the rows `where`, a mask or indices, by those of `by`."""

    def replaced(values: Array, new: Array) -> Array:
        out = values.astype(np.result_type(values, new)) if values.dtype != object else values.copy()
        out[where] = new
        return out

    return cast(T, mapped(replaced, batch, by))


class Rows:
    """A dataclass of arrays of shape (n, ...)."""

    def __getitem__(self, index: object) -> Self:
        return take(self, index)


class Columns:
    """A dataclass of arrays of shape (..., n), of linkages, and of other batches."""

    def __getitem__(self, index: Any) -> Self:
        def chosen(values: Any) -> Any:
            if values is None:
                return None
            return values[..., index] if isinstance(values, np.ndarray) else values[index]

        kind: Any = type(self)
        made: Self = kind(*(chosen(getattr(self, name)) for name in names(kind)))
        return made

    def replaced(self, where: Mask | Indices, by: Self) -> Self:
        """Replace the columns `where`, a mask (n,) or indices, by those of `by`.

        The precision of the batch is kept.
        """

        def put(values: Array, new: Array) -> Array:
            out = values.copy()
            out[..., where] = new
            return out

        made: Self = mapped(put, self, by)
        return made
