"""Export guides: drawings of parts, named parameters, scripts, motion tables.

`export` writes any placed guide; `formats` lists the formats.  `links` splits a guide into links,
`outlines` makes parts of them, and each format has a module.  Import `export` from the room.  It
imports `kinematics` and `problem`, and gets the motion from the guide; packages of a format are
imported on use.
"""

from .write import export

__all__ = ["export"]
