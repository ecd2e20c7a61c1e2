"""Kinematics: where a guided body is, how fast it moves and how far it can go, for batches of mechanisms.

`mechanism.Mechanisms` is a checked batch; `position.solve_positions` solves its position equations (`equations`, by
`newton`), `assemblies` finds all solutions, `derivatives.jets` velocities and what follows them, `follow.follow` leads
a batch along a path of its drivers (`continuation`, one step at a time: `predictor_corrector`).  Import from the
modules; they import `geometry`.
"""
