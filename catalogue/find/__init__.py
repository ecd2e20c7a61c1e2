"""Find: from a request in the user's unit to candidates, and what is told of them.

`find` is the way; `results` is what comes of it, `explain` what is said; `prescribed_pivots`, `stored`, `dwells` and
`specimens` (of collections) are other questions, `census` counts what there is, `frame` returns it as a data frame.
`placed` is what all guides have that stand somewhere, `measure` and `improve` take a linkage of the user's own, and
`answers` keeps answers under their codes.
Import from the modules; they import everything below, nothing of the command line.
"""
