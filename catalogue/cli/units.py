"""Parse lengths and angles: ``80mm``, ``3.5in``, ``3 1/2"``, ``1/8in``, ``30deg``.

A command has one unit of output: that of ``--unit``, else of the first length with a unit, else of
the answers or linkages it reads.  Numbers without a unit, in files too, are in this unit; lengths
in other units are converted exactly before rounding to a double.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import click

from ..errors import InvalidRequest
from ..units import ASSUMPTION, MILLIMETRES, angle_in, factor, length_in
from .options import option

if TYPE_CHECKING:
    _ParamType = click.ParamType[Any]
else:  # click's type is not generic in older versions
    _ParamType = click.ParamType


class _WithUnit(Protocol):
    @property
    def unit(self) -> str | None: ...


T = TypeVar("T", bound=_WithUnit)

#: Units of output.
UNITS = (*MILLIMETRES,)
#: Key of the unit of output in the context of click.
KEY = "catalogue.unit"


class Length(_ParamType):
    """A length, with or without a unit; one with a unit is converted to that of the output."""

    name = "length"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> float:
        found = length_in(value)
        if found is None:
            self.fail(f'{value!r} is no length: write 80, 80mm, 2.5cm, 3.5in, 3 1/2" or 1/8in', param, ctx)
        number, base = found
        if base is None:
            return float(number)
        target = base if ctx is None else ctx.meta.setdefault(KEY, base)
        return float(number * factor(base, target))


class Angle(_ParamType):
    """An angle, in degrees unless given in radians."""

    name = "angle"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> float:
        found = angle_in(value)
        if found is None:
            self.fail(f"{value!r} is no angle: write 30, 30deg or 0.5rad", param, ctx)
        return found


LENGTH = Length()
ANGLE = Angle()


class Zone(_ParamType):
    """A box of four lengths, or a polygon of points, separated by commas or blanks."""

    name = "zone"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> Any:
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

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> Any:
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

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        name, _, numbers = value.partition("=")
        parts = numbers.split(",")
        if len(parts) != 2:
            raise InvalidRequest(f"--also takes NAME=X,Y, not {value!r}")
        return name.strip(), tuple(LENGTH.convert(part, param, ctx) for part in parts)


def _output_unit(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:  # noqa: ARG001  # click gives it
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
    callback=_output_unit,
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
    return [_convert(one, chosen) for one in guides]


def _convert(one: Any, unit: str | None) -> Any:
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
