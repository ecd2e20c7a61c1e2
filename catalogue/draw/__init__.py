"""Drawings of guides; matplotlib is imported only when one is made."""

from .sheet import FORMATS, draw

__all__ = ["FORMATS", "draw"]
