"""Contract tests for the authors of plugins; needs pytest and mpmath (``mechanism-catalogue[test]``).

`SeriesContract` and `CollectionContract` are subclassed, `load` reads a plugin; `contact` measures
orders of contact with many digits, sharing no formula with the core.  Import the three from the
room; it imports `plugin` and what lies below.
"""

from .collection import CollectionContract
from .contract import SeriesContract, load

__all__ = ["CollectionContract", "SeriesContract", "load"]
