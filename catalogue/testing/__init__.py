"""Contract tests for authors of plugins (extra ``test``: pytest and mpmath).

Subclass `SeriesContract` or `CollectionContract`; `load` reads a plugin; `contact` measures orders
of contact with many digits, and shares no formula with the core.  Import these from the room; it
imports `plugin` and what lies below.
"""

from .collection import CollectionContract
from .contract import SeriesContract, load

__all__ = ["CollectionContract", "SeriesContract", "load"]
