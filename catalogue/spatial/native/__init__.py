"""What compiled kernels have in common: whether numba is there, how it compiles and what it keeps, who is told to wait
for it, and the solution of a few equations.

`jointed.compiled` and `guided.compiled` load theirs by it.  numba is imported with the first kernel that is loaded.
"""
