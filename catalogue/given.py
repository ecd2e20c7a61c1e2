"""Validate arguments of users: numbers, names, switches, arrays, objects.

Invalid arguments raise `InvalidRequest`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from decimal import Decimal
from functools import cache
from numbers import Real
from operator import index
from os import PathLike
from types import EllipsisType, UnionType
from typing import Any, TypeVar, get_args, get_type_hints

import numpy as np
import numpy.typing as npt

from .errors import CatalogueError, InvalidRequest, quoted

T = TypeVar("T")

#: Largest accepted whole number: doubles represent all integers up to it.
LARGEST = 2**53
#: Range of accepted lengths: a thousandth and a thousand times a length are still normal doubles.
RANGE = 1e-305, 1e304


def number(name: str, value: object, kind: str = "a number") -> float:
    """Convert a real number to float, NaN and infinity too; refuse texts and truth values."""
    scalar = value[()] if isinstance(value, np.ndarray) and not value.ndim else value
    if isinstance(scalar, Real | Decimal) and not isinstance(scalar, bool):
        try:
            return float(scalar)
        except OverflowError:
            raise InvalidRequest(f"{name} is beyond 1e308, the largest number that can be reckoned with") from None
        except ValueError:  # a signalling NaN
            return math.nan
    raise InvalidRequest(f"{name} must be {kind}, not {quoted(value)}")


def positive(name: str, value: object) -> float:
    """Convert a positive number within `RANGE` to float; refuse anything else."""
    given = number(name, value)
    if not math.isfinite(given) or given <= 0:
        raise InvalidRequest(f"{name} must be a finite number above zero, not {given:g}")
    if not RANGE[0] <= given <= RANGE[1]:
        raise InvalidRequest(f"{name} must lie between {RANGE[0]:g} and {RANGE[1]:g}, not {given:g}: take another unit")
    return given


def whole(name: str, value: Any, least: int, most: int = LARGEST) -> int:
    """Convert a whole number from `least` to `most` to int; refuse anything else."""
    try:
        given = None if isinstance(value, bool | np.bool_) else index(value)
    except TypeError:
        given = None
    if given is None:
        raise InvalidRequest(f"{name} must be a whole number, not {quoted(value)}")
    if not least <= given <= most:
        bound = f"at least {least}" if given < least else f"at most {most}"
        raise InvalidRequest(f"{name} must be {bound}, not {quoted(given)}")
    return given


def switch(name: str, value: object) -> bool:
    """Convert a truth value, NumPy's too, to bool; refuse anything else."""
    if not isinstance(value, bool | np.bool_):
        raise InvalidRequest(f"{name} must be True or False, not {quoted(value)}")
    return bool(value)


def listed(given: Any) -> list[Any] | None:
    """List the elements of an iterable; None for a scalar, a text, a mapping, a 0-d array."""
    if isinstance(given, str | bytes | Mapping):
        return None
    try:
        return list(given)
    except TypeError:
        return None


def names(name: str, given: object) -> tuple[str, ...]:
    """Convert one name or path, or several, to a tuple of texts; refuse anything else."""
    found = []
    for one in (given,) if isinstance(given, str | Mapping) else _each(given):  # an iterator may be endless
        if not isinstance(one, str | PathLike):
            raise InvalidRequest(f"{name} must be a name or a sequence of names, not {quoted(one)}")
        found.append(str(one))
    return tuple(found)


def _each(given: Any) -> Iterator[Any]:
    """Yield the elements of an iterable; yield any other object itself."""
    try:
        yield from given
    except TypeError:
        yield given


def complexes(name: str, given: object) -> npt.NDArray[np.complex128]:
    """Convert finite points x + iy to a complex array; refuse anything else."""
    try:
        found = np.asarray(given, dtype=complex)
    except (TypeError, ValueError, OverflowError):
        found = np.full((), np.nan, complex)
    if not np.isfinite(found).all():
        raise InvalidRequest(f"{name} must be x + iy with finite coordinates, or an array of such, not {quoted(given)}")
    return found


def doubles(given: object) -> npt.NDArray[np.float64]:
    """Convert real numbers, nested too, to an array of doubles.

    Raises
    ------
    ValueError
        For texts, truth values, complex numbers or ragged rows.
    """
    try:
        found = np.asarray(given)
        real = found.dtype.kind in "iuf" or all(
            isinstance(x, Real | Decimal) and not isinstance(x, bool) for x in found.astype(object).flat
        )
        if real:
            return found.astype(float)
    except (TypeError, ValueError, OverflowError):
        pass
    raise ValueError("these are no real numbers in rows of one length")


