"""Numbers as they are written, units of length, and conversion: exact, before it is rounded to a double."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from .errors import InvalidRequest, quoted

#: Millimetres of a unit.
MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8}
#: How the unit of a length is declared, whatever the user's is; compound ones are ``1/length``, ``length/rad``.
LENGTH = "length"
#: Unit of files and drawings that must have one, where none is known: that of most CAD programs.  They say so.
ASSUMED = "mm"
#: What they say.
ASSUMPTION = f"unit unknown, taken as {ASSUMED}"


def decimal(text: str) -> float | None:
    """Return the number that a text writes, None if it writes none: digits are 0 to 9, and none stands apart by a
    line, as in 1_000."""
    try:
        return float(text) if text.isascii() and "_" not in text else None
    except ValueError:
        return None


def millimetres(unit: str) -> float:
    """Return how many millimetres a unit has; `InvalidRequest` if it is none."""
    if not isinstance(unit, str) or unit not in MILLIMETRES:
        raise InvalidRequest(f"there is no unit {quoted(unit)} of length; there are {', '.join(MILLIMETRES)}")
    return MILLIMETRES[unit]


def unit_or_none(unit: Any) -> str | None:
    """Return a unit of length, None where none is known; `InvalidRequest` for anything else."""
    if unit is not None:
        millimetres(unit)
    return unit  # type: ignore[no-any-return]  # `millimetres` refuses what is no text


def common(units: Sequence[str | None]) -> str | None:
    """Return the unit that several lengths share; `InvalidRequest` if they have different ones."""
    if len(every := dict.fromkeys(units)) > 1:
        told = ", ".join(unit or "an unknown unit" for unit in every)
        raise InvalidRequest(f"these have lengths in {told}: convert them to one unit, by `in_unit`")
    return next(iter(every), None)


def factor(unit: str, other: str) -> Fraction:
    """Return how many of another unit one unit has."""
    return Fraction(str(millimetres(unit))) / Fraction(str(millimetres(other)))


def power(declared: str) -> int:
    """Return the power of a length in a declared unit: 1 of ``length/rad``, -1 of ``1/length``, 0 of ``deg``."""
    over, *under = declared.split("/")
    return _power(over) - sum(map(_power, under))


def _power(product: str) -> int:
    return sum(int(n or 1) for n in re.findall(rf"\b{LENGTH}\b(?:\^(\d+))?", product))


def converted(value: Any, times: Fraction) -> Any:
    """Return a number, or each one in lists and mappings, multiplied; of a pivot [x, y, w] not w, and at infinity
    nothing.

    Raises
    ------
    InvalidRequest
        If a product is beyond the largest double.
    """
    if isinstance(value, Mapping):
        return {name: converted(one, times) for name, one in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        if len(value) == 3 and not any(isinstance(one, Sequence) for one in value):
            return [*(converted(value[:2], times) if value[2] else value[:2]), value[2]]
        return [converted(one, times) for one in value]
    if value is None or not math.isfinite(value):
        return value
    try:
        return float(Fraction(repr(float(value))) * times)  # as it is written: 355.6 mm are 14 in to the last digit
    except OverflowError:
        raise InvalidRequest(f"{value:g} is too large to be told in the unit asked for") from None
