"""What somebody gives, read: numbers, names, switches, arrays, objects; else `InvalidRequest` says what is wanted."""

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
from typing import Any, TypeVar, get_args

import numpy as np
import numpy.typing as npt

from .errors import CatalogueError, InvalidRequest, quoted

T = TypeVar("T")

#: Largest whole number that is taken: beyond it doubles hold no more all of them.
LARGEST = 2**53
#: Lengths that are taken: a thousand times of them is a number still, with all its digits.
RANGE = 1e-305, 1e304


def number(name: str, value: Any, kind: str = "a number") -> float:
    """Return `value` as a float, NaN and infinity too; `InvalidRequest` unless it is a real number: a text or a truth
    value is none."""
    scalar = value[()] if isinstance(value, np.ndarray) and not value.ndim else value
    if isinstance(scalar, Real | Decimal) and not isinstance(scalar, bool):
        try:
            return float(scalar)
        except OverflowError:
            raise InvalidRequest(f"{name} is beyond 1e308, the largest number that can be reckoned with") from None
        except ValueError:  # a signalling NaN
            return math.nan
    raise InvalidRequest(f"{name} must be {kind}, not {quoted(value)}")


def positive(name: str, value: Any) -> float:
    """Return `value` as a float; `InvalidRequest` unless it is a number above zero in `RANGE`."""
    given = number(name, value)
    if not math.isfinite(given) or given <= 0:
        raise InvalidRequest(f"{name} must be a finite number above zero, not {given:g}")
    if not RANGE[0] <= given <= RANGE[1]:
        raise InvalidRequest(f"{name} must lie between {RANGE[0]:g} and {RANGE[1]:g}, not {given:g}: take another unit")
    return given


def whole(name: str, value: Any, least: int, most: int = LARGEST) -> int:
    """Return `value` as an int; `InvalidRequest` unless it is a whole number from `least` to `most`."""
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


def switch(name: str, value: Any) -> bool:
    """Return `value` as a bool; `InvalidRequest` unless it is True or False."""
    if not isinstance(value, bool | np.bool_):
        raise InvalidRequest(f"{name} must be True or False, not {quoted(value)}")
    return bool(value)


def listed(given: Any) -> list[Any] | None:
    """Return the parts of a sequence, or of anything else that has parts; None of one thing: a number, a text, a
    mapping, an array without a dimension."""
    if isinstance(given, str | bytes | Mapping):
        return None
    try:
        return list(given)
    except TypeError:
        return None


def names(name: str, given: Any) -> tuple[str, ...]:
    """Return one name, of a folder too, or several as a tuple; `InvalidRequest` for anything else."""
    found = []
    for one in (given,) if isinstance(given, str | Mapping) else _each(given):  # maybe without end
        if not isinstance(one, str | PathLike):
            raise InvalidRequest(f"{name} must be a name or a sequence of names, not {quoted(one)}")
        found.append(str(one))
    return tuple(found)


def _each(given: Any) -> Iterator[Any]:
    """Yield what something holds, or itself if it holds nothing."""
    try:
        yield from given
    except TypeError:
        yield given


def complexes(name: str, given: Any) -> npt.NDArray[np.complex128]:
    """Return one point x + iy or an array of them; `InvalidRequest` unless their coordinates are finite numbers."""
    try:
        found = np.asarray(given, dtype=complex)
    except (TypeError, ValueError, OverflowError):
        found = np.full((), np.nan, complex)
    if not np.isfinite(found).all():
        raise InvalidRequest(f"{name} must be x + iy with finite coordinates, or an array of such, not {quoted(given)}")
    return found


def doubles(given: Any) -> npt.NDArray[np.float64]:
    """Return real numbers, or nested sequences of them, as an array of doubles; `ValueError` for anything else: texts,
    truth values, complex numbers, rows of unlike lengths."""
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
    given: Any,
    *shapes: tuple[int | EllipsisType | None, ...],
    finite: bool = False,
    wrong: type[CatalogueError] = InvalidRequest,
) -> npt.NDArray[np.float64]:
    """Return real numbers as an array of doubles of one of some shapes, of any if none is said; `wrong` for others.

    None in a shape is any length above 0, an ellipsis any number of axes: ``(..., 3)`` are points.
    """
    try:
        found = doubles(given)
    except (ValueError, MemoryError):
        found = None
    if found is None or (shapes and not any(_fits(found.shape, shape) for shape in shapes)):
        what = " or ".join(dict.fromkeys(_told(shape, finite) for shape in shapes or ((...,),)))
        raise wrong(f"{name} must be {what}, not {quoted(given) if found is None else f'of shape {found.shape}'}")
    if finite and not np.isfinite(found).all():
        raise wrong(f"{name} must be finite numbers, not {quoted(given)}")
    return found


