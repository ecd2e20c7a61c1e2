"""The names that plugins may import: ``from catalogue.plugin import hookimpl, Series``.

For all: `hookimpl`, errors, array types, arithmetic of power series.  For series: `Series` and its
parts, building blocks of synthesis, `Instant`.  For collections: `Collection` and its parts, the
request, results, the paper of drawings. `hookspecs` is the contract; `registry`, which loads
plugins, is for the core alone.  Names are loaded when first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..chains.structure import Structure
    from ..collections.goal import Bound, Goal
    from ..collections.results import CollectionCandidate
    from ..collections.spec import LENGTH, Collection, Measured, Metric, Places, Specimen, Tags
    from ..curvature_theory.dead_points import dead_points, off_line
    from ..curvature_theory.instant import Instant
    from ..curvature_theory.leading_error import EXACT
    from ..errors import InvalidLinkage, InvalidRequest, PluginError
    from ..guidance.minimum_zone import grid
    from ..kinematics.families import Family
    from ..kinematics.linkage import PR, RP, RR, Linkage
    from ..kinematics.plane_vectors import dot
    from ..kinematics.polynomials import product, real_roots
    from ..kinematics.power_series import taylor_product, taylor_quotient, taylor_root
    from ..kinematics.types import Array, Complexes, Floats, Indices, Mask
    from ..paper import PAPER, blank, kind_of, write
    from ..problem.path import CircularArc, PathRequest, StraightLine
    from ..series.chain_family import ChainFamily, apex
    from ..series.pairs import (
        alike,
        circle_pair,
        linkage_of,
        normal_pair,
        pair,
        parallel_pair,
        point,
        ray_pair,
        roots,
        slide_pair,
        slider_pair,
        tangent_circle_pair,
        tangent_pair,
        without,
    )
    from ..series.posed import (
        Posed,
        circle_through,
        equidistant,
        four_bars,
        mirror_images,
        on_ray,
        poles_by_two_cranks,
        unit,
    )
    from ..series.series import Guided, Member, Parameter, Parameters, Series, angles
    from .hookspecs import hookimpl
    from .mechanisms import chain_collection

#: Module of each public name.
_HOME = {
    "plugin.hookspecs": "hookimpl",
    "errors": "InvalidLinkage InvalidRequest PluginError",
    "kinematics.types": "Array Complexes Floats Indices Mask",
    "kinematics.families": "Family",
    "kinematics.linkage": "Linkage PR RP RR",
    "kinematics.plane_vectors": "dot",
    "kinematics.polynomials": "product real_roots",
    "kinematics.power_series": "taylor_product taylor_quotient taylor_root",
    "curvature_theory.instant": "Instant",
    "curvature_theory.dead_points": "dead_points off_line",
    "curvature_theory.leading_error": "EXACT",
    "chains.structure": "Structure",
    "series.chain_family": "ChainFamily apex",
    "plugin.mechanisms": "chain_collection",
    "series.series": "Guided Member Parameter Parameters Series angles",
    "series.pairs": "alike circle_pair linkage_of normal_pair pair parallel_pair point ray_pair roots slide_pair "
    "slider_pair tangent_circle_pair tangent_pair without",
    "series.posed": "Posed circle_through equidistant four_bars mirror_images on_ray poles_by_two_cranks unit",
    "problem.path": "CircularArc PathRequest StraightLine",
    "collections.goal": "Bound Goal",
    "collections.spec": "Collection LENGTH Measured Metric Places Specimen Tags",
    "collections.results": "CollectionCandidate",
    "guidance.minimum_zone": "grid",
    "paper": "PAPER blank kind_of write",
}
_MODULE = {name: home for home, names in _HOME.items() for name in names.split()}

__all__ = [
    "EXACT",
    "LENGTH",
    "PAPER",
    "PR",
    "RP",
    "RR",
    "Array",
    "Bound",
    "ChainFamily",
    "CircularArc",
    "Collection",
    "CollectionCandidate",
    "Complexes",
    "Family",
    "Floats",
    "Goal",
    "Guided",
    "Indices",
    "Instant",
    "InvalidLinkage",
    "InvalidRequest",
    "Linkage",
    "Mask",
    "Measured",
    "Member",
    "Metric",
    "Parameter",
    "Parameters",
    "PathRequest",
    "Places",
    "PluginError",
    "Posed",
    "Series",
    "Specimen",
    "StraightLine",
    "Structure",
    "Tags",
    "alike",
    "angles",
    "apex",
    "blank",
    "chain_collection",
    "circle_pair",
    "circle_through",
    "dead_points",
    "dot",
    "equidistant",
    "four_bars",
    "grid",
    "hookimpl",
    "kind_of",
    "linkage_of",
    "mirror_images",
    "normal_pair",
    "off_line",
    "on_ray",
    "pair",
    "parallel_pair",
    "point",
    "poles_by_two_cranks",
    "product",
    "ray_pair",
    "real_roots",
    "roots",
    "slide_pair",
    "slider_pair",
    "tangent_circle_pair",
    "tangent_pair",
    "taylor_product",
    "taylor_quotient",
    "taylor_root",
    "unit",
    "without",
    "write",
]


def __getattr__(name: str) -> Any:
    if name in _MODULE:
        value = getattr(import_module(f"catalogue.{_MODULE[name]}"), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
