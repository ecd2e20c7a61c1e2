"""Mechanisms of bodies, joints and links, defined by hard points; one or a batch.

An engineer states a mechanism in `elements`.  `formulation` makes equations of them:
`spanning_tree` chooses the joints that carry bodies, `loop_closure` the conditions of the other
joints, `drives` the functions of scalars; all refer to `hard_points` and `located_guide`.  `tree`
computes the poses and screws of carried bodies, `system` the loop conditions and the Jacobian.

`mechanism.Mechanism` is the public class.  `sweeping` moves it along its `curve` of poses by
`continuation`; a sweep returns a `motion`, the whole motion is a `circuit`.  Where numba is
installed, `compiled` does this by `kernel`.  The room imports `geometry`, `continuation` and
`native`.
"""
