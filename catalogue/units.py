"""Parse numbers, and convert units of length exactly before rounding to a double."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from .errors import InvalidRequest, quoted

#: Millimetres per unit.
MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8}
#: Unit of a quantity that is a length in the user's unit; compound units are ``1/length``,
#: ``length/rad``.
LENGTH = "length"
#: Unit assumed for files and drawings that need one if it is unknown: the default of most CAD
#: programs.
ASSUMED = "mm"
#: Note on files and drawings in the assumed unit.
ASSUMPTION = f"unit unknown, taken as {ASSUMED}"
#: Spellings of units of length, each as a multiple of a unit in `MILLIMETRES`.
WRITTEN = {
    **{unit: (Fraction(1), unit) for unit in MILLIMETRES},
    **dict.fromkeys(("um", "\u00b5m", "\u03bcm"), (Fraction(1, 1000), "mm")),
    **dict.fromkeys(('"', "\u2033", "\u201d", "''", "inch", "inches"), (Fraction(1), "in")),
    **dict.fromkeys(("'", "\u2032", "\u2019", "foot", "feet"), (Fraction(1), "ft")),
}
#: Spellings of units of angles [deg].
ANGLES = {"": 1.0, "deg": 1.0, "\u00b0": 1.0, "rad": math.degrees(1.0)}
#: Pattern of infinity and NaN, which have no unit.
_NO_NUMBER = re.compile(r"[+-]?(?:inf(?:inity)?|nan)", re.IGNORECASE | re.ASCII)
#: A decimal or a mixed fraction, and a unit: 3.5in, 3 1/2", 3-1/2", 1/8 in, 80.
_NUMBER = re.compile(
    r"(?P<sign>[+-]?)(?:(?:(?P<whole>\d+)(?:\s+|-))?(?P<over>\d+)\s*/\s*(?P<under>\d+)|"
    r"(?P<decimal>(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?))\s*(?P<unit>[^\d\s.][^\s\d]*)?",
    re.IGNORECASE | re.ASCII,
)


def decimal(text: str) -> float | None:
    """Parse a number in ASCII digits without underscores; None for any other text."""
    try:
        return float(text) if text.isascii() and "_" not in text else None
    except ValueError:
        return None


def length_in(value: object) -> tuple[Fraction | float, str | None] | None:
    """Parse a length with its unit, or a number, whose unit is None; None for any other text."""
    plain = _plain(value)
    if plain is not None:
        return plain, None
    number, unit = _read(str(value))
    if number is None or unit.lower() not in WRITTEN | {"": None}:
        return None
    if not unit:
        return number, None
    times, base = WRITTEN[unit.lower()]
    return number * times, base


def angle_in(value: object) -> float | None:
    """Parse an angle in degrees or with its unit [deg]; None for any other text."""
    plain = _plain(value)
    if plain is not None:
        return plain
    number, unit = _read(str(value))
    if number is None or unit.lower() not in ANGLES:
        return None
    return float(number) * ANGLES[unit.lower()]


def _plain(value: Any) -> float | None:
    """Convert a number, or a text of infinity or NaN; None for other texts."""
    if isinstance(value, str) and not _NO_NUMBER.fullmatch(value.strip()):
        return None
    return float(value)


def _read(text: str) -> tuple[Fraction | None, str]:
    """Parse a number and its unit; the number is None if it is missing or overflows a double."""
    found = _NUMBER.fullmatch(text.strip())
    if found is None:
        return None, ""
    try:
        if found["decimal"]:
            if not math.isfinite(rough := float(found["decimal"])):
                return None, ""
            number = Fraction(found["decimal"]) if rough else Fraction(0)
        else:
            number = int(found["whole"] or 0) + Fraction(int(found["over"]), int(found["under"]))
            float(number)
    except (ValueError, ZeroDivisionError, OverflowError):
        return None, ""
    return (-number if found["sign"] == "-" else number), found["unit"] or ""


def millimetres(unit: str) -> float:
    """Return the millimetres per unit; refuse unknown units."""
    if not isinstance(unit, str) or unit not in MILLIMETRES:
        raise InvalidRequest(f"there is no unit {quoted(unit)} of length; there are {', '.join(MILLIMETRES)}")
    return MILLIMETRES[unit]


def unit_or_none(unit: Any) -> str | None:
    """Return a unit of length, or None for an unknown one; refuse anything else."""
    if unit is not None:
        millimetres(unit)
    return unit  # type: ignore[no-any-return]  # `millimetres` refuses what is no text


def common(units: Sequence[str | None]) -> str | None:
    """Return the common unit of several lengths; refuse different ones."""
    if len(every := dict.fromkeys(units)) > 1:
        told = ", ".join(unit or "an unknown unit" for unit in every)
        raise InvalidRequest(f"these have lengths in {told}: convert them to one unit, by `in_unit`")
    return next(iter(every), None)


def factor(unit: str, other: str) -> Fraction:
    """Return the conversion factor from one unit to another, exactly."""
    return Fraction(str(millimetres(unit))) / Fraction(str(millimetres(other)))


def power(declared: str) -> int:
    """Return the exponent of length in a unit: 1 for ``length/rad``, -1 for ``1/length``."""
    over, *under = declared.split("/")
    return _power(over) - sum(map(_power, under))


def columns_in(columns: Mapping[tuple[str, str], Any], unit: str | None, to: str | None) -> dict[str, Any]:
    """Convert columns to those of a table, with units in the headings.

    Parameters
    ----------
    columns : mapping of (name, declared unit) to ndarray
        Declared units are products and quotients, such as ``length/rad``; empty without a unit.
    unit, to : str, optional
        Unit of their lengths, and that to convert them to.  Lengths of unknown unit are taken to
        be in `to`; without any unit the headings say ``length``.

    Raises
    ------
    InvalidRequest
        If the unit is unknown.

    Examples
    --------
    >>> columns_in({("x", "length"): 2.0, ("turn", "deg"): 3.0}, "cm", "mm")
    {'x [mm]': 20.0, 'turn [deg]': 3.0}
    """
    told = unit_or_none(to) or unit
    times = float(factor(unit, told)) if unit and told else 1.0
    table = {}
    for (name, declared), values in columns.items():
        scale = times ** power(declared)
        heading = f"{name} [{declared.replace(LENGTH, told or LENGTH)}]" if declared else name
        table[heading] = values if scale == 1 else scale * values
    return table


def _power(product: str) -> int:
    return sum(int(n or 1) for n in re.findall(rf"\b{LENGTH}\b(?:\^(\d+))?", product))


def converted(value: Any, times: Fraction) -> Any:
    """Multiply a number, or all numbers in nested lists and mappings, by an exact factor.

    For a pivot [x, y, w] only x and y are multiplied; a pivot at infinity (w = 0) is not changed.

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
        return float(Fraction(repr(float(value))) * times)  # from decimal digits: 355.6 mm is then exactly 14 in
    except OverflowError:
        raise InvalidRequest(f"{value:g} is too large to be told in the unit asked for") from None
