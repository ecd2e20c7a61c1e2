"""Curvature law, stationary curvature and principal pairs of a linkage in its reference position."""

from .analysis import Curvature, curvature
from .dead import dead_points
from .regions import configuration

__all__ = ["Curvature", "configuration", "curvature", "dead_points"]
