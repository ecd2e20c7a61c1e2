"""A rigid body guided in space by points on surfaces and curves (Mangeron, Oğuztöreli and Plitea 1970, two notes).

Five points on surfaces, one on a curve and three on surfaces, ...: six classes with one to three degrees of freedom;
as many curvilinear coordinates of guided points are driven.  Everything works on batches, the leading axis being
that of the mechanisms, with guides of different kinds side by side.  Modules, from the bottom:

``taylor``, ``rotation``, ``elimination``
    Power series that numpy's functions take, quaternions, small linear systems by the thousand.
``kinds``, ``surfaces``, ``curves``
    ``Kind``: a surface or curve in its own axes; a new one is a subclass of a few lines.  Six surfaces (cylinder, cone,
    hyperboloid, torus, sphere, plane; charts of Table I and regular ones, ``hyperboloid:sinh`` ...), three curves.
``guides``, ``mechanism``
    ``Guides(kind, parameters, origin, quaternion)``: the guides of one point of all mechanisms; ``KINDS`` by name.
    ``Mechanisms(body, guides, drivers)``: a checked batch; ``name`` is its class, ``series`` the degeneration series,
    ``[index]`` selects or repeats.
``unknowns``, ``system``, ``newton``
    The equations, six at most, which know the handedness of the body, and damped Newton steps.
``position``
    ``solve_positions(mechanisms, drivers, start)``: ``Positions`` with success, residual, condition number and reason.
``assemblies``
    ``assemblies(mechanisms, drivers)``: all ``Assemblies`` of each, with hits and certificates.
``jets``
    ``jets(mechanisms, positions, rates)``: ``Jets`` of points, coordinates and angular velocity, to any order;
    with rates (1, 0, ...) the reduced ones, by the driver.
``continuation``, ``walk``, ``follow``
    ``follow(mechanisms, path, start)``: ``Motion`` along the path, up to turning points, branch points and edges.
``plain``, ``fits``, ``measures``, ``points``, ``special``, ``draw``, ``picture``
    Mechanisms as plain data; the nearest line and circle of a path; what is measured over a stroke; which point runs
    straightest; well-known cases; random mechanisms; a drawing.
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
    from .collection import COLLECTION

    return [COLLECTION]
