"""Candidates: placed guides, measured on their finite motion, checked, compared and selected.

May import `problem`, `guide` and what lies below.
"""
