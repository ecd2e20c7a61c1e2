"""Curvature theory: pole, axes, cubics and guided elements of a linkage in its reference position.

`instant.Instant` is a batch of linkages with these, each computed on first use.
`analysis.curvature` computes pole, axes, cubics of stationary curvature and principal pairs
(`finite_pole`, `parallel_cranks`, `dead_points`), `configuration` the letters of the pivots,
`leading_error` how a path leaves its tangent or circle, `guided_elements` all guided points and
slots of a linkage.  Import from the modules; they import `kinematics` and what lies below.
"""
