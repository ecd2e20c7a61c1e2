"""A design catalogue of guide mechanisms: linkages that guide a point along a line or an arc.

>>> import catalogue
>>> cat = catalogue.open()
>>> found = cat.find(catalogue.StraightLine(stroke=150, deviation=0.05), min_transmission=40)

Names are loaded when they are first used; see README.md.
"""

from __future__ import annotations

from .interrupt import IS_COMMAND  # imported first: the other imports are slow

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
    from .find.improve import improve
    from .find.measure import measure
    from .guides.candidate import Candidate
    from .guides.chain_motion import ChainMotion
    from .guides.chain_stretch import ChainStretch
    from .guides.dwell import StandStill
    from .guides.guide_motion import GuideMotion
    from .guides.own_chain import OwnChain, mechanism
    from .guides.own_guide import OwnGuide, guide
    from .guides.placed import PlacedGuide
    from .guides.results import Found, Improvement, Measured
    from .guides.stretch import Stretch
    from .kinematics.linkage import Linkage
    from .problem.constraints import ConstraintArguments, Constraints
    from .problem.path import CircularArc, StraightLine
    from .problem.problem import Request
    from .study.study import Study

_HOME = {
    "Candidate": "guides.candidate",
    "Catalogue": "api",
    "CatalogueError": "errors",
    "ChainMotion": "guides.chain_motion",
    "ChainStretch": "guides.chain_stretch",
    "CircularArc": "problem.path",
    "ConstraintArguments": "problem.constraints",
    "Constraints": "problem.constraints",
    "Curvature": "curvature_theory.analysis",
    "DatabaseError": "errors",
    "DatabaseTooNew": "errors",
    "DuplicateSeries": "errors",
    "Found": "guides.results",
    "GuideMotion": "guides.guide_motion",
    "Improvement": "guides.results",
    "InvalidLinkage": "errors",
    "InvalidRequest": "errors",
    "Linkage": "kinematics.linkage",
    "Measured": "guides.results",
    "MissingExtra": "errors",
    "OwnChain": "guides.own_chain",
    "OwnGuide": "guides.own_guide",
    "PlacedGuide": "guides.placed",
    "PluginError": "errors",
    "Request": "problem.problem",
    "StandStill": "guides.dwell",
    "StraightLine": "problem.path",
    "Stretch": "guides.stretch",
    "Study": "study.study",
    "classify": "api",
    "curvature": "curvature_theory.analysis",
    "guide": "guides.own_guide",
    "improve": "find.improve",
    "load": "find.answers",
    "measure": "find.measure",
    "mechanism": "guides.own_chain",
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


if not TYPE_CHECKING:  # type checkers use the imports above

    def __getattr__(name: str) -> Any:
        if name in _HOME:
            value = getattr(import_module(f".{_HOME[name]}", __name__), name)
            globals()[name] = value
            return value
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
