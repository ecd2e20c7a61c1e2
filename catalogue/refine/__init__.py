"""Refinement: move the pivots and the guided points of candidates until what they are ranked by is
least.

`sqp` drives, `subproblem` says what may move and linearises, `quantities` has the derivatives,
`step` makes of them a programme, which `interior_point` solves, `certificate` proves, and tells how
far it went.

`race` leads many starts inside the limits of a problem without a programme, by the steps of
`hinges`. Import from the modules; they import `candidates`, `series` (for the drift), `problem`,
`guidance` and what lies below.
"""
