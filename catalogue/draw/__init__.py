"""Drawings of guides, collections and series; matplotlib is imported only for stills.

`picture.draw` implements `plot`: stills by `sheet` (of a `scene`, with `mechanism` and `symbols`),
films, and animated files by `moving_file`.  `moving.moving_svg` animates the `poses` of a placed
guide in a `frame`: `svg` writes elements, `machine` the linkage, `moving_layers` the theory,
`moving_style` colours. `curves` plots quantities over the drive; `datasheet` collects the contents
of a sheet, set by `datasheet_pdf` and `datasheet_html`; `cards` are for notebooks.  `plate` draws a
series by its `cells` and `vignette`, with `cubics`, `labels` and `lettering`.  `units` has lengths
and scales, `words` texts. Import `draw` and `moving_svg` from the room, the rest from the modules;
they import `series`, `guidance` and what lies below.
"""

from .moving import moving_svg
from .picture import draw

__all__ = ["draw", "moving_svg"]
