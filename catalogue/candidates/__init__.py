"""Candidates: placed guides, measured on their finite motion, checked, compared and selected.

`batch.CandidateBatch` is what search, refinement and results pass on (`batching` takes and joins such records);
`placement` places and measures, `feasibility` checks, `similarity`, `pareto` and `select` choose, `stored` reads
guides.  Import from the modules; they import `problem`, `guide` and what lies below.
"""
