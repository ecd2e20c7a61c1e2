"""What compiled kernels have in common: whether numba is there, how it compiles and what it keeps,
who is told to wait for it; the steps along a curve of poses, its dead points and the poses between,
whatever equations they satisfy.

`equations` says what a kernel must offer, `newton` solves, `curve` follows; `elimination` solves
linear equations. `jointed.compiled` and `guided.compiled` load theirs by `loading`.  numba is
imported with the first kernel.
"""
