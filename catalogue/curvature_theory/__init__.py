"""Curvature theory: what a linkage is in its reference position, and how it leaves that.

`instant.Instant` is a batch of linkages with all of it, computed when first asked for;
`analysis.curvature` gives pole, axes, cubics of stationary curvature and principal pairs
(`finite_pole`, `parallel_cranks`, `dead_points`), `configuration` the letters of the pivots,
`leading_error` how a path leaves its tangent or circle, `guided_elements` all that a linkage
guides.  Import from the modules; they import `kinematics` and what lies below.
"""
