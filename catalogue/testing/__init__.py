"""Contract tests for the authors of plugins; needs pytest and mpmath (``mechanism-catalogue[test]``)."""

from .contract import SeriesContract, load

__all__ = ["SeriesContract", "load"]
