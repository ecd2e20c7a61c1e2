"""What compiled kernels have in common: whether numba is there, loading one, telling who waits for the compiler.

`jointed.compiled` and `guided.compiled` load theirs by it.  numba is imported with the first kernel that is loaded.
"""
