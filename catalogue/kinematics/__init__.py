"""Linkages and their finite motion: six families as one type, moved in closed form.

`linkage` is the type that everything else passes on, a batch of pivots; `motion` solves the pose
equation in its charts, change points included; `link_lengths` and `from_lengths` go between pivots
and lengths, `cognates` to other linkages with the same path.  `types` has the names of array types,
`batch` takes records of arrays apart, `polynomials` and `power_series` have their arithmetic.
`families` is what a plugin says of a family.  Import from the modules; they import `errors` alone.
"""
