"""The six classes of a body with points on surfaces and curves: where it is, how fast it moves, how
far it can go.

Batches of unlike guides.  `mechanism.Mechanisms` is a checked batch; `position.solve_positions`
solves its position equations (`equations`) by `newton`, and `formulation` says where Euler angles
or distances would be singular. `assemblies` finds all solutions (by `closed_form`, else from
random starts), `derivatives.jets` velocities and what follows them, `follow.follow` leads a batch
along a path of its drivers (`walk`, whose steps are those of `continuation`, and `filling`), or,
where numba is installed, `compiled` does by `kernel`.  It imports `geometry`, `continuation` and
`native`.
"""
