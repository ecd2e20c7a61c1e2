"""Series: classes of linkages whose cubics degenerate in one way; classification.

`series` is the author's guide and the types of a plugin, with `pairs` and `posed` as building
blocks; `sampling` draws linkages of a series; `classification` finds the memberships of linkages;
`named_guides` are those of the literature. Import from the modules; they import `guide`,
`curvature_theory`, `kinematics` and what lies below.
"""
