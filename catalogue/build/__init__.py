"""Filling the database: draw linkages of each series, trace what they guide, keep what is in proportion."""

from .fill import Progress, fill

__all__ = ["Progress", "fill"]
