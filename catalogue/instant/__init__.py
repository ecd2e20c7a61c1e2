"""The instant of a linkage: pole, axes, cubics, principal pairs, configuration, leading errors of guided points."""

from .analysis import Curvature, curvature
from .dead import dead_points
from .error import LeadingError, leading_error, leading_error_of_pairs, path_singularity
from .instant import Instant
from .regions import configuration

__all__ = [
    "Curvature",
    "Instant",
    "LeadingError",
    "configuration",
    "curvature",
    "dead_points",
    "leading_error",
    "leading_error_of_pairs",
    "path_singularity",
]
