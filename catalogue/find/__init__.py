"""Find: from a request in the user's unit to candidates, and what is told of them.

`find` is the way; `results` is what comes of it, `explain` what is said; `prescribed_pivots`, `stored`, `dwells` and
`specimens` (of collections) are other questions, `census` counts what there is, `frame` returns it as a data frame.
Import from the modules; they import everything below, nothing of the command line.
"""
