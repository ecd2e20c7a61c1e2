"""Placed guides of any origin: what they are, their motion, and the results that hold them.

What rooms above do with a guide (draw, export, measure, improve, keep it) is named in `verbs`.
"""
