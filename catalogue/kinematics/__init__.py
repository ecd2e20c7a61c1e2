"""Linkages and their finite motion: six families as one type, moved in closed form.

`linkage` has the central type, a batch of pivots; `motion` solves the pose equation in its charts,
change points included; `link_lengths` and `from_lengths` convert between pivots and lengths,
`cognates` finds other linkages with the same path.  `types` has the names of array types, `batch`
indexing of records of arrays, `polynomials` and `power_series` their arithmetic, `families` the
declaration of a family by a plugin.  Import from the modules; they import `errors` alone.
"""