def array(
    name: str,
    given: object,
    *shapes: tuple[int | EllipsisType | None, ...],
    finite: bool = False,
    wrong: type[CatalogueError] = InvalidRequest,
) -> npt.NDArray[np.float64]:
    """Convert real numbers to an array of doubles and check its shape.

    Parameters
    ----------
    name : str
        Name of the argument, for the message.
    given : array_like
    *shapes : tuple
        Accepted shapes; any if none is given.  None is any length above 0, an ellipsis any number
        of axes: ``(..., 3)`` are points.
    finite : bool
        Refuse NaN and infinity.
    wrong : type
        Class of the error to raise.
    """
    try:
        found = doubles(given)
    except (ValueError, MemoryError):
        found = None
    if found is None or (shapes and not any(_fits_shape(found.shape, shape) for shape in shapes)):
        what = " or ".join(dict.fromkeys(_describe_shape(shape, finite) for shape in shapes or ((...,),)))
        raise wrong(f"{name} must be {what}, not {quoted(given) if found is None else f'of shape {found.shape}'}")
    if finite and not np.isfinite(found).all():
        raise wrong(f"{name} must be finite numbers, not {quoted(given)}")
    return found


def _fits_shape(shape: tuple[int, ...], wanted: tuple[int | EllipsisType | None, ...]) -> bool:
    if ... in wanted:
        before = wanted.index(...)
        after = len(wanted) - before - 1
        if len(shape) < before + after:
            return False
        shape, wanted = shape[:before] + shape[len(shape) - after :], wanted[:before] + wanted[before + 1 :]
    return len(shape) == len(wanted) and all(s > 0 if w is None else s == w for s, w in zip(shape, wanted, strict=True))


def _describe_shape(shape: tuple[int | EllipsisType | None, ...], finite: bool) -> str:
    """Describe an accepted shape in words."""
    numbers = "finite numbers" if finite else "numbers"
    if not shape:
        return f"a {numbers[:-1]}"
    if shape == (...,):
        return numbers
    if len(shape) == 1:
        return f"{numbers} in a row" if shape[0] is None else f"{shape[0]} {numbers}"
    return f"{numbers} of shape ({', '.join('...' if n is ... else 'n' if n is None else str(n) for n in shape)})"


def instance(name: str, given: T, kind: type | UnionType) -> T:
    """Return an object if it is of a type or union; refuse anything else."""
    if not isinstance(given, kind):
        kinds = ["None" if k is type(None) else k.__name__ for k in get_args(kind) or (kind,)]
        raise InvalidRequest(f"{name} must be of type {' or '.join(kinds)}, not {quoted(given)}")
    return given


def several(name: str, given: Iterable[T], kind: type | UnionType) -> tuple[T, ...]:
    """Convert a sequence of objects of a type to a tuple; refuse anything else."""
    try:
        every = iter(given)
    except TypeError:
        raise InvalidRequest(f"{name} must be a sequence, not {quoted(given)}") from None
    return tuple(instance(f"each of {name}", one, kind) for one in every)


def pair(name: str, given: Any, parts: str) -> tuple[Any, Any]:
    """Unpack a pair; refuse anything else with a message that names its `parts`."""
    try:
        one, other = given
    except (TypeError, ValueError):
        raise InvalidRequest(f"{name} must be {parts}, not {quoted(given)}") from None
    return one, other


def text(name: str, given: Any) -> str:
    """Return one line of printable text.

    Refuse control characters, lone surrogates and other types.
    """
    found: str = instance(name, given, str)
    if not found.isprintable():
        raise InvalidRequest(f"{name} must be one line of printable text, not {quoted(found)}")
    return found


def choice(name: str, given: object, options: Sequence[str]) -> str:
    """Return a name if it is one of the options; refuse anything else."""
    if not isinstance(given, str) or given not in options:
        raise InvalidRequest(f"{name} must be one of {', '.join(map(repr, options))}, not {quoted(given)}")
    return given


class Stated:
    """Base of dataclasses that validate fields of type str, int, float and bool."""

    def __post_init__(self) -> None:
        for field, name, read in _declared_fields(type(self)):  # type: ignore[arg-type]  # a class can be hashed
            object.__setattr__(self, field, read(name, getattr(self, field)))


@cache
def _declared_fields(kind: Any) -> list[tuple[str, str, Any]]:
    """List the validated fields of a dataclass: field, name for messages, validator."""
    known = {name: _DECLARED[of] for name, of in field_types(kind).items() if of in _DECLARED}
    return [(name, f"{kind.__name__}.{name.rstrip('_')}", read) for name, read in known.items()]


_DECLARED: Mapping[Any, Any] = {
    str: text,
    int: lambda name, given: whole(name, given, 0),
    float: number,
    bool: switch,
}


@cache
def field_types(kind: Any) -> dict[str, Any]:
    """Resolve the types of a dataclass's fields, postponed annotations too.

    A name that is imported for type checkers only resolves to `Any`.
    """
    unknown: dict[str, Any] = {}
    while True:
        try:
            hints = get_type_hints(kind, localns=unknown)
        except NameError as error:
            unknown[str(error.name)] = Any
        else:
            return {field.name: hints[field.name] for field in fields(kind)}
