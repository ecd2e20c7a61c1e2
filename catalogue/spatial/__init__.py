"""Mechanisms in space: rigid bodies on joints, links and guides.

``geometry``
    ``Guides(kind, parameters, origin, quaternion)``: the guides of one point of all mechanisms;
    ``KINDS`` by name: six surfaces (cylinder, cone, hyperboloid, torus, sphere, plane; charts of
    Table I and regular ones, ``hyperboloid:sinh`` ...), three curves; ``Kind``, ``Revolved`` and
    ``Quadric`` are the base classes of a user's own surfaces.
``guided``
    A body with points on surfaces and curves (Mangeron, Oğuztöreli and Plitea 1970, two notes):
    five points on surfaces, one on a curve and three on surfaces, ...; six classes with one to
    three degrees of freedom.  Everything works on batches, the leading axis being that of the
    mechanisms, with guides of different kinds side by side. ``Mechanisms(body, guides, drivers)``
    is a checked batch, ``solve_positions`` computes its positions near a start, ``assemblies`` all
    positions, ``jets`` derivatives of any order, ``follow`` the motion along a path of the drivers.

>>> from catalogue.spatial import Guides, Mechanisms, follow, jets
>>> circles = Guides("circle", r), Guides("circle", s, origins, quaternions)
>>> batch = Mechanisms(body, [*circles, Guides(["cylinder", "torus"], shapes)], drivers=[(0, "u")])
>>> motion = follow(batch, path, start)
>>> jets(batch, motion.node(0), [[1.0, 0.0]]).spin

``jointed``
    Bodies on revolute, screw, prismatic, cylindrical, spherical and universal joints, on gears, on
    links with spherical joints at both ends, and on guides, from hard points in the design pose.
    ``Mechanism(elements)``; ``sweep(drive, values)`` returns its ``Motion`` with derivatives,
    ``circuit(drive)`` the whole circuit (``circuits`` for a batch), ``mobility`` its freedoms.  Any
    scalar can drive: ``Joint``, ``Travel``, ``Length``, ``Angle``, ``GuideCoordinate``.

>>> from catalogue.spatial import Link, Mechanism, Travel
>>> axle = Mechanism([Link("ground", a, "wheel", b) for a, b in zip(inner, outer)])
>>> axle.sweep(Travel("wheel", centre), np.linspace(-80, 80, 161)).point("wheel", centre)

``fitting``
    ``fit(mechanism, targets, boxes, bounds)``: move hard points inside boxes to fit target curves.

>>> from catalogue.spatial import Box, Sweep, Target, fit
>>> bump = Sweep(Travel("wheel", centre), np.linspace(-80, 80, 17))
>>> read = lambda m: kinematics(m, wheel)["toe [deg]"]
>>> toe = Target("toe", read, bump, 0.0, tolerance=0.01, unit="deg")
>>> print(fit(axle, [toe], [Box("tie rod.to", (0, 0, 15))]))

Names are loaded when first used; no planar request loads any.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .fitting.boxes import Box
    from .fitting.fit import fit
    from .fitting.outcome import Fit
    from .fitting.targets import Bound, Sweep, Target, link_length, off_circle, off_line
    from .geometry.guides import KINDS, Guides
    from .geometry.kinds import Kind, Quadric, Revolved
    from .geometry.rotations import matrix, quaternion
    from .guided.assemblies import Assemblies, assemblies
    from .guided.derivatives import Jets, jets
    from .guided.follow import follow
    from .guided.mechanism import Mechanisms
    from .guided.position import Positions, solve_positions
    from .jointed.axle import Wheel, kinematics
    from .jointed.circuit import Circuit
    from .jointed.elements import (
        Angle,
        Coupling,
        Cylindrical,
        Fixed,
        GuideCoordinate,
        Joint,
        KeepAngle,
        Length,
        Link,
        OnGuide,
        Prismatic,
        Revolute,
        Screw,
        Spherical,
        Sum,
        Travel,
        Universal,
    )
    from .jointed.job import Job
    from .jointed.links import PAIRS, links
    from .jointed.mechanism import Mechanism, Mobility
    from .jointed.motion import Motion, in_time
    from .jointed.reading import load
    from .jointed.sensitivity import sensitivities
    from .jointed.statics import Load, reactions
    from .jointed.transmission import transmission
    from .jointed.two_wheels import axle
    from .jointed.vehicle import Vehicle, anti_dive

#: Module of each public name.
_HOME = {
    "fitting.boxes": "Box",
    "fitting.fit": "fit",
    "fitting.outcome": "Fit",
    "fitting.targets": "Bound Sweep Target link_length off_circle off_line",
    "geometry.guides": "KINDS Guides",
    "geometry.kinds": "Kind Quadric Revolved",
    "geometry.rotations": "matrix quaternion",
    "guided.assemblies": "Assemblies assemblies",
    "guided.derivatives": "Jets jets",
    "guided.follow": "follow",
    "guided.mechanism": "Mechanisms",
    "guided.position": "Positions solve_positions",
    "jointed.axle": "Wheel kinematics",
    "jointed.circuit": "Circuit",
    "jointed.elements": "Angle Coupling Cylindrical Fixed GuideCoordinate Joint KeepAngle Length Link OnGuide "
    "Prismatic Revolute Screw Spherical Sum Travel Universal",
    "jointed.links": "PAIRS links",
    "jointed.mechanism": "Mechanism Mobility",
    "jointed.motion": "Motion in_time",
    "jointed.job": "Job",
    "jointed.reading": "load",
    "jointed.sensitivity": "sensitivities",
    "jointed.statics": "Load reactions",
    "jointed.transmission": "transmission",
    "jointed.two_wheels": "axle",
    "jointed.vehicle": "Vehicle anti_dive",
}
_MODULE = {name: home for home, names in _HOME.items() for name in names.split()}

__all__ = [
    "KINDS",
    "PAIRS",
    "Angle",
    "Assemblies",
    "Bound",
    "Box",
    "Circuit",
    "Coupling",
    "Cylindrical",
    "Fit",
    "Fixed",
    "GuideCoordinate",
    "Guides",
    "Jets",
    "Job",
    "Joint",
    "KeepAngle",
    "Kind",
    "Length",
    "Link",
    "Load",
    "Mechanism",
    "Mechanisms",
    "Mobility",
    "Motion",
    "OnGuide",
    "Positions",
    "Prismatic",
    "Quadric",
    "Revolute",
    "Revolved",
    "Screw",
    "Spherical",
    "Sum",
    "Sweep",
    "Target",
    "Travel",
    "Universal",
    "Vehicle",
    "Wheel",
    "anti_dive",
    "assemblies",
    "axle",
    "fit",
    "follow",
    "in_time",
    "jets",
    "kinematics",
    "link_length",
    "links",
    "load",
    "matrix",
    "off_circle",
    "off_line",
    "quaternion",
    "reactions",
    "sensitivities",
    "solve_positions",
    "transmission",
]


if not TYPE_CHECKING:  # type checkers use the imports above

    def __getattr__(name: str) -> Any:
        if name in _MODULE:
            value = getattr(import_module(f"{__name__}.{_MODULE[name]}"), name)
            globals()[name] = value
            return value
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
