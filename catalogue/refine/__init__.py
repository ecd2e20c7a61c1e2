"""Refinement: move pivots and guided points of candidates to minimise the ranked cost.

`sqp` iterates, `subproblem` linearises, `quantities` has the derivatives, `step` makes a linear
programme of them, which `interior_point` solves, `certificate` bounds what is left to gain.

`race` leads many starts inside the limits of a problem without a programme, by the steps of
`hinges`. Import from the modules; they import `candidates`, `series` (for the drift), `problem`,
`guidance` and what lies below.
"""
