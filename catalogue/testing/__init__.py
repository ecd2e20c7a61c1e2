"""Contract tests for the authors of plugins; needs pytest and mpmath (``mechanism-catalogue[test]``)."""

from .collection import CollectionContract
from .contract import SeriesContract, load

__all__ = ["CollectionContract", "SeriesContract", "load"]
