"""A design catalogue of guide mechanisms: linkages that guide a point along a line or an arc.

>>> import catalogue
>>> cat = catalogue.open()
>>> found = cat.find(catalogue.StraightLine(stroke=150, deviation=0.05), min_transmission=40)

Names are loaded when they are first used; see README.md.
"""

from __future__ import annotations

from .interrupt import IS_COMMAND  # imported first: what follows takes time

# isort: split
from importlib import import_module
from typing import TYPE_CHECKING, Any

from .installed import fault

__version__ = "0.1.0"

if not IS_COMMAND and (_fault := fault()):  # the command reports the fault itself
    import warnings

    warnings.warn(_fault, stacklevel=2)

if TYPE_CHECKING:
    from .api import Catalogue, classify, open
    from .curvature_theory.analysis import Curvature, curvature
    from .errors import (
        CatalogueError,
        DatabaseError,
        DatabaseTooNew,
        DuplicateSeries,
        InvalidLinkage,
        InvalidRequest,
        MissingExtra,
        PluginError,
    )
    from .find.answers import load, recall
    from .find.candidate import Candidate
    from .find.chain_motion import ChainMotion
    from .find.dwell_results import StandStill
    from .find.guide_motion import GuideMotion
    from .find.improve import Improvement, improve
    from .find.measure import Measured, Stretch, measure
    from .find.own_chain import ChainStretch, OwnChain, mechanism
    from .find.own_guide import OwnGuide, guide
    from .find.placed import PlacedGuide
    from .find.results import Found
    from .kinematics.linkage import Linkage
    from .problem.constraints import ConstraintArguments, Constraints
    from .problem.path import CircularArc, StraightLine
    from .problem.problem import Request
    from .study.study import Study

_HOME = {
    "Candidate": "find.candidate",
    "Catalogue": "api",
    "CatalogueError": "errors",
    "ChainMotion": "find.chain_motion",
    "ChainStretch": "find.own_chain",
    "CircularArc": "problem.path",
    "ConstraintArguments": "problem.constraints",
    "Constraints": "problem.constraints",
    "Curvature": "curvature_theory.analysis",
    "DatabaseError": "errors",
    "DatabaseTooNew": "errors",
    "DuplicateSeries": "errors",
    "Found": "find.results",
    "GuideMotion": "find.guide_motion",
    "Improvement": "find.improve",
    "InvalidLinkage": "errors",
    "InvalidRequest": "errors",
    "Linkage": "kinematics.linkage",
    "Measured": "find.measure",
    "MissingExtra": "errors",
    "OwnChain": "find.own_chain",
    "OwnGuide": "find.own_guide",
    "PlacedGuide": "find.placed",
    "PluginError": "errors",
    "Request": "problem.problem",
    "StandStill": "find.dwell_results",
    "StraightLine": "problem.path",
    "Stretch": "find.measure",
    "Study": "study.study",
    "classify": "api",
    "curvature": "curvature_theory.analysis",
    "guide": "find.own_guide",
    "improve": "find.improve",
    "load": "find.answers",
    "measure": "find.measure",
    "mechanism": "find.own_chain",
    "open": "api",
    "recall": "find.answers",
}

__all__ = [
    "Candidate",
    "Catalogue",
    "CatalogueError",
    "ChainMotion",
    "ChainStretch",
    "CircularArc",
    "ConstraintArguments",
    "Constraints",
    "Curvature",
    "DatabaseError",
    "DatabaseTooNew",
    "DuplicateSeries",
    "Found",
    "GuideMotion",
    "Improvement",
    "InvalidLinkage",
    "InvalidRequest",
    "Linkage",
    "Measured",
    "MissingExtra",
    "OwnChain",
    "OwnGuide",
    "PlacedGuide",
    "PluginError",
    "Request",
    "StandStill",
    "StraightLine",
    "Stretch",
    "Study",
    "__version__",
    "classify",
    "curvature",
    "guide",
    "improve",
    "load",
    "measure",
    "mechanism",
    "open",
    "recall",
]


if not TYPE_CHECKING:  # type checkers must know the names above and no others

    def __getattr__(name: str) -> Any:
        if name in _HOME:
            value = getattr(import_module(f".{_HOME[name]}", __name__), name)
            globals()[name] = value
            return value
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
