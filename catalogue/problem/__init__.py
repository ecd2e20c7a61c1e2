"""The design problem: path, constraints and ranking, normalised to the stroke.

`request` is the path in the user's unit and frame; `constraints`, `region` and `ranking` hold
constraints, workspaces and objectives; `problem.Problem` combines them in strokes.  Import from the
modules; they import `kinematics` (array types) and `errors`.
"""
