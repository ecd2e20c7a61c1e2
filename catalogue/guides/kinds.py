"""Tell kinds of guides apart by their attributes, without importing their classes."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from typing_extensions import TypeIs

    from .candidate import Candidate
    from .chain_stretch import ChainStretch
    from .dwell import DwellCandidate
    from .own_chain import OwnChain
    from .placed import PlacedGuide

    #: A linkage of two dyads, or a mechanism of many bars.
    Guide: TypeAlias = PlacedGuide | OwnChain


def has_bars(guide: object) -> TypeIs[OwnChain]:
    """Tell whether a guide is a mechanism of many bars, such as `catalogue.mechanism` makes."""
    return hasattr(guide, "bars")


def has_stroke(guide: object) -> TypeIs[Candidate | ChainStretch]:
    """Tell whether a guide runs along a path: an answer of a search, or a measured stretch."""
    return hasattr(guide, "stroke")


def is_candidate(guide: object) -> TypeIs[Candidate]:
    """Tell whether a guide runs along a path and is a linkage of two dyads."""
    return has_stroke(guide) and not has_bars(guide)


def is_dwell(guide: object) -> TypeIs[DwellCandidate]:
    """Tell whether a guide drives a rod and a rocker that dwells."""
    return hasattr(guide, "joint")
