"""Search: from a problem to candidates that meet it; stored guides and guides made to measure are starts.

`retrieve` reads stored starts, `synthesis` makes others, `search.Search` drives the refinement in stages.  Import from
the modules; they import `refine`, `candidates`, `problem`, `store` and what lies below.
"""
