"""Refinement: move the pivots and the guided point so that the deviation over the stroke becomes least."""

from .refine import refined

__all__ = ["refined"]
