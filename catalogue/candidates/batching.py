"""Batches: records whose arrays run over the same n things, taken apart and put together again."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any, TypeVar, cast

import numpy as np

from ..kinematics.linkage import Linkage
from ..kinematics.types import Array

T = TypeVar("T")


def take(batch: T, index: Any) -> T:
    """Return the chosen ones of a batch: an array, a `Linkage`, None, or a dataclass of these."""
    return cast(T, _mapped(lambda values: values[index], batch))


def join(*batches: T) -> T:
    """Return the things of all batches, one after the other."""
    return cast(T, _mapped(lambda *values: np.concatenate(values), *batches))


def put(batch: T, where: Array, by: T) -> T:
    """Return a batch with the entries `where`, a mask or indices, taken from `by`, which holds just those."""

    def replaced(values: Array, new: Array) -> Array:
        out = values.astype(np.result_type(values, new)) if values.dtype != object else values.copy()
        out[where] = new
        return out

    return cast(T, _mapped(replaced, batch, by))


def _mapped(function: Any, *batches: Any) -> Any:
    first = batches[0]
    if first is None:
        return None
    if isinstance(first, Linkage):
        return Linkage.trusted(np.asarray(function(*(b.pivots for b in batches))))
    if is_dataclass(first):
        made: Any = type(first)
        return made(*(_mapped(function, *(getattr(b, f.name) for b in batches)) for f in fields(first)))
    return function(*batches)
