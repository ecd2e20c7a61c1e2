"""A design catalogue of guide mechanisms (see README.md)."""

__version__ = "0.1.0"
