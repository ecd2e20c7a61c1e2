"""Mechanisms of bodies, joints and links from hard points, one or a batch.

`elements` is what an engineer states, `formulation` makes equations of it: `spanning_tree` says
which joint carries which body, `loop_closure` what closes the loops, `drives` what scalars are, all
in terms of `hard_points` and `located_guide`.  `tree` has the poses and screws of bodies that hang
on joints, `system` the conditions between them and the Jacobian.

`mechanism.Mechanism` is the front; `sweeping` moves it along its `curve` of poses, by
`continuation`; `motion` is what a sweep gives, `circuit` the whole of a motion.  `compiled` lets
numba do it, by `kernel`, where it is installed.  It imports `geometry`, `continuation` and
`native`.
"""
