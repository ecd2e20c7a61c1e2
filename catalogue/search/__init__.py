"""Search: from a problem to candidates that meet it; stored guides and guides made to measure are starts.

`retrieve` reads stored starts, `synthesis` makes others, `search` drives the refinement in stages.
May import `refine`, `candidates`, `problem`, `store` and what lies below.
"""
