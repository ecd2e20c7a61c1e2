"""Fit hard points, within boxes, to target curves read off the motion.

``boxes`` has the movable hard points, ``targets`` the target curves and bounds; ``trials`` sweeps
and reads mechanisms with moved points, many at once, with derivatives; ``fit`` is the least-squares
search, ``outcome`` its report; ``files`` fits by a section of a file.
"""
