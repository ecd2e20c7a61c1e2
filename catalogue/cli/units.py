"""Parse lengths and angles: ``80mm``, ``3.5in``, ``3 1/2"``, ``1/8in``, ``30deg``.

A command has one unit of output: that of ``--unit``, else of the first length with a unit, else of
the answers or linkages it reads.  Numbers without a unit, in files too, are in this unit; lengths
in other units are converted exactly before rounding to a double.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import click

from ..errors import InvalidRequest
from ..units import ASSUMPTION, MILLIMETRES, factor
from .options import option

if TYPE_CHECKING:
    _ParamType = click.ParamType[Any]
else:  # which is no generic type in its older versions
    _ParamType = click.ParamType


class _WithUnit(Protocol):
    @property
    def unit(self) -> str | None: ...


T = TypeVar("T", bound=_WithUnit)

#: Units of output.
UNITS = (*MILLIMETRES,)
#: Spellings of units of length, each as a multiple of a unit of output.
WRITTEN = {
    **{unit: (Fraction(1), unit) for unit in UNITS},
    **dict.fromkeys(("um", "\u00b5m", "\u03bcm"), (Fraction(1, 1000), "mm")),
    **dict.fromkeys(('"', "\u2033", "\u201d", "''", "inch", "inches"), (Fraction(1), "in")),
    **dict.fromkeys(("'", "\u2032", "\u2019", "foot", "feet"), (Fraction(1), "ft")),
}
#: Units of angles [deg].
ANGLES = {"": 1.0, "deg": 1.0, "\u00b0": 1.0, "rad": math.degrees(1.0)}
#: Key of the unit of output in the context of click.
KEY = "catalogue.unit"
#: Infinity or NaN, without a unit.
_NO_NUMBER = re.compile(r"[+-]?(?:inf(?:inity)?|nan)", re.IGNORECASE | re.ASCII)
#: A decimal or a mixed fraction, and a unit: 3.5in, 3 1/2", 3-1/2", 1/8 in, 80.
_NUMBER = re.compile(
    r"(?P<sign>[+-]?)(?:(?:(?P<whole>\d+)(?:\s+|-))?(?P<over>\d+)\s*/\s*(?P<under>\d+)|"
    r"(?P<decimal>(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?))\s*(?P<unit>[^\d\s.][^\s\d]*)?",
    re.IGNORECASE | re.ASCII,
)


class Length(_ParamType):
    """A length, converted to the unit of output if it has its own."""

    name = "length"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        plain = _plain(value)
        if plain is not None:
            return plain
        number, unit = _read(str(value))
        if number is None or unit.lower() not in WRITTEN | {"": None}:
            self.fail(f'{value!r} is no length: write 80, 80mm, 2.5cm, 3.5in, 3 1/2" or 1/8in', param, ctx)
        if not unit:
            return float(number)
        times, base = WRITTEN[unit.lower()]
        target = base if ctx is None else ctx.meta.setdefault(KEY, base)
        return float(number * times * factor(base, target))


class Angle(_ParamType):
    """An angle, in degrees unless given in radians."""

    name = "angle"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        plain = _plain(value)
        if plain is not None:
            return plain
        number, unit = _read(str(value))
        if number is None or unit.lower() not in ANGLES:
            self.fail(f"{value!r} is no angle: write 30, 30deg or 0.5rad", param, ctx)
        return float(number) * ANGLES[unit.lower()]


LENGTH = Length()
ANGLE = Angle()


class Zone(_ParamType):
    """A box of four lengths, or a polygon of points, separated by commas or blanks."""

    name = "zone"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        numbers = [LENGTH.convert(part, param, ctx) for part in value.replace(",", " ").split()]
        if len(numbers) == 4:
            return numbers
        if len(numbers) < 6 or len(numbers) % 2:
            raise InvalidRequest(f"--keep-out takes x0,y0,x1,y1 or x and y of three or more points, not {value!r}")
        return list(zip(numbers[::2], numbers[1::2], strict=True))


class Desire(_ParamType):
    """A desirability: NAME=BEST:WORST or NAME=BEST:WORST:WEIGHT."""

    name = "desire"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        name, equals, numbers = (part.strip() for part in value.partition("="))
        read = ANGLE if name == "transmission" else LENGTH
        parts = [(read if k < 2 else LENGTH).convert(part, param, ctx) for k, part in enumerate(numbers.split(":"))]
        if not equals or not 2 <= len(parts) <= 3:
            raise InvalidRequest(f"--desire takes NAME=BEST:WORST or NAME=BEST:WORST:WEIGHT, not {value!r}")
        return name, parts


class NamedPoint(_ParamType):
    """A named point: NAME=X,Y."""

    name = "named point"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        name, _, numbers = value.partition("=")
        parts = numbers.split(",")
        if len(parts) != 2:
            raise InvalidRequest(f"--also takes NAME=X,Y, not {value!r}")
        return name.strip(), tuple(LENGTH.convert(part, param, ctx) for part in parts)


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


def _chosen(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:  # noqa: ARG001  # click gives it
    if value is not None:
        ctx.meta[KEY] = value
    return value


ZONE = Zone()
DESIRE = Desire()
NAMED_POINT = NamedPoint()
#: The unit of output.
UNIT = option(
    "--unit",
    None,
    'Unit of the output and of lengths given without one. Any length may carry its own: 80mm, 3.5in, 3 1/2", 1/8in.',
    click.Choice([*UNITS]),
    is_eager=True,
    expose_value=False,
    callback=_chosen,
    show_default="that of the first length with a unit, else of the answer",
)


def length(flag: str, metavar: str | None, help: str, **more: Any) -> click.Option:
    return option(flag, metavar, help, LENGTH, **more)


def angle(flag: str, metavar: str | None, help: str, **more: Any) -> click.Option:
    return option(flag, metavar, help, ANGLE, **more)


def unit() -> str | None:
    """Return the unit of output of the running command, or None."""
    running = click.get_current_context(silent=True)
    found: str | None = running.meta.get(KEY) if running else None
    return found


def in_output_unit(guides: Sequence[T]) -> list[T]:
    """Convert guides to the unit of output, else to the first unit among them."""
    chosen = unit() or next((one.unit for one in guides if one.unit), None)
    if chosen is not None:
        click.get_current_context().meta[KEY] = chosen
    return [_in_unit(one, chosen) for one in guides]


def _in_unit(one: Any, unit: str | None) -> Any:
    if not hasattr(one, "collection"):
        return one.in_unit(unit)
    from ..find.specimens import in_unit

    return in_unit(one, unit)


def warn_of_unit(guide: _WithUnit) -> None:
    """Warn on standard error that a guide of unknown unit was taken in millimetres."""
    if guide.unit is None and unit() is None:
        print(f"catalogue: {ASSUMPTION}; --unit names another", file=sys.stderr)


def with_unit(text: str) -> str:
    """Append the unit of output to a formatted length."""
    return f"{text} {unit() or ''}".rstrip()
