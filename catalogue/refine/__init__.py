"""Refinement: move the pivots and the guided points of candidates until what they are ranked by is least.

`sqp` drives, `subproblem` linearises, `quantities` has the derivatives, `step` and `qp` solve, `parametrisation` says
what may move, `certificate` proves, `drift` tells how far it went.  Import from the modules; they import `candidates`,
`series` (for the drift), `problem`, `guide` and what lies below.
"""
