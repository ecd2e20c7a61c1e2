"""The instant of a linkage: pole, axes, cubics of stationary curvature, principal pairs, configuration."""

from .analysis import Curvature, curvature
from .dead import dead_points
from .instant import Instant
from .regions import configuration

__all__ = ["Curvature", "Instant", "configuration", "curvature", "dead_points"]
