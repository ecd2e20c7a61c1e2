"""Search: from a problem to candidates that meet it; stored guides and guides made to measure are
starts.

`retrieve` reads stored starts; `euler_savary`, `rotating_crank` and `exact_guides` make others,
from `draws`; `starts.Starts` gathers them, `search.Search` drives their refinement in phases, and
`report` tells of it.  Import from the modules; they import `refine`, `candidates`, `problem`,
`store` and what lies below.
"""
