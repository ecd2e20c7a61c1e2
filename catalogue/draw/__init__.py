"""Drawings of guides, of collections and of whole series; matplotlib is imported only when one is made.

`picture.draw` is what `plot` does: stills by `sheet` (of a `scene`, with `mechanism` and `symbols`), films, and moving
files by `moving_file`.  `moving.moving_svg` makes a drawing that moves, of the `poses` of any placed guide in a
`frame`: `svg` writes its elements, `machine` what holds and moves, `moving_layers` the theory, `moving_style` colours.
`curves` are over the drive; `datasheet` says what a page tells, which `datasheet_pdf` and `datasheet_html` set; `cards`
are for a notebook.  `plate` draws a series by its `cells` and `vignette`, with `cubics`, `labels` and `lettering`.
`units` are lengths and scales, `words` what is said of a guide.  Import `draw` and `moving_svg` from the room, the rest
from the modules; they import `series`, `guidance` and what lies below.
"""

from .moving import moving_svg
from .picture import draw

__all__ = ["draw", "moving_svg"]
