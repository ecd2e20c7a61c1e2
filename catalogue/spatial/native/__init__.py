"""Common parts of compiled kernels: loading and compiling by numba, continuation of curves of
poses.

`equations` is the interface of a kernel's equations, `newton` solves them, `curve` follows their
curve to dead points and given values; `elimination` solves linear equations.  `loading` loads
kernels for `jointed.compiled` and `guided.compiled`; the first one imports numba.
"""
