"""Drawings of guides, of collections and of whole series; matplotlib is imported only when one is made.

`sheet.draw` draws one guide of a `scene`, `plate` a series by its `cells` and `vignette`; `symbols`, `mechanism`,
`cubics`, `labels` and `lettering` are what they are made of, `paper` is the file.  Import `draw` from the room, the
rest from the modules; they import `series`, `guide` and what lies below.
"""

from .sheet import draw

__all__ = ["draw"]
