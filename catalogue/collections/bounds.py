"""Bounds on the metrics of a collection: ``range >= 0.5``."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import Any

from ..errors import InvalidRequest, quoted
from ..given import number
from ..problem.constraints import REGIONS, Constraints
from ..quantities import BOUNDS
from ..units import decimal
from .goal import Bound
from .spec import LENGTH, Metric

_CONDITION = re.compile(r"\s*(\w+)\s*(<=|>=)\s*(\S+)\s*")


def bounds(name: str, metrics: Mapping[str, Metric], stroke: float, where: Mapping[str, Any]) -> list[Bound]:
    """Check bounds given as pairs (least, most) by metric; None leaves a side open.

    `name` says whose metrics they are.

    Raises
    ------
    InvalidRequest
        If a metric is unknown, or a bound is not a pair or excludes all values.
    """
    if not isinstance(where, Mapping):
        raise InvalidRequest(f"bounds must be a mapping of metrics to (least, most), not {quoted(where)}")
    found = []
    for metric, pair in where.items():
        if metric not in metrics:
            raise InvalidRequest(f"{name} has no metric {quoted(metric)}; it has {', '.join(metrics) or 'none'}")
        try:
            least, most = pair
            low = -math.inf if least is None else number(metric, least)
            high = math.inf if most is None else number(metric, most)
        except (TypeError, ValueError):
            raise InvalidRequest(
                f"{metric} must be bounded by two numbers, least and most (or None), not {quoted(pair)}"
            ) from None
        if not low <= high:
            raise InvalidRequest(f"{metric} cannot be at least {least} and at most {most}")
        found.append(Bound(metric, low, high, stroke if metrics[metric].unit == LENGTH else 1.0))
    return found


def with_constraints(
    name: str, metrics: Mapping[str, Metric], where: Mapping[str, Any], wanted: Constraints
) -> dict[str, tuple[float | None, float | None]]:
    """Add constraints that bound metrics to bounds on metrics.

    Regions and `pins_only` are left out.

    Raises
    ------
    InvalidRequest
        If there is no metric for a constraint; `name` says of what.
    """
    found = dict(where)
    # full rotation last, as other constraints imply it
    for constraint in sorted(wanted.active(), key="full_rotation".__eq__):
        if constraint in (*REGIONS, "keep_out", "pins_only"):
            continue
        upper, value = False, getattr(wanted, constraint)
        if constraint == "full_rotation":
            metric, value = "turns", 1.0
        elif constraint in BOUNDS:
            metric, upper = BOUNDS[constraint].measure, BOUNDS[constraint].is_upper
        else:
            raise InvalidRequest(f"{constraint} is a constraint on linkages of two dyads: leave it out for {name}")
        if metric not in metrics:
            raise InvalidRequest(f"{constraint} does not go with {name}, which measures {', '.join(metrics)}")
        least, most = found.get(metric, (None, None))
        if upper:
            found[metric] = least, value if most is None else min(value, most)
        else:
            found[metric] = value if least is None else max(value, least), most
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
