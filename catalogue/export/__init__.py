"""Guides for other programs: drawings to cut from, parameters by name, scripts, tables of the motion.

`export` writes any guide that stands somewhere; `formats` says which formats there are.  `links` takes a guide apart,
`outlines` makes parts of it, and each format has a module of its own.  Import `export` from the room.  It imports
`kinematics` and `problem`, and asks the guide for its motion; what other packages a format needs is imported with it.
"""

from .write import export

__all__ = ["export"]
