"""Bounds on the metrics of a collection: ``range >= 0.5``."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from ..errors import InvalidRequest, quoted
from ..given import number
from ..units import decimal
from .spec import LENGTH, Collection

_CONDITION = re.compile(r"\s*(\w+)\s*(<=|>=)\s*(\S+)\s*")


@dataclass(frozen=True)
class Bound:
    """A metric between two numbers; `scale` is its stored unit in that of the user."""

    name: str
    low: float
    high: float
    scale: float

    def holds(self, value: float) -> bool:
        """Return whether a value in the user's unit is within."""
        return self.low <= value <= self.high

    def __str__(self) -> str:
        parts = [f"{self.name} >= {self.low:g}"] * (self.low > -math.inf)
        return " and ".join(parts + [f"{self.name} <= {self.high:g}"] * (self.high < math.inf))


def bounds(collection: Collection, stroke: float, where: Mapping[str, Any]) -> list[Bound]:
    """Check bounds given as pairs (least, most) by metric; None leaves a side open.

    Raises
    ------
    InvalidRequest
        If a metric is unknown, or a bound is not a pair or excludes all values.
    """
    if not isinstance(where, Mapping):
        raise InvalidRequest(f"bounds must be a mapping of metrics to (least, most), not {quoted(where)}")
    found = []
    for name, pair in where.items():
        if name not in collection.metrics:
            known = ", ".join(collection.metrics) or "none"
            raise InvalidRequest(f"{collection.name} has no metric {quoted(name)}; it has {known}")
        try:
            least, most = pair
            low = -math.inf if least is None else number(name, least)
            high = math.inf if most is None else number(name, most)
        except (TypeError, ValueError):
            raise InvalidRequest(
                f"{name} must be bounded by two numbers, least and most (or None), not {quoted(pair)}"
            ) from None
        if not low <= high:
            raise InvalidRequest(f"{name} cannot be at least {least} and at most {most}")
        found.append(Bound(name, low, high, stroke if collection.metrics[name].unit == LENGTH else 1.0))
    return found


def parsed(conditions: Iterable[str]) -> dict[str, tuple[float | None, float | None]]:
    """Return pairs (least, most) by metric from texts such as ``range>=0.5``.

    Raises
    ------
    InvalidRequest
        If a text is no condition, or bounds one side twice.
    """
    found: dict[str, tuple[float | None, float | None]] = {}
    for text in conditions:
        match = _CONDITION.fullmatch(text)
        name, sign, written = match.groups() if match else ("", "", "")
        value = decimal(written)
        if value is None:
            raise InvalidRequest(f"--where takes a condition such as 'range>=0.5' (or <=), not {text!r}")
        low, high = found.get(name, (None, None))
        if (low if sign == ">=" else high) is not None:
            raise InvalidRequest(f"--where bounds {name} {sign} twice; give one of them")
        found[name] = (value, high) if sign == ">=" else (low, value)
    return found
