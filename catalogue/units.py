"""Units of length."""

from __future__ import annotations

from .errors import InvalidRequest, quoted

#: Millimetres of a unit.
MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8}


def millimetres(unit: str) -> float:
    """Return how many millimetres a unit has; `InvalidRequest` if it is none."""
    if not isinstance(unit, str) or unit not in MILLIMETRES:
        raise InvalidRequest(f"there is no unit {quoted(unit)} of length; there are {', '.join(MILLIMETRES)}")
    return MILLIMETRES[unit]
