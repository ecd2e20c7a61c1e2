"""The instant of a linkage: pole, axes, cubics, principal pairs, configuration, leading errors of guided points."""

from .analysis import Curvature, curvature
from .circling import circling_points
from .dead import dead_points
from .elements import Elements, elements
from .error import EXACT, LeadingError, leading_error, leading_error_of_pairs, path_singularity
from .instant import Instant
from .regions import configuration

__all__ = [
    "EXACT",
    "Curvature",
    "Elements",
    "Instant",
    "LeadingError",
    "circling_points",
    "configuration",
    "curvature",
    "dead_points",
    "elements",
    "leading_error",
    "leading_error_of_pairs",
    "path_singularity",
]
