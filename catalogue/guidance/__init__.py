"""Trace, fit, place and measure guides on their finite motion.

This room is independent of requests and the database.

`coupler_curve` holds the motion of a point, `trace` measures its path over a window, `minimum_zone`
and `cusped_zone` its deviation; `placement` carries it to where it is wanted, `metrics`, `drive`,
`swept_area`, `sensitivity` and `dwell` measure it there, `fixed_nominal` against a nominal that
stays, `reach` and `arc_window` choose windows. Import from the modules; they import
`curvature_theory`, `kinematics` and what lies below.
"""
