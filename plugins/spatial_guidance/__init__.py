"""A rigid body guided in space by points on surfaces and curves (Mangeron, Oğuztöreli and Plitea 1970, two notes).

Five points on surfaces, one on a curve and three on surfaces, ...: six classes with one to three degrees of freedom;
as many curvilinear coordinates of guided points are driven.  Everything works on batches, the leading axis being
that of the mechanisms, with guides of different kinds side by side.  Rooms, each of which imports from those above it
in this list alone; their first pages say what is where:

``geometry``
    ``Guides(kind, parameters, origin, quaternion)``: the guides of one point of all mechanisms; ``KINDS`` by name: six
    surfaces (cylinder, cone, hyperboloid, torus, sphere, plane; charts of Table I and regular ones,
    ``hyperboloid:sinh`` ...), three curves.
``kinematics``
    ``Mechanisms(body, guides, drivers)``: a checked batch; ``name`` is its class, ``series`` the degeneration series,
    ``[index]`` selects or repeats.
    ``solve_positions(mechanisms, drivers, start)``: ``Positions`` with success, residual, condition number and reason.
    ``assemblies(mechanisms, drivers)``: all ``Assemblies`` of each, with hits and certificates.
    ``jets(mechanisms, positions, rates)``: ``Jets`` of points, coordinates and angular velocity, to any order;
    with rates (1, 0, ...) the reduced ones, by the driver.
    ``follow(mechanisms, path, start)``: ``Motion`` along the path, up to turning points, branch points and edges.
``collection``
    ``COLLECTION``: all of that as a collection of the catalogue, imported when one is asked for.

>>> guides = [Guides("circle", r), Guides("circle", s, origins, quaternions), Guides(["cylinder", "torus"], shapes)]
>>> batch = Mechanisms(body, guides, drivers=[(0, "u")])
>>> motion = follow(batch, path, start)
>>> jets(batch, motion.node(0), [[1.0, 0.0]]).spin
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from catalogue.plugin import hookimpl

if TYPE_CHECKING:
    from catalogue.plugin import Collection


@hookimpl
def catalogue_collections() -> list[Collection]:
    from .collection.definition import COLLECTION

    return [COLLECTION]