def _fits(shape: tuple[int, ...], wanted: tuple[int | EllipsisType | None, ...]) -> bool:
    if ... in wanted:
        before = wanted.index(...)
        after = len(wanted) - before - 1
        if len(shape) < before + after:
            return False
        shape, wanted = shape[:before] + shape[len(shape) - after :], wanted[:before] + wanted[before + 1 :]
    return len(shape) == len(wanted) and all(s > 0 if w is None else s == w for s, w in zip(shape, wanted, strict=True))


def _told(shape: tuple[int | EllipsisType | None, ...], finite: bool) -> str:
    """Return what is wanted of a shape in words."""
    numbers = "finite numbers" if finite else "numbers"
    if not shape:
        return f"a {numbers[:-1]}"
    if shape == (...,):
        return numbers
    if len(shape) == 1:
        return f"{numbers} in a row" if shape[0] is None else f"{shape[0]} {numbers}"
    return f"{numbers} of shape ({', '.join('...' if n is ... else 'n' if n is None else str(n) for n in shape)})"


def instance(name: str, given: T, kind: type | UnionType) -> T:
    """Return what is of a type, or of one of a union; `InvalidRequest` for anything else."""
    if not isinstance(given, kind):
        kinds = ["None" if k is type(None) else k.__name__ for k in get_args(kind) or (kind,)]
        raise InvalidRequest(f"{name} must be of type {' or '.join(kinds)}, not {quoted(given)}")
    return given


def several(name: str, given: Iterable[T], kind: type | UnionType) -> tuple[T, ...]:
    """Return a sequence of what is of a type, as a tuple; `InvalidRequest` for anything else."""
    try:
        every = iter(given)
    except TypeError:
        raise InvalidRequest(f"{name} must be a sequence, not {quoted(given)}") from None
    return tuple(instance(f"each of {name}", one, kind) for one in every)


def pair(name: str, given: Any, parts: str) -> tuple[Any, Any]:
    """Return the two parts of something; `InvalidRequest`, which says what they are, for anything else."""
    try:
        one, other = given
    except (TypeError, ValueError):
        raise InvalidRequest(f"{name} must be {parts}, not {quoted(given)}") from None
    return one, other


def text(name: str, given: Any) -> str:
    """Return a text; `InvalidRequest` for anything else, and unless it is one line without control characters, which a
    terminal would obey, and without half a character, which nothing can show."""
    found: str = instance(name, given, str)
    if not found.isprintable():
        raise InvalidRequest(f"{name} must be one line of printable text, not {quoted(found)}")
    return found


def choice(name: str, given: Any, options: Sequence[str]) -> str:
    """Return one of some names; `InvalidRequest` for anything else."""
    if not isinstance(given, str) or given not in options:
        raise InvalidRequest(f"{name} must be one of {', '.join(map(repr, options))}, not {quoted(given)}")
    return given


class Stated:
    """Base of dataclasses whose names and numbers are read when they are made.

    Which they are is what their module, which postpones the evaluation of annotations, says: ``name: str``.
    """

    def __post_init__(self) -> None:
        for field, name, read in _declared(type(self)):  # type: ignore[arg-type]  # a class can be hashed
            object.__setattr__(self, field, read(name, getattr(self, field)))


@cache
def _declared(kind: Any) -> list[tuple[str, str, Any]]:
    """Return the names and numbers of a dataclass: the field, what it is called, how it is read."""
    known = [(field.name, _DECLARED.get(str(field.type))) for field in fields(kind)]
    return [(name, f"{kind.__name__}.{name.rstrip('_')}", read) for name, read in known if read]


_DECLARED: dict[str, Any] = {
    "str": text,
    "int": lambda name, given: whole(name, given, 0),
    "float": number,
    "bool": switch,
}
