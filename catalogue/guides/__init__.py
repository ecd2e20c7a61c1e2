"""Placed guides of any origin, their motion, and lists of results.

`verbs` names the functions of rooms above that draw, export, measure, improve or keep a guide.
"""
