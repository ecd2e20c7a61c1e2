"""Drawings of guides; matplotlib is imported only when one is made."""

from .paper import FORMATS
from .sheet import draw

__all__ = ["FORMATS", "draw"]
