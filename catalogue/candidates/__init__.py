"""Candidates: placed guides, measured on their finite motion, checked, compared and selected.

`batch.CandidateBatch` is the type that search, refinement and results pass on; its module places
and measures candidates, `feasibility` checks, `select` compares and chooses, `stored` reads guides.
Import from the modules; they import `problem`, `guidance` and what lies below.
"""
