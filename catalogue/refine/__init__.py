"""Refinement: move pivots and guided points of candidates to minimise the ranked cost.

`sqp` iterates, `subproblem` linearises, `quantities` has the derivatives, `step` sets up a convex
programme, which `interior_point` solves, `certificate` bounds the possible further gain.

`race` leads many starts inside the constraints without a programme, by the steps of `hinges`.
Import from the modules; they import `candidates`, `series` (for the drift), `problem`, `guidance`
and what lies below.
"""
