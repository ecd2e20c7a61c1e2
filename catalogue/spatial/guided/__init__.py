"""The six classes of a body with points on surfaces and curves: positions, derivatives, motion.

Guides of a batch may differ in kind.  `mechanism.Mechanisms` is a checked batch;
`position.solve_positions` solves its position equations (`equations`) by `newton`; `formulation`
finds singularities of Euler angles and distances.  `assemblies` finds all solutions, by
`closed_form` or from random starts; `derivatives.jets` computes velocities and higher derivatives.
`follow.follow` moves a batch along a path of its drivers, by `walk` (with steps of `continuation`)
and `filling`, or, where numba is installed, by `compiled` and `kernel`.  The room imports
`geometry`, `continuation` and `native`.
"""
