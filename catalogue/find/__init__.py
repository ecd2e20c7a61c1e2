"""Answer requests in the user's unit: search, measure, improve, explain and store.

`find` answers a request with `results`, which `explain` explains; `prescribed_pivots`, `stored`,
`dwells` and `specimens` (of collections) answer other questions; `census` counts the store and
`frame` returns it as a data frame.  `placed` is the base of all placed guides; `measure` and
`improve` take the user's own linkage; `answers` stores answers under their codes. Import from the
modules; they import everything below, nothing of the command line.
"""
