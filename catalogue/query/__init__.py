"""From a wish to ranked, verified candidates."""

from .found import Candidate, Found
from .request import CircularArc, Constraints, StraightLine

__all__ = ["Candidate", "CircularArc", "Constraints", "Found", "StraightLine"]
