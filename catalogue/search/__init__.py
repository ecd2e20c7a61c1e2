"""Search: from a problem to feasible candidates; starts are stored or synthesised guides.

`retrieve` reads stored starts; `euler_savary`, `rotating_crank`, `turning_cranks` and
`exact_guides` synthesise others, with `draws`; `starts.Starts` gathers and counts them,
`search.Search` refines them in phases. Import from the modules; they import `refine`, `candidates`,
`problem`, `store` and what lies below.
"""
