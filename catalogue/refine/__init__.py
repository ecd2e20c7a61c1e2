"""Refinement: move the pivots and the guided points of candidates until what they are ranked by is least.

`sqp` drives, `subproblem` linearises, `quantities` has the derivatives, `qp` solves, `certificate` proves.
May import `candidates`, `problem`, `guide` and what lies below.
"""
