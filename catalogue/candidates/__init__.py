"""Candidates: placed guides, measured on their finite motion, checked, compared and selected.

`batch.CandidateBatch` is what search, refinement and results pass on; `placement` places and measures,
`feasibility` checks, `select` compares and chooses, `stored` reads guides.  Import from the modules; they import
`problem`, `guide` and what lies below.
"""
