"""Candidates: placed guides, measured on their finite motion, checked, compared and selected.

`batch.CandidateBatch` is what search, refinement and results pass on; the same module places and
measures it, `feasibility` checks, `select` compares and chooses, `stored` reads guides.  Import
from the modules; they import `problem`, `guidance` and what lies below.
"""
