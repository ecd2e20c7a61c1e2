"""What is asked: the path, the constraints and the ranking, as one frozen problem in strokes.

`request` is the path in the user's unit and frame, `constraints` what must hold, `region` where, `ranking` what is
better, `problem.Problem` all of it in strokes.  Import from the modules; they import `kinematics` (array types) and
`errors`.
"""
