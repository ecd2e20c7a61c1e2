"""From a wish to ranked, verified candidates."""

from .candidate import Candidate
from .constraints import Constraints
from .found import Found
from .request import CircularArc, StraightLine

__all__ = ["Candidate", "CircularArc", "Constraints", "Found", "StraightLine"]
