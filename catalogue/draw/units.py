"""Format lengths on drawings, and choose scales of drawings in true millimetres."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from ..errors import InvalidRequest, quoted
from ..units import millimetres


def decimals(unit: str) -> int:
    """Return the decimals needed for a thousandth of a millimetre in a unit."""
    return math.ceil(math.log10(millimetres(unit))) + 3


def fixed(value: float, digits: int) -> str:
    """Format a number with a given number of decimals; zero has no sign."""
    told = f"{value:.{digits}f}"
    return told.lstrip("-") if float(told) == 0 else told.replace("-", "−")


def length(value: float, unit: str) -> str:
    """Format a length with its unit, to four or five digits."""
    digits = max(0, min(6, 4 - math.floor(math.log10(abs(value))))) if value else 0
    told = fixed(value, min(digits, decimals(unit)) if unit else digits)
    return f"{told.rstrip('0').rstrip('.') if '.' in told else told} {unit}".rstrip()


def rounded(value: float, steps: tuple[float, ...] = (1, 2, 5)) -> float:
    """Round a value down to a step times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(m * power for m in steps if m * power <= value * (1 + 1e-12) or m == 1)


@dataclass(frozen=True)
class Scale:
    """Ratio of lengths on paper to real lengths, such as 1:2."""

    drawn: float
    real: float

    @property
    def ratio(self) -> float:
        """Length on paper over real length."""
        return self.drawn / self.real

    def __str__(self) -> str:
        return f"{self.drawn:g}:{self.real:g}"

    @classmethod
    def named(cls, text: str) -> Scale:
        """Parse a scale such as ``1:2``."""
        parts = re.fullmatch(r"\s*([0-9.]+)\s*:\s*([0-9.]+)\s*", text) if isinstance(text, str) else None
        try:
            drawn, real = (float(part) for part in parts.groups()) if parts else (0.0, 0.0)
        except ValueError:
            drawn = real = 0.0
        if not (0 < drawn < math.inf and 0 < real < math.inf):
            raise InvalidRequest(f"a scale is written as 1:2 or 5:1, not {quoted(text)}")
        return cls(drawn, real)

    @classmethod
    def fitting(cls, largest: float) -> Scale:
        """Return the largest standard scale up to a ratio."""
        ratio = rounded(largest, (1, 2, 2.5, 5) if largest >= 1 else (1, 2, 4, 5))
        return cls(float(f"{ratio:g}"), 1.0) if ratio >= 1 else cls(1.0, float(f"{1 / ratio:g}"))

    def bar(self, unit: str, longest: float) -> float:
        """Return a round length in a unit, drawn up to `longest` millimetres."""
        return rounded(longest / (self.ratio * millimetres(unit)))
